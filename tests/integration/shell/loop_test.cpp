// The daemon's loop on an emulated bus: handling of frames that were pending while the process did not run.
#include "daemon/shell/loop.hpp"

#include <array>
#include <csignal>
#include <ctime>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include <sys/eventfd.h>
#include <unistd.h>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/one_bus.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

/// Stands for SIGSTOP and SIGCONT, or for a busy processor: the process does nothing for this time.
void be_stopped(Duration how_long) {
  const timespec span{.tv_sec = 0, .tv_nsec = static_cast<long>(how_long.count())};
  REQUIRE(::nanosleep(&span, nullptr) == 0);
}

/// A bus that the test fills, and that stops the process at the point the test selects.
struct ScriptedPort : BusPort {
  std::deque<CanFrame> waiting;
  std::function<void(const CanFrame&)> on_send;
  std::function<void()> on_read;  // before a frame is handed over
  std::uint32_t rate = 0;

  [[nodiscard]] int fd() const override { return event_.get(); }
  [[nodiscard]] ReadStatus read(ReceivedFrame& out) override {
    if (waiting.empty()) {
      std::uint64_t count = 0;
      static_cast<void>(::read(event_.get(), &count, sizeof(count)));
      return ReadStatus::empty;
    }
    if (on_read) on_read();
    out = {.frame = waiting.front(), .received_at = monotonic_now()};
    waiting.pop_front();
    return ReadStatus::frame;
  }
  [[nodiscard]] Result<void, SendError> send(const CanFrame& frame) override {
    on_send(frame);
    return {};
  }
  void maintain() override {}
  [[nodiscard]] BusState state() const override { return BusState::up; }
  [[nodiscard]] std::uint64_t frames_lost() const override { return 0; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string last_error() const override { return {}; }
  [[nodiscard]] std::uint32_t rate_bit_per_s() const override { return rate; }

  void arrive(const CanFrame& frame) {
    waiting.push_back(frame);
    const std::uint64_t one = 1;
    REQUIRE(::write(event_.get(), &one, sizeof(one)) == sizeof(one));
  }

 private:
  OwnedFd event_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::string name_ = "scripted";
};

CanFrame current_frame() {
  CanFrame frame = make_frame(internal_bus::sensor_current);
  seal(internal_bus::sensor_current, 7, frame);
  return frame;
}

/// Both emergency stops are pressed in it: the loop decides on it at once, before it reads further frames.
CanFrame urgent_frame() {
  CanFrame frame = make_frame(internal_bus::pdu_status);
  seal(internal_bus::pdu_status, 7, frame);
  return frame;
}

/// The first decision after a stop: time since the decision before, and times of the values it used.
struct FirstDecision : CoreTap {
  const Core* core = nullptr;
  bool is_awaited = false;
  Duration gap{};
  TimePoint current_taken_at{};
  TimePoint pdu_taken_at{};

  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint at, const Decisions& /*decisions*/) override {
    if (std::exchange(is_awaited, false)) {
      gap = at - last_at_;
      current_taken_at = core->sensors().current_mA.taken_at;
      pdu_taken_at = core->sensors().pdu.taken_at;
    }
    last_at_ = at;
  }

 private:
  TimePoint last_at_{};
};

/// The first observation of all, if it is the start of the claim.
struct ClaimTap : CoreTap {
  std::optional<ClaimBegins> claim;

  void observed(const Observation& observation) override {
    const auto* const begins = std::get_if<ClaimBegins>(&observation.what);
    if (!std::exchange(has_any_, true) && begins != nullptr) claim = *begins;
  }
  void decided(TimePoint /*at*/, const Decisions& /*decisions*/) override {}

 private:
  bool has_any_ = false;
};

struct LoopBench {
  static constexpr int frame_number = 20;  // number of the frame at which `happens` is called: during normal operation
  static constexpr int frames_after = 10;  // sent after it, within less than the max age of a value

