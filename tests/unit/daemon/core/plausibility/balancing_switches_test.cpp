// Reported balancing switches compared with the commands: the bled charge, and mismatches.
#include "daemon/core/plausibility/balancing_switches.hpp"

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

/// Two modules of four cells that report their switches at times set by the test.
struct Bench {
  Bench() {
    modules.init(config);
    switches.init(config);
  }

  /// Delivers a complete answer of a module: cells at 4 V, and these switches on.
  void say(std::uint8_t node, std::uint16_t on, const ModuleStatus& said = {.mode = internal_bus::Mode::normal}) {
    using namespace internal_bus;
    modules.begin_cycle(now, {});
    CanFrame word = make_frame(status, node);
    write<status, "mode">(word, static_cast<std::int64_t>(said.mode));
    write<status, "supply">(word, said.on_module_supply ? 1 : 0);
    write<status, "board_too_hot">(word, said.board_too_hot ? 1 : 0);
    write<status, "cell_count">(word, 4);
    write<status, "cell_voltage_age_ms">(word, 0);
    modules.observe(status, node, word, now);
    for (const auto* row : {&cells_1, &cells_2}) {
      CanFrame cells = make_frame(*row, node);
      for (std::size_t slot = 0; slot < 3; ++slot) encode_signal(row->signals[slot], known(4'000'000), cells.data);
      modules.observe(*row, node, cells, now);
    }
    CanFrame stack = make_frame(module, node);
    write<module, "module_voltage_mV">(stack, stack_voltage_mV);
    write<module, "balancing_cells">(stack, on);
    modules.observe(module, node, stack, now);
    switches.update(modules);
  }
  void both(std::uint16_t first, std::uint16_t second) {
    say(1, first);
    say(2, second);
  }
  /// Delivers both answers every 100 ms for this duration.
  void keep(std::uint16_t first, std::uint16_t second, Duration duration) {
    for (const TimePoint end = now + duration; now < end;) {
      now += 100ms;
      both(first, second);
    }
  }

  CoreConfig config = test::small_pack();
  ModuleTable modules;
  BalancingSwitches switches;
  TimePoint now{100s};
  SignalValue stack_voltage_mV = known(16'000);
};

constexpr std::uint16_t cell_2 = 1U << 1U;
constexpr std::uint16_t cell_4 = 1U << 3U;
constexpr BalancingMinutes two_minutes_for_2{0, 2, 0, 0};

bool is_true(const Reading& reading) {
  REQUIRE(reading.is_known);
  return reading.value == 1;
}

}  // namespace

TEST_CASE("nothing is known before a module has spoken, off is as it should be", "[unit][balancing]") {
  Bench bench;
  CHECK_FALSE(bench.switches.stays_on().is_known);
  CHECK_FALSE(bench.switches.stays_off().is_known);
  CHECK_FALSE(bench.switches.are_all_off(bench.now - 1s));
  bench.say(1, 0);
  CHECK_FALSE(bench.switches.are_all_off(bench.now - 1s));  // the other has not answered
  bench.say(2, 0);
  CHECK(bench.switches.are_all_off(bench.now - 1ns));
  CHECK_FALSE(bench.switches.are_all_off(bench.now));
  CHECK_FALSE(is_true(bench.switches.stays_on()));
  CHECK_FALSE(is_true(bench.switches.stays_off()));
}

TEST_CASE("a module whose stack has no voltage tells its switches all the same", "[unit][balancing]") {
  Bench bench;
  bench.stack_voltage_mV = not_known();
  bench.say(1, cell_2);
  bench.say(2, 0);
  CHECK(bench.switches.on(0) == cell_2);
  CHECK(bench.switches.is_any_on());
  bench.keep(0, 0, 1s);
  CHECK(bench.switches.are_all_off(bench.now - 1ns));
  CHECK(bench.switches.bled_uAs(1) > 0);
}

TEST_CASE("a cell told to bleed is on for its minutes and off again: nobody disobeys", "[unit][balancing][MMU_CB]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(1, two_minutes_for_2, bench.now);
  CHECK(bench.switches.is_any_told());
  CHECK(bench.switches.minutes_told(1, 1) == 2);
  CHECK(bench.switches.minutes_told(1, 0) == 0);
  CHECK(bench.switches.minutes_told(0, 1) == 0);
  bench.keep(0, 0, 900ms);  // until the next mark of the module
  bench.keep(0, cell_2, 120s);
  CHECK(bench.switches.is_any_on());
  CHECK(bench.switches.on(1) == cell_2);
  CHECK_FALSE(bench.switches.has_unwanted(1));
  bench.keep(0, 0, 100ms);
  CHECK_FALSE(bench.switches.is_any_told());
  CHECK_FALSE(bench.switches.is_any_on());
  bench.keep(0, 0, 10s);
  CHECK_FALSE(is_true(bench.switches.stays_on()));
  CHECK_FALSE(is_true(bench.switches.stays_off()));
  // 100 mA for two minutes.
  CHECK(bench.switches.bled_uAs(5) == 12'000'000);
  CHECK(bench.switches.bled_uAs(1) == 0);
  CHECK(bench.switches.first_cell(1) == 4);
}

