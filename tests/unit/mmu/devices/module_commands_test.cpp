// Commands of the core to single modules, their times, and the reaction to the states that modules report.
#include <algorithm>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

struct Sent {
  TimePoint at;
  CanFrame frame;
};

/// COMMANDs with this operation to this node.
std::vector<Sent> commands(const CoreBench& bench, std::uint8_t node, internal_bus::Operation operation) {
  std::vector<Sent> found;
  for (std::size_t index = 0; index < bench.sent().size(); ++index) {
    const OutgoingFrame& out = bench.sent()[index];
    const bool is_it = out.port == Port::internal && out.frame.id == 0x340U + node &&
                       out.frame.data[0] == static_cast<std::uint8_t>(operation);
    if (is_it) found.push_back({bench.sent_at()[index], out.frame});
  }
  return found;
}

bool blocks(const CoreBench& bench, Blocker blocker) {
  const auto& blockers = bench.core().permission().blockers;
  return std::find(blockers.begin(), blockers.end(), blocker) != blockers.end();
}

CoreConfig balancing_pack() {
  CoreConfig config = small_pack();
  config.balancing.is_enabled = true;
  config.balancing.requires_closed = false;
  config.balancing.method = BalancingMethod::terminal_voltage;
  config.balancing.top_uV = 3'500'000;
  config.balancing.voltage_min_uV = 3'200'000;
  config.balancing.settle = 1s;
  return config;
}

}  // namespace

// --- modes ----------------------------------------------------------------------------------------------------------

TEST_CASE("nothing closes with a module that is still starting or going to sleep, and it is named",
          "[unit][core][BMS_F.2][MMU_S]") {
  using internal_bus::Mode;
  const bool is_starting = GENERATE(true, false);
  CoreBench bench(small_pack());
  bench.modules[1].mode = is_starting ? Mode::starting : Mode::going_to_sleep;
  CHECK_FALSE(bench.close());
  bench.run(2s);
  const FaultId fault = is_starting ? FaultId::module_starting : FaultId::module_going_to_sleep;
  CHECK(bench.is_active(fault));
  CHECK(bench.core().faults().state(fault).confirmed.element == Element{.module_node = 2});
  CHECK(blocks(bench, Blocker::fault));
  bench.modules[1].mode = Mode::normal;
  bench.inputs.vehicle_on = false;
  bench.run(2s);
  CHECK_FALSE(bench.is_active(fault));
  CHECK(bench.close());
}

TEST_CASE("a module that starts for a moment is no fault, and still nothing closes meanwhile", "[unit][core][MMU_S]") {
  CoreBench bench(small_pack());
  bench.modules[1].mode = internal_bus::Mode::starting;
  bench.run(500ms);
  CHECK_FALSE(bench.core().permission().may_close);
  CHECK(blocks(bench, Blocker::suspicion));
  CHECK_FALSE(bench.is_active(FaultId::module_starting));
  bench.modules[1].mode = internal_bus::Mode::normal;
  CHECK(bench.close());
}

TEST_CASE("a closed pack stays closed with a module that goes to sleep, says so, and opens when it is silent",
          "[unit][core][BMS_F.3]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[0].mode = internal_bus::Mode::going_to_sleep;
  bench.run(200ms);
  CHECK(bench.is_active(FaultId::module_going_to_sleep));
  CHECK(bench.core().sequence().phase == Phase::closed);
  bench.modules[0].talks = false;
  bench.run(500ms);
  CHECK(bench.core().sequence().phase == Phase::open);
  CHECK(bench.core().last_opening().fault == FaultId::module_lost);
}

TEST_CASE("a module on its own supply opens the pack after half a second, and keeps it open", "[unit][core][MMU_7b]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[1].on_module_supply = true;
  bench.run(450ms);
  CHECK(bench.core().sequence().phase == Phase::closed);
  bench.run(300ms);
  CHECK(bench.core().sequence().phase == Phase::open);
  CHECK(bench.core().last_opening().fault == FaultId::module_supply_lost);
  CHECK(bench.core().faults().state(FaultId::module_supply_lost).confirmed.element == Element{.module_node = 2});
  bench.give(Command::clear_faults);
  bench.run(2s);
  CHECK(bench.is_active(FaultId::module_supply_lost));  // its cause is still present
}