  TemporaryFolder folder;
  PackConfig pack = *load_pack_config(test::in_source("config/packs/demo-48s.json"));
  Journal journal{Severity::error};
  ServiceNotify notify;
  std::unique_ptr<StatusSocket> socket = *StatusSocket::open({.path = folder / "bmud.sock"});
  std::unique_ptr<StateStore> store = *StateStore::open({});
  RateWatch rate{pack, "pack.json"};
  Buses buses = test::one_bus(std::make_unique<ScriptedPort>());
  ScriptedPort& port = static_cast<ScriptedPort&>(buses.internal());
  std::unique_ptr<Core> core = std::make_unique<Core>(pack.core, monotonic_now());
  FirstDecision first;
  ClaimPlan claim{};
  ClaimTap claim_tap;
  std::string failure_text;  // error with which the loop ended; empty: it ended in order
  int frames_sent = 0;
  bool has_ended = false;
  std::function<bool()> is_done = [] { return true; };  // after those frames: true if the loop may end
  TimePoint stopped_at{};

  /// Runs until some frames after the one at which `happens` is called.
  void run(const std::function<void()>& happens) {
    port.on_send = [&](const CanFrame&) {
      ++frames_sent;
      if (frames_sent == frame_number) happens();
      if (has_ended || frames_sent < frame_number + frames_after || !is_done()) return;
      has_ended = true;
      end();
    };
    Loop loop({.core = *core,
               .buses = buses,
               .status_socket = *socket,
               .journal = journal,
               .notify = notify,
               .store = *store,
               .rate = rate,
               .claim = claim,
               .taps = {&first, &claim_tap}});
    loop.set_answers([](std::string_view, const Peer&) { return StatusReply{}; }, [] { return std::string(); });
    sigset_t ends;
    sigset_t before;
    sigemptyset(&ends);
    for (const int signal : {SIGTERM, SIGINT}) sigaddset(&ends, signal);
    REQUIRE(::pthread_sigmask(SIG_BLOCK, &ends, &before) == 0);
    REQUIRE(loop.init());
    const auto ended = loop.run();
    failure_text = ended ? "" : to_text(ended.error());
    REQUIRE(::pthread_sigmask(SIG_SETMASK, &before, nullptr) == 0);
  }
  /// The second signal skips the wait for contacts, which no node reports here.
  static void end() {
    REQUIRE(::raise(SIGTERM) == 0);
    REQUIRE(::raise(SIGINT) == 0);
  }
  void stop_for(Duration how_long) {
    stopped_at = monotonic_now();
    first.core = core.get();
    first.is_awaited = true;
    be_stopped(how_long);
  }
  void arrive_three() {
    port.arrive(current_frame());
    port.arrive(urgent_frame());
    port.arrive(current_frame());
  }
};

}  // namespace

