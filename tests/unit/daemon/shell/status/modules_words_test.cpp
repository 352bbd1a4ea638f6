// Texts of the daemon and bmuctl about modules that are not in their place, or not as configured.
#include <string>

#include "daemon/shell/status/modules_json.hpp"
#include "daemon/shell/status/why_json.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tools/bmuctl/text_pages.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

PersistentState known_1001_and_1002() {
  PersistentState state;
  state.modules[1] = {true, 1001};
  state.modules[2] = {true, 1002};
  return state;
}

/// Drops the answers of the modules to the first POLL, so that a test can change them before they are received.
void lose_first_answers(CoreBench& bench) {
  bench.is_lost = [&bench](const CanFrame&) { return bench.now() < TimePoint{1s} + 50ms; };
}

CoreView view_of(const CoreBench& bench) {
  return {.core = bench.core(), .now = bench.now()};
}

std::string problems(const CoreBench& bench, std::uint8_t node) {
  return joined(module_problems(*bench.core().modules().find(node), view_of(bench)));
}

bool has_text(const CoreBench& bench, std::string_view part) {
  return why_json(view_of(bench)).dump().find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("each kind of wrong module is named with node and serial numbers, and so is why nothing closes",
          "[unit][why][BMS_F.2]") {
  CoreBench bench(small_pack(), known_1001_and_1002());
  lose_first_answers(bench);
  SECTION("all is well") {
    bench.run(2s);
    CHECK(problems(bench, 1).empty());
  }
  SECTION("another one") {
    bench.modules[1].serial_number = 5555;
    bench.run(2s);
    const std::string text = "module 2 has serial number 5555, expected serial number 1002";
    CHECK(problems(bench, 2) == text);
    CHECK(has_text(bench, text));
  }
  SECTION("changed places") {
    std::swap(bench.modules[0].serial_number, bench.modules[1].serial_number);
    bench.run(2s);
    const std::string text = "module 1 has serial number 1002, expected serial number 1001 (now at node 2): swapped";
    CHECK(problems(bench, 1) == text);
    CHECK(has_text(bench, text));
  }
  SECTION("on a node of nobody") {
    bench.modules[1].node = 9;
    bench.run(4s);
    CHECK(problems(bench, 2) ==
          "module 2, expected serial number 1002 (now at node 9), not identified (no IDENT received)");
    CHECK(joined(stranger_problems(view_of(bench))) == "unknown module at node 9, serial number 1002");
    CHECK(has_text(bench, "unknown module at node 9, serial number 1002"));
    CHECK(has_text(bench, "now at node 9"));
  }
  SECTION("on the other's node") {
    bench.modules[0].talks = false;
    bench.modules[1].node = 1;
    bench.run(4s);
    CHECK(problems(bench, 1) == "module 1 has serial number 1002, registered at node 2; expected serial number 1001");
  }
  SECTION("two of them") {
    bench.run(1s);
    bench.modules[1].serial_number = 5555;
    bench.run(11s);
    CHECK(problems(bench, 2).starts_with("two modules answer as node 2: serial numbers 5555 and 1002"));
    CHECK(has_text(bench, "two modules answer as node 2"));
  }
  SECTION("another number of cells and sensors") {
    bench.modules[1].cell_count = 3;
    bench.modules[1].sensor_count = 1;
    bench.run(4s);
    CHECK(problems(bench, 2) ==
          "module 2, serial number 1002, has 3 cells, expected 4, module 2, serial number 1002, has 1 cell temperature "
          "sensors, expected 2");
    CHECK(has_text(bench, "has 3 cells, expected 4"));
  }
}

TEST_CASE("an assignment is told as it stands", "[unit][why][MMU_N]") {
  CoreBench bench(small_pack(), known_1001_and_1002());
  CHECK(assignment_json(view_of(bench)).is_null());
  bench.run(2s);
  const auto assign = [&](std::uint32_t serial_number, std::uint8_t node) {
    bench.observe(CommandGiven{.command = Command::assign_node,
                               .authority = Authority::service,
                               .node = node,
                               .serial_number = serial_number});
    bench.run(2ms);  // before the module can have answered
    return assignment_json(view_of(bench));
  };
  CHECK(assign(1002, 1)["text"].get<std::string>().starts_with("failed: node in use by another module"));
  const Json already = assign(1002, 2);
  CHECK(already["text"] == "serial number 1002 already has node 2");
  CHECK(already["is_over"] == true);
  CHECK(already["is_done"] == true);  // already as requested
  const Json asking = assign(1002, 9);
  CHECK(asking["text"] == "assigning node 9 to serial number 1002");
  CHECK(asking["is_over"] == false);
  bench.run(1s);
  const Json done = assignment_json(view_of(bench));
  CHECK(done["is_done"] == true);
  CHECK(done["text"] == "serial number 1002: node 9 assigned and confirmed, previously node 2");
  CHECK(assignment_page(Reply(nlohmann::json::parse(done.dump()))).text(false) ==
        "Serial number 1002: node 9 assigned and confirmed, previously node 2.\n");
}

TEST_CASE("a number that a module has already does not make it the expected one", "[unit][why][MMU_N]") {
  CoreBench bench(small_pack(), known_1001_and_1002());
  lose_first_answers(bench);
  bench.modules[1].serial_number = 5555;
  bench.run(2s);
  bench.observe(
      CommandGiven{.command = Command::assign_node, .authority = Authority::service, .node = 2, .serial_number = 5555});
  CHECK(assignment_json(view_of(bench))["text"] ==
        "serial number 5555 already has node 2; to register it there: `bmuctl modules accept 2`");
}

TEST_CASE("the pages of modules: both tables, what is wrong, what was accepted", "[unit][bmuctl]") {
  const nlohmann::json reply = nlohmann::json::parse(R"({
    "poll": {"pace": "parked", "period_ms": 500}, "modules_answering": 1, "modules_expected": 1,
    "modules": [{"node": 3, "is_answering": true, "serial_number": 5, "serial_number_expected": 4, "place": "exchanged",
                 "problems": ["module 3 has serial number 5, expected serial number 4"], "mode": "normal",
                 "on_module_supply": false, "is_balancing": true, "cell_count": 12, "temperature_sensor_count": 4,
                 "limits": "set",
                 "answer_times": {"last_us": 4449, "mean_us": 4450, "worst_us": 12000, "jitter_us": null,
                                  "within_95_percent_us": 5000},
                 "losses": {"answers_complete": 990, "answers_missed": 10, "missed_permille": 10, "asked_alone": 12,
                            "wrong_crc": 1, "wrong_length": 2, "wrong_counter": 20, "repeated_counter": 3, "conflicting": 4, "values_out_of_range": 38,
                            "late": 5, "restarts": 6}}],
    "strangers": [{"node": 9, "serial_number": 77, "cell_count": 8}, {"node": 10, "serial_number": null}],
    "assignment": null})");
  const std::string text = modules_page(Reply(reply)).text(false);
  CAPTURE(text);
  for (const char* part :
       {"parked, 500 ms", "1 of 1 answering", "5 (expected 4)", "exchanged", "normal, balancing", "external", "4.4 ms",
        "4.5 ms", "12.0 ms", "--", "990", "27", "range", "38",
        "Module 3 has serial number 5, expected serial number 4.",
        "Unknown module at node 9: serial number 77, 8 cells.", "Unknown module at node 10: not identified."}) {
    CAPTURE(part);
    CHECK(text.find(part) != std::string::npos);
  }
}