TEST_CASE("a switch that does not come on is remembered until it does", "[unit][balancing][faults]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.keep(0, 0, obey_max);
  CHECK_FALSE(is_true(bench.switches.stays_off()));
  bench.keep(0, 0, 100ms);
  REQUIRE(is_true(bench.switches.stays_off()));
  CHECK(bench.switches.stays_off().element == Element{.module_node = 1, .number = 2, .pack_number = 2});
  CHECK_FALSE(is_true(bench.switches.stays_on()));
  bench.keep(0, 0, 130s);
  CHECK_FALSE(bench.switches.is_any_told());  // its time has elapsed, whatever the switch did
  CHECK(is_true(bench.switches.stays_off()));
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.keep(cell_2, 0, 100ms);
  CHECK_FALSE(is_true(bench.switches.stays_off()));
}

TEST_CASE("a switch that is on without having been told is unwanted at once, and disobeys after its time",
          "[unit][balancing][faults]") {
  Bench bench;
  bench.both(0, cell_4);
  CHECK(bench.switches.has_unwanted(1));
  CHECK_FALSE(bench.switches.has_unwanted(0));
  bench.keep(0, cell_4, obey_max - 100ms);
  bench.switches.note_stopped(1);  // sent repeatedly, without effect
  CHECK_FALSE(is_true(bench.switches.stays_on()));
  bench.keep(0, cell_4, 100ms);
  REQUIRE(is_true(bench.switches.stays_on()));
  CHECK(bench.switches.stays_on().element == Element{.module_node = 2, .number = 4, .pack_number = 8});
  CHECK(bench.switches.stays_on().taken_at == bench.now);
  bench.keep(0, 0, 100ms);
  CHECK_FALSE(is_true(bench.switches.stays_on()));
  bench.keep(0, cell_4, 100ms);  // too short for a mismatch
  CHECK_FALSE(is_true(bench.switches.stays_on()));
}

TEST_CASE("a switch that stays on behind its time, with what its clock may be wrong, disobeys",
          "[unit][balancing][faults]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.keep(cell_2, 0, 120s + 2400ms + 1s);  // two percent, and the mark it began at
  CHECK_FALSE(bench.switches.has_unwanted(0));
  bench.keep(cell_2, 0, 100ms);
  CHECK(bench.switches.has_unwanted(0));
  CHECK_FALSE(bench.switches.is_any_told());
  bench.keep(cell_2, 0, obey_max);
  CHECK(is_true(bench.switches.stays_on()));
}

TEST_CASE("a switch that was on for half its time and went off is over, however fast its module's clock goes",
          "[unit][balancing]") {
  for (const Duration on : {60s, 100s, 114s, 117s, 118s}) {
    CAPTURE(to_s(on));
    Bench bench;
    bench.both(0, 0);
    bench.switches.note_told(0, two_minutes_for_2, bench.now);
    bench.keep(cell_2, 0, on);
    bench.keep(0, 0, obey_max + 100ms);
    CHECK_FALSE(bench.switches.is_any_told());
    bench.keep(0, 0, 2min);
    CHECK_FALSE(is_true(bench.switches.stays_off()));
    CHECK_FALSE(is_true(bench.switches.stays_on()));
  }
}

TEST_CASE("a switch that goes off before half its time is dead: no clock is so wrong", "[unit][balancing][faults]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.keep(cell_2, 0, 59s);
  bench.keep(0, 0, obey_max);
  CHECK_FALSE(is_true(bench.switches.stays_off()));
  CHECK(bench.switches.is_any_told());
  bench.keep(0, 0, 200ms);
  CHECK(is_true(bench.switches.stays_off()));
}

TEST_CASE("a switch that is off for a moment goes on with its minutes", "[unit][balancing]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.keep(cell_2, 0, 100s);
  bench.keep(0, 0, obey_max - 200ms);  // e.g. for a measurement
  bench.keep(cell_2, 0, 1s);
  CHECK(bench.switches.is_any_told());
  CHECK_FALSE(bench.switches.has_unwanted(0));
}

TEST_CASE("heat pauses: a hot module's switch may be off", "[unit][balancing][MMU_17]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  for (int count = 0; count < 60; ++count) {
    bench.now += 100ms;
    bench.say(1, 0, {.mode = internal_bus::Mode::normal, .board_too_hot = true});
  }
  CHECK_FALSE(is_true(bench.switches.stays_off()));
  bench.keep(0, 0, obey_max + 100ms);
  CHECK(is_true(bench.switches.stays_off()));
}

