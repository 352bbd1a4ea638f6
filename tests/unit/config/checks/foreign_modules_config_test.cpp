// Pack-file settings that are permitted or rejected with modules of another manufacturer.
#include <string>

#include "config/checks/bus_budget.hpp"
#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

/// Test pack with modules of an i3 or an Outlander, and the settings that they require.
std::vector<Change> with(const std::string& protocol, int modules, int cells, const std::vector<Change>& more = {}) {
  Json nodes = Json::array();
  for (int node = 1; node <= modules; ++node) nodes.push_back(node);
  std::vector<Change> changes{
      {"/foreign_modules", {{"protocol", protocol}}},
      {"/modules", Json::array({{{"nodes", nodes}, {"cells", cells}, {"temperature_sensors", 4}}})},
      {"/vehicle/base_id", "700"},
      {"/poll/period_ms", 70},
      {"/limits/cell_overvoltage/warn_mV", 4170},
      {"/limits/cell_overvoltage/open_mV", 4200},
      {"/contactors/precharge_resistance_Ohm", 0},
      {"/contactors/precharge_energy_J", 0},
      {"/contactors/precharge_overcurrent_mA", 0}};
  changes.insert(changes.end(), more.begin(), more.end());
  return changes;
}
std::vector<Change> outlander(const std::vector<Change>& more = {}) {
  return with("outlander_cmu", 4, 8, more);
}
std::vector<Change> i3(const std::vector<Change>& more = {}) {
  return with("i3_csc", 4, 12, more);
}

PackConfig load(const std::vector<Change>& changes) {
  const auto pack = parse(changed(changes).dump());
  REQUIRE(pack.has_value());
  return *pack;
}

}  // namespace

TEST_CASE("a pack file names whose its modules are", "[unit][config][foreign_modules]") {
  accepts(outlander());
  accepts(i3());
  accepts({{"/foreign_modules", {{"protocol", ""}}}});
  refuses({{"/foreign_modules", {{"protocol", "elcon_tc"}}}}, "/foreign_modules/protocol", "i3_csc or outlander_cmu");
  refuses({{"/foreign_modules", {{"protocol", "leaf"}}}}, "/foreign_modules/protocol", "i3_csc or outlander_cmu");
}

TEST_CASE("another maker's modules have the cells, sensors and numbers they have", "[unit][config][foreign_modules]") {
  refuses(with("outlander_cmu", 1, 9, {{"/limits/pack_voltage_mismatch/open_mV", 3'500}}), "/modules/0/cells",
          "at most 8");
  refuses(with("i3_csc", 9, 12), "/modules/8/node", "1 to 8");
  refuses(with("i3_csc", 1, 12, {{"/modules/0/temperature_sensors", 5}}), "/modules/0/temperature_sensors",
          "at most 4");
  refuses(with("i3_csc", 1, 12, {{"/modules/0/front_end_faults", true}}), "/modules/0/front_end_faults",
          "false, as i3_csc does not report them");
  accepts(outlander({{"/modules/0/temperature_sensors", 5}}));
  refuses({{"/modules", Json::array({{{"nodes", {1}}, {"cells", 12}, {"temperature_sensors", 5}}})}},
          "/modules/0/temperature_sensors", "at most 4, as a module of ours");
}

TEST_CASE("another maker's modules are asked as they are known to be asked", "[unit][config][foreign_modules]") {
  refuses(outlander({{"/poll/fast_period_ms", 30}}), "/poll/fast_period_ms", "all answers of 4 modules take");
  refuses(outlander({{"/poll/parked_period_ms", 500}}), "/poll/parked_period_ms", "40 to 400");
  refuses(i3({{"/poll/temperature_every", 2}, {"/ages/temperature_ms", 400}}), "/poll/temperature_every",
          "1, as i3_csc");
}

TEST_CASE("where no module watches its cells the daemon opens a little earlier", "[unit][config][foreign_modules]") {
  const auto pack = load(outlander());
  const int most_mV = pack.core.cell.voltage_max_uV / 1'000;
  const int least_mV = pack.core.cell.voltage_min_uV / 1'000;
  const auto opening_above = [](int open_mV, bool is_bled) {
    return outlander({{"/limits/cell_overvoltage/open_mV", open_mV},
                      {"/balancing", {{"enabled", is_bled}, {"without_board_sensor", true}}}});
  };
  accepts(opening_above(most_mV - 10, false));
  refuses(opening_above(most_mV - 9, false), "/limits/cell_overvoltage/open_mV", "10 mV");
  accepts(opening_above(most_mV - 50, true));
  refuses(opening_above(most_mV - 49, true), "/limits/cell_overvoltage/open_mV", "reads a cell low while it bleeds it");
  accepts(outlander({{"/limits/cell_undervoltage/open_mV", least_mV + 10}}));
  refuses(outlander({{"/limits/cell_undervoltage/open_mV", least_mV + 9}}), "/limits/cell_undervoltage/open_mV",
          "10 mV");
}

TEST_CASE("another maker's modules bleed by voltage", "[unit][config][foreign_modules]") {
  refuses(outlander({{"/balancing/method", "charge"}}), "/balancing/method", "bleeds by voltage");
  refuses(i3({{"/balancing/autonomous", true}}), "/balancing/autonomous", "does not support it");
}

TEST_CASE("another maker's modules have their identifiers to themselves", "[unit][config][foreign_modules]") {
  refuses(outlander({{"/vehicle/base_id", "620"}, {"/buses/vehicle", "can0"}, {"/buses/internal", "can0"}}),
          "/foreign_modules/protocol", "Mitsubishi Outlander PHEV modules");
  accepts(outlander({{"/vehicle/base_id", "620"}, {"/buses/vehicle", "can1"}, {"/buses/internal", "can0"}}));
}

TEST_CASE("an inverter may be on the bus of another maker's modules", "[unit][config][foreign_modules][inverter]") {
  for (const char* const form : {"sma", "victron", "pylontech", "discover", "orion"}) {
    CAPTURE(form);
    accepts(i3({{"/inverter", {{"protocol", form}}}}));
    accepts(outlander({{"/inverter", {{"protocol", form}}}}));
    refuses({{"/inverter", {{"protocol", form}}}}, "/inverter/protocol", "351 would be both COMMAND to a module");
  }
  // Another protocol on this bus clashes as usual.
  refuses(i3({{"/inverter", {{"protocol", "sma"}}}, {"/vehicle/base_id", "00A"}}), "/inverter/protocol",
          "would be both the messages to the vehicle and SMA battery inverter (Sunny Island)");
}

TEST_CASE("the answers of another maker's modules have their room on the bus", "[unit][config][foreign_modules]") {
  const CoreConfig own = load({}).core;
  CoreConfig foreign = load(i3()).core;
  const std::int64_t frames = 4 + 4 * 10;  // requests and answers
  CHECK(bus_load_permille(foreign, 100ms, 500) > frames * 10 * 111 / 500);
  const auto longer = cycle_time_max(foreign, all_wants, 125);
  const auto shorter = cycle_time_max(foreign, all_wants, 500);
  REQUIRE(longer.has_value());
  REQUIRE(shorter.has_value());
  CHECK(*longer > *shorter);
  CHECK(*shorter >= foreign.foreign.driver->answer_within);
  CHECK(period_min(foreign, 500) == cycle_time_max(foreign, all_wants, 500));
  CHECK(period_min(own, 500) > cycle_time_max(own, all_wants, 500));
}

}  // namespace bmu