TEST_CASE("a module that is autonomous though it is polled is a warning", "[unit][core][MMU_A]") {
  CoreBench bench(small_pack());
  bench.each_ms = [&] { bench.modules[1].mode = internal_bus::Mode::autonomous; };
  CHECK(bench.close());
  bench.run(1s);
  CHECK(bench.is_active(FaultId::module_alone));
  CHECK(bench.core().faults().state(FaultId::module_alone).confirmed.element == Element{.module_node = 2});
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("a module that stays autonomous is told to be normal, once a second", "[unit][core][MMU_A]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  const std::size_t before = commands(bench, 2, internal_bus::Operation::set_mode).size();
  CHECK(before == 1);  // with its set-up
  bench.modules[1].mode = internal_bus::Mode::autonomous;
  bench.run(900ms);
  CHECK(commands(bench, 2, internal_bus::Operation::set_mode).size() == before);
  bench.run(4s);
  const auto told = commands(bench, 2, internal_bus::Operation::set_mode);
  CHECK(told.size() >= before + 3);
  CHECK(told.size() <= before + 4);
  CHECK(told.back().frame.data[1] == 1);
  CHECK(told.back().frame.data[2] == 0);
  CHECK(commands(bench, 1, internal_bus::Operation::set_mode).size() == 1);
  bench.modules[1].mode = internal_bus::Mode::normal;
  bench.run(3s);
  CHECK(commands(bench, 2, internal_bus::Operation::set_mode).size() <= told.size() + 1);
}

TEST_CASE("whether modules may balance by themselves is told to each, again after a restart, and not to strangers",
          "[unit][core][MMU_A][MMU_AB]") {
  using internal_bus::Operation;
  CoreConfig config = small_pack();
  config.balancing.is_autonomous_allowed = true;
  const auto allowed = [](const std::vector<Sent>& told) {
    return std::count_if(told.begin(), told.end(), [](const Sent& sent) { return sent.frame.data[2] == 1; });
  };
  SECTION("all in order") {
    CoreBench bench(config);
    bench.run(2s);
    for (const std::uint8_t node : {std::uint8_t{1}, std::uint8_t{2}}) {
      CHECK(allowed(commands(bench, node, Operation::set_mode)) == 1);
    }
    CHECK(bench.core().module_setup().is_autonomous_balancing_allowed(1));
    bench.modules[1].restarted = bench.modules[1].limits_not_set = true;
    bench.run(2s);
    CHECK(allowed(commands(bench, 1, Operation::set_mode)) == 1);
    CHECK(allowed(commands(bench, 2, Operation::set_mode)) == 2);
  }
  SECTION("an exchanged module: nobody is allowed anything") {
    PersistentState state;
    state.modules[2] = {true, 5555};
    CoreBench bench(config, state);
    bench.run(5s);
    REQUIRE(bench.is_active(FaultId::module_exchanged));
    CHECK(allowed(commands(bench, 1, Operation::set_mode)) == 0);
    CHECK(allowed(commands(bench, 2, Operation::set_mode)) == 0);
    CHECK(commands(bench, 1, Operation::set_mode).size() == 1);
    bench.observe(CommandGiven{.command = Command::accept_modules, .authority = Authority::service});
    bench.run(3s);
    CHECK(allowed(commands(bench, 2, Operation::set_mode)) == 1);
  }
  SECTION("an answer that is lost") {
    CoreBench bench(config);
    int lost = 0;
    bench.is_lost = [&](const CanFrame& frame) { return frame.id == 0x382 && frame.data[0] == 1 && lost++ == 0; };
    bench.run(4s);
    CHECK(allowed(commands(bench, 2, Operation::set_mode)) == 2);
    CHECK(bench.core().module_setup().is_autonomous_balancing_allowed(1));
  }
  SECTION("not wanted by the pack file") {
    CoreBench bench(small_pack());
    bench.run(4s);
    CHECK(allowed(commands(bench, 2, Operation::set_mode)) == 0);
    CHECK(commands(bench, 2, Operation::set_mode).size() == 1);  // another pack file may have allowed it
  }
}

// --- a restart while the contactors close ---------------------------------------------------------------------------

TEST_CASE("a module that restarts during the precharge withdraws the permission at once, and is named",
          "[unit][core][BMS_F.2][MMU_2]") {
  CoreBench bench(small_pack());
  bench.link_rise_mV_per_ms = 2;
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::precharge; }, 3s));
  bench.run(300ms);
  bench.modules[1].restarted = bench.modules[1].limits_not_set = true;
  bench.run(200ms);
  CHECK(bench.core().sequence().phase == Phase::open);
  const OpeningRecord& opening = bench.core().last_opening();
  CHECK(opening.cause == OpeningCause::permission);
  CHECK(opening.blocker == Blocker::modules_not_set_up);
  CHECK(opening.reading.element == Element{.module_node = 2});
  CHECK_FALSE(bench.is_active(FaultId::precharge_failed));
  CHECK(std::any_of(bench.events().begin(), bench.events().end(), [](const Event& event) {
    return event.id == EventId::opened && to_text(event).find("module 2") != std::string::npos;
  }));
}