TEST_CASE("a bit rate that an interface comes back with is judged, and the loop goes on", "[integration][loop]") {
  LoopBench bench;
  // A starved loop may send ten frames between two checks of its ports.
  const TimePoint give_up_at = monotonic_now() + test::hang_max;
  bench.is_done = [&] { return bench.rate.finding().verdict == RateVerdict::too_slow || monotonic_now() > give_up_at; };
  bench.run([&] { bench.port.rate = 10'000; });
  CHECK(bench.failure_text.empty());
  CHECK(bench.rate.finding().verdict == RateVerdict::too_slow);
  CHECK(bench.rate.finding().found_bit_per_s == 10'000);
  CHECK(bench.frames_sent >= LoopBench::frame_number + LoopBench::frames_after);
}

TEST_CASE("a loop begins with its claim, and ends for another master's frame without having sent anything",
          "[integration][loop][F39]") {
  LoopBench bench;
  bench.claim = {.length = 60s};
  bench.port.arrive(contactor_command_frame({.main_positive = true, .main_negative = true}, 7));
  bench.run([] {});
  CHECK(bench.failure_text.starts_with("second master: "));
  CHECK(bench.failure_text.find("frame 040") != std::string::npos);
  CHECK(bench.frames_sent == 0);
  REQUIRE(bench.claim_tap.claim);
  CHECK(bench.claim_tap.claim->length == 60s);
  CHECK_FALSE(bench.claim_tap.claim->is_kept);
}

TEST_CASE("a loop that follows one through the same ports keeps its claim, if the silence was short",
          "[integration][loop][F39]") {
  LoopBench bench;
  bench.claim = {.length = 20ms, .kept_max = 60s, .held_until = monotonic_now() - 50ms};
  bench.run([] {});
  CHECK(bench.failure_text.empty());
  REQUIRE(bench.claim_tap.claim);
  CHECK(bench.claim_tap.claim->is_kept);

  LoopBench late;
  late.claim = {.length = 20ms, .kept_max = 40ms, .held_until = monotonic_now() - 50ms};
  late.run([] {});
  REQUIRE(late.claim_tap.claim);
  CHECK_FALSE(late.claim_tap.claim->is_kept);

  LoopBench without;  // as in the other tests of this file
  without.run([] {});
  CHECK_FALSE(without.claim_tap.claim);
}

TEST_CASE("frames that waited while a decision was stopped on its way are not taken", "[integration][loop][F53][F60]") {
  LoopBench bench;
  bench.run([&] {
    bench.arrive_three();
    bench.stop_for(loop_gap_max + 70ms);
  });
  CHECK(bench.port.waiting.empty());
  CHECK(bench.core->sensors().current_mA.taken_at == TimePoint{});
  CHECK(bench.core->sensors().pdu.taken_at == TimePoint{});
}

TEST_CASE("frames that waited while the reading was stopped half-way are not taken", "[integration][loop][F53][F60]") {
  LoopBench bench;
  bench.run([&] {
    bench.arrive_three();
    bench.port.on_read = [&] {
      bench.port.on_read = nullptr;
      bench.stop_for(loop_gap_max + 70ms);
    };
  });
  CHECK(bench.port.waiting.empty());
  CHECK(bench.core->sensors().current_mA.taken_at == TimePoint{});
  CHECK(bench.core->sensors().pdu.taken_at == TimePoint{});
}

namespace {

/// Three frames are pending while the loop is stopped for 60 ms, reading or deciding.
void stop_briefly(LoopBench& bench, bool is_reading) {
  bench.run([&] {
    bench.arrive_three();
    if (!is_reading) return bench.stop_for(60ms);
    bench.port.on_read = [&] {
      bench.port.on_read = nullptr;
      bench.stop_for(60ms);
    };
  });
}

/// The first run in which the loop was not starved as well. A run that decided later than `loop_gap_max` after the
/// decision before shows only that a longer stop is a gap. The loop decides after it has discarded frames, so a stop
/// that it counts as a gap by mistake is measured with its true length and does not pass for starvation.
std::unique_ptr<LoopBench> stopped_briefly(bool is_reading) {
  const TimePoint give_up_at = monotonic_now() + test::hang_max;
  while (monotonic_now() < give_up_at) {
    auto bench = std::make_unique<LoopBench>();
    stop_briefly(*bench, is_reading);
    if (bench->first.gap <= loop_gap_max) return bench;
  }
  return nullptr;
}

}  // namespace

TEST_CASE("frames that waited for a time that is bridged are as old as it is long", "[integration][loop][F53][F60]") {
  const bool is_reading = GENERATE(false, true);
  INFO("stopped " << (is_reading ? "reading" : "deciding"));
  const auto bench = stopped_briefly(is_reading);
  REQUIRE(bench);
  CHECK(bench->port.waiting.empty());
  for (const TimePoint taken_at : {bench->first.current_taken_at, bench->first.pdu_taken_at}) {
    CHECK(taken_at != TimePoint{});
    CHECK(taken_at <= bench->stopped_at);
  }
}

}  // namespace bmu
