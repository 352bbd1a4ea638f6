// Poll rates, single polls, and the statistics of answers.
#include "daemon/core/modules/poll_pace.hpp"

#include <algorithm>

#include "daemon/core/measurement/answer_times.hpp"
#include "daemon/core/modules/poll_schedule.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

constexpr TimePoint start{10s};
constexpr PollConfig three_paces{.period = 100ms, .fast_period = 50ms, .parked_period = 500ms};

PaceInputs quiet(TimePoint now) {
  return {.now = now, .is_open = true, .is_settled = true};
}

CoreConfig paced_pack() {
  CoreConfig config = small_pack();
  config.poll = three_paces;
  return config;
}

bool is_broadcast(const OutgoingFrame& out) {
  return out.port == Port::internal && out.frame.id == internal_bus::poll.base_id && out.frame.data[0] == 0;
}

/// Number of broadcast POLLs sent within `duration`.
std::ptrdiff_t polls_in(CoreBench& bench, Duration duration) {
  const auto before = static_cast<std::ptrdiff_t>(bench.sent().size());
  bench.run(duration);
  return std::count_if(bench.sent().begin() + before, bench.sent().end(), is_broadcast);
}

}  // namespace

TEST_CASE("the pace follows what happens, and is parked only after ten quiet seconds", "[unit][polling][FS_1]") {
  PollPacer pacer;
  pacer.init(three_paces, start);
  CHECK(pacer.step(quiet(start + 10s - 1ns)) == PollPace::active);
  CHECK(pacer.step(quiet(start + 10s)) == PollPace::parked);
  CHECK(pacer.period() == 500ms);
  TimePoint now = start + 20s;
  const std::vector<std::function<void(PaceInputs&)>> busy{
      [](PaceInputs& in) { in.is_open = false; }, [](PaceInputs& in) { in.is_wanted = true; },
      [](PaceInputs& in) { in.is_settled = false; }, [](PaceInputs& in) { in.is_near_limit = true; }};
  for (const auto& change : busy) {
    PaceInputs in = quiet(now);
    change(in);
    CHECK(pacer.step(in) == PollPace::active);
    CHECK(pacer.period() == 100ms);
    CHECK(pacer.since() == now);
    CHECK(pacer.step(quiet(now + 10s)) == PollPace::parked);
    now += 20s;
  }
}

TEST_CASE("fast is for suspicions, and for limits and changes of a pack that is not open", "[unit][polling]") {
  PollPacer pacer;
  pacer.init(three_paces, start);
  PaceInputs in = quiet(start);
  in.changes_current = true;  // caused by sensor noise, in an open pack
  CHECK(pacer.step(in) == PollPace::active);
  in.is_open = false;
  CHECK(pacer.step(in) == PollPace::fast);
  CHECK(pacer.period() == 50ms);
  CHECK(pacer.step(quiet(start + 2s - 1ns)) == PollPace::fast);
  CHECK(pacer.step(quiet(start + 2s)) == PollPace::active);
  in = quiet(start + 3s);
  in.is_near_limit = true;
  CHECK(pacer.step(in) == PollPace::active);
  in.is_open = false;
  CHECK(pacer.step(in) == PollPace::fast);
  in = quiet(start + 10s);
  in.is_suspected = true;
  CHECK(pacer.step(in) == PollPace::fast);
  pacer.start_over(start + 11s);
  CHECK(pacer.pace() == PollPace::active);
}

TEST_CASE("a pace without a period is not entered", "[unit][polling]") {
  PollPacer pacer;
  pacer.init({.period = 100ms}, start);
  CHECK(pacer.step(quiet(start + 60s)) == PollPace::active);
  PaceInputs in = quiet(start + 60s);
  in.is_suspected = true;
  CHECK(pacer.step(in) == PollPace::active);
}

