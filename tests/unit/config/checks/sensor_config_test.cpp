// Sensors of other manufacturers in a pack file: their roles, and rejected combinations.
#include <algorithm>
#include <string>

#include "config/checks/bus_budget.hpp"
#include "daemon/shell/can/buses.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

CoreConfig core_of(const std::vector<Change>& changes) {
  const auto pack = parse(changed(changes).dump());
  if (!pack) FAIL(all_text(pack.error()));
  return pack->core;
}

const std::vector<Change> two_sensors{{"/sensor", Json{{"has_second_current", true}, {"second_protocol", "lem_cab"}}}};

TEST_CASE("nothing is asked of a sensor unless the pack file names what it speaks", "[unit][config][sensors]") {
  const CoreConfig core = core_of({});
  CHECK(core.sensor.set_up == nullptr);
  CHECK(core.sensor.first == nullptr);
  CHECK(core.sensor.second == nullptr);
  CHECK(core.insulation.driver == nullptr);
  for (const Port port : all_ports) CHECK(sensor_receive_ids(port, core).empty());
}

TEST_CASE("an IVT-S is verified unless the pack file wants it configured", "[unit][config][sensors]") {
  const SensorConfig verified = core_of({{"/sensor", Json{{"protocol", "ivt_s"}}}}).sensor;
  CHECK(verified.set_up == find_device("ivt_s")->set_up);
  CHECK_FALSE(verified.is_configured);
  CHECK_FALSE(verified.is_stored);
  const SensorConfig configured =
      core_of({{"/sensor", Json{{"protocol", "ivt_s"}, {"set_up", "configure"}, {"store", true}}}}).sensor;
  CHECK(configured.is_configured);
  CHECK(configured.is_stored);
}

TEST_CASE("what a sensor cannot do is not asked of it", "[unit][config][sensors]") {
  refuses({{"/sensor", Json{{"set_up", "configure"}}}}, "/sensor/set_up", "a protocol in which");
  refuses({{"/sensor", Json{{"protocol", "ivt_s"}, {"store", true}}}}, "/sensor/store", "set_up is not");
  refuses({{"/sensor", Json{{"protocol", "lem_cab"}}}}, "/sensor/protocol", "ivt_s, or nothing");
  refuses({{"/sensor", Json{{"current_protocol", "ivt_s"}}}}, "/sensor/current_protocol",
          "lem_cab or outlander_current, or nothing");
  refuses({{"/sensor", Json{{"protocol", "ivt_s"}, {"set_up", "perhaps"}}}}, "/sensor/set_up", "verify or configure");
  refuses({{"/sensor", Json{{"second_protocol", "lem_cab"}}}}, "/sensor/second_protocol",
          "has_second_current is false");
  refuses({{"/sensor", Json{{"second_is_reversed", true}}}}, "/sensor/second_is_reversed",
          "has_second_current is false");
  refuses({{"/sensor", Json{{"bus", "vehicle"}}}}, "/sensor/bus", "neither current_protocol nor second_protocol");
  refuses({{"/sensor", Json{{"current_protocol", "lem_cab"}, {"bus", "second_pack"}}}}, "/sensor/bus",
          "internal, vehicle or charger");
}

TEST_CASE("a second IVT-S is asked where the pack file has identifiers for it", "[unit][config][sensors]") {
  const Json second{
      {"protocol", "ivt_s"}, {"has_second_current", true}, {"second_command_id", "413"}, {"second_response_id", "513"}};
  const CoreConfig core = core_of({{"/sensor", second}});
  CHECK(core.sensor.second_command_id == 0x413);
  CHECK(core.sensor.second_response_id == 0x513);
  const auto ids = receive_ids(Port::internal, core).standard;
  for (const std::uint32_t id : {0x413U, 0x513U}) CHECK(std::count(ids.begin(), ids.end(), id) == 1);
  const auto with = [&second](const char* key, const Json& value) {
    Json changed_one = second;
    changed_one[key] = value;
    return std::vector<Change>{{"/sensor", changed_one}};
  };
  refuses(with("second_response_id", ""), "/sensor/second_command_id", "both, or neither");
  refuses(with("second_command_id", ""), "/sensor/second_command_id", "both, or neither");
  refuses(with("protocol", ""), "/sensor/second_command_id", "protocol names none");
  refuses(with("has_second_current", false), "/sensor/second_command_id", "no second sensor at 531h");
  refuses(with("second_protocol", "lem_cab"), "/sensor/second_command_id", "no second sensor at 531h");
  refuses(with("second_command_id", "521"), "/sensor/second_command_id", "521 is SENSOR_CURRENT");
  refuses(with("second_command_id", "411"), "/sensor/second_command_id", "Isabellenhuette IVT-S");
  refuses(with("second_response_id", "413"), "/sensor/second_response_id", "commands to the second current sensor");
}

