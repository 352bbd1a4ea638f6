// Registered and present modules of each node, and the reaction of the core: registered, replaced, swapped, duplicate.
#include "daemon/core/modules/module_roster.hpp"

#include <algorithm>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/module_feed.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::ModuleFeed;
using bmu::test::small_pack;

namespace {

/// Three nodes with the registered serial numbers 101, 102, 103.
struct Roster {
  explicit Roster(std::optional<std::uint32_t> named_at_1 = {}) : feed(pack(named_at_1)) {
    roster.init(feed.config());
    KnownModules known;
    for (std::uint8_t node = 1; node <= 3; ++node) known[node] = {true, 100U + node};
    roster.restore(known);
  }
  static CoreConfig pack(std::optional<std::uint32_t> named_at_1) {
    CoreConfig config = test::pack_of(3);
    config.modules[0].serial_number = named_at_1;
    return config;
  }
  void says(std::uint8_t node, std::uint32_t serial_number) {
    feed.identity(
        node, {.protocol_version = 1, .cell_count = 12, .temperature_sensor_count = 4, .serial_number = serial_number});
  }
  [[nodiscard]] ModuleFinding finding(std::uint8_t node) const {
    return roster.finding(*feed.modules().find(node), feed.modules(), feed.now());
  }

  ModuleFeed feed;
  ModuleRoster roster;
};

CanFrame ident_frame(std::uint8_t node, std::uint32_t serial_number) {
  CanFrame frame = make_frame(internal_bus::ident, node);
  write<internal_bus::ident, "serial_number">(frame, serial_number);
  write<internal_bus::ident, "cell_count">(frame, 8);
  return frame;
}

/// Drops the answers of the modules to the first POLL, so that a test can change them before they are received.
void lose_first_answers(CoreBench& bench) {
  bench.is_lost = [&bench](const CanFrame&) { return bench.now() < TimePoint{1s} + 50ms; };
}

void give(CoreBench& bench, const CommandGiven& what) {
  bench.observe(what);
}

CommandGiven accept(std::uint8_t node = 0, Authority authority = Authority::service) {
  return {.command = Command::accept_modules, .authority = authority, .node = node};
}

}  // namespace

TEST_CASE("a module is as expected, another one, one of another node, or has changed places with it",
          "[unit][modules][BMS_F.2]") {
  Roster all;
  CHECK(all.finding(1).place == ModulePlace::unheard);
  CHECK(all.finding(1).expected == KnownModule{true, 101});
  all.says(1, 101);
  CHECK(all.finding(1).place == ModulePlace::expected);
  all.says(2, 999);
  CHECK(all.finding(2).place == ModulePlace::exchanged);
  CHECK(all.finding(2).belongs_to == 0);

  Roster moved;
  moved.says(1, 102);
  CHECK(moved.finding(1).place == ModulePlace::misplaced);
  CHECK(moved.finding(1).belongs_to == 2);
  CHECK(moved.finding(2).place == ModulePlace::unheard);
  CHECK(moved.finding(2).seen_at == 1);
  moved.says(2, 101);
  CHECK(moved.finding(1).place == ModulePlace::swapped);
  CHECK(moved.finding(2).place == ModulePlace::swapped);
  CHECK(moved.finding(1).seen_at == 2);

  Roster circle;
  circle.says(1, 102);
  circle.says(2, 103);
  circle.says(3, 101);
  for (std::uint8_t node = 1; node <= 3; ++node) CHECK(circle.finding(node).place == ModulePlace::misplaced);
}

TEST_CASE("the pack file's serial number counts, whatever was remembered", "[unit][modules][BMS_F.2]") {
  Roster named(777U);
  named.says(1, 101);
  CHECK(named.finding(1).place == ModulePlace::exchanged);
  CHECK(named.finding(1).is_from_file);
  const ModuleRecord& module = *named.feed.modules().find(1);
  CHECK(named.roster.reason_against_accepting(module, named.feed.now()) == AcceptRefusal::named_otherwise);
  CHECK_FALSE(named.roster.accept(module, named.feed.now()));
  named.feed.pass(20s);  // so that no duplicate node is detected
  named.says(1, 777);
  named.feed.pass(20s);
  CHECK(named.finding(1).place == ModulePlace::expected);
  CHECK(to_text(named.roster.reason_against_accepting(module, named.feed.now())) == "none");
  CHECK(named.roster.accept(module, named.feed.now()));
  CHECK(named.roster.known()[1].serial_number == 101);  // the file is sufficient
}

TEST_CASE("remembered is who speaks alone where nobody was known", "[unit][modules][BMS_F.2]") {
  ModuleFeed feed(small_pack());
  ModuleRoster roster;
  roster.init(feed.config());
  CHECK_FALSE(roster.remember(feed.modules(), feed.now()));
  feed.identity(1, {.serial_number = 5});
  feed.identity(2, {.serial_number = 6});
  feed.identity(2, {.serial_number = 7});  // two modules
  CHECK(roster.remember(feed.modules(), feed.now()));
  CHECK(roster.known()[1] == KnownModule{true, 5});
  CHECK_FALSE(roster.known()[2].is_known);
  CHECK_FALSE(roster.remember(feed.modules(), feed.now()));
  feed.pass(conflict_memory);
  CHECK_FALSE(roster.remember(feed.modules(), feed.now()));
  feed.pass(1ns);
  CHECK(roster.remember(feed.modules(), feed.now()));
  CHECK(roster.known()[2] == KnownModule{true, 7});
}

