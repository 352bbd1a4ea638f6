// Replies of the status socket are one line, equal to the output of a tree, and need few allocations.
#include <cmath>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/core/estimation/energy_left.hpp"
#include "daemon/shell/status/status_requests.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/told_core.hpp"
#include "tools/bmuctl/text_pages.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

constexpr std::uint32_t odd_user = 1'000;
constexpr std::string_view odd_name = "Käthe \"K\" \\ \xFF";

FreezeFrame full_frame() {
  constexpr Element cell{.module_node = 1, .number = 3, .pack_number = 3};
  constexpr Element sensor{.module_node = 2, .number = 1, .is_temperature_sensor = true};
  FreezeFrame frame{.unix_time_ms = 1'700'000'000'000,
                    .value = -12'345,
                    .threshold = 100'000,
                    .element = cell,
                    .phase = Phase::closed,
                    .mode = PackMode::driving};
  frame.cell_voltage_min_uV = 2'800'000;
  frame.cell_voltage_min_at = cell;
  frame.cell_temperature_max_dC = -5;
  frame.cell_temperature_max_at = sensor;
  frame.current_mA = -40'000;
  frame.outputs = ContactorOutputs{.main_positive = true, .fan = true};
  frame.inputs = PduState{.main_positive_closed = true, .estops_pressed = 0b101, .throttle_permille = known(7)};
  return frame;
}

/// Each fault occurred in a previous session, and was cleared by a user with an odd name.
PersistentState with_all_recorded() {
  PersistentState state;
  for (FaultRecord& record : state.faults) {
    record = {.count = 3,
              .first_unix_time_ms = 1'600'000'000'000,
              .last_unix_time_ms = 1'700'000'000'000,
              .cleared = ClearRecord{.unix_time_ms = 1'700'000'100'000, .user_id = odd_user},
              .frame = full_frame()};
  }
  return state;
}

/// Commands of the status socket with a core, and users of which one has an odd name.
struct Desk {
  TemporaryFolder folder;
  test::ToldCore told;
  Access access{
      {.own_user_id = 0},
      UserNames(folder.file("passwd", std::string(odd_name) + ":x:" + std::to_string(odd_user) + ":100::/:/\n")),
      [](std::string_view) {}};
  StatusRequests requests{{.make_view = [this] { return told.view(access.users()); },
                           .carry_out = [](const CommandGiven&) {},
                           .log = [](std::string_view) {},
                           .access = access,
                           .reload = [](const Peer&) { return refusal("refused", "not here"); }}};

  explicit Desk(const PersistentState& state = {}, const CoreConfig& config = small_pack())
      : told{CoreBench(config, state)} {}
  Desk(const Desk&) = delete;
  Desk& operator=(const Desk&) = delete;
  ~Desk() = default;

  [[nodiscard]] std::string ask(std::string_view command) const {
    return requests.answer(Json{{"cmd", command}}.dump(), {.user_id = 0}).line;
  }
};

struct World {
  const char* name;
  std::function<void(Desk&)> make;
};

std::vector<World> worlds() {
  return {
      {"nothing heard yet", [](Desk&) {}},
      {"a pack's name that is no UTF-8, and needs escaping",
       [](Desk& desk) { desk.told.pack_name = "\xFF \"\n\t\x01 ü"; }},
      {"driving", [](Desk& desk) { REQUIRE(desk.told.bench.close()); }},
      {"a warning",
       [](Desk& desk) {
         REQUIRE(desk.told.bench.close());
         desk.told.bench.modules[0].cell_voltage_uV[2] = known(3'050'000);
         desk.told.bench.run(500ms);
       }},
      {"opened by a cell, and a module is silent",
       [](Desk& desk) {
         CoreBench& bench = desk.told.bench;
         REQUIRE(bench.close());
         bench.observe(WallClockSeen{.unix_time_ms = 1'700'000'000'000});
         bench.modules[0].cell_voltage_uV[2] = known(2'000'000);
         bench.run(1s);
         bench.modules[1].talks = false;
         bench.run(2s);
         REQUIRE(bench.is_active(FaultId::cell_undervoltage));
         REQUIRE(bench.is_active(FaultId::module_lost));
       }},
      {"nothing is heard any more",
       [](Desk& desk) {
         desk.told.bench.run(1s);
         desk.told.bench.sensor_talks = desk.told.bench.voltage_talks = desk.told.bench.pdu_talks = false;
         desk.told.bench.run(3s);
       }},
  };
}