TEST_CASE("accept says who was accepted and who could not be, one who is merely unheard is no failure",
          "[unit][bmuctl]") {
  nlohmann::json reply = nlohmann::json::parse(R"json({
    "node": null, "accepted": [{"node": 3, "serial_number": 5, "serial_number_before": 4}],
    "already": [{"node": 1, "serial_number": 7}],
    "not_accepted": [{"node": 2, "reason": "unheard", "text": "module 2 not identified (no IDENT received)"}],
    "problems": ["module 3, serial number 5, has 3 cells, expected 4"]})json");
  CHECK(accept_page(Reply(reply)).text(false) ==
        "Module 3: serial number 5 registered, previously 4.\n"
        "Not accepted: module 2 not identified (no IDENT received).\n"
        "Remaining problem: module 3, serial number 5, has 3 cells, expected 4.\n");
  CHECK_FALSE(leaves_unaccepted(Reply(reply)));
  reply["node"] = 2;  // this node was requested
  CHECK(leaves_unaccepted(Reply(reply)));
  for (const char* reason : {"two speak", "named otherwise"}) {
    reply["node"] = nullptr;
    reply["not_accepted"][0]["reason"] = reason;
    CHECK(leaves_unaccepted(Reply(reply)));
  }
  reply = nlohmann::json::parse(R"({"accepted": [], "already": [{"node": 1}, {"node": 2}], "not_accepted": []})");
  CHECK(accept_page(Reply(reply)).text(false) == "Nothing to accept: all 2 modules are registered.\n");
  CHECK_FALSE(leaves_unaccepted(Reply(reply)));
  reply["already"] = nlohmann::json::parse(R"([{"node": 1}])");
  CHECK(accept_page(Reply(reply)).text(false) == "Nothing to accept: the module is registered.\n");
}

