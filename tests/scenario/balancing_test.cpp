// Balancing from the pack file to the emulated resistors: the core, its frames, the modules and the cells.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/balancing_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::BalancingBench;
using test::SimRun;

namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/") + name);
  std::string problems;
  if (!pack) {
    for (const ConfigProblem& problem : pack.error()) problems += to_text(problem) + "\n";
  }
  INFO(problems);
  REQUIRE(pack.has_value());
  return pack->core;
}

/// The 24 V pack with cells of `smaller` times less capacity: the same curve of voltage over charge, but a resistor
/// bleeds that much more of a cell. So minutes show the effect of hours.
CoreConfig small_cells(std::int64_t smaller) {
  CoreConfig config = shipped("lipo-6s-24v.json");
  config.cell.capacity_uAs /= smaller;
  config.balancing.is_enabled = true;
  config.balancing.method = BalancingMethod::ocv;
  config.balancing.dead_band_uV = 3'000;
  config.balancing.settle = 5s;
  return config;
}

double soc_at(const CellModel& cell, double wanted_uV) {
  return charge_at_uAs(cell, wanted_uV) / static_cast<double>(cell.capacity_uAs);
}

struct Rested {
  double low_mV = 1e9;
  double high_mV = 0.0;
};
/// Range of the cells' voltages at rest.
Rested rested(const SimRun& run, const CoreConfig& config) {
  Rested rested;
  const Plant& plant = run.simulator().plant();
  for (std::size_t cell = 0; cell < plant.cell_count(); ++cell) {
    const double one_mV = ocv_uV(config.cell, plant.cell(cell).soc * 1e3) * 1e-3;
    rested.low_mV = std::min(rested.low_mV, one_mV);
    rested.high_mV = std::max(rested.high_mV, one_mV);
  }
  return rested;
}

std::uint16_t mask(std::initializer_list<unsigned> cells) {
  unsigned bits = 0;
  for (const unsigned cell : cells) bits |= 1U << (cell - 1U);
  return static_cast<std::uint16_t>(bits);
}

std::string permille_text(double soc) {
  return std::to_string(soc * 1e3);
}

}  // namespace