const Json* row_named(const Json& reply, std::string_view name) {
  for (const Json& row : reply.at("faults")) {
    if (row.at("name") == name) return &row;
  }
  return nullptr;
}

std::uint64_t allocations_of(const std::function<std::string()>& make) {
  static_cast<void>(make());  // allocated only once
  const std::uint64_t before = test::allocation_count();
  static_cast<void>(make());
  return test::allocation_count() - before;
}

}  // namespace

TEST_CASE("each answer is a line that a tree would be written as", "[unit][status]") {
  for (const bool is_recorded : {false, true}) {
    for (const World& world : worlds()) {
      INFO(world.name << (is_recorded ? ", each fault recorded" : ""));
      Desk desk(is_recorded ? with_all_recorded() : PersistentState{});
      world.make(desk);
      for (const char* command : {"status", "cells", "faults", "why", "modules", "health", "balance", "version"}) {
        CAPTURE(command);
        const std::string line = desk.ask(command);
        const Json reply = Json::parse(line);
        CHECK(reply.dump() == line);
        CHECK(reply.begin().key() == "ok");
        CHECK(reply.at("cmd") == command);
      }
    }
  }
}

TEST_CASE("a picture has what the single answers have", "[unit][status]") {
  for (const World& world : worlds()) {
    INFO(world.name);
    Desk desk(with_all_recorded());
    world.make(desk);
    const std::string line = desk.requests.picture();
    const Json picture = Json::parse(line);
    CHECK(picture.dump() == line);
    for (const char* part : {"status", "cells", "faults", "why"}) {
      CAPTURE(part);
      Json alone = Json::parse(desk.ask(part));
      alone.erase("ok");
      alone.erase("cmd");
      CHECK(picture.at(part) == alone);
    }
  }
}