TEST_CASE("one module on two nodes is never remembered twice", "[unit][modules]") {
  ModuleFeed feed(small_pack());
  ModuleRoster roster;
  roster.init(feed.config());
  feed.identity(1, {.serial_number = 5});
  CHECK(roster.remember(feed.modules(), feed.now()));
  feed.identity(2, {.serial_number = 5});
  CHECK_FALSE(roster.remember(feed.modules(), feed.now()));
  CHECK(roster.finding(*feed.modules().find(2), feed.modules(), feed.now()).place == ModulePlace::misplaced);
}

TEST_CASE("who is accepted belongs there and nowhere else", "[unit][modules]") {
  Roster moved;
  moved.says(1, 102);
  moved.says(2, 101);
  CHECK(moved.roster.accept(*moved.feed.modules().find(1), moved.feed.now()));
  CHECK(moved.roster.known()[1] == KnownModule{true, 102});
  CHECK_FALSE(moved.roster.known()[2].is_known);
  CHECK_FALSE(moved.roster.accept(*moved.feed.modules().find(3), moved.feed.now()));  // no module there
}

TEST_CASE("strangers are known by node and serial number for as long as they talk", "[unit][modules][F31]") {
  Roster pack;
  const TimePoint now = pack.feed.now();
  CHECK_FALSE(pack.roster.is_stranger(9, now));
  pack.roster.observe_stranger(internal_bus::status, 9, make_frame(internal_bus::status, 9), now);
  CHECK(pack.roster.unidentified_stranger(now) == 9);
  pack.roster.observe_stranger(internal_bus::ident, 9, ident_frame(9, 103), now);
  CHECK(pack.roster.unidentified_stranger(now) == 0);
  CHECK(pack.roster.stranger(9).serial_number == 103);
  CHECK(pack.roster.stranger(9).cell_count == 8);
  CHECK(pack.finding(3).seen_at == 9);  // the missing module was found there
  CHECK(pack.roster.is_stranger(9, now + stranger_memory));
  CHECK_FALSE(pack.roster.is_stranger(9, now + stranger_memory + 1ns));
  pack.roster.observe_stranger(internal_bus::status, 9, make_frame(internal_bus::status, 9), now + 10s);
  CHECK(pack.roster.unidentified_stranger(now + 10s) == 9);  // may be another module by now
}

// --- within the core ------------------------------------------------------------------------------------------------

TEST_CASE("an exchanged module refuses to close until somebody with authority accepts it",
          "[unit][core][BMS_F.2][F37]") {
  CoreBench before(small_pack());
  before.run(2s);
  REQUIRE(before.core().persistent().modules[2] == KnownModule{true, 1002});

  CoreBench bench(small_pack(), before.core().persistent());
  lose_first_answers(bench);
  bench.modules[1].serial_number = 5555;
  CHECK_FALSE(bench.close());
  CHECK(bench.is_active(FaultId::module_exchanged));
  CHECK(bench.core().faults().state(FaultId::module_exchanged).confirmed.element.module_node == 2);
  CHECK(bench.has_event(EventId::module_out_of_place));
  bench.inputs.vehicle_on = false;
  bench.run(200ms);
  give(bench, accept(2, Authority::user));
  give(bench, accept(1));
  bench.run(2s);
  CHECK(bench.is_active(FaultId::module_exchanged));
  give(bench, accept(2));
  bench.run(2s);
  CHECK_FALSE(bench.is_active(FaultId::module_exchanged));
  CHECK(bench.core().persistent().modules[2].serial_number == 5555);
  CHECK(bench.close());
}

