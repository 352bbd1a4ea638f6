// Bit rates of the buses in a pack file, and devices that do not support them.
#include "config/checks/device_rates.hpp"

#include "config/checks/identifier_checks.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

const Json lem_on_charger_bus{{"current_protocol", "lem_cab"}, {"bus", "charger"}};
const Json elcon{{"protocol", "elcon_tc"}};

/// Test pack with a vehicle bus that is separate from the bus of the modules.
std::vector<Change> apart(std::vector<Change> changes) {
  changes.push_back({"/buses/vehicle", "can1"});
  return changes;
}

TEST_CASE("a bit rate that a device on the bus cannot have is refused, with those it can have", "[unit][config]") {
  const Json lem{{"current_protocol", "lem_cab"}};
  refuses(
      {{"/sensor", lem}, {"/buses/internal_kbit_per_s", 250}}, "/buses/internal_kbit_per_s",
      "found 250, expected 500, the only bit rate of LEM CAB 300 / CAB 500 current sensor (sensor/current_protocol)");
  accepts({{"/sensor", lem}, {"/buses/internal_kbit_per_s", 500}});

  // The chargers are on the vehicle bus unless the file names another.
  refuses(apart({{"/charger", elcon}, {"/interfaces/vehicle_kbit_per_s", 125}}), "/interfaces/vehicle_kbit_per_s",
          "found 125, expected 250 or 500, the bit rates of Elcon / TC (HK-J) charger (charger/protocol)");
  for (const int kbit_per_s : {250, 500}) {
    accepts(apart({{"/charger", elcon}, {"/interfaces/vehicle_kbit_per_s", kbit_per_s}}));
  }
  // The bit rate of a bus without its own interface is not used.
  accepts(apart({{"/charger", elcon}, {"/interfaces/charger_kbit_per_s", 125}}));
  refuses({{"/charger", elcon}, {"/buses/charger", "can7"}, {"/interfaces/charger_kbit_per_s", 125}},
          "/interfaces/charger_kbit_per_s", "250 or 500");
}

TEST_CASE("every kind of device is held against the bit rate of its bus", "[unit][config]") {
  const auto refuses_250 = [](const std::vector<Change>& with, const std::string& path, const std::string& who) {
    std::vector<Change> changes = apart(with);
    changes.push_back({path, 250});
    refuses(changes, path, "(" + who + ")");
    changes.back() = {path, 500};
    accepts(changes);
  };
  const Json inverter{{"protocol", "sma"}};
  refuses_250({{"/inverter", inverter}}, "/interfaces/vehicle_kbit_per_s", "inverter/protocol");
  refuses_250({{"/inverter", inverter}, {"/buses/inverter", "can7"}}, "/interfaces/inverter_kbit_per_s",
              "inverter/protocol");
  refuses_250({{"/charger", Json{{"protocol", "brusa_nlg5"}}}}, "/interfaces/vehicle_kbit_per_s", "charger/protocol");
  refuses_250({{"/sensor", Json{{"has_second_current", true}, {"second_protocol", "lem_cab"}}}},
              "/buses/internal_kbit_per_s", "sensor/second_protocol");
  const Json ivt_s{{"protocol", "ivt_s"}};
  refuses({{"/sensor", ivt_s}, {"/buses/internal_kbit_per_s", 125}}, "/buses/internal_kbit_per_s", "(sensor/protocol)");
  const Json monitor{{"protocol", "iso165c"}, {"monitoring", "measured"}, {"bus", "vehicle"}};
  refuses(apart({{"/insulation", monitor}, {"/interfaces/vehicle_kbit_per_s", 1'000}}),
          "/interfaces/vehicle_kbit_per_s", "250 or 500");
  // An iso165C, and an iso165C-1.
  for (const int kbit_per_s : {250, 500}) {
    accepts(apart({{"/insulation", monitor}, {"/interfaces/vehicle_kbit_per_s", kbit_per_s}}));
  }
}

TEST_CASE("an inverter of any bit rate refuses none", "[unit][config]") {
  accepts(apart({{"/inverter", Json{{"protocol", "orion"}}}, {"/interfaces/vehicle_kbit_per_s", 125}}));
  accepts(apart({{"/inverter", Json{{"protocol", "victron"}}}, {"/interfaces/vehicle_kbit_per_s", 250}}));
}

TEST_CASE("a chargers' bus without a bit rate has the first that all devices there can have", "[unit][config]") {
  const auto rate_with = [](std::vector<Change> changes) {
    changes.push_back({"/buses/charger", "can7"});
    const auto pack = parse(changed(changes).dump());
    REQUIRE(pack);
    return bit_rate_kbit_per_s(*pack, Port::charger);
  };
  CHECK(rate_with({}) == 0);
  CHECK(rate_with({{"/charger", elcon}}) == 250);
  CHECK(rate_with({{"/sensor", lem_on_charger_bus}}) == 500);
  CHECK(rate_with({{"/charger", elcon}, {"/sensor", lem_on_charger_bus}}) == 500);
  CHECK(rate_with({{"/charger", elcon}, {"/interfaces/charger_kbit_per_s", 500}}) == 500);
  refuses({{"/charger", elcon},
           {"/sensor", lem_on_charger_bus},
           {"/buses/charger", "can7"},
           {"/interfaces/charger_kbit_per_s", 250}},
          "/interfaces/charger_kbit_per_s", "sensor/current_protocol");
}

TEST_CASE("a device meets another bit rate when the command line joins the buses", "[unit][config]") {
  auto pack = parse(changed(apart({{"/charger", Json{{"protocol", "brusa_nlg5"}}},
                                   {"/buses/charger", "can7"},
                                   {"/interfaces/vehicle_kbit_per_s", 250}}))
                        .dump());
  REQUIRE(pack);
  CHECK(bus_clashes(*pack).empty());
  BusNames names = pack->buses;
  names.charger = names.vehicle;
  set_buses(*pack, names);
  const ConfigProblems clashes = bus_clashes(*pack);
  REQUIRE(clashes.size() == 1);
  CHECK(clashes[0].path == "/interfaces/vehicle_kbit_per_s");
  CHECK(clashes[0].wanted.find("500, the only bit rate of Brusa NLG5 charger") == 0);
}

}  // namespace
}  // namespace bmu