TEST_CASE("a fault tells what is seen, and what is remembered of it", "[unit][status][faults]") {
  Desk desk(with_all_recorded());
  worlds()[4].make(desk);
  const Json reply = Json::parse(desk.ask("faults"));
  CHECK(reply.at("faults").size() == fault_count);
  const Json* const low = row_named(reply, "cell_undervoltage");
  REQUIRE(low != nullptr);
  CHECK(low->at("is_present") == true);
  CHECK(low->at("threshold_uV") == 2'900'000);
  CHECK(low->at("warning_uV") == 3'100'000);
  CHECK(low->at("latest").at("value_uV") == 2'000'000);
  CHECK(low->at("latest").at("element") ==
        Json{{"module", 1}, {"number", 3}, {"pack_number", 3}, {"text", "cell 1.3 (no. 3)"}});
  CHECK(low->at("count") == 4);
  CHECK(low->at("freeze_frame").at("value_uV") == 2'000'000);

  const Json* const lost = row_named(reply, "module_lost");
  REQUIRE(lost != nullptr);
  CHECK(lost->at("modules").size() == 1);
  CHECK_FALSE(lost->contains("threshold"));

  const Json* const old = row_named(reply, "discharge_overcurrent");
  REQUIRE(old != nullptr);
  CHECK(old->at("is_present") == false);
  CHECK(old->at("confirmed").is_null());
  CHECK(old->at("cleared") == Json{{"unix_time_ms", 1'700'000'100'000},
                                   {"user_id", odd_user},
                                   {"user_name", "Käthe \"K\" \\ \xEF\xBF\xBD"},
                                   {"authority", "user"}});
  const Json& frame = old->at("freeze_frame");
  CHECK(frame.at("value_mA") == -12'345);
  CHECK(frame.at("cell_voltage_max_uV").is_null());
  CHECK(frame.at("cell_voltage_max_at").is_null());
  CHECK(frame.at("cell_temperature_max_at").at("text") == "temperature sensor 2.1");
  CHECK(frame.at("outputs").at("fan") == true);
  CHECK(frame.at("inputs").at("estops_pressed") == Json{1, 3});
  CHECK(frame.at("inputs").at("throttle_permille") == 7);
}

TEST_CASE("the status has the permissible power and the energy left of the core, bmuctl shows the power",
          "[unit][status][POW_1][SOE_1]") {
  CoreConfig config = small_pack();
  config.dynamics = test::sloped_cell();
  Desk desk({}, config);
  CoreBench& bench = desk.told.bench;
  REQUIRE(bench.close());
  bench.current_mA = 5'000;
  bench.run(2s);
  const Core& core = bench.core();
  const Json status = Json::parse(desk.ask("status"));
  const PowerLimits powers = core.power_limits();
  REQUIRE(powers.discharge.limit_W != powers.charge.limit_W);
  const auto shown = [](const PowerLimit& power) {
    return Json{{"limit_W", power.limit_W}, {"cause", to_text(power.cause)}};
  };
  CHECK(status.at("power_limits") == Json{{"discharge", shown(powers.discharge)},
                                          {"charge", shown(powers.charge)},
                                          {"discharge_continuous", shown(powers.discharge_continuous)},
                                          {"charge_continuous", shown(powers.charge_continuous)}});
  const EnergyLeft energy = energy_left(core.estimate(), core.config());
  REQUIRE(energy.is_known);
  CHECK(status.at("charge").at("energy_left_mWh") == in_mWh(energy.energy_Wh));
  CHECK(status.at("charge").at("energy_left_sigma_mWh") == in_mWh(energy.sigma_Wh));
  CHECK(status.at("charge").at("energy_left_load_mA") == std::llround(energy.load_A * 1e3));
  const std::string page = status_page(Reply(status)).text(false);
  INFO(page);
  CHECK(page.find("discharge " + std::to_string(powers.discharge.limit_W) + " W") != std::string::npos);
  CHECK(page.find("charge " + std::to_string(powers.charge.limit_W) + " W", page.find(" W") + 1) != std::string::npos);
}

TEST_CASE("a fault shows what it does in this pack, and what it usually does where the pack file is stricter",
          "[unit][status][faults][reactions]") {
  CoreConfig config = small_pack();
  config.stricter_reactions.push_back({.fault = FaultId::supply_low, .reaction = Reaction::open_now});
  config.stricter_reactions.push_back(
      {.fault = FaultId::cell_imbalance, .reaction = Reaction::open_after_grace, .grace = 100ms});
  const Desk desk({}, config);
  const Json reply = Json::parse(desk.ask("faults"));
  struct Case {
    const char* fault;
    const char* reaction;
    Json grace_ms;
    Json usual_reaction;
    Json usual_grace_ms;
  };
  const std::vector<Case> cases{{"supply_low", "open now", nullptr, "refuse to close", nullptr},
                                {"cell_imbalance", "open after grace", 100, "open after grace", 250},
                                {"discharge_overload", "open after grace", 250, nullptr, nullptr},
                                {"emergency_stop", "open now", nullptr, nullptr, nullptr}};
  for (const Case& one : cases) {
    CAPTURE(one.fault);
    const Json* const row = row_named(reply, one.fault);
    REQUIRE(row != nullptr);
    CHECK(row->at("reaction") == one.reaction);
    CHECK(row->at("grace_ms") == one.grace_ms);
    CHECK(row->at("usual_reaction") == one.usual_reaction);
    CHECK(row->at("usual_grace_ms") == one.usual_grace_ms);
  }
}

TEST_CASE("an answer asks for memory a few times, however many faults are recorded", "[unit][status][allocation]") {
  struct Answer {
    const char* command;
    std::uint64_t pieces_max;
    std::uint64_t pieces_of_a_tree;  // required by a complete tree
  };
  Desk desk(with_all_recorded());
  worlds()[4].make(desk);
  for (const Answer& answer :
       {Answer{"faults", 1'000, 59'741}, Answer{"status", 1'000, 3'959}, Answer{"cells", 100, 978}}) {
    CAPTURE(answer.command, answer.pieces_of_a_tree);
    CHECK(allocations_of([&] { return desk.ask(answer.command); }) < answer.pieces_max);
  }
  CHECK(allocations_of([&] { return desk.requests.picture(); }) < 4'000);  // of 66,290
}