namespace {

/// Cells with voltages that show their SOC after two seconds of rest.
CoreConfig telling_pack() {
  CoreConfig config = small_pack();
  config.cell.ocv.clear();
  config.cell.ocv.push_back({0, 3'000'000});
  config.cell.ocv.push_back({1'000, 4'200'000});
  config.cell.rc_time_constant_s = 0.1;
  config.cell.slow_rc_resistance_Ohm = 0.0;
  config.soc.rest = 1s;
  return config;
}

bool knows_cells_of(const CoreBench& bench, std::size_t module) {
  const bool knows = bench.core().cell_charges().cell(module * 4).is_known;
  for (std::size_t cell = 1; cell < 4; ++cell) {
    CHECK(bench.core().cell_charges().cell(module * 4 + cell).is_known == knows);
  }
  return knows;
}

/// Learns all cells at rest, then draws a current: nothing more is learned.
void learn_and_draw(CoreBench& bench) {
  bench.run(5s);
  REQUIRE(bench.core().cell_charges().known_cells() == 8);
  bench.current_mA = 5'000;
  bench.run(1s);
  REQUIRE(bench.core().cell_charges().known_cells() == 8);
}

}  // namespace

TEST_CASE("what was learned of cells ends with their module: exchanged, accepted, or one of two on its number",
          "[unit][core][BMS_F.2][BMS_F.4]") {
  SECTION("exchanged, and accepted") {
    CoreBench bench(telling_pack());
    learn_and_draw(bench);
    bench.modules[1].serial_number = 5555;
    bench.run(12s);
    CHECK(bench.is_active(FaultId::module_exchanged));
    CHECK_FALSE(knows_cells_of(bench, 1));
    CHECK(knows_cells_of(bench, 0));
    bench.current_mA = 0;
    bench.run(60s);                     // until the two no longer count as duplicates
    REQUIRE(knows_cells_of(bench, 1));  // of the present cells
    bench.current_mA = 5'000;
    bench.run(1s);
    give(bench, accept(2));
    bench.run(100ms);
    CHECK(bench.has_event(EventId::module_accepted));
    CHECK_FALSE(knows_cells_of(bench, 1));
    CHECK(knows_cells_of(bench, 0));
  }
  SECTION("one of two") {
    CoreBench bench(telling_pack());
    learn_and_draw(bench);
    CanFrame last;
    bench.on_observe = [&last](const Observation& seen) {
      const auto* frame = std::get_if<FrameReceived>(&seen.what);
      if (frame != nullptr && frame->frame.id == internal_bus::status.base_id + 2U) last = frame->frame;
    };
    for (int count = 0; count < 4; ++count) {
      bench.run(1s + 50ms);  // between an answer and the next POLL
      CanFrame other = last;
      other.data[5] = static_cast<std::uint8_t>(other.data[5] ^ 1U);
      seal(internal_bus::status, other.data[6], other);
      bench.deliver(other);
    }
    CHECK(bench.core().modules().find(2)->rival_seen_at != TimePoint{});
    CHECK_FALSE(knows_cells_of(bench, 1));
    CHECK(knows_cells_of(bench, 0));
  }
}

TEST_CASE("the right module put back ends it, too", "[unit][core][BMS_F.2]") {
  CoreBench before(small_pack());
  before.run(2s);
  CoreBench bench(small_pack(), before.core().persistent());
  lose_first_answers(bench);
  bench.modules[1].serial_number = 5555;
  bench.run(2s);
  REQUIRE(bench.is_active(FaultId::module_exchanged));
  bench.modules[1].serial_number = 1002;
  REQUIRE(bench.run_until([&] { return !bench.is_active(FaultId::module_exchanged); }, 15s));
  CHECK(bench.core().persistent().modules[2].serial_number == 1002);
}

TEST_CASE("two modules that changed places are named as such", "[unit][core][BMS_F.2]") {
  CoreBench before(small_pack());
  before.run(2s);
  CoreBench bench(small_pack(), before.core().persistent());
  lose_first_answers(bench);
  std::swap(bench.modules[0].serial_number, bench.modules[1].serial_number);
  CHECK_FALSE(bench.close());
  CHECK(bench.is_active(FaultId::modules_swapped));
  CHECK_FALSE(bench.is_active(FaultId::module_exchanged));
  bench.inputs.vehicle_on = false;
  bench.run(200ms);
  give(bench, accept());
  bench.run(2s);
  CHECK_FALSE(bench.is_active(FaultId::modules_swapped));
  CHECK(bench.core().persistent().modules[1].serial_number == 1002);
  CHECK(bench.core().persistent().modules[2].serial_number == 1001);
}

TEST_CASE("a module that is exchanged behind a closed pack's back opens it", "[unit][core][BMS_F.2][F30]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[1].serial_number = 5555;
  CHECK(bench.run_until([&] { return !bench.core().outputs().any_contactor(); }, 11s));
  CHECK(bench.core().last_opening().fault == FaultId::duplicate_node);
  CHECK(bench.core().modules().find(2)->rival_serial_number == 1002);
}

TEST_CASE("while it is not known whether somebody was known, nobody is remembered", "[unit][core][F76]") {
  CoreBench bench(small_pack());
  bench.observe(HealthSeen{{.store_unreadable = true}});
  bench.run(2s);
  CHECK_FALSE(bench.core().persistent().modules[1].is_known);
  bench.observe(HealthSeen{});
  bench.run(2s);
  CHECK_FALSE(bench.core().persistent().modules[1].is_known);  // the fault is still present
  bench.observe(CommandGiven{.command = Command::clear_faults, .authority = Authority::service});
  bench.run(1s);
  CHECK(bench.core().persistent().modules[1] == KnownModule{true, 1001});
}

TEST_CASE("an extra module is asked who it is", "[unit][core][F31]") {
  CoreBench bench(small_pack());
  bench.run(11s);
  auto extra = bench.modules[0];
  extra.node = 9;
  extra.serial_number = 4711;
  bench.modules.push_back(extra);
  bench.run(2s);
  CHECK(bench.is_active(FaultId::unknown_module));
  CHECK(bench.core().watchers().roster.stranger(9).serial_number == 4711);
}