TEST_CASE("whatever mode or supply a module claims, what it was not told to bleed is unwanted, judged and counted",
          "[unit][balancing][faults]") {
  using internal_bus::Mode;
  const auto claims = {ModuleStatus{.mode = Mode::autonomous}, ModuleStatus{.mode = Mode::starting},
                       ModuleStatus{.mode = Mode::normal, .on_module_supply = true}};
  for (const ModuleStatus& said : claims) {
    CAPTURE(static_cast<int>(said.mode), said.on_module_supply);
    Bench bench;
    bench.say(2, 0);
    for (int count = 0; count < 60; ++count) {
      bench.say(1, cell_2, said);
      bench.now += 100ms;
    }
    CHECK(bench.switches.has_unwanted(0));
    REQUIRE(is_true(bench.switches.stays_on()));
    CHECK(bench.switches.stays_on().element == Element{.module_node = 1, .number = 2, .pack_number = 2});
    CHECK(bench.switches.is_any_on());
    CHECK(bench.switches.bled_uAs(1) == 590'000);
  }
}

TEST_CASE("a module that is not in its normal mode, or on its own cells, need not bleed what it was told",
          "[unit][balancing]") {
  using internal_bus::Mode;
  const auto claims = {ModuleStatus{.mode = Mode::autonomous},
                       ModuleStatus{.mode = Mode::normal, .on_module_supply = true}};
  for (const ModuleStatus& said : claims) {
    Bench bench;
    bench.both(0, 0);
    bench.switches.note_told(0, two_minutes_for_2, bench.now);
    for (int count = 0; count < 60; ++count) {
      bench.now += 100ms;
      bench.say(1, 0, said);
    }
    CHECK_FALSE(is_true(bench.switches.stays_off()));
  }
}

TEST_CASE("a switch of a cell that is not there is unwanted too, and named without a number in the pack",
          "[unit][balancing][faults]") {
  Bench bench;
  constexpr std::uint16_t cell_10 = 1U << 9U;
  bench.keep(cell_10, 0, obey_max + 200ms);
  CHECK(bench.switches.unwanted(0) == cell_10);
  REQUIRE(is_true(bench.switches.stays_on()));
  CHECK(bench.switches.stays_on().element == Element{.module_node = 1, .number = 10, .pack_number = 0});
  for (std::size_t cell = 0; cell < 8; ++cell) CHECK(bench.switches.bled_uAs(cell) == 0);
  bench.keep(0, 0, 100ms);
  CHECK_FALSE(is_true(bench.switches.stays_on()));
}

TEST_CASE("a gap of more than a second is not counted", "[unit][balancing]") {
  Bench bench;
  bench.both(cell_2, 0);
  bench.now += 1s;
  bench.both(cell_2, 0);
  CHECK(bench.switches.bled_uAs(1) == 100'000);
  bench.now += 1s + 1ns;
  bench.both(cell_2, 0);
  CHECK(bench.switches.bled_uAs(1) == 100'000);
  bench.now += 10ns;  // ten parts of a uAs that is not whole yet are kept
  bench.both(cell_2, 0);
  bench.now += 999'999'990ns;
  bench.both(cell_2, 0);
  CHECK(bench.switches.bled_uAs(1) == 200'000);
}

TEST_CASE("after a gap nobody counts as told, and what was bled stays known", "[unit][balancing]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.keep(cell_2, 0, 2s);
  const std::int64_t bled_uAs = bench.switches.bled_uAs(1);
  CHECK(bled_uAs > 0);
  bench.switches.forget();
  CHECK_FALSE(bench.switches.is_any_told());
  CHECK_FALSE(bench.switches.is_any_on());
  CHECK_FALSE(bench.switches.stays_on().is_known);
  bench.now += 500ms;
  bench.both(cell_2, 0);
  CHECK(bench.switches.bled_uAs(1) == bled_uAs);
  CHECK(bench.switches.has_unwanted(0));
}

TEST_CASE("a stop for all ends what every module was told", "[unit][balancing]") {
  Bench bench;
  bench.both(0, 0);
  bench.switches.note_told(0, two_minutes_for_2, bench.now);
  bench.switches.note_told(1, two_minutes_for_2, bench.now);
  bench.keep(cell_2, cell_2, 1s);
  bench.switches.note_stopped(0);
  CHECK(bench.switches.has_unwanted(0));
  CHECK_FALSE(bench.switches.has_unwanted(1));
  bench.switches.note_all_stopped();
  CHECK(bench.switches.has_unwanted(1));
  CHECK_FALSE(bench.switches.is_any_told());
}
