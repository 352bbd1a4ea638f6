// Assignment of node numbers by serial number: refusals, frames on the bus, and the condition for success.
#include "daemon/core/modules/module_assignment.hpp"

#include <algorithm>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

constexpr TimePoint start{10s};
constexpr AssignmentRequest wish{.serial_number = 4711, .node = 3};
constexpr AssignmentView all_well{.is_open = true, .is_bus_up = true, .node_now = 1};

CommandGiven assign(std::uint32_t serial_number, std::uint8_t node, bool unheard = false,
                    Authority authority = Authority::service) {
  return {.command = Command::assign_node,
          .authority = authority,
          .node = node,
          .serial_number = serial_number,
          .is_unheard_allowed = unheard};
}

std::ptrdiff_t set_node_commands(const CoreBench& bench) {
  return std::count_if(bench.sent().begin(), bench.sent().end(), [](const OutgoingFrame& out) {
    return out.port == Port::internal && out.frame.id == internal_bus::command.base_id &&
           out.frame.data[0] == static_cast<std::uint8_t>(internal_bus::Operation::set_node);
  });
}

}  // namespace

TEST_CASE("every reason against giving a node number is named", "[unit][modules][MMU_N]") {
  struct Case {
    AssignmentRefusal refusal;
    std::function<void(AssignmentView&, AssignmentRequest&)> spoil;
  };
  const std::vector<Case> cases{
      {AssignmentRefusal::none, [](auto&, auto&) {}},
      {AssignmentRefusal::shutting_down, [](auto& view, auto&) { view.is_shutting_down = true; }},
      {AssignmentRefusal::not_open, [](auto& view, auto&) { view.is_open = false; }},
      {AssignmentRefusal::close_requested, [](auto& view, auto&) { view.is_close_requested = true; }},
      {AssignmentRefusal::bus_down, [](auto& view, auto&) { view.is_bus_up = false; }},
      {AssignmentRefusal::resting, [](auto& view, auto&) { view.is_resting = true; }},
      {AssignmentRefusal::bad_node, [](auto&, auto& request) { request.node = 0; }},
      {AssignmentRefusal::bad_node, [](auto&, auto& request) { request.node = 64; }},
      {AssignmentRefusal::already_there, [](auto& view, auto&) { view.node_now = 3; }},
      {AssignmentRefusal::named_otherwise, [](auto& view, auto&) { view.is_named_otherwise = true; }},
      {AssignmentRefusal::node_taken, [](auto& view, auto&) { view.is_node_taken = true; }},
      {AssignmentRefusal::unheard, [](auto& view, auto&) { view.node_now = 0; }},
      {AssignmentRefusal::none,
       [](auto& view, auto& request) {
         view.node_now = 0;
         request.is_unheard_allowed = true;
       }},
  };
  for (const Case& one : cases) {
    AssignmentView view = all_well;
    AssignmentRequest request = wish;
    one.spoil(view, request);
    ModuleAssignment assignment;
    CAPTURE(to_text(one.refusal));
    CHECK(assignment.ask(request, view, start) == one.refusal);
    const bool is_asked = one.refusal == AssignmentRefusal::none;
    CHECK(assignment.stage() == (is_asked ? AssignmentStage::asking : AssignmentStage::refused));
    CHECK(assignment.step(start).sends_command == is_asked);
    CHECK(to_text(one.refusal) != "?");
  }
}