// --- one COMMAND at a time ------------------------------------------------------------------------------------------

TEST_CASE("limits and a stop for one module never cross: no answer is late", "[unit][core][MMU_2][MMU_CB]") {
  CoreBench bench(small_pack());
  bench.run(2s);
  bench.modules[1].balancing_cells = 1;  // not commanded: stopped repeatedly
  for (int tenth = 0; tenth < 200; ++tenth) {
    if (tenth % 3 == 0) bench.modules[1].restarted = bench.modules[1].limits_not_set = true;
    bench.run(100ms);
  }
  CHECK(commands(bench, 2, internal_bus::Operation::stop_balancing).size() >= 20);
  CHECK(commands(bench, 2, internal_bus::Operation::set_limits).size() >= 60);
  const ModuleRecord& module = *bench.core().modules().find(2);
  CHECK(module.rejected[static_cast<std::size_t>(RejectReason::late)] == 0);
}

TEST_CASE("a module that answers no COMMAND is still told to stop", "[unit][core][MMU_CB]") {
  CoreBench bench(small_pack());
  bench.modules[1].ignores_commands = true;
  bench.modules[1].balancing_cells = 1;
  bench.run(5s);
  CHECK(commands(bench, 2, internal_bus::Operation::stop_balancing).size() >= 5);
  CHECK(commands(bench, 2, internal_bus::Operation::set_limits).size() >= 10);
}

// --- modules that do not balance ------------------------------------------------------------------------------------

TEST_CASE("a module that refuses its minutes is a warning that names it, until it obeys", "[unit][core][MMU_CB]") {
  CoreBench bench(balancing_pack());
  bench.modules[1].cell_voltage_uV[2] = known(3'750'000);
  bench.modules[1].refuses_balancing = true;
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::balancing_refused); }, 20s));
  CHECK(bench.core().faults().state(FaultId::balancing_refused).confirmed.element == Element{.module_node = 2});
  CHECK_FALSE(bench.is_active(FaultId::balancing_stays_off));
  bench.modules[1].refuses_balancing = false;
  CHECK(bench.run_until([&] { return !bench.is_active(FaultId::balancing_refused); }, 20s));
}

// --- poll rates -----------------------------------------------------------------------------------------------------

TEST_CASE("a parked pack with a single module that lost its POLL is asked again before the module ends what it does",
          "[unit][core][paces][MMU_CB]") {
  CoreConfig config = small_pack();
  const ModuleConfig only = config.modules[0];
  config.modules.clear();
  config.modules.push_back(only);
  config.poll.parked_period = 500ms;
  CoreBench bench(config);
  bench.run(14s);
  REQUIRE(bench.core().pace().pace() == PollPace::parked);
  std::vector<TimePoint> heard;
  bench.before_poll = [&] { heard.push_back(bench.now()); };
  REQUIRE(bench.run_until([&] { return heard.size() == 2; }, 2s));
  bench.loses_polls = true;
  bench.run(600ms);
  bench.loses_polls = false;
  bench.run(300ms);
  REQUIRE(heard.size() >= 3);
  CHECK(heard[2] - heard[1] <= 800ms);
}

TEST_CASE("a pack whose cells bleed is never parked", "[unit][core][paces][MMU_CB]") {
  CoreConfig config = small_pack();
  config.poll.parked_period = 500ms;
  CoreBench bench(config);
  bench.run(14s);
  REQUIRE(bench.core().pace().pace() == PollPace::parked);
  bench.modules[1].balancing_cells = 1;
  bench.run(1s);
  CHECK(bench.core().pace().pace() == PollPace::active);
  bench.run(20s);
  CHECK(bench.core().pace().pace() == PollPace::active);
}
