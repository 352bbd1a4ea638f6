// Balancing from the measurement to bled cells and back: windows, minutes, responses, stops. The modules are emulated.
#include "daemon/core/balancing/balancing_control.hpp"

#include <algorithm>

#include "tests/support/balancing_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using test::BalancingBench;

namespace {

/// 1 mV a permille, 1 Ah: 100 mA take a permille in 36 s. Two modules of four cells at 3.5 V.
CoreConfig small() {
  CoreConfig config = test::small_pack();
  config.cell.ocv.clear();
  config.cell.ocv.push_back({0, 3'000'000});
  config.cell.ocv.push_back({1'000, 4'000'000});
  config.cell.capacity_uAs = uAs_per_Ah;
  config.cell.series_resistance_Ohm = 0.0;
  config.balancing.is_enabled = true;
  config.balancing.bleed_resistance_Ohm = 35;
  return config;
}

constexpr BalancingBlockers some_blocker = 1U << static_cast<unsigned>(BalancingBlocker::discharging);

std::uint16_t mask(std::initializer_list<unsigned> cells) {
  unsigned bits = 0;
  for (const unsigned cell : cells) bits |= 1U << (cell - 1U);
  return static_cast<std::uint16_t>(bits);
}

bool is_bleeding(const BalancingBench& bench) {
  return bench.control().state() == BalancingState::bleeding;
}

/// Runs until the next plan has been commanded and its switches are on.
void wait_for_bleeding(BalancingBench& bench) {
  REQUIRE(bench.run_until([&] { return is_bleeding(bench) && bench.switches().is_any_on(); }, 2min));
}

std::size_t stops(const BalancingBench& bench) {
  return static_cast<std::size_t>(std::count_if(bench.orders().begin(), bench.orders().end(),
                                                [](const BalancingOrder& order) { return order.is_stop; }));
}

}  // namespace

TEST_CASE("nothing is commanded before a window without bleeding has passed, and ten poll cycles behind it",
          "[unit][balancing][BMS_F.4]") {
  BalancingBench bench(small());
  bench.soc[2] = 0.52;
  bench.run(1s);
  CHECK(bench.control().state() == BalancingState::measuring);
  bench.run(10s);
  CHECK(bench.control().verdict() == PlanVerdict::none);
  bench.run(8s);
  CHECK(bench.orders().empty());
  bench.run(3s);
  REQUIRE(bench.orders().size() == 2);  // one module, all its cells in one COMMAND: 0, then the minutes
  CHECK(bench.orders()[0].module_index == 0);
  CHECK_FALSE(bench.orders()[0].is_stop);
  CHECK(bench.orders()[0].minutes == BalancingMinutes{});
  CHECK(bench.orders()[1].module_index == 0);
  CHECK(bench.orders()[1].minutes == BalancingMinutes{0, 0, 5, 0});  // 15 mV are 9 minutes
  CHECK(bench.control().cells_told() == 1);
  CHECK(bench.control().stage(0) == OrderStage::done);
  CHECK(bench.control().stage(1) == OrderStage::none);
  CHECK(static_cast<double>(bench.control().to_go_uAs(2, bench.switches())) == Approx(54'000'000.0).epsilon(0.01));
}

TEST_CASE("bled are the cells of the plan, for their minutes, then everything is measured again",
          "[unit][balancing][BMS_F.4][MMU_CB]") {
  BalancingBench bench(small());
  bench.soc[2] = 0.52;
  wait_for_bleeding(bench);
  CHECK(bench.really_on(0) == mask({3}));
  CHECK(bench.really_on(1) == 0);
  const TimePoint began_at = bench.now();
  REQUIRE(bench.run_until([&] { return !is_bleeding(bench); }, 6min));
  CHECK(bench.now() - began_at >= 295s);
  CHECK(bench.now() - began_at <= 305s);
  CHECK(bench.control().state() == BalancingState::measuring);
  CHECK(bench.orders().size() == 2);
  const TimePoint over_at = bench.now();
  REQUIRE(bench.run_until([&] { return is_bleeding(bench); }, 1min));
  CHECK(bench.now() - over_at >= 19s);  // the window and ten cycles of a second
  wait_for_bleeding(bench);
  // 15 mV less five minutes: a little less than four more.
  CHECK(bench.orders().size() == 4);
  CHECK(bench.orders().back().minutes[2] == 3);
  bench.run(20min);
  CHECK(bench.control().verdict() == PlanVerdict::planned);  // less than a minute is left
  CHECK(bench.control().state() == BalancingState::measuring);
  CHECK(bench.soc[2] >= 0.505);
  CHECK(bench.soc[2] <= 0.507);
  CHECK(static_cast<double>(bench.switches().bled_uAs(2)) == Approx(bench.bled_uAs[2]).epsilon(0.02));
}

TEST_CASE("cells of two modules are told side by side", "[unit][balancing]") {
  BalancingBench bench(small());
  for (const std::size_t cell : {1U, 3U, 4U, 7U}) bench.soc[cell] = 0.52;
  wait_for_bleeding(bench);
  CHECK(bench.really_on(0) == mask({2, 4}));
  CHECK(bench.really_on(1) == mask({1, 4}));
  CHECK(bench.orders().size() == 4);
}

TEST_CASE("a balanced pack is measured on and on, and nobody is told anything", "[unit][balancing]") {
  BalancingBench bench(small());
  bench.run(1h);
  CHECK(bench.control().verdict() == PlanVerdict::balanced);
  CHECK(bench.orders().empty());
}

TEST_CASE("voltages are taken for a plan only while the current stands still", "[unit][balancing]") {
  const auto plans = [](BalancingMethod method) {
    CoreConfig config = small();
    config.current.charge_continuous_mA = 10'000;  // a twentieth of it may fluctuate
    config.balancing.method = method;
    BalancingBench bench(config);
    bench.soc[2] = 0.52;
    for (int count = 0; count < 20; ++count) {
      bench.current_A = count % 2 == 0 ? -0.100 : -0.601;
      bench.run(5s);
    }
    return bench.control().verdict() != PlanVerdict::none;
  };
  CHECK_FALSE(plans(BalancingMethod::ocv));
  CHECK_FALSE(plans(BalancingMethod::terminal_voltage));
  CHECK(plans(BalancingMethod::charge));
}

TEST_CASE("whatever speaks against it stops everything at once, by one word to all", "[unit][balancing]") {
  BalancingBench bench(small());
  for (const std::size_t cell : {1U, 3U, 4U, 7U}) bench.soc[cell] = 0.52;
  wait_for_bleeding(bench);
  bench.run(10s);
  bench.blockers = some_blocker;
  bench.run(1s);
  CHECK(bench.orders().back().is_stop);
  CHECK(bench.orders().back().module_index == BalancingOrder::to_all);
  CHECK(bench.really_on(0) == 0);
  CHECK(bench.really_on(1) == 0);
  CHECK(bench.control().state() == BalancingState::idle);
  CHECK(bench.control().blockers() == some_blocker);
  CHECK(bench.steps().back().was_stopped);
  CHECK_FALSE(bench.switches().is_any_told());
  bench.run(10min);
  CHECK(stops(bench) == 1);  // followed, so sent once
  CHECK_FALSE(bench.switches().is_any_on());
  bench.blockers = 0;
  bench.run(10s);
  CHECK(bench.control().state() == BalancingState::measuring);
  CHECK_FALSE(is_bleeding(bench));
  wait_for_bleeding(bench);
}

TEST_CASE("a stop that is not obeyed is said again, to that module alone", "[unit][balancing]") {
  BalancingBench bench(small());
  for (const std::size_t cell : {1U, 4U}) bench.soc[cell] = 0.52;
  wait_for_bleeding(bench);
  bench.answers = [](std::size_t module) { return module != 1; };
  bench.blockers = some_blocker;
  bench.run(4s);
  CHECK(bench.really_on(0) == 0);
  CHECK(bench.really_on(1) == mask({1}));
  CHECK(stops(bench) >= 3);
  CHECK(bench.orders().back().module_index == 1);
  bench.run(1s);
  CHECK(bench.switches().stays_on().value == 1);
  CHECK(bench.switches().stays_on().element.module_node == bench.config.modules[1].node);
}

TEST_CASE("a switch that was on before anybody was told is stopped", "[unit][balancing]") {
  BalancingBench bench(small());
  std::uint16_t left_on = mask({2});
  bench.told_switches = [&left_on](std::size_t module, std::uint16_t on) { return module == 0 ? left_on : on; };
  bench.blockers = some_blocker;  // even with an inhibit
  bench.run(1s);
  REQUIRE(bench.orders().size() == 1);
  CHECK(bench.orders()[0].is_stop);
  CHECK(bench.orders()[0].module_index == 0);
  left_on = 0;
  bench.run(1min);
  CHECK(bench.orders().size() == 1);
  CHECK(bench.switches().stays_on().value == 0);
}

TEST_CASE("a module that refuses is left out until the next plan, and named once", "[unit][balancing]") {
  BalancingBench bench(small());
  bench.soc[2] = 0.52;
  bench.result = internal_bus::CommandResult::refused_in_this_mode;
  bench.run(21s);
  CHECK(bench.control().stage(0) == OrderStage::refused);
  CHECK(bench.control().has_failed(0));
  CHECK_FALSE(bench.switches().is_any_told());
  bench.run(1min);
  CHECK(bench.orders().size() >= 2);  // commanded again with each plan
  CHECK(bench.control().has_failed(0));
  bench.result = internal_bus::CommandResult::done;
  wait_for_bleeding(bench);
  CHECK_FALSE(bench.control().has_failed(0));
}

TEST_CASE("a module that begins only when a number changes, and keeps the one of last time, is bled each time",
          "[unit][balancing][MMU_CB]") {
  BalancingBench bench(small());
  bench.keeps_minutes = true;
  bench.soc[2] = 0.56;
  REQUIRE(bench.run_until([&] { return bench.soc[2] < 0.507; }, 2h));  // 50 minutes, five by five
  CHECK(bench.switches().stays_off().value == 0);
  CHECK(bench.control().stage(0) == OrderStage::done);
}

TEST_CASE("minutes are said only when the 0 before them was answered", "[unit][balancing][MMU_CB]") {
  BalancingBench bench(small());
  bench.soc[2] = 0.52;
  int lost = 2;
  bench.answers = [&lost](std::size_t) { return lost == 0 || --lost == 0; };
  wait_for_bleeding(bench);
  REQUIRE(bench.orders().size() == 3);
  for (const std::size_t zero : {0U, 1U}) CHECK(bench.orders()[zero].minutes == BalancingMinutes{});
  CHECK(bench.orders()[2].minutes == BalancingMinutes{0, 0, 5, 0});
}

TEST_CASE("what a module claims to be does not end the word to stop, nor the judgement", "[unit][balancing][faults]") {
  BalancingBench bench(small());
  bench.mode = internal_bus::Mode::autonomous;
  bench.is_on_module_supply = true;
  bench.told_switches = [](std::size_t module, std::uint16_t on) { return module == 0 ? mask({2}) : on; };
  bench.blockers = some_blocker;
  bench.run(10s);
  CHECK(stops(bench) == 10);  // the bench steps a second at a time
  CHECK(bench.orders().back().module_index == 0);
  CHECK(bench.switches().stays_on().value == 1);
}

TEST_CASE("a module that does not answer is asked five times, then left out and named", "[unit][balancing]") {
  BalancingBench bench(small());
  bench.soc[2] = 0.52;
  bench.answers = [](std::size_t) { return false; };
  bench.run(40s);
  CHECK(bench.control().has_failed(0));
  const auto named = std::count_if(bench.steps().begin(), bench.steps().end(),
                                   [&](const BalancingStep& step) { return step.unanswered_node != 0; });
  CHECK(named == 1);
  CHECK(bench.steps().back().unanswered_node == bench.config.modules[0].node);
  CHECK(bench.orders().size() == balancing_tries);
  bench.run(5min);
  CHECK(std::count_if(bench.steps().begin(), bench.steps().end(),
                      [](const BalancingStep& step) { return step.unanswered_node != 0; }) == 1);
}

TEST_CASE("an answer that is none of ours, or of another time, changes nothing", "[unit][balancing]") {
  BalancingBench bench(small());
  BalancingControl control;
  control.init(bench.config);
  BalancingSwitches switches;
  switches.init(bench.config);
  CanFrame done = make_frame(internal_bus::response, 1);
  write<internal_bus::response, "operation">(done, static_cast<std::int64_t>(internal_bus::Operation::balance));
  CHECK(control.observe_response(0, done, bench.now(), switches) == OrderStage::none);
  CHECK_FALSE(switches.is_any_told());
}

TEST_CASE("the frame of an order says minutes cell by cell, and zero for those that are not to bleed",
          "[unit][balancing][MMU_CB]") {
  const CanFrame frame =
      balancing_frame({.module_index = 2, .is_stop = false, .minutes = {0, 2, 0, 0, 2, 0, 0, 2, 0, 0, 2, 5}}, 3, 0x11);
  CHECK(frame.id == 0x343);
  CHECK(read_raw<internal_bus::command, "operation">(frame) == 3);
  CHECK(read_raw<internal_bus::command, "balancing_time_1_s">(frame) == 0);
  CHECK(read_raw<internal_bus::command, "balancing_time_2_s">(frame) == 2);
  CHECK(read_raw<internal_bus::command, "balancing_time_11_s">(frame) == 2);
  CHECK(read_raw<internal_bus::command, "balancing_time_12_s">(frame) == 5);
  CHECK(frame.data[6] == 0x11);
  CHECK(frame.data[7] == frame_crc(frame));
  const CanFrame stop = balancing_frame({}, 0, 9);
  CHECK(stop.id == 0x340);
  CHECK(stop.data[0] == 4);
  for (std::size_t index = 1; index < 6; ++index) CHECK(stop.data.at(index) == 0);
}

TEST_CASE("after a gap everything begins with a measurement", "[unit][balancing]") {
  BalancingControl control;
  control.init(small());
  control.forget(TimePoint{7s});
  CHECK(control.state() == BalancingState::idle);
  CHECK(control.since() == TimePoint{7s});
}

TEST_CASE("a bleeding cell's voltage is not planned with, however far its wires pull it down",
          "[unit][balancing][BMS_F.4]") {
  BalancingBench bench(small());
  bench.wire_Ohm = 0.5;  // 50 mV
  bench.soc[2] = 0.52;
  REQUIRE(bench.run_until([&] { return bench.soc[2] < 0.507; }, 1h));
  bench.run(1h);
  CHECK(bench.soc[2] > 0.505);
  for (std::size_t cell = 0; cell < 8; ++cell) {
    if (cell != 2) CHECK(bench.bled_uAs[cell] == 0.0);
  }
}
