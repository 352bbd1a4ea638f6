// Claim that decides which of several daemons commands a pack: alone, two claims on one bus in every order, and in a
// core.
#include "daemon/core/contactors/master_claim.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

constexpr TimePoint start{100s};
constexpr Duration length = 273ms;
constexpr std::uint32_t rival_id = internal_bus::contactor_command.base_id;

/// Claim of a daemon with a bus that came up at `start`.
MasterClaim listening_since_start() {
  MasterClaim claim;
  claim.begin(length, false);
  claim.note_port(Port::internal, true, start);
  return claim;
}

MasterClaim proving() {
  MasterClaim claim = listening_since_start();
  claim.step(start + length);
  REQUIRE(claim.stage() == ClaimStage::proving);
  return claim;
}

/// Claim that is held since `start + length + 1ms`.
MasterClaim held() {
  MasterClaim claim = proving();
  claim.note_echo(start + length + 1ms);
  REQUIRE(claim.stage() == ClaimStage::held);
  return claim;
}

}  // namespace

TEST_CASE("a start listens for three periods of a master and a random time", "[unit][claim][F39]") {
  CoreConfig config = small_pack();
  REQUIRE(config.contactors.has_pdu);
  config.poll = {.period = 100ms, .parked_period = 500ms};
  CHECK(claim_length(config, 0) == 150ms);
  CHECK(claim_length(config, 250'000) == 400ms);
  CHECK(claim_length(config, 250'001) == 150ms);
  CHECK(claim_length(config, UINT32_MAX) <= 400ms);
  CHECK(claim_length(config, 7) == 150ms + 7us);
  CHECK(claim_kept_max(config) == 100ms);
  config.contactors.has_pdu = false;
  CHECK(claim_length(config, 0) == 1500ms);
  CHECK(claim_length(config, 250'000) == 1750ms);
  CHECK(claim_kept_max(config) == 1000ms);
  config.poll.parked_period = {};
  CHECK(claim_length(config, 0) == 300ms);
}

TEST_CASE("a claim that was never held is not taken up, however young the clock is", "[unit][claim][F39]") {
  MasterClaim claim;
  claim.begin(length, false);
  const TimePoint first = TimePoint{} + claim_lapse / 2;
  claim.note_port(Port::internal, true, first);
  CHECK(claim.is_listening());
  claim.note_port(Port::internal, false, first + 1ms);
  claim.note_port(Port::internal, true, first + 2ms);
  CHECK(claim.is_listening());
  CHECK_FALSE(claim.may_command());
}

TEST_CASE("nothing may be sent before a start has listened for its time", "[unit][claim][F39]") {
  MasterClaim claim;
  claim.begin(length, false);
  CHECK(claim.stage() == ClaimStage::listening);
  CHECK_FALSE(claim.is_listening());  // no bus is up
  CHECK_FALSE(claim.may_command());
  claim.step(start + 1h);
  CHECK(claim.stage() == ClaimStage::listening);
  for (const Port port : all_ports) {
    CHECK_FALSE(claim.may_send(port, start + 1h));
    claim.note_port(port, true, start);
  }
  CHECK(claim.is_listening());
  claim.step(start + length - 1ns);
  CHECK(claim.is_listening());
  CHECK_FALSE(claim.may_command());
  for (const Port port : all_ports) CHECK_FALSE(claim.may_send(port, start + length - 1ns));
  for (const Port port : all_ports) CHECK_FALSE(claim.may_send(port, start + length));  // before the tick
  claim.step(start + length);
  CHECK(claim.stage() == ClaimStage::proving);
  CHECK_FALSE(claim.is_listening());
  CHECK(claim.may_command());
  for (const Port port : all_ports) CHECK(claim.may_send(port, start + length));
}

TEST_CASE("each other port waits for as long after it came up, and while the internal bus is listened to",
          "[unit][claim][F39]") {
  MasterClaim claim = listening_since_start();
  claim.note_port(Port::vehicle, true, start + 1s);
  claim.step(start + 1s);
  CHECK(claim.may_send(Port::internal, start + 1s));
  CHECK_FALSE(claim.may_send(Port::charger, start + 10s));  // never came up
  CHECK_FALSE(claim.may_send(Port::vehicle, start + 1s + length - 1ns));
  CHECK(claim.may_send(Port::vehicle, start + 1s + length));
  claim.note_port(Port::internal, false, start + 2s);
  CHECK_FALSE(claim.may_send(Port::internal, start + 2s));
  CHECK(claim.may_send(Port::vehicle, start + 2s));  // reports of an open pack continue
  claim.note_port(Port::vehicle, false, start + 2s);
  claim.note_port(Port::vehicle, true, start + 2s);  // listening once is enough
  CHECK(claim.may_send(Port::vehicle, start + 2s));
  claim.note_port(Port::internal, true, start + 3s);
  CHECK_FALSE(claim.may_send(Port::vehicle, start + 3s));
  claim.step(start + 3s + length);
  CHECK(claim.may_send(Port::vehicle, start + 3s + length));
}

TEST_CASE("the effect of a second master's frame in each stage", "[unit][claim][F39]") {
  struct Case {
    const char* name;
    MasterClaim claim;
    bool is_resting;
    bool is_fault;
    ClaimLoss loss;
  };
  const TimePoint at = start + 10s;
  const std::array cases{
      Case{"listening", listening_since_start(), false, false, ClaimLoss::while_listening},
      Case{"proving", proving(), false, false, ClaimLoss::before_own_frame},
      Case{"held", held(), false, true, ClaimLoss::none},
      Case{"held, resting", held(), true, false, ClaimLoss::while_resting},
      Case{"no claim", MasterClaim{}, false, true, ClaimLoss::none},
      Case{"no claim, resting", MasterClaim{}, true, true, ClaimLoss::none},
  };
  for (Case one : cases) {
    INFO(one.name);
    one.claim.note_port(Port::vehicle, true, start);
    CHECK(one.claim.note_rival(rival_id, at, one.is_resting) == one.is_fault);
    CHECK(one.claim.loss() == one.loss);
    const bool is_lost = one.loss != ClaimLoss::none;
    CHECK(one.claim.is_lost() == is_lost);
    CHECK(one.claim.rival_id() == (is_lost ? rival_id : 0));
    CHECK(one.claim.may_command() == !is_lost);
    if (!is_lost) continue;
    // The loss is permanent, whatever follows.
    one.claim.note_echo(at);
    one.claim.wake();
    one.claim.note_gap(1h, at);
    one.claim.note_port(Port::internal, false, at);
    one.claim.note_port(Port::internal, true, at);
    one.claim.step(at + 1h);
    CHECK_FALSE(one.claim.note_rival(rival_id + 1, at + 1h, false));
    CHECK(one.claim.loss() == one.loss);
    CHECK(one.claim.rival_id() == rival_id);
    CHECK_FALSE(one.claim.is_listening());
    CHECK_FALSE(one.claim.may_command());
    for (const Port port : all_ports) CHECK_FALSE(one.claim.may_send(port, at + 2h));
  }
}

TEST_CASE("what the loser had sent is ignored for two periods of the contactor command, and no longer",
          "[unit][claim][F39]") {
  const TimePoint echo_at = start + length + 1ms;
  MasterClaim claim = held();
  CHECK_FALSE(claim.note_rival(rival_id, echo_at, false));
  CHECK_FALSE(claim.note_rival(rival_id, echo_at + 100ms - 1ns, false));
  CHECK(claim.stage() == ClaimStage::held);
  CHECK(claim.note_rival(rival_id, echo_at + 100ms, false));
  claim.note_echo(echo_at + 1s);  // a later echo restarts nothing
  CHECK(claim.note_rival(rival_id, echo_at + 1s, false));
}

TEST_CASE("an echo proves nothing before the listening is over", "[unit][claim][F39]") {
  MasterClaim claim = listening_since_start();
  claim.note_echo(start + 1ms);  // of the previous session
  CHECK(claim.is_listening());
}

TEST_CASE("a port that was down, and a gap in which the unit has opened by itself, are listened for again",
          "[unit][claim][F39][F53]") {
  MasterClaim claim = held();
  claim.note_port(Port::internal, false, start + 1s);
  CHECK_FALSE(claim.may_command());
  CHECK_FALSE(claim.is_listening());
  MasterClaim back_at_once = claim;
  back_at_once.note_port(Port::internal, true, start + 1s + 200ms - 1ns);
  CHECK(back_at_once.stage() == ClaimStage::held);
  claim.note_port(Port::internal, true, start + 1s + 200ms);
  CHECK(claim.is_listening());
  claim.note_port(Port::internal, false, start + 1s + 250ms);  // while listening, no claim is kept over a loss
  claim.note_port(Port::internal, true, start + 1s + 251ms);
  CHECK(claim.is_listening());
  claim.note_port(Port::internal, false, start + 2s);
  claim.note_port(Port::internal, true, start + 2s);
  CHECK(claim.is_listening());
  claim.step(start + 2s + length - 1ns);
  CHECK_FALSE(claim.may_command());
  claim.step(start + 2s + length);
  CHECK(claim.may_command());

  MasterClaim stopped = held();
  stopped.note_port(Port::vehicle, true, start);
  MasterClaim down = stopped;
  down.note_port(Port::internal, false, start + 1s);
  down.note_gap(200ms, start + 1s + 150ms);  // both together end the claim
  down.note_port(Port::internal, true, start + 1s + 160ms);
  CHECK(down.is_listening());
  stopped.note_gap(200ms - 1ns, start + 1s);
  CHECK(stopped.may_command());
  stopped.note_gap(200ms, start + 1s);
  CHECK(stopped.is_listening());
  stopped.step(start + 1s + length - 1ns);
  CHECK_FALSE(stopped.may_command());
  CHECK_FALSE(stopped.may_send(Port::vehicle, start + 1s + length - 1ns));
  stopped.step(start + 1s + length);
  CHECK(stopped.may_command());
  CHECK(stopped.may_send(Port::vehicle, start + 1s + length));
  CHECK_FALSE(stopped.may_send(Port::charger, start + 1h));  // never came up

  for (MasterClaim claim_before :
       {proving(), listening_since_start()}) {  // the discarded frames may include a master's
    claim_before.note_gap(131ms, start + 1s);
    CHECK(claim_before.is_listening());
    claim_before.step(start + 1s + length - 1ns);
    CHECK(claim_before.is_listening());
  }

  MasterClaim unused = held();
  unused.note_port(Port::vehicle, false, start + 1s);  // not a bus of masters
  CHECK(unused.may_command());
}

TEST_CASE("a port that begins down is listened to from when it is up", "[unit][claim]") {
  MasterClaim claim = listening_since_start();
  claim.note_port(Port::vehicle, false, start);
  claim.step(start + length);
  REQUIRE(claim.stage() == ClaimStage::proving);
  CHECK_FALSE(claim.may_send(Port::vehicle, start + length));
  claim.note_port(Port::vehicle, true, start + 1s);
  CHECK_FALSE(claim.may_send(Port::vehicle, start + 1s + length - 1ns));
  CHECK(claim.may_send(Port::vehicle, start + 1s + length));
}

TEST_CASE("a claim that is kept sends at once where its ports are up, and listens on those that come later",
          "[unit][claim]") {
  MasterClaim claim;
  claim.begin(length, true);
  claim.note_port(Port::internal, true, start);
  claim.note_port(Port::vehicle, true, start);
  claim.step(start);
  CHECK(claim.stage() == ClaimStage::held);
  CHECK(claim.may_send(Port::internal, start));
  CHECK(claim.may_send(Port::vehicle, start));
  CHECK(claim.note_rival(rival_id, start, false));  // no frame of a loser is in transit
  claim.note_port(Port::charger, true, start + 1s);
  CHECK_FALSE(claim.may_send(Port::charger, start + 1s));
  claim.note_port(Port::internal, false, start + 1s);
  claim.note_port(Port::internal, true, start + 2s);
  CHECK(claim.is_listening());

  MasterClaim late;
  late.begin(length, true);
  late.step(start);
  late.note_port(Port::internal, true, start + 1s);
  CHECK(late.is_listening());
}

TEST_CASE("a second begin forgets the first", "[unit][claim]") {
  MasterClaim claim = held();
  static_cast<void>(claim.note_rival(rival_id, start + 1h, true));
  REQUIRE(claim.is_lost());
  claim.begin(length, false);
  CHECK(claim.loss() == ClaimLoss::none);
  CHECK_FALSE(claim.is_listening());
}

TEST_CASE("leaving the rest a master proves its claim once more", "[unit][claim][BMS_F.9]") {
  MasterClaim claim = held();
  claim.wake();
  CHECK(claim.stage() == ClaimStage::proving);
  CHECK(claim.may_command());
  MasterClaim beaten = claim;
  CHECK_FALSE(beaten.note_rival(rival_id, start + 1h, false));
  CHECK(beaten.loss() == ClaimLoss::before_own_frame);
  claim.note_echo(start + 1h);
  CHECK(claim.stage() == ClaimStage::held);
  MasterClaim listening = listening_since_start();
  listening.wake();
  CHECK(listening.is_listening());
  MasterClaim unclaimed;
  unclaimed.wake();
  CHECK(unclaimed.stage() == ClaimStage::held);
}

TEST_CASE("without a begin the claim is held permanently", "[unit][claim][recording]") {
  MasterClaim claim;
  claim.note_port(Port::internal, true, start);
  claim.note_port(Port::internal, false, start);
  claim.note_gap(1h, start);
  claim.step(start);
  CHECK(claim.stage() == ClaimStage::held);
  for (const Port port : all_ports) CHECK(claim.may_send(port, start));
}

TEST_CASE("each stage of a claim has its words", "[unit][claim]") {
  CHECK(to_text(ClaimStage::held) == "held");
  CHECK(to_text(ClaimStage::listening) == "listening for another master");
  CHECK(to_text(ClaimStage::proving) == "waiting for the echo of the first frame");
  CHECK(to_text(ClaimStage::lost) == "lost to another master");
  CHECK(to_text(static_cast<ClaimStage>(99)) == "?");
}

// --- two daemons on one bus -----------------------------------------------------------------------------------------

namespace {

/// Two daemons on one bus; both receive all frames in the same order, each with any delay.
struct TwoOnABus {
  struct Daemon {
    MasterClaim claim = listening_since_start();
    int frames_left = 2;
    std::size_t received = 0;
    bool has_fault = false;
  };
  std::array<Daemon, 2> daemons;
  std::vector<std::size_t> bus;  // sender of each frame

  /// Executes a tick after the listening time: sends if permitted.
  [[nodiscard]] bool decide(std::size_t who) {
    Daemon& daemon = daemons[who];
    if (daemon.frames_left == 0) return false;
    daemon.claim.step(start + length);
    --daemon.frames_left;
    if (daemon.claim.may_command()) bus.push_back(who);
    return true;
  }
  /// Delivers the next frame of the bus to this daemon.
  [[nodiscard]] bool receive(std::size_t who) {
    Daemon& daemon = daemons[who];
    if (daemon.received == bus.size()) return false;
    const TimePoint at = start + length;
    if (bus[daemon.received++] == who) {
      daemon.claim.note_echo(at);
    } else {
      daemon.has_fault = daemon.claim.note_rival(rival_id, at, false) || daemon.has_fault;
    }
    return true;
  }
};

/// Visits every order of events from here to its end.
void follow(const TwoOnABus& now, const std::function<void(const TwoOnABus&)>& at_the_end) {
  bool is_over = true;
  for (const std::size_t who : {0U, 1U}) {
    for (const bool decides : {true, false}) {
      TwoOnABus next = now;
      if (!(decides ? next.decide(who) : next.receive(who))) continue;
      is_over = false;
      follow(next, at_the_end);
    }
  }
  if (is_over) at_the_end(now);
}

}  // namespace

TEST_CASE("of two that start together exactly one goes on, in whatever order frames and echoes come",
          "[unit][claim][F39]") {
  int courses = 0;
  std::array<int, 2> won{};
  int faults = 0;
  int wrong = 0;
  std::array<int, 3> losses{};
  follow({}, [&](const TwoOnABus& end) {
    ++courses;
    const auto& [one, other] = end.daemons;
    const bool is_one_left = one.claim.is_lost() != other.claim.is_lost();
    const auto& winner = one.claim.is_lost() ? other : one;
    if (!is_one_left || winner.claim.stage() != ClaimStage::held) ++wrong;
    if (one.has_fault || other.has_fault) ++faults;
    ++won[one.claim.is_lost() ? 1 : 0];
    ++losses[static_cast<std::size_t>(one.claim.is_lost() ? one.claim.loss() : other.claim.loss())];
  });
  CHECK(courses > 1'000);
  CHECK(wrong == 0);
  CHECK(faults == 0);
  CHECK(won[0] == won[1]);
  CHECK(losses[static_cast<std::size_t>(ClaimLoss::while_listening)] > 0);
  CHECK(losses[static_cast<std::size_t>(ClaimLoss::before_own_frame)] > 0);
}

// --- the core -------------------------------------------------------------------------------------------------------

namespace {

/// POLL to all modules by a second master.
CanFrame poll_of_a_stranger() {
  CanFrame frame = make_frame(internal_bus::poll);
  seal(internal_bus::poll, 77, frame);
  return frame;
}

bool blocks(const CoreBench& bench, Blocker blocker) {
  const auto& blockers = bench.core().permission().blockers;
  return std::find(blockers.begin(), blockers.end(), blocker) != blockers.end();
}

/// Core that has just started.
struct Starting : CoreBench {
  explicit Starting(const CoreConfig& config = small_pack(), Duration listens = length)
      : CoreBench(config, {}, 0, ClaimBegins{.length = listens}) {}
};

}  // namespace

TEST_CASE("a core that starts sends nothing on any port while it listens, then closes", "[unit][core][claim][F39]") {
  Starting bench;
  const TimePoint began_at = bench.now();
  bench.run(60ms);
  bench.inputs.vehicle_on = true;  // requested while listening
  bench.run(length - 70ms);
  CHECK(bench.sent().empty());
  CHECK(bench.core().claim().is_listening());
  CHECK(bench.core().is_close_requested());
  CHECK(blocks(bench, Blocker::no_claim));
  CHECK_FALSE(bench.last().outputs.any_contactor());
  bench.run(20ms);
  REQUIRE_FALSE(bench.sent().empty());
  CHECK(bench.sent_at().front() >= began_at + length);
  CHECK(bench.sent().front().frame.id == internal_bus::contactor_command.base_id);
  CHECK_FALSE(outputs_of(bench.sent().front().frame).any_contactor());
  bench.run(20ms);
  CHECK(bench.core().claim().stage() == ClaimStage::held);
  CHECK_FALSE(blocks(bench, Blocker::no_claim));
  CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
}

TEST_CASE("modules are late from when they could be asked, not from the start", "[unit][core][claim]") {
  Starting bench(small_pack(), 2500ms);
  bench.run(3s);
  CHECK_FALSE(bench.has_event(EventId::fault_confirmed));
  CHECK(bench.close());
}

TEST_CASE("a master's frame while a core listens: it never sends anything", "[unit][core][claim][F39]") {
  for (const CanFrame& frame :
       {contactor_command_frame({}, 77), contactor_command_frame({.main_positive = true, .main_negative = true}, 77),
        poll_of_a_stranger()}) {
    Starting bench;
    bench.run(100ms);
    bench.deliver(frame);
    CHECK(bench.core().claim().loss() == ClaimLoss::while_listening);
    CHECK(bench.core().claim().rival_id() == frame.id);
    bench.give(Command::shut_down);
    bench.run(5s);
    CHECK(bench.sent().empty());
    CHECK_FALSE(bench.is_active(FaultId::foreign_master));
    CHECK(blocks(bench, Blocker::no_claim));
  }
}

TEST_CASE("a damaged frame under a master's identifier is no master", "[unit][core][claim][F39]") {
  Starting bench;
  CanFrame damaged = contactor_command_frame({}, 77);
  damaged.data[7] ^= 1U;
  bench.deliver(damaged);
  CHECK(bench.core().claim().is_listening());
  bench.run(length + 100ms);
  CHECK_FALSE(bench.sent().empty());
}

TEST_CASE("of two cores that start together the one that receives first stops, the other's pack stays well",
          "[unit][core][claim][F39]") {
  Starting loser;
  loser.bus_echoes = false;  // its own frame is still in transit
  REQUIRE(loser.run_until([&] { return !loser.sent().empty(); }, 1s));
  loser.deliver(contactor_command_frame({}, 77));
  CHECK(loser.core().claim().loss() == ClaimLoss::before_own_frame);
  const std::size_t sent = loser.sent().size();
  loser.run(1s);
  CHECK(loser.sent().size() == sent);

  Starting winner;
  REQUIRE(winner.run_until([&] { return winner.core().claim().stage() == ClaimStage::held; }, 1s));
  winner.deliver(contactor_command_frame({}, 77));
  winner.run(90ms);
  winner.deliver(poll_of_a_stranger());
  winner.run(50ms);
  CHECK_FALSE(winner.is_active(FaultId::foreign_master));
  CHECK(winner.close());
  winner.deliver(contactor_command_frame({}, 78));  // a later one is a fault
  winner.run(20ms);
  CHECK(winner.is_active(FaultId::foreign_master));
  CHECK_FALSE(winner.commanded().any_contactor());
}

TEST_CASE("a core that was stopped for longer than the unit waits listens before it sends again",
          "[unit][core][claim][F39][F53]") {
  Starting bench;
  REQUIRE(bench.close());
  const std::size_t sent = bench.sent().size();
  bench.stall(300ms);
  bench.run(length - 10ms);
  CHECK(bench.sent().size() == sent);
  CHECK_FALSE(bench.last().outputs.any_contactor());
  bench.deliver(contactor_command_frame({.main_positive = true, .main_negative = true}, 77));
  CHECK(bench.core().claim().loss() == ClaimLoss::while_listening);
  bench.run(1s);
  CHECK(bench.sent().size() == sent);

  Starting brief;
  REQUIRE(brief.close());
  const std::size_t sent_before = brief.sent().size();
  brief.stall(150ms);
  brief.run(10ms);  // the PDU may still be closed: it is commanded open at once
  REQUIRE(brief.sent().size() > sent_before);
  CHECK_FALSE(outputs_of(brief.sent()[sent_before].frame).any_contactor());
}

TEST_CASE("a core whose bus was away listens before it sends again", "[unit][core][claim][F39][F41]") {
  Starting bench;
  REQUIRE(bench.close());
  bench.observe(PortChanged{Port::internal, false});
  bench.run(300ms);
  const std::size_t sent = bench.sent().size();
  bench.observe(PortChanged{Port::internal, true});
  bench.run(length - 10ms);
  CHECK(bench.sent().size() == sent);
  bench.run(20ms);
  CHECK(bench.sent().size() > sent);

  Starting brief;
  REQUIRE(brief.close());
  brief.observe(PortChanged{Port::internal, false});
  brief.run(50ms);
  const std::size_t sent_before = brief.sent().size();
  brief.observe(PortChanged{Port::internal, true});
  REQUIRE(brief.sent().size() > sent_before);  // the PDU may still be closed: it is commanded open at once
  CHECK_FALSE(outputs_of(brief.sent()[sent_before].frame).any_contactor());
}

TEST_CASE("a claim that is kept lets a core send with its first tick", "[unit][core][claim]") {
  const CoreBench bench(small_pack(), {}, 0, ClaimBegins{.length = length, .is_kept = true});
  CHECK_FALSE(bench.sent().empty());
}

TEST_CASE("a core that is to end while it listens sends nothing at all", "[unit][core][claim]") {
  Starting bench;
  bench.run(100ms);
  bench.give(Command::shut_down);
  REQUIRE(bench.run_until([&] { return bench.last().is_shut_down; }, 2s));
  bench.run(1s);
  CHECK(bench.sent().empty());
}

TEST_CASE("a resting core gives way to a master that has started meanwhile, and sends nothing",
          "[unit][core][claim][rest][BMS_F.9][F39]") {
  CoreConfig config = small_pack();
  config.rest = {.after = 10s, .look_every = 60s};
  const auto empty_and_rest = [](CoreBench& bench) {
    REQUIRE(bench.close());
    bench.modules[0].cell_voltage_uV[1] = known(2'800'000);
    REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 2s));
    bench.inputs.vehicle_on = false;
    REQUIRE(bench.run_until([&] { return bench.core().rest().is_resting(); }, 20s));
    bench.run(5s);
  };
  Starting bench(config);
  empty_and_rest(bench);
  const std::size_t sent = bench.sent().size();
  bench.deliver(contactor_command_frame({.main_positive = true, .main_negative = true}, 77));
  CHECK(bench.core().claim().loss() == ClaimLoss::while_resting);
  bench.run(2min);
  CHECK(bench.sent().size() == sent);
  CHECK_FALSE(bench.is_active(FaultId::foreign_master));

  Starting looking(config);
  empty_and_rest(looking);
  looking.echo_is_lost = [](const OutgoingFrame&) { return true; };
  REQUIRE(looking.run_until([&] { return looking.core().rest().phase() == RestPhase::looking; }, 61s));
  looking.deliver(poll_of_a_stranger());  // both started at the same instant, and this one's frame was second
  CHECK(looking.core().claim().loss() == ClaimLoss::before_own_frame);

  CoreBench recorded(config);  // as in recordings from before the claim existed
  empty_and_rest(recorded);
  recorded.deliver(poll_of_a_stranger());
  recorded.run(20ms);
  CHECK_FALSE(recorded.core().claim().is_lost());
  CHECK(recorded.is_active(FaultId::foreign_master));
}