namespace {

/// Hours of a charge that starts with one cell 100 mV below the others, with `smaller` times less capacity.
double hours_of_charge(std::int64_t smaller) {
  CoreConfig config = shipped("lipo-6s-24v.json");
  config.cell.capacity_uAs /= smaller;
  SimRun run(config);
  constexpr double start_uV = 3'900'000.0;
  constexpr double full_uV = 4'170'000.0;
  run.apply("pack soc_permille " + permille_text(soc_at(config.cell, start_uV)));
  run.apply("cell 1.3 soc_permille " + permille_text(soc_at(config.cell, start_uV - 100'000.0)));
  const Rested before = rested(run, config);
  CHECK(before.high_mV - before.low_mV == Approx(100.0).epsilon(0.02));
  run.run_to(2.0);
  run.apply("charger obeys nobody");  // less than an ampere, and the limits to the vehicle are whole amperes
  run.apply("charger connected");
  run.run_to(6.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  CHECK(run.core().balancing().state() == BalancingState::measuring);
  // Until the highest cell is full, and on again when bleeding has made room.
  double over_at_s = 0.0;
  while (over_at_s == 0.0 && run.seconds() < 24.0 * 3'600.0) {
    run.run_to(run.seconds() + 180.0 / static_cast<double>(smaller));
    REQUIRE(run.core().sequence().phase == Phase::closed);
    const Rested now = rested(run, config);
    const bool is_full = now.high_mV * 1e3 >= full_uV;
    run.apply(is_full ? "charger current_A 0" : "charger current_A 0.33");
    if (is_full && now.high_mV - now.low_mV <= 20.0) over_at_s = run.seconds();
  }
  const Rested after = rested(run, config);
  CAPTURE(over_at_s, after.low_mV, after.high_mV);
  CHECK(after.high_mV - after.low_mV <= 20.0);
  CHECK(after.high_mV >= full_uV * 1e-3 - 5.0);
  CHECK(run.core().watchers().switches.bled_uAs(2) == 0);  // the low one was never bled
  for (const FaultRow& row : fault_table()) {
    CAPTURE(row.name);
    CHECK(run.core().faults().state(row.id).count == 0);
  }
  return over_at_s / 3'600.0;
}

}  // namespace

TEST_CASE("from one cell 100 mV below the rest a charge ends with all cells within 20 mV",
          "[scenario][balancing][BMS_F.4]") {
  CHECK(hours_of_charge(10) == Approx(0.65).epsilon(0.2));
}

// Twenty seconds of computing.
TEST_CASE("the shipped 24 V pack takes six and a half hours for that", "[scenario][balancing][slow][hours]") {
  CHECK(hours_of_charge(1) == Approx(6.5).epsilon(0.03));
}

TEST_CASE("cells 2, 5, 8 and 11 for two minutes: on in exactly those, read back, and off again",
          "[scenario][balancing][BMS_F.4][MMU_CB][MMU_3]") {
  CoreConfig config = shipped("lfp-96s.json");
  config.balancing.is_enabled = true;
  config.balancing.method = BalancingMethod::ocv;
  config.balancing.requires_closed = false;
  config.balancing.settle = 2s;
  const std::size_t modules = config.modules.size();
  while (config.modules.size() > 1) {
    FixedVector<ModuleConfig, modules_max> one;
    one.push_back(config.modules[0]);
    config.modules = one;
  }
  REQUIRE(modules == 8);
  config.cell.hysteresis_V = 0.0;
  config.cell.capacity_uAs = uAs_per_Ah;
  // Charge that the resistor takes in two and a half minutes, in addition to that left by the dead band.
  const double low = 0.06;
  const double low_uV = ocv_uV(config.cell, low * 1e3);
  const double surplus_As = 150.0 * low_uV * 1e-6 / config.balancing.bleed_resistance_Ohm;
  const double high_uV = low_uV + config.balancing.dead_band_uV;
  const double high = soc_at(config.cell, high_uV) + surplus_As / 3'600.0;
  SimRun run(config);
  run.apply("pack soc_permille " + permille_text(low));
  for (const int cell : {2, 5, 8, 11}) {
    run.apply("cell 1." + std::to_string(cell) + " soc_permille " + permille_text(high));
  }
  const auto on = [&run] { return run.simulator().mmu(0).balancing_cells(); };
  while (on() == 0 && run.seconds() < 30.0) run.run_to(run.seconds() + 0.01);
  const double began_s = run.seconds();
  REQUIRE(on() == mask({2, 5, 8, 11}));
  run.run_to(began_s + 0.3);
  CHECK(run.core().watchers().switches.on(0) == mask({2, 5, 8, 11}));  // read back from MODULE
  CHECK(run.core().watchers().switches.minutes_told(0, 1) == 2);
  run.run_to(began_s + 119.0);
  CHECK(on() == mask({2, 5, 8, 11}));
  run.run_to(began_s + 121.5);
  CHECK(on() == 0);
  CHECK(run.core().watchers().switches.on(0) == 0);
  CHECK(run.core().watchers().switches.stays_on().value == 0);
  CHECK(run.core().watchers().switches.stays_off().value == 0);
  // At least 75 mA: of each 120 s.
  for (const std::size_t cell : {1U, 4U, 7U, 10U})
    CHECK(run.core().watchers().switches.bled_uAs(cell) >= 75'000LL * 119);
  CHECK(run.core().watchers().switches.bled_uAs(0) == 0);
}

TEST_CASE("a charge that turns into a discharge stops all bleeding within half a second", "[scenario][balancing]") {
  CoreConfig config = small_cells(40);
  config.balancing.settle = 2s;
  SimRun run(config);
  run.apply("pack soc_permille 500");
  run.apply("cell 1.3 soc_permille 300");
  run.run_to(2.0);
  run.apply("vehicle on");
  while (run.simulator().mmu(0).balancing_cells() == 0 && run.seconds() < 30.0) run.run_to(run.seconds() + 0.1);
  REQUIRE(run.simulator().mmu(0).balancing_cells() != 0);
  run.apply("load current_A 0.6");
  run.run_to(run.seconds() + 0.5);
  CHECK(run.simulator().mmu(0).balancing_cells() == 0);
  CHECK(run.core().balancing().state() == BalancingState::idle);
  CHECK(first_of(run.core().balancing().blockers()) == BalancingBlocker::discharging);
  CHECK(run.first(EventId::balancing_stopped) > 0.0);
}

namespace {

/// Small cells, for tests with one far below the others, and a short settling time.
CoreConfig out_of_balance() {
  CoreConfig config = small_cells(40);
  config.balancing.settle = 2s;
  return config;
}

/// Replaces the switch states in module 1's report.
test::Fate say_switches(CanFrame& frame, std::uint16_t on) {
  if (frame.id != internal_bus::module.base_id + 1U) return {};
  write<internal_bus::module, "balancing_cells">(frame, on);
  seal(internal_bus::module, frame.data[6], frame);
  return {};
}

bool is_present(const test::WiredPack& pack, FaultId id) {
  return pack.core().faults().state(id).is_present();
}

}  // namespace

TEST_CASE("a switch that stays on is a fault: a closed pack stays closed, an open one open",
          "[scenario][balancing][faults]") {
  test::WiredPack pack(out_of_balance());
  pack.run(2s);
  REQUIRE(pack.close());
  pack.on_sent = [](CanFrame& frame, const test::WiredPack&) { return say_switches(frame, mask({2})); };
  pack.run(2500ms);
  CHECK_FALSE(is_present(pack, FaultId::balancing_stays_on));
  pack.run(1500ms);
  REQUIRE(is_present(pack, FaultId::balancing_stays_on));
  CHECK(pack.core().faults().state(FaultId::balancing_stays_on).confirmed.element ==
        Element{.module_node = 1, .number = 2, .pack_number = 2});
  CHECK(pack.phase() == Phase::closed);
  CHECK(first_of(pack.core().balancing().blockers()) == BalancingBlocker::fault);
  pack.apply("vehicle off");
  pack.run(2s);
  pack.apply("vehicle on");
  pack.run(10s);
  CHECK(pack.phase() == Phase::open);
  pack.on_sent = nullptr;
  pack.apply("vehicle off");
  pack.run(2s);
  CHECK_FALSE(is_present(pack, FaultId::balancing_stays_on));
  CHECK(pack.close());
}

TEST_CASE("a switch that does not come on is told, and nothing else happens", "[scenario][balancing][faults]") {
  test::WiredPack pack(out_of_balance());
  pack.apply("pack soc_permille 500; cell 1.3 soc_permille 300");
  pack.run(2s);
  REQUIRE(pack.close());
  pack.on_sent = [](CanFrame& frame, const test::WiredPack&) { return say_switches(frame, 0); };
  REQUIRE(
      pack.run_until([](const test::WiredPack& now) { return is_present(now, FaultId::balancing_stays_off); }, 20s));
  CHECK(pack.core().faults().state(FaultId::balancing_stays_off).confirmed.element.module_node == 1);
  CHECK(pack.core().balancing().state() == BalancingState::bleeding);
  pack.on_sent = nullptr;
  pack.run(3s);
  CHECK_FALSE(is_present(pack, FaultId::balancing_stays_off));
  CHECK(pack.phase() == Phase::closed);
}

TEST_CASE("what is missing in the cells is kept when it is learned, then every ten minutes at most, and at the end",
          "[scenario][balancing][BMS_F.4]") {
  CoreConfig config = small_cells(10);
  config.balancing.method = BalancingMethod::charge;
  config.balancing.requires_closed = false;
  config.balancing.capacity_tolerance_permille = 0;  // it continues until the end
  config.balancing.dead_band_permille = 0;
  config.cell.hysteresis_V = 0.0;
  config.cell.slow_rc_resistance_Ohm = 0.0;
  config.cell.rc_time_constant_s = 0.1;
  config.soc.rest = 1s;
  test::WiredPack pack(config);
  pack.apply("pack soc_permille 500; cell 1.3 soc_permille 300");
  pack.observe(WallClockSeen{1'700'000'000'000});
  std::vector<std::int64_t> kept_at_ms;
  const auto run = [&](Duration duration) {
    for (const TimePoint end = pack.now() + duration; pack.now() < end;) {
      pack.run(1s);
      const std::int64_t kept_ms = pack.core().persistent().cell_charges.unix_time_ms;
      if (kept_ms != 0 && (kept_at_ms.empty() || kept_at_ms.back() != kept_ms)) kept_at_ms.push_back(kept_ms);
    }
  };
  run(10s);
  CHECK(kept_at_ms.size() == 1);
  CHECK(pack.core().persistent().cell_charges.modules[1].cell_count == 6);
  run(24min);
  REQUIRE(pack.core().watchers().switches.bled_uAs(0) > config.cell.capacity_uAs / 100);
  REQUIRE(kept_at_ms.size() == 3);
  CHECK(kept_at_ms[1] - kept_at_ms[0] >= 600'000);
  CHECK(kept_at_ms[2] - kept_at_ms[1] >= 600'000);
  pack.give(Command::shut_down);
  run(2s);
  CHECK(kept_at_ms.size() == 4);
}

TEST_CASE("a hot board stops the bleeding of the whole pack, until it has cooled", "[scenario][balancing][MMU_17]") {
  SimRun run(out_of_balance());
  run.apply("pack soc_permille 500");
  run.apply("cell 1.3 soc_permille 300");
  run.run_to(2.0);
  run.apply("vehicle on");
  const auto on = [&run] { return run.simulator().mmu(0).balancing_cells(); };
  while (on() == 0 && run.seconds() < 30.0) run.run_to(run.seconds() + 0.1);
  REQUIRE(on() != 0);
  run.apply("module 1 board_temperature_dC 660");
  run.run_to(run.seconds() + 1.0);
  CHECK(on() == 0);
  run.run_to(run.seconds() + 1.0);  // a jump of this size is accepted with the next sample
  CHECK(first_of(run.core().balancing().blockers()) == BalancingBlocker::board_too_hot);
  run.apply("module 1 board_temperature_dC 610");
  run.run_to(run.seconds() + 10.0);
  CHECK(on() == 0);
  run.apply("module 1 board_temperature_dC 590");
  const double cooled_s = run.seconds();
  while (on() == 0 && run.seconds() < cooled_s + 20.0) run.run_to(run.seconds() + 0.1);
  CHECK(on() != 0);
}

TEST_CASE("switched off by command, balancing stops until it is switched on again", "[scenario][balancing]") {
  CoreConfig config = small_cells(40);
  config.balancing.settle = 2s;
  SimRun run(config);
  run.apply("pack soc_permille 500");
  run.apply("cell 1.3 soc_permille 300");
  run.run_to(2.0);
  run.apply("vehicle on");
  const auto on = [&run] { return run.simulator().mmu(0).balancing_cells(); };
  while (on() == 0 && run.seconds() < 30.0) run.run_to(run.seconds() + 0.1);
  REQUIRE(on() != 0);
  run.give(Command::balancing_off);
  run.run_to(run.seconds() + 0.2);
  CHECK(on() == 0);
  run.run_to(run.seconds() + 20.0);
  CHECK(on() == 0);
  run.give(Command::balancing_on);
  const double asked_s = run.seconds();
  while (on() == 0 && run.seconds() < asked_s + 30.0) run.run_to(run.seconds() + 0.1);
  CHECK(on() != 0);
}

namespace {

double sum_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double one : values) sum += one;
  return sum;
}

/// Requirement of an ideal bleeding: every cell down to the lowest, all at the same time.
struct Least {
  double charge_Ah = 0.0;
  double energy_Wh = 0.0;
  double hours = 0.0;
};
Least least_for(const BalancingBench& bench) {
  const CellModel& cell = bench.config.cell;
  const double capacity_Ah = Ah_from_uAs(cell.capacity_uAs);
  const double lowest = *std::min_element(bench.soc.begin(), bench.soc.end());
  Least least;
  for (const double soc : bench.soc) {
    const double surplus_Ah = (soc - lowest) * capacity_Ah;
    const double voltage_V = ocv_uV(cell, (soc + lowest) / 2.0 * 1e3) * 1e-6;
    least.charge_Ah += surplus_Ah;
    least.energy_Wh += surplus_Ah * voltage_V;
    least.hours = std::max(least.hours, surplus_Ah / (voltage_V / bench.config.balancing.bleed_resistance_Ohm));
  }
  return least;
}

/// Bleeds until the plan is empty; returns the hours it took.
double bleed_out(BalancingBench& bench) {
  const TimePoint began_at = bench.now();
  bench.blockers = 0;
  const auto is_over = [&bench] {
    const BalancingControl& control = bench.control();
    return control.planned_at() > TimePoint{} && control.state() == BalancingState::measuring &&
           control.cells_told() == 0;
  };
  bench.run(1min);
  REQUIRE(bench.run_until(is_over, 300h));
  bench.blockers = 1U << static_cast<unsigned>(BalancingBlocker::switched_off);
  bench.run(5s);
  return to_s(bench.now() - began_at) / 3'600.0;
}

/// A rest with open contactors that gives every entry of the charge book its best accuracy.
void rest(BalancingBench& bench) {
  bench.current_A = 0.0;
  bench.is_open = true;
  bench.run(40min);
  bench.is_open = false;
}

void carry(BalancingBench& bench, double share) {
  const double hours = 2.0;
  bench.current_A = share * Ah_from_uAs(bench.config.cell.capacity_uAs) / hours;
  bench.run(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(hours * 3'600.0)));
  bench.current_A = 0.0;
}

void bring_lowest(BalancingBench& bench, double to_soc) {
  carry(bench, *std::min_element(bench.soc.begin(), bench.soc.end()) - to_soc);
}

void bring_highest(BalancingBench& bench, double to_soc) {
  carry(bench, *std::max_element(bench.soc.begin(), bench.soc.end()) - to_soc);
}

std::string row_text(const char* round, double spread_before, double spread_after, const Least& least,
                     const Least& taken, double on_hours) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(),
                "| %s | %.1f %% | %.1f %% | %.0f Ah, %.0f Wh, %.0f h | %.0f Ah, %.0f Wh, %.0f h | %.0f h |\n", round,
                spread_before * 100.0, spread_after * 100.0, least.charge_Ah, least.energy_Wh, least.hours,
                taken.charge_Ah, taken.energy_Wh, taken.hours, on_hours);
  return text.data();
}

/// One round: charges learned near empty and near full, discharge to the middle of the flat stretch, bled there.
std::string turn(BalancingBench& bench, const char* name) {
  bring_lowest(bench, 0.02);
  rest(bench);
  REQUIRE(bench.book().known_cells() == bench.soc.size());
  bring_highest(bench, 0.995);
  rest(bench);
  bring_lowest(bench, 0.5);
  const double before = bench.soc_spread();
  const double lowest = *std::min_element(bench.soc.begin(), bench.soc.end());
  const Least least = least_for(bench);
  const double bled_Ah = sum_of(bench.bled_uAs) / static_cast<double>(uAs_per_Ah);
  const double bled_J = sum_of(bench.bled_J);
  const std::vector<double> bled_before_uAs = bench.bled_uAs;
  Least taken{.hours = bleed_out(bench)};
  taken.charge_Ah = sum_of(bench.bled_uAs) / static_cast<double>(uAs_per_Ah) - bled_Ah;
  taken.energy_Wh = (sum_of(bench.bled_J) - bled_J) / 3'600.0;
  CHECK(*std::min_element(bench.soc.begin(), bench.soc.end()) >= lowest - 1e-6);  // the lowest cell is not bled
  CHECK(taken.charge_Ah <= least.charge_Ah);
  CHECK(bench.soc_spread() < before);
  double longest_uAs = 0.0;
  for (std::size_t cell = 0; cell < bench.soc.size(); ++cell) {
    longest_uAs = std::max(longest_uAs, bench.bled_uAs[cell] - bled_before_uAs[cell]);
  }
  const double bleed_A = ocv_uV(bench.config.cell, lowest * 1e3) * 1e-6 / bench.config.balancing.bleed_resistance_Ohm;
  const double on_hours = longest_uAs / static_cast<double>(uAs_per_Ah) / bleed_A;
  // Measuring, and at most five minutes at a time, add little to the time of the cell that is bled longest.
  CHECK(taken.hours <= on_hours * 1.1);
  return row_text(name, before, bench.soc_spread(), least, taken, on_hours);
}

const std::string page_file = test::in_source("docs/balancing.md");

std::string bytes_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

}  // namespace

TEST_CASE("96 LFP cells with 5 % of spread are balanced on the flat stretch: charge, energy and time as on the page",
          "[scenario][balancing][BMS_F.4][docs]") {
  const CoreConfig config = shipped("lfp-96s.json");
  REQUIRE(config.balancing.method == BalancingMethod::charge);
  BalancingBench bench(config);
  bench.blockers = 1U << static_cast<unsigned>(BalancingBlocker::switched_off);
  REQUIRE(bench.soc.size() == 96);
  for (std::size_t cell = 0; cell < 96; ++cell) {
    bench.soc[cell] = 0.30 + 0.05 * static_cast<double>(cell * 37 % 96) / 95.0;  // all of them, well mixed
    // Between its ends, and differing from cell to cell by as much as the charge book assumes.
    bench.hysteresis[cell] = -1.0 + 2.0 * static_cast<double>(cell * 53 % 96) / 95.0;
    bench.hysteresis_V[cell] = config.cell.hysteresis_V * (0.8 + 0.4 * static_cast<double>(cell * 29 % 96) / 95.0);
  }
  REQUIRE(bench.soc_spread() == Approx(0.05));
  std::string rows = turn(bench, "first");
  rows += turn(bench, "second");
  CHECK(bench.soc_spread() <= 0.015);
  rows += turn(bench, "third");
  CHECK(bench.soc_spread() <= 0.005);
  const std::string begin = "<!-- begin of the figures: written by BMUD_REWRITE=1 test_scenario \"[docs]\" -->\n";
  const std::string end = "<!-- end of the figures -->\n";
  const std::string head =
      "| turn | spread before | after | least possible for all of it | taken | longest switch on |\n"
      "|---|---|---|---|---|---|\n";
  const std::string page = bytes_of(page_file);
  const std::size_t first = page.find(begin);
  const std::size_t last = page.find(end);
  REQUIRE(first != std::string::npos);
  REQUIRE(last != std::string::npos);
  const std::string wanted = page.substr(0, first + begin.size()) + head + rows + page.substr(last);
  if (std::getenv("BMUD_REWRITE") != nullptr) std::ofstream(page_file, std::ios::binary) << wanted;
  INFO("to write it anew: BMUD_REWRITE=1 test_scenario \"[docs]\"");
  CHECK(bytes_of(page_file) == wanted);
}

namespace {

struct Flatness {
  const char* pack;
  double soc;  // of the lowest cell
  BalancingMethod method;
  bool bleeds;
};

/// Each method on a curve that rises everywhere and on one with a flat stretch, in the middle and near the top.
constexpr std::array flatness_rows{
    Flatness{"traction-16x12.json", 0.50, BalancingMethod::terminal_voltage, false},
    Flatness{"traction-16x12.json", 0.94, BalancingMethod::terminal_voltage, true},
    Flatness{"traction-16x12.json", 0.50, BalancingMethod::ocv, true},
    Flatness{"traction-16x12.json", 0.94, BalancingMethod::ocv, true},
    Flatness{"lfp-96s.json", 0.50, BalancingMethod::terminal_voltage, false},
    Flatness{"lfp-96s.json", 0.95, BalancingMethod::terminal_voltage, true},
    Flatness{"lfp-96s.json", 0.50, BalancingMethod::ocv, false},
    Flatness{"lfp-96s.json", 0.95, BalancingMethod::ocv, true},
    Flatness{"lfp-96s.json", 0.50, BalancingMethod::charge, false},  // no charge has been learned
};

}  // namespace

TEST_CASE("no method bleeds what may not be there, on a steep curve or a flat one, whatever hysteresis says",
          "[scenario][balancing][BMS_F.4]") {
  for (const Flatness& row : flatness_rows) {
    CoreConfig config = shipped(row.pack);
    FixedVector<ModuleConfig, modules_max> one;
    one.push_back(config.modules[0]);
    config.modules = one;
    config.cell.capacity_uAs = uAs_per_Ah;
    config.balancing.method = row.method;
    BalancingBench bench(config);
    for (std::size_t cell = 0; cell < bench.soc.size(); ++cell) {
      bench.soc[cell] = row.soc + 0.05 * static_cast<double>(cell * 5 % 12) / 11.0;
      // Worst case: the lowest read too low, the others too high, by all their hysteresis and 1 mV.
      bench.error_uV[cell] = (bench.soc[cell] == row.soc ? -1.0 : 1.0) * (config.cell.hysteresis_V * 1e6 + 1'000.0);
    }
    const double lowest = row.soc;
    bench.run(6h);
    CAPTURE(row.pack, row.soc, to_text(row.method), to_text(bench.control().verdict()));
    CHECK((sum_of(bench.bled_uAs) > 0.0) == row.bleeds);
    for (const double soc : bench.soc) CHECK(soc >= lowest - 1e-6);
  }
}