TEST_CASE("what became of accepting is told for each module asked for", "[unit][why][BMS_F.2]") {
  CoreConfig config = small_pack();
  KnownModules before{};
  const auto outcome = [&before](CoreBench& bench, std::uint8_t node) {
    before = bench.core().watchers().roster.known();
    bench.observe(CommandGiven{.command = Command::accept_modules, .authority = Authority::service, .node = node});
    return acceptance_json(node, before, view_of(bench));
  };
  SECTION("one exchanged, one unheard") {
    CoreBench bench(config, known_1001_and_1002());
    lose_first_answers(bench);
    bench.modules[0].serial_number = 5555;
    bench.modules[1].talks = false;
    bench.run(4s);
    const Json all = outcome(bench, 0);
    CHECK(all["node"].is_null());
    REQUIRE(all["accepted"].size() == 1);
    CHECK(all["accepted"][0] == Json{{"node", 1}, {"serial_number", 5555}, {"serial_number_before", 1001}});
    REQUIRE(all["not_accepted"].size() == 1);
    CHECK(all["not_accepted"][0]["reason"] == "unheard");
    CHECK(all["not_accepted"][0]["text"] ==
          "module 2, expected serial number 1002, not identified (no IDENT received)");
    const Json again = outcome(bench, 1);
    CHECK(again["node"] == 1);
    CHECK(again["accepted"].empty());
    CHECK(again["already"][0] == Json{{"node", 1}, {"serial_number", 5555}});
    CHECK(again["not_accepted"].empty());  // only the requested node
  }
  SECTION("two under one number") {
    CoreBench bench(config, known_1001_and_1002());
    bench.run(1s);
    bench.modules[1].serial_number = 5555;
    bench.run(11s);
    const Json all = outcome(bench, 0);
    REQUIRE(all["not_accepted"].size() == 1);
    CHECK(all["not_accepted"][0]["reason"] == "two speak");
    CHECK(all["not_accepted"][0]["text"].get<std::string>().starts_with("two modules answer as node 2"));
  }
  SECTION("the pack file names another one") {
    config.modules[1].serial_number = 77;
    CoreBench bench(config);
    bench.run(2s);
    const Json all = outcome(bench, 2);
    REQUIRE(all["not_accepted"].size() == 1);
    CHECK(all["not_accepted"][0]["reason"] == "named otherwise");
    CHECK(all["not_accepted"][0]["text"] ==
          "module 2 has serial number 1002, expected serial number 77 by the pack file");
  }
}

TEST_CASE("a module without the pack's limits is named by its fault", "[unit][why]") {
  CoreBench bench(small_pack(), known_1001_and_1002());
  bench.run(2s);
  CHECK(problems_of(FaultId::module_not_set_up, view_of(bench)).empty());
  bench.modules[1].talks = false;
  CoreBench fresh(small_pack(), known_1001_and_1002());
  fresh.modules[1].talks = false;
  fresh.run(1s);
  CHECK(joined(problems_of(FaultId::module_not_set_up, view_of(fresh))) == "module 2: cell limits not acknowledged");
}

TEST_CASE("the page of faults names the modules a fault is about", "[unit][bmuctl]") {
  const nlohmann::json reply = nlohmann::json::parse(R"({"faults": [
    {"name": "modules_swapped", "meaning": "two modules swapped", "stage": "active", "count": 1,
     "is_present": true, "reaction": "refuse to close",
     "modules": ["module 1: serial number 1002", "module 2: serial number 1001"]},
    {"name": "overload", "stage": "good", "count": 0, "modules": []}]})");
  const std::string text = faults_page(Reply(reply)).text(false);
  CAPTURE(text);
  CHECK(text.find("affected  module 1: serial number 1002\n") != std::string::npos);
  CHECK(text.find("          module 2: serial number 1001\n") != std::string::npos);
}

TEST_CASE("a module that answers with old voltages is told by their age, not by its last answer",
          "[unit][why][BMS_F.3]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  bench.modules[1].voltage_age_ms = known(254);
  bench.run(1s);
  REQUIRE(bench.is_active(FaultId::module_lost));
  CHECK(has_text(bench, "its oldest cell voltage"));
  CHECK(has_text(bench, "allowed 250 ms"));
}

TEST_CASE("a module that restarts during the precharge is named where the opening is told", "[unit][why][BMS_F.2]") {
  CoreBench bench(small_pack());
  bench.link_rise_mV_per_ms = 2;
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::precharge; }, 3s));
  bench.run(300ms);
  bench.modules[1].restarted = bench.modules[1].limits_not_set = true;
  bench.run(200ms);
  CHECK(has_text(bench, "cell limits not acknowledged by a module: module 2"));
}