TEST_CASE("beside the modules of an Outlander the sensor at 3C2h has the direction of the car",
          "[unit][config][sensors]") {
  const Change modules{"/foreign_modules", Json{{"protocol", "outlander_cmu"}}};
  const auto has_problem = [&](const Json& sensor, std::string_view key) {
    const ConfigProblems problems = problems_of(changed({modules, {"/sensor", sensor}}).dump());
    return std::any_of(problems.begin(), problems.end(), [&](const auto& one) {
      return one.path == key && to_text(one).find("outlander_current") != std::string::npos;
    });
  };
  CHECK(has_problem({{"current_protocol", "lem_cab"}}, "/sensor/current_protocol"));
  CHECK(has_problem({{"has_second_current", true}, {"second_protocol", "lem_cab"}}, "/sensor/second_protocol"));
  CHECK_FALSE(has_problem({{"current_protocol", "outlander_current"}}, "/sensor/current_protocol"));
  CHECK_FALSE(has_problem({{"current_protocol", "lem_cab"}, {"bus", "vehicle"}}, "/sensor/current_protocol"));
  const CoreConfig core = core_of({{"/sensor", Json{{"current_protocol", "outlander_current"}}}});
  CHECK(core.sensor.first == find_device("outlander_current")->current);
}

TEST_CASE("a monitor on a bus reports its resistance, and is somewhere", "[unit][config][insulation]") {
  const CoreConfig core =
      core_of({{"/insulation", Json{{"protocol", "iso165c"}, {"monitoring", "measured"}, {"bus", "vehicle"}}}});
  CHECK(core.insulation.driver == find_device("iso165c")->insulation);
  CHECK(core.insulation.bus == Port::vehicle);
  refuses({{"/insulation", Json{{"protocol", "iso165c"}, {"monitoring", "ok_line"}}}}, "/insulation/monitoring",
          "reports its resistance");
  refuses({{"/insulation", Json{{"monitoring", "measured"}, {"bus", "charger"}}}}, "/insulation/bus",
          "names no monitor");
  refuses({{"/insulation", Json{{"protocol", "lem_cab"}}}}, "/insulation/protocol", "iso165c, or nothing");
}

TEST_CASE("sensors whose identifiers clash with others on their bus are refused with both names",
          "[unit][config][identifiers]") {
  accepts(two_sensors);
  refuses({{"/sensor",
            Json{{"has_second_current", true}, {"current_protocol", "lem_cab"}, {"second_protocol", "lem_cab"}}}},
          "/sensor/second_protocol", "LEM CAB 300 / CAB 500 current sensor (sensor/current_protocol)");
  const Json ivt{{"protocol", "ivt_s"}};
  // Vehicle messages with the identifier of the sensor's command: on one bus, and on two.
  const auto shared =
      changed({{"/sensor", ivt}, {"/vehicle/base_id", "40F"}, {"/buses/vehicle", valid_pack()["buses"]["internal"]}});
  const ConfigProblems problems = problems_of(shared.dump());
  REQUIRE(problems.size() == 1);
  CHECK(problems.front().path == "/sensor/protocol");
  CHECK(to_text(problems.front()).find("the messages to the vehicle (vehicle/base_id)") != std::string::npos);
  CHECK(to_text(problems.front()).find("Isabellenhuette IVT-S") != std::string::npos);
  CHECK(to_text(problems.front()).find("411") != std::string::npos);
  accepts({{"/sensor", ivt}, {"/vehicle/base_id", "40F"}, {"/buses/internal", "can0"}, {"/buses/vehicle", "can1"}});
}

TEST_CASE("a port lets in what its sensors say, and nothing of others", "[unit][buses][sensors]") {
  const auto has = [](const std::vector<std::uint32_t>& ids, std::uint32_t id) {
    return std::find(ids.begin(), ids.end(), id) != ids.end();
  };
  CoreConfig core = core_of(
      {{"/sensor",
        Json{{"protocol", "ivt_s"}, {"has_second_current", true}, {"second_protocol", "lem_cab"}, {"bus", "vehicle"}}},
       {"/insulation", Json{{"protocol", "iso165c"}, {"monitoring", "measured"}, {"bus", "charger"}}}});
  const auto internal = sensor_receive_ids(Port::internal, core);
  CHECK(has(internal, 0x511));
  CHECK_FALSE(has(internal, 0x3C2));
  CHECK_FALSE(has(internal, 0x037));
  CHECK(has(sensor_receive_ids(Port::vehicle, core), 0x3C2));
  CHECK(has(receive_ids(Port::charger, core).standard, 0x037));
  CHECK(sensor_receive_ids(Port::second_pack, core).empty());
  CHECK_FALSE(receive_ids(Port::charger, core).empty());
  CHECK(has(receive_ids(Port::internal, core).standard, 0x521));
  core.sensor.first = core.sensor.second;
  core.sensor.second = nullptr;
  CHECK(has(sensor_receive_ids(Port::vehicle, core), 0x3C2));
}

TEST_CASE("a sensor with frames of its own takes its share of the bus", "[unit][config][sensors]") {
  const auto load = [](const std::vector<Change>& changes) {
    const CoreConfig core = core_of(changes);
    return bus_load_permille(core, core.poll.period, 500);
  };
  const auto none = load({});
  const auto own = load({{"/sensor", Json{{"has_second_current", true}}}});
  const auto lem = load(two_sensors);
  CHECK(own > none);
  CHECK(lem > own);  // 100 messages per second
  const std::vector<Change> apart{{"/buses/internal", "can0"}, {"/buses/vehicle", "can1"}};
  std::vector<Change> lem_apart = apart;
  lem_apart.push_back(
      {"/sensor", Json{{"has_second_current", true}, {"second_protocol", "lem_cab"}, {"bus", "vehicle"}}});
  CHECK(load(lem_apart) == load(apart));
}

}  // namespace
}  // namespace bmu