TEST_CASE("parked, ages allow two slow periods and an answer, and never less than configured", "[unit][polling][I7]") {
  const AgeConfig configured;
  CHECK(ages_at(PollPace::active, configured, three_paces).cell_voltage == 250ms);
  CHECK(ages_at(PollPace::fast, configured, three_paces).temperature == 250ms);
  const AgeConfig parked = ages_at(PollPace::parked, configured, three_paces);
  CHECK(parked.cell_voltage == 1'050ms);
  CHECK(parked.temperature == 1'050ms);
  CHECK(parked.module_status == 1'050ms);
  CHECK(parked.pack_current == configured.pack_current);
  CHECK(parked.pdu_status == configured.pdu_status);
}

TEST_CASE("parked, cell voltages are left what all answers may take when active", "[unit][polling][I7]") {
  const auto parked_ages = [](Duration cell_voltage) {
    return ages_at(PollPace::parked, {.cell_voltage = cell_voltage}, three_paces);
  };
  CHECK(parked_ages(249ms).cell_voltage == 1'050ms);  // 49 ms beyond two periods: below the minimum
  CHECK(parked_ages(250ms).cell_voltage == 1'050ms);
  CHECK(parked_ages(251ms).cell_voltage == 1'051ms);
  CHECK(parked_ages(290ms).cell_voltage == 1'090ms);
  CHECK(parked_ages(290ms).temperature == 1'050ms);
  CHECK(parked_ages(290ms).module_status == 1'050ms);
}

TEST_CASE("temperatures and identities are asked in their own time at every pace", "[unit][polling][FS_1]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms, .temperature_every = 4}, start);
  int polls = 0;
  int temperatures = 0;
  int identities = 0;
  for (TimePoint now = start; now < start + 20s; now += tick_period) {
    const Poll poll = schedule.step(now, now < start + 10s ? 50ms : 100ms, true);
    if (!poll.is_due) continue;
    ++polls;
    temperatures += poll.wants.temperatures ? 1 : 0;
    identities += poll.wants.identity ? 1 : 0;
  }
  CHECK(polls == 300);
  CHECK(temperatures == 50);
  CHECK(identities == 2);
}

TEST_CASE("a pace that rises asks at once if it is time by then", "[unit][polling]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms}, start);
  REQUIRE(schedule.step(start, 500ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 40ms, 50ms, true).is_due);
  CHECK(schedule.step(start + 50ms, 50ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 60ms, 500ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 99ms, 500ms, true).is_due);  // set at the poll rate of that time
  CHECK(schedule.step(start + 100ms, 500ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 599ms, 500ms, true).is_due);
  CHECK(schedule.step(start + 600ms, 500ms, true).is_due);
}

TEST_CASE("who is in a hurry lets the answers to the last POLL pass: 100 ms at a slow pace", "[unit][polling]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms}, start);
  REQUIRE(schedule.step(start, 500ms, true).is_due);
  schedule.hurry();
  CHECK_FALSE(schedule.step(start + 99ms, 500ms, true).is_due);
  CHECK(schedule.step(start + 100ms, 500ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 599ms, 500ms, true).is_due);  // only once
}

TEST_CASE("who is in a hurry just after a slow POLL waits for a period of the new pace", "[unit][polling]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms}, start);
  REQUIRE(schedule.step(start, 500ms, true).is_due);
  schedule.hurry();
  CHECK_FALSE(schedule.step(start + 10ms, 50ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 40ms, 50ms, true).is_due);
  CHECK(schedule.step(start + 50ms, 50ms, true).is_due);
  schedule.hurry();
  CHECK(schedule.step(start + 400ms, 50ms, true).is_due);
}

TEST_CASE("two modules a cycle are asked alone, near its end", "[unit][polling]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms}, start);
  REQUIRE(schedule.step(start, 100ms, true).is_due);
  CHECK_FALSE(schedule.may_ask_silent(start + 79ms, 100ms));
  CHECK(schedule.may_ask_silent(start + 80ms, 100ms));
  CHECK(schedule.may_ask_silent(start + 90ms, 100ms));
  CHECK_FALSE(schedule.may_ask_silent(start + 95ms, 100ms));
  REQUIRE(schedule.step(start + 100ms, 100ms, true).is_due);
  CHECK_FALSE(schedule.may_ask_silent(start + 100ms + 99ms, 500ms));
  CHECK(schedule.may_ask_silent(start + 100ms + 100ms, 500ms));  // not half a second later
}

TEST_CASE("how long answers take: last, mean, worst, jitter and shares", "[unit][modules]") {
  AnswerTimes times;
  CHECK(times.mean() == 0ns);
  CHECK(times.within(950) == 0ns);
  for (int i = 0; i < 19; ++i) times.add(4ms);
  CHECK(times.jitter() == 0ns);
  CHECK(times.within(950) == 4ms);  // no longer than the worst
  times.add(36ms);
  CHECK(times.last() == 36ms);
  CHECK(times.worst() == 36ms);
  CHECK(times.mean() == 5'600us);
  CHECK(times.jitter() == 2ms);
  CHECK(times.within(950) == 5ms);
  CHECK(times.within(951) == 36ms);
  times.add(2ms);
  times.add(1s);
  CHECK(times.counts() == AnswerTimes::Counts{1, 19, 0, 0, 0, 1, 0, 0, 1});
  CHECK(times.count() == 22);
}

// --- within the core ------------------------------------------------------------------------------------------------

TEST_CASE("a pack that stands is asked slowly, and closes only on fresh answers at the usual pace",
          "[unit][core][polling][FS_1][I1]") {
  CoreBench bench(paced_pack());
  CHECK(polls_in(bench, 5s) >= 49);
  bench.run(10s);
  CHECK(bench.core().pace().pace() == PollPace::parked);
  CHECK(polls_in(bench, 10s) == 20);
  CHECK(bench.core().pack().is_complete());
  CHECK_FALSE(bench.is_active(FaultId::module_lost));
  const std::size_t sent = bench.sent().size();
  bench.inputs.vehicle_on = true;
  std::ptrdiff_t polls_before_closing = 0;
  REQUIRE(bench.run_until([&] { return bench.core().outputs().any_contactor(); }, 2s));
  polls_before_closing =
      std::count_if(bench.sent().begin() + static_cast<std::ptrdiff_t>(sent), bench.sent().end(), is_broadcast);
  CHECK(polls_before_closing >= 3);
  CHECK(bench.core().modules().complete_cycles() >= qualifying_cycles);
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
  CHECK(bench.core().config().ages.cell_voltage == 250ms);
}

TEST_CASE("a bad value in a parked pack is believed as fast as in a closed one", "[unit][core][polling][F1]") {
  CoreBench bench(paced_pack());
  bench.run(20s);
  REQUIRE(bench.core().pace().pace() == PollPace::parked);
  bench.modules[0].cell_voltage_uV[1] = known(4'200'000);
  REQUIRE(bench.run_until([&] { return bench.core().faults().state(FaultId::cell_overvoltage).is_doubtful(); }, 600ms));
  const TimePoint suspected_at = bench.now();
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::cell_overvoltage); }, 500ms));
  CHECK(bench.now() - suspected_at <= 200ms);
  CHECK(bench.core().pace().pace() == PollPace::fast);
}

TEST_CASE("a module that falls silent in a parked pack is found, and loses nobody on the way back",
          "[unit][core][polling][F21]") {
  CoreBench bench(paced_pack());
  bench.run(20s);
  REQUIRE(bench.core().pace().pace() == PollPace::parked);
  bench.modules[1].talks = false;
  CHECK(bench.run_until([&] { return bench.is_active(FaultId::module_lost); }, 1'200ms));
  bench.run(3s);
  CHECK(bench.core().pace().pace() == PollPace::active);
  CHECK(bench.core().faults().state(FaultId::module_lost).confirmed.element.module_node == 2);
}

TEST_CASE("a load that jumps makes the master look faster", "[unit][core][polling]") {
  CoreBench bench(paced_pack());
  REQUIRE(bench.close());
  bench.run(3s);
  CHECK(polls_in(bench, 1s) == 10);
  bench.current_mA = 20'000;
  bench.run(100ms);
  CHECK(bench.core().pace().pace() == PollPace::fast);
  CHECK(polls_in(bench, 1s) == 20);
  bench.run(3s);
  CHECK(bench.core().pace().pace() == PollPace::active);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("a frame that was lost is asked for again within its cycle", "[unit][core][polling][F23]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1s);
  const std::uint64_t missed = bench.core().modules().find(1)->answers_missed;
  const std::uint32_t asked = bench.core().modules().find(1)->asked_alone;
  int lost = 0;
  bench.is_lost = [&](const CanFrame& frame) { return frame.id == 0x141 && lost++ == 0; };
  bench.run(1s);
  CHECK(lost > 1);
  CHECK(bench.core().modules().find(1)->answers_missed == missed);
  CHECK(bench.core().modules().find(1)->asked_alone == asked + 1);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("when nobody answers nobody is asked alone", "[unit][core][polling][F22]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1s);
  const auto asked = [&] {
    return bench.core().modules().find(1)->asked_alone + bench.core().modules().find(2)->asked_alone;
  };
  const std::uint32_t before = asked();
  for (auto& module : bench.modules) module.talks = false;
  bench.run(2s);
  CHECK(asked() == before);
  CHECK(bench.is_active(FaultId::module_lost));
}

TEST_CASE("a module that is gone is asked alone once a cycle, and opens as soon as before",
          "[unit][core][polling][F21]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1s);
  const TimePoint gone_at = bench.now();
  bench.modules[1].talks = false;
  REQUIRE(bench.run_until([&] { return !bench.core().outputs().any_contactor(); }, 1s));
  CHECK(bench.now() - gone_at <= 300ms);
  const std::uint32_t asked = bench.core().modules().find(2)->asked_alone;
  bench.run(1s);
  CHECK(bench.core().modules().find(2)->asked_alone == asked + 10);
}

TEST_CASE("what was refused is counted by module and reason", "[unit][core][F28]") {
  CoreBench bench(small_pack());
  bench.run(1s);
  CanFrame damaged = make_frame(internal_bus::status, 2);
  seal(internal_bus::status, 0, damaged);
  damaged.data[2] ^= 0x10U;
  bench.deliver(damaged);
  damaged.length = 7;
  bench.deliver(damaged);
  const ModuleRecord& module = *bench.core().modules().find(2);
  CHECK(module.rejected[static_cast<std::size_t>(RejectReason::wrong_crc)] == 1);
  CHECK(module.rejected[static_cast<std::size_t>(RejectReason::wrong_length)] == 1);
  CHECK(bench.core().modules().find(1)->rejected[static_cast<std::size_t>(RejectReason::wrong_crc)] == 0);
}

// --- limits ---------------------------------------------------------------------------------------------------------

TEST_CASE("a module that restarts while closed gets its limits again, and the pack stays closed",
          "[unit][core][MMU_2][BMS_F.3][F33]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1s);
  bench.modules[1].restarted = true;
  bench.modules[1].limits_not_set = true;
  bench.run(500ms);
  CHECK_FALSE(bench.modules[1].limits_not_set);
  CHECK(bench.core().module_setup().is_complete());
  CHECK(bench.core().modules().find(2)->restarts == 1);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("a module that refuses the limits is told of once, and warned of while closed", "[unit][core][MMU_2]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[1].restarted = bench.modules[1].limits_not_set = bench.modules[1].refuses_limits = true;
  bench.run(5s);
  CHECK(std::count_if(bench.events().begin(), bench.events().end(),
                      [](const Event& event) { return event.id == EventId::module_refused_limits; }) == 1);
  CHECK(bench.core().module_setup().is_refused(1));
  CHECK(bench.is_active(FaultId::module_not_set_up));
  CHECK(bench.core().sequence().phase == Phase::closed);
  bench.modules[1].refuses_limits = false;
  bench.run(3s);
  CHECK_FALSE(bench.core().module_setup().is_refused(1));
  CHECK_FALSE(bench.is_active(FaultId::module_not_set_up));
}

TEST_CASE("a board limit of the pack file is sent and answered before anything closes", "[unit][core][MMU_2][MMU_17]") {
  CoreConfig config = small_pack();
  config.module_board_limit_dC = 750;
  CoreBench bench(config);
  int responses_lost = 0;
  bench.is_lost = [&](const CanFrame& frame) {
    return frame.id == 0x382 && frame.data[0] == 7 && responses_lost++ == 0;
  };
  REQUIRE(bench.close());
  CHECK(responses_lost == 2);  // sent again, and answered
  const auto is_board_limit = [](const OutgoingFrame& out) {
    return out.frame.id == internal_bus::command.base_id + 1 && out.frame.data[0] == 7;
  };
  const auto sent = std::find_if(bench.sent().begin(), bench.sent().end(), is_board_limit);
  REQUIRE(sent != bench.sent().end());
  CHECK(sent->frame.data[1] == 75);
}
