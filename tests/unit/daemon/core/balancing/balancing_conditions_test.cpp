// Each balancing inhibit: just below its threshold, active, and the condition that ends it.
#include "daemon/core/balancing/balancing_conditions.hpp"

#include <set>
#include <string>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

/// Closed, healthy pack at rest with balancing enabled: no inhibit is active.
struct Bench {
  Bench() {
    config.balancing = {.is_enabled = true,
                        .voltage_min_uV = 3'300'000,
                        .discharge_max_mA = 500,
                        .board_min_dC = 0,
                        .board_max_dC = 650};
    modules.init(config);
    for (const std::uint8_t node : {std::uint8_t{1}, std::uint8_t{2}}) say_boards(node, 0);
    say({.mode = internal_bus::Mode::normal});
    pack.cell_voltage_uV = {.min = 3'700'000, .max = 3'700'000, .count = 8, .expected = 8};
    pack.cell_temperature_dC = {.count = 4, .expected = 4};
    pack.board_temperature_dC = {.min = 300, .max = 300, .count = 2, .expected = 2};
    pack.modules_answering = pack.modules_expected = 2;
    pack.current_mA = {.value = 0, .taken_at = now, .validity = Validity::valid};
    conditions = {.config = &config,
                  .pack = &pack,
                  .modules = &modules,
                  .phase = Phase::closed,
                  .internal_bus_up = true,
                  .modules_set_up = true};
  }

  void say(const ModuleStatus& said, std::uint8_t node = 2) {
    using namespace internal_bus;
    CanFrame frame = make_frame(status, node);
    write<status, "mode">(frame, static_cast<std::int64_t>(said.mode));
    write<status, "supply">(frame, said.on_module_supply ? 1 : 0);
    write<status, "board_too_hot">(frame, said.board_too_hot ? 1 : 0);
    modules.observe(status, node, frame, now);
  }
  /// Reports a board sensor at this position and at no other.
  void say_boards(std::uint8_t node, std::size_t fitted) {
    using namespace internal_bus;
    CanFrame frame = make_frame(temp_2, node);
    constexpr std::size_t first = 1;  // after the fourth cell sensor
    encode_signal(temp_2.signals[0], not_known(Validity::not_fitted), frame.data);
    for (std::size_t place = 0; place < board_temperatures_per_module; ++place) {
      const bool is_fitted = place == fitted;
      encode_signal(temp_2.signals[first + place], is_fitted ? known(300) : not_known(Validity::not_fitted),
                    frame.data);
    }
    modules.observe(temp_2, node, frame, now);
  }
  BalancingBlockers look() { return before = balancing_blockers(conditions, before); }
  /// Whether this inhibit is active and no other.
  bool only(BalancingBlocker id) { return look() == 1U << static_cast<unsigned>(id); }

  CoreConfig config = test::small_pack();
  ModuleTable modules;
  PackState pack;
  BalancingConditions conditions;
  BalancingBlockers before = 0;
  TimePoint now{100s};
};

}  // namespace

TEST_CASE("with all as it should be nothing speaks against balancing", "[unit][balancing]") {
  Bench bench;
  CHECK(bench.look() == 0);
}

TEST_CASE("each simple reason speaks against balancing, alone", "[unit][balancing]") {
  struct Case {
    BalancingBlocker id;
    void (*change)(Bench&);
  };
  const Case cases[] = {
      {BalancingBlocker::not_enabled, [](Bench& bench) { bench.config.balancing.is_enabled = false; }},
      {BalancingBlocker::switched_off, [](Bench& bench) { bench.conditions.is_switched_off = true; }},
      {BalancingBlocker::shutting_down, [](Bench& bench) { bench.conditions.is_shutting_down = true; }},
      {BalancingBlocker::resting, [](Bench& bench) { bench.conditions.is_resting = true; }},
      {BalancingBlocker::internal_bus_down, [](Bench& bench) { bench.conditions.internal_bus_up = false; }},
      {BalancingBlocker::fault, [](Bench& bench) { bench.conditions.has_fault = true; }},
      {BalancingBlocker::incomplete, [](Bench& bench) { bench.pack.cell_voltage_uV.count = 7; }},
      {BalancingBlocker::incomplete, [](Bench& bench) { bench.pack.modules_answering = 1; }},
      {BalancingBlocker::not_set_up, [](Bench& bench) { bench.conditions.modules_set_up = false; }},
      {BalancingBlocker::module_not_normal, [](Bench& bench) { bench.say({.mode = internal_bus::Mode::autonomous}); }},
      {BalancingBlocker::module_not_normal, [](Bench& bench) { bench.say({.mode = internal_bus::Mode::starting}); }},
      {BalancingBlocker::on_module_supply,
       [](Bench& bench) { bench.say({.mode = internal_bus::Mode::normal, .on_module_supply = true}); }},
      {BalancingBlocker::current_unknown, [](Bench& bench) { bench.pack.current_mA.validity = Validity::unknown; }},
      {BalancingBlocker::not_closed, [](Bench& bench) { bench.conditions.phase = Phase::open; }},
      {BalancingBlocker::board_too_hot,
       [](Bench& bench) { bench.say({.mode = internal_bus::Mode::normal, .board_too_hot = true}); }},
  };
  for (const Case& one : cases) {
    CAPTURE(row_of(one.id).name);
    Bench bench;
    one.change(bench);
    CHECK(bench.only(one.id));
  }
}

