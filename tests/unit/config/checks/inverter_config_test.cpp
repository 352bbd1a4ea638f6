// Section `inverter`: accepted values, rejected values with their error texts, and identifier clashes.
#include "config/checks/identifier_checks.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

/// Inverter on its own bus, with these keys.
std::vector<Change> inverter(const Json& more, const std::string& bus = "can7") {
  Json all{{"protocol", "pylontech"}};
  all.update(more);
  return {{"/inverter", all}, {"/buses/inverter", bus}};
}

std::vector<Change> with(std::vector<Change> changes, const Change& more) {
  changes.push_back(more);
  return changes;
}

}  // namespace

TEST_CASE("an inverter is chosen by name, and what is left out has a safe default", "[unit][config][inverter]") {
  const auto pack = parse(changed(inverter(Json::object())).dump());
  REQUIRE(pack);
  const InverterConfig& read = pack->core.inverter;
  CHECK(read.driver->name == "pylontech");
  CHECK(read.when_silent == SilentInverter::open);
  CHECK(read.silence_max == 5s);
  CHECK(read.first_word_max == 60s);
  CHECK(read.charge_voltage_max_mV == pack->core.charger.cell_full_uV / 1'000 * 48);
  CHECK(read.discharge_voltage_min_mV == 144'000);
  CHECK(read.soh_assumed_permille == 0);
  CHECK_FALSE(read.is_discharge_positive.has_value());
  CHECK(read.maker.front() == '\0');
  CHECK(pack->buses.name(Port::inverter) == "can7");
  for (const char* name : {"sma", "victron", "pylontech", "discover", "orion"}) accepts(inverter({{"protocol", name}}));
  refuses(inverter({{"protocol", "elcon_tc"}}), "/inverter/protocol", "discover, orion, pylontech, sma or victron");
  const auto none = parse(valid_pack().dump());
  REQUIRE(none);
  CHECK(none->core.inverter.driver == nullptr);
  CHECK(none->buses.name(Port::inverter) == none->buses.vehicle);
}

TEST_CASE("what an inverter is told has its bounds", "[unit][config][inverter]") {
  refuses(inverter({{"period_ms", 199}}), "/inverter/period_ms", "200");
  accepts(inverter({{"period_ms", 2'500}}));
  refuses(inverter({{"period_ms", 2'501}}), "/inverter/period_ms", "at most 2500: one that hears nothing for 5000");
  accepts(inverter({{"protocol", "sma"}, {"period_ms", 5'000}}));
  accepts(inverter({{"silence_max_ms", 0}}));
  accepts(inverter({{"silence_max_ms", 2'000}}));
  refuses(inverter({{"silence_max_ms", 1'999}}), "/inverter/silence_max_ms", "0, or at least 2000");
  for (const char* name : {"warn", "stop", "open"}) accepts(inverter({{"when_silent", name}}));
  refuses(inverter({{"when_silent", "shut"}}), "/inverter/when_silent", "warn, stop or open");
  accepts(inverter({{"charge_voltage_max_mV", 203'040}}));
  refuses(inverter({{"charge_voltage_max_mV", 203'041}}), "/inverter/charge_voltage_max_mV", "at most 203040");
  accepts(inverter({{"discharge_voltage_min_mV", 134'400}}));
  refuses(inverter({{"discharge_voltage_min_mV", 134'399}}), "/inverter/discharge_voltage_min_mV", "at least 134400");
  refuses(inverter({{"charge_voltage_max_mV", 150'000}, {"discharge_voltage_min_mV", 150'000}}),
          "/inverter/discharge_voltage_min_mV", "less than charge_voltage_max_mV, 150000");
  refuses(inverter({{"maker", "NINECHARS"}}), "/inverter/maker", "8");
}

TEST_CASE("a name for the maker is padded, and none is the protocol's own", "[unit][config][inverter]") {
  const auto named = parse(changed(inverter({{"maker", "HOME"}})).dump());
  REQUIRE(named);
  CHECK(named->core.inverter.maker == std::array<char, 8>{'H', 'O', 'M', 'E', ' ', ' ', ' ', ' '});
  const auto unnamed = parse(changed(inverter({{"maker", ""}})).dump());
  REQUIRE(unnamed);
  CHECK(unnamed->core.inverter.maker.front() == '\0');
}

TEST_CASE("an inverter on the bus of the modules is refused with both names", "[unit][config][identifiers][inverter]") {
  // The demonstration pack has one bus for everything.
  refuses({{"/inverter", Json{{"protocol", "sma"}}}}, "/inverter/protocol",
          "351 would be both COMMAND to a module and the limits for the SMA battery inverter (Sunny Island)");
  accepts(inverter(Json::object()));
}

TEST_CASE("an inverter's identifiers clash with others on its bus, and both are named",
          "[unit][config][identifiers][inverter]") {
  accepts(with(inverter(Json::object()), {"/buses/vehicle", "can7"}));
  // The identifiers 305 to 379 of the three protocols are in a range that is reserved for the internal bus; only SMA's
  // standby can clash with another message.
  const std::vector<Change> sma = with(inverter({{"protocol", "sma"}}), {"/buses/vehicle", "can7"});
  accepts(sma);
  refuses(with(sma, {"/vehicle/base_id", "00A"}), "/inverter/protocol",
          "00F would be both the messages to the vehicle and SMA battery inverter (Sunny Island)");
  accepts(with(inverter({{"protocol", "sma"}}, "can8"), {"/vehicle/base_id", "00A"}));
}

TEST_CASE("an inverter that was apart in the file clashes when the command line joins the buses",
          "[unit][config][identifiers][inverter]") {
  auto pack = parse(changed(inverter(Json::object())).dump());
  REQUIRE(pack);
  CHECK(bus_clashes(*pack).empty());
  BusNames names = pack->buses;
  names.inverter = names.internal;
  set_buses(*pack, names);
  const ConfigProblems clashes = bus_clashes(*pack);
  REQUIRE(clashes.size() == 1);
  CHECK(clashes[0].path == "/inverter/protocol");
}

}  // namespace bmu
