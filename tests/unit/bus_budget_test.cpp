// What a pack asks of its bus at worst: the bound of a cycle and the load, by hand.
#include "config/bus_budget.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu::test {

TEST_CASE("an answer has the frames that were asked for", "[unit][config][bus_budget]") {
  struct Row {
    std::uint8_t cells;
    PollWants wants;
    std::int64_t frames;
  };
  const PollWants nothing{.status = false, .cells = false, .temperatures = false, .module = false, .identity = false};
  for (const Row& row : {Row{12, all_wants, 9}, Row{12, {}, 8}, Row{1, {}, 5}, Row{3, {}, 5}, Row{4, {}, 6},
                         Row{6, {}, 6}, Row{7, {}, 7}, Row{9, {}, 7}, Row{10, {}, 8}, Row{12, nothing, 0}}) {
    INFO(int{row.cells} << " cells");
    CHECK(answer_frames({.node = 1, .cell_count = row.cells}, row.wants) == row.frames);
  }
  PollWants seldom = nothing;
  seldom.temperatures = true;
  CHECK(answer_frames({}, seldom) == 2);
}

TEST_CASE("the longest cycle is turnaround, POLL, answers, and what cannot be avoided", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  // 2 ms, and 11 frames of 135 bits.
  CHECK(cycle_time_max(config, all_wants, 1'000) == 2ms + 1'485us);
  CHECK(cycle_time_max(config, all_wants, 500) == 2ms + 2'970us);
  CHECK(cycle_time_max(config, {}, 500) == 2ms + 2'700us);
  // With a unit: twice its word and twice the command.
  config.contactors.has_pdu = true;
  CHECK(cycle_time_max(config, all_wants, 500) == 2ms + 2'970us + 4 * 270us);
  // 19 modules end within 50 ms, 20 begin another period of both.
  CHECK(cycle_time_max(pack_of(19), all_wants, 500) == 2ms + (2 + 171 + 4) * 270us);
  CHECK(cycle_time_max(pack_of(20), all_wants, 500) == 2ms + (2 + 180 + 6) * 270us);
}

TEST_CASE("between two polls there is room for two modules asked alone besides", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  // 11 frames of the cycle; a POLL and 9 frames of the only module.
  CHECK(period_min(config, 500) == 2ms + (11 + 10) * 270us);
  config = pack_of(2);
  config.contactors.has_pdu = false;
  CHECK(period_min(config, 500) == 2ms + (20 + 2 * 10) * 270us);
  CHECK(period_min(config, 1'000) == 2ms + (20 + 2 * 10) * 135us);
  // Never more than two, and the largest module counts for both.
  config = pack_of(3);
  config.contactors.has_pdu = false;
  config.modules[0].cell_count = config.modules[1].cell_count = 9;
  CHECK(period_min(config, 500) == 2ms + (2 + 8 + 8 + 9 + 2 * 10) * 270us);
  // What goes ahead does so for as long: three periods of both in more than 50 ms.
  CHECK(cycle_time_max(pack_of(18), all_wants, 500) == 2ms + (2 + 162 + 4) * 270us);
  CHECK(period_min(pack_of(18), 500) == 2ms + (2 + 162 + 20 + 6) * 270us);
}

TEST_CASE("temperatures and identities are asked for in their own time at every pace", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  config.poll = {.period = 100ms, .temperature_every = 1};
  constexpr std::int64_t sensed = 5'750 + 2 * 1'916;
  const auto load_at = [&](Duration period) { return bus_load_permille(config, period, false, 1); };
  // POLL, STATUS, four of CELLS and MODULE as often as there is a POLL; TEMP ten times a second, IDENT every 10 s.
  CHECK(load_at(100ms) == 7 * 135 * 10 + 2 * 135 * 10 + 13 + sensed);
  CHECK(load_at(50ms) == 7 * 135 * 20 + 2 * 135 * 10 + 13 + sensed);
  CHECK(load_at(500ms) == 7 * 135 * 2 + 2 * 135 * 2 + 13 + sensed);
  config.poll.temperature_every = 4;
  CHECK(load_at(50ms) == 7 * 135 * 20 + 2 * 135 * 10 / 4 + 13 + sensed);
}

TEST_CASE("the load is what all messages take in their periods", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  // A POLL and 8 answers ten times a second, IDENT every ten; 50 currents and 2 x 16.7 voltages of 115 bits.
  constexpr std::int64_t polled = 9 * 135 * 10 + 13;
  constexpr std::int64_t sensed = 5'750 + 2 * 1'916;
  CHECK(bus_load_permille(config, 100ms, false, 500) == (polled + sensed + 499) / 500);
  CHECK(bus_load_permille(config, 100ms, false, 125) == (polled + sensed + 124) / 125);
  const std::int64_t alone = bus_load_permille(config, 100ms, false, 1'000);
  config.contactors.has_pdu = true;
  CHECK(bus_load_permille(config, 100ms, false, 1'000) >= alone + 5);  // 40 x 135 bits
  CHECK(bus_load_permille(config, 100ms, true, 1'000) > bus_load_permille(config, 100ms, false, 1'000));
  config.poll.period = 50ms;
  const std::int64_t at_50ms = bus_load_permille(config, 50ms, false, 1'000);
  CHECK(at_50ms >= bus_load_permille(config, 100ms, false, 1'000) + 12);
  config.poll.temperature_every = 2;
  CHECK(bus_load_permille(config, 50ms, false, 1'000) < at_50ms);
  config.sensor.has_second_current = true;
  CHECK(bus_load_permille(config, 50ms, false, 1'000) > bus_load_permille(pack_of(1), 100ms, false, 1'000) + 5);
}

}  // namespace bmu::test