TEST_CASE("while contactors move nothing is bled, whatever the pack file says of open ones", "[unit][balancing]") {
  for (const bool requires_closed : {true, false}) {
    for (const Phase phase : all_phases) {
      Bench bench;
      bench.config.balancing.requires_closed = requires_closed;
      bench.conditions.phase = phase;
      CAPTURE(to_text(phase), requires_closed);
      if (phase == Phase::closed || (phase == Phase::open && !requires_closed)) {
        CHECK(bench.look() == 0);
      } else {
        CHECK(bench.only(phase == Phase::open ? BalancingBlocker::not_closed : BalancingBlocker::moving_contactors));
      }
    }
  }
}

TEST_CASE("a discharge speaks against it beyond its threshold, until it is a fifth less", "[unit][balancing]") {
  Bench bench;
  bench.pack.current_mA.value = 500;
  CHECK(bench.look() == 0);
  bench.pack.current_mA.value = 501;
  CHECK(bench.only(BalancingBlocker::discharging));
  bench.pack.current_mA.value = 401;
  CHECK(bench.only(BalancingBlocker::discharging));
  bench.pack.current_mA.value = 400;
  CHECK(bench.look() == 0);
  bench.pack.current_mA.value = -100'000;  // charging does not inhibit
  CHECK(bench.look() == 0);
}

TEST_CASE("a cell below the minimum speaks against it, until it has come 20 mV back", "[unit][balancing]") {
  Bench bench;
  bench.pack.cell_voltage_uV.min = 3'300'000;
  CHECK(bench.look() == 0);
  bench.pack.cell_voltage_uV.min = 3'299'999;
  CHECK(bench.only(BalancingBlocker::cell_too_low));
  bench.pack.cell_voltage_uV.min = 3'319'999;
  CHECK(bench.only(BalancingBlocker::cell_too_low));
  bench.pack.cell_voltage_uV.min = 3'320'000;
  CHECK(bench.look() == 0);
}

TEST_CASE("boards speak against it when hot or cold, until they are 5 C better", "[unit][balancing][MMU_16]") {
  Bench bench;
  bench.pack.board_temperature_dC.max = 650;
  CHECK(bench.look() == 0);
  bench.pack.board_temperature_dC.max = 651;
  CHECK(bench.only(BalancingBlocker::board_too_hot));
  bench.pack.board_temperature_dC.max = 601;
  CHECK(bench.only(BalancingBlocker::board_too_hot));
  bench.pack.board_temperature_dC.max = 600;
  CHECK(bench.look() == 0);
  bench.pack.board_temperature_dC.min = 0;
  CHECK(bench.look() == 0);
  bench.pack.board_temperature_dC.min = -1;
  CHECK(bench.only(BalancingBlocker::board_too_cold));
  bench.pack.board_temperature_dC.min = 49;
  CHECK(bench.only(BalancingBlocker::board_too_cold));
  bench.pack.board_temperature_dC.min = 50;
  CHECK(bench.look() == 0);
}

TEST_CASE("a module without a sensor on its board is bled only where the pack file says so",
          "[unit][balancing][MMU_16]") {
  constexpr std::size_t nowhere = internal_bus::board_temperatures_per_module;
  for (const std::uint8_t node : {std::uint8_t{1}, std::uint8_t{2}}) {
    CAPTURE(node);
    Bench bench;
    bench.modules.init(bench.config);
    bench.say_boards(static_cast<std::uint8_t>(3 - node), 3);  // one sensor is enough, at any position
    CHECK(bench.only(BalancingBlocker::board_unknown));        // its sensors are not reported yet
    bench.say_boards(node, nowhere);
    CHECK(bench.only(BalancingBlocker::board_unknown));
    bench.config.balancing.without_board_sensor = true;
    CHECK(bench.look() == 0);
  }
}

TEST_CASE("what is not known yet is not judged by its zeros", "[unit][balancing]") {
  Bench bench;
  bench.pack.cell_voltage_uV = {.expected = 8};
  CHECK(bench.only(BalancingBlocker::incomplete));
}

TEST_CASE("the first reason is the most telling one, and each has a name and words of its own", "[unit][balancing]") {
  Bench bench;
  bench.conditions.has_fault = true;
  bench.conditions.phase = Phase::open;
  CHECK(first_of(bench.look()) == BalancingBlocker::fault);
  std::set<std::string> texts;
  for (const BalancingBlockerRow& row : balancing_blocker_table()) {
    CHECK(texts.insert(std::string(row.name)).second);
    CHECK(texts.insert(std::string(row.meaning)).second);
  }
}
