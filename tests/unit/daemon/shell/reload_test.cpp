// Conditions for loading another pack file, and the reported result.
#include "daemon/shell/reload.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

ReloadRefusal refusal(const CoreBench& bench) {
  return reload_refusal(bench.core(), bench.now());
}

}  // namespace

TEST_CASE("a reload is taken while the pack is open, and in no phase of closing, driving and opening",
          "[unit][reload]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  CHECK(refusal(bench) == ReloadRefusal::none);
  bench.inputs.vehicle_on = true;
  bool has_seen_precharge = false;
  bench.each_ms = [&] {
    const bool is_open = bench.core().sequence().phase == Phase::open;
    has_seen_precharge = has_seen_precharge || bench.core().sequence().phase == Phase::precharge;
    if (!is_open && refusal(bench) != ReloadRefusal::contactors_closed) FAIL("taken in the midst of a sequence");
  };
  REQUIRE(bench.close());
  CHECK(has_seen_precharge);
  CHECK(refusal(bench) == ReloadRefusal::contactors_closed);
  bench.inputs.vehicle_on = false;
  REQUIRE(bench.run_until([&] { return refusal(bench) == ReloadRefusal::none; }, 2s));
  CHECK_FALSE(bench.contacts().any_contactor());
}

TEST_CASE("a reload waits for contacts that say they are still closed", "[unit][reload]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.contactors_stuck = true;
  bench.inputs.vehicle_on = false;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::open; }, 2s));
  bench.run(100ms);
  CHECK(refusal(bench) == ReloadRefusal::contact_closed);
  bench.contactors_stuck = false;
  bench.drop_contacts();
  CHECK(bench.run_until([&] { return refusal(bench) == ReloadRefusal::none; }, 1s));
}

TEST_CASE("a reload is refused while somebody asks for a closed pack", "[unit][reload]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.inputs.vehicle_on = false;
  REQUIRE(bench.run_until([&] { return refusal(bench) == ReloadRefusal::none; }, 2s));
  bench.inputs.vehicle_on = true;  // too soon after the opening to close at once
  REQUIRE(bench.run_until([&] { return bench.core().is_close_requested(); }, 1s));
  REQUIRE(bench.core().sequence().phase == Phase::open);
  CHECK(refusal(bench) == ReloadRefusal::close_wanted);
  bench.inputs.vehicle_on = false;
  CHECK(bench.run_until([&] { return refusal(bench) == ReloadRefusal::none; }, 1s));
}

TEST_CASE("a reload is refused while a module is given a node number, and once the daemon ends", "[unit][reload]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  bench.observe(CommandGiven{.command = Command::assign_node,
                             .authority = Authority::service,
                             .node = 9,
                             .serial_number = bench.modules[1].serial_number});
  bench.run(2ms);
  CHECK(refusal(bench) == ReloadRefusal::node_under_way);
  CHECK(bench.run_until([&] { return refusal(bench) == ReloadRefusal::none; }, 3s));
  bench.give(Command::shut_down);
  CHECK(refusal(bench) == ReloadRefusal::ending);
}

TEST_CASE("where nobody tells of contacts the commands alone count", "[unit][reload]") {
  CoreBench bench(small_pack());
  bench.pdu_talks = false;
  bench.run(1s);
  CHECK(refusal(bench) == ReloadRefusal::none);
}

TEST_CASE("a reply tells so many changes, a log fewer, and both how many there are more", "[unit][reload]") {
  ReloadDone done{.hash_before = "a", .hash_now = "b", .is_new_life = true, .away = 12ms};
  CHECK(reload_lines(done).front() == "configuration b active, previously a: 0 values changed, downtime 12 ms");
  done.changes.push_back({.file = "f", .path = "/x", .before = "", .now = "1"});
  CHECK(reload_lines(done).size() == 2);
  CHECK(reload_lines(done).back() == "changed: f: /x: absent -> 1");
  CHECK(reload_json(done).at("changes").at(0).at("before").is_null());
  CHECK(reload_json(done).at("changes").at(0).at("now") == "1");
  done.changes.resize(changes_told_max + 7, done.changes.front());
  CHECK(reload_json(done).at("changes").size() == changes_told_max);
  CHECK(reload_json(done).at("changes_left_out") == 7);
  CHECK(reload_lines(done).size() == 1 + changes_logged_max + 1);
  CHECK(reload_lines(done).back() == "and " + std::to_string(changes_told_max + 7 - changes_logged_max) + " more");
  done.is_new_life = false;
  CHECK(reload_lines(done) == std::vector<std::string>{"configuration b unchanged"});
}