TEST_CASE("the command goes out three times, and only the module's own word counts", "[unit][modules][MMU_N]") {
  ModuleAssignment assignment;
  REQUIRE(assignment.ask(wish, all_well, start) == AssignmentRefusal::none);
  CHECK_FALSE(assignment.observe_identity(3, 4711, start));  // from before the command
  int commands = 0;
  int questions = 0;
  bool has_ended = false;
  TimePoint now = start;
  for (; !has_ended && now < start + 3s; now += tick_period) {
    const ModuleAssignment::Step step = assignment.step(now);
    commands += step.sends_command ? 1 : 0;
    questions += step.asks_node ? 1 : 0;
    has_ended = step.has_ended;
    CHECK(assignment.ask({.serial_number = 1, .node = 2}, all_well, now) ==
          (has_ended ? AssignmentRefusal::none : AssignmentRefusal::busy));
    if (has_ended) break;
  }
  CHECK(commands == 3);
  CHECK(questions >= 10);
  CHECK(now - start == 1'600ms);
}

TEST_CASE("how an assignment ends: taken, another one there, nobody there", "[unit][modules][MMU_N]") {
  ModuleAssignment taken;
  REQUIRE(taken.ask(wish, all_well, start) == AssignmentRefusal::none);
  CHECK(taken.step(start).sends_command);
  CHECK_FALSE(taken.observe_identity(4, 4711, start + 5ms));  // another node
  CHECK(taken.observe_identity(3, 4711, start + 30ms));
  CHECK(taken.stage() == AssignmentStage::taken);
  CHECK(taken.ended_at() == start + 30ms);
  CHECK_FALSE(taken.observe_identity(3, 4711, start + 40ms));  // only once
  CHECK_FALSE(taken.step(start + 2s).has_ended);

  ModuleAssignment other;
  REQUIRE(other.ask(wish, all_well, start) == AssignmentRefusal::none);
  static_cast<void>(other.step(start));
  CHECK_FALSE(other.observe_identity(3, 8, start + 30ms));
  CHECK(other.step(start + 1'600ms).has_ended);
  CHECK(other.stage() == AssignmentStage::seen_other);
  CHECK(other.other_serial_number() == 8);

  ModuleAssignment nobody;
  REQUIRE(nobody.ask(wish, all_well, start) == AssignmentRefusal::none);
  static_cast<void>(nobody.step(start));
  CHECK(nobody.step(start + 1'600ms).has_ended);
  CHECK(nobody.stage() == AssignmentStage::not_seen);
  CHECK(nobody.number() == 1);
}

// --- within the core ------------------------------------------------------------------------------------------------

TEST_CASE("a module on a wrong node is given its own, and the pack closes", "[unit][core][MMU_N][BMS_F.2]") {
  CoreBench bench(small_pack());
  bench.modules[1].node = 40;
  bench.run(7s);
  REQUIRE(bench.is_active(FaultId::module_lost));
  REQUIRE(bench.is_active(FaultId::unknown_module));
  bench.observe(assign(1002, 2, false, Authority::user));
  bench.run(100ms);
  CHECK(bench.core().assignment().stage() == AssignmentStage::none);  // no authorisation
  bench.observe(assign(1002, 2));
  REQUIRE(bench.run_until([&] { return !bench.core().assignment().is_asking(); }, 2s));
  CHECK(bench.core().assignment().stage() == AssignmentStage::taken);
  CHECK(bench.core().assignment().node_before() == 40);
  bench.run(tick_period);
  CHECK(bench.has_event(EventId::module_given_node));
  CHECK(bench.core().persistent().modules[2] == KnownModule{true, 1002});
  bench.run(7s);
  bench.give(Command::clear_faults);
  bench.run(1s);
  CHECK_FALSE(bench.is_active(FaultId::unknown_module));
  CHECK(bench.close());
}

TEST_CASE("a module that got its node is no extra module any more, at once", "[unit][core][MMU_N][F31]") {
  CoreBench bench(small_pack());
  bench.modules[1].node = 9;
  bench.run(7s);
  REQUIRE(bench.is_active(FaultId::unknown_module));
  bench.observe(assign(1002, 2));
  REQUIRE(bench.run_until([&] { return bench.core().assignment().stage() == AssignmentStage::taken; }, 2s));
  CHECK_FALSE(bench.core().watchers().roster.is_stranger(9, bench.now()));
  bench.run(tick_period);
  CHECK(bench.core().watchers().bus.unknown_module(bench.now()) == 0);
  bench.run(row_of(FaultId::unknown_module).clear + tick_period);
  CHECK_FALSE(bench.is_active(FaultId::unknown_module));
}

TEST_CASE("while the key is on nobody gets a node, whether or not what it asked for was refused",
          "[unit][core][MMU_N]") {
  CoreBench bench(small_pack());
  bench.inputs.vehicle_on = true;  // on since before the start: no request
  bench.run(3s);
  REQUIRE_FALSE(bench.core().is_close_requested());
  bench.observe(assign(1002, 9));
  bench.run(100ms);
  CHECK(bench.core().assignment().refusal() == AssignmentRefusal::close_requested);
  CHECK(set_node_commands(bench) == 0);
}

TEST_CASE("modules that all came with one number are told apart by their serial numbers", "[unit][core][MMU_N]") {
  CoreBench bench(small_pack());
  bench.modules[1].node = 1;
  bench.modules[1].cell_voltage_uV.fill(known(3'690'000));
  bench.run(7s);
  REQUIRE(bench.is_active(FaultId::duplicate_node));
  bench.observe(assign(1002, 2, true));  // not received because of the other one
  REQUIRE(bench.run_until([&] { return !bench.core().assignment().is_asking(); }, 2s));
  CHECK(bench.core().assignment().stage() == AssignmentStage::taken);
  CHECK(bench.modules[1].node == 2);
  bench.run(20s);
  bench.give(Command::clear_faults);
  bench.run(1s);
  CHECK_FALSE(bench.is_active(FaultId::duplicate_node));
  CHECK(bench.core().persistent().modules[1].serial_number == 1001);
  CHECK(bench.close());
}

TEST_CASE("a number that was given away is free at once", "[unit][core][MMU_N]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  for (const std::uint8_t node : {std::uint8_t{9}, std::uint8_t{2}}) {
    bench.observe(assign(1002, node));
    REQUIRE(bench.run_until([&] { return !bench.core().assignment().is_asking(); }, 2s));
    CHECK(bench.core().assignment().stage() == AssignmentStage::taken);
    bench.run(300ms);
  }
  CHECK(bench.core().persistent().modules[2] == KnownModule{true, 1002});
  bench.run(7s);
  bench.give(Command::clear_faults);
  bench.run(1s);
  CHECK(bench.close());
}

TEST_CASE("a closed pack keeps its numbers", "[unit][core][MMU_N]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.observe(assign(1002, 9));
  bench.run(2s);
  CHECK(bench.core().assignment().refusal() == AssignmentRefusal::not_open);
  CHECK(set_node_commands(bench) == 0);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("a node of a module that is there is taken, a module that does not obey is told", "[unit][core][MMU_N]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  bench.observe(assign(1002, 1));
  bench.run(100ms);
  CHECK(bench.core().assignment().refusal() == AssignmentRefusal::node_taken);
  bench.observe(assign(1002, 2));
  bench.run(100ms);
  CHECK(bench.core().assignment().refusal() == AssignmentRefusal::already_there);
  bench.modules[1].ignores_commands = true;
  bench.observe(assign(1002, 9));
  bench.run(2s);
  CHECK(bench.core().assignment().stage() == AssignmentStage::not_seen);
  CHECK(bench.has_event(EventId::module_node_not_taken));
  CHECK(set_node_commands(bench) == 3);
  CHECK(bench.core().persistent().modules[2].serial_number == 1002);  // and nothing else has changed
}
