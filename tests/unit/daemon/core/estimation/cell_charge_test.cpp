// Charge tracking of the cells: which values are entered, and how they are kept.
#include "daemon/core/estimation/cell_charge.hpp"

#include <array>
#include <cmath>

#include "tests/support/balancing_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using test::BalancingBench;

namespace {

constexpr double capacity_uAs = 10.0 * uAs_per_Ah;

/// Steep to 20 %, flat to 90 %, steep again; two modules of four cells.
CoreConfig flat_pack() {
  CoreConfig config = test::small_pack();
  config.cell.ocv.clear();
  for (const OcvPoint point :
       {OcvPoint{0, 2'800'000}, OcvPoint{200, 3'290'000}, OcvPoint{900, 3'300'000}, OcvPoint{1'000, 3'450'000}}) {
    config.cell.ocv.push_back(point);
  }
  config.cell.capacity_uAs = 10 * uAs_per_Ah;
  config.cell.rc_time_constant_s = 60.0;
  config.soc = {.rest_current_mA = 200, .rest = 30s};
  config.balancing.method = BalancingMethod::charge;
  config.balancing.is_enabled = true;
  config.balancing.capacity_tolerance_permille = 0;  // all cells alike, unless a test sets another value
  return config;
}

double missing_share(const BalancingBench& bench, std::size_t cell) {
  return static_cast<double>(bench.book().cell(cell).missing_uAs) / capacity_uAs;
}

}  // namespace

TEST_CASE("what is missing is learned from a rest where the curve is steep", "[unit][estimators][BMS_F.4]") {
  BalancingBench bench(flat_pack());
  bench.is_open = true;
  bench.soc.assign(8, 0.10);
  bench.soc[3] = 0.15;
  bench.soc[5] = 0.95;
  bench.run(120s);  // two time constants
  CHECK(bench.book().known_cells() == 0);
  bench.run(2s);
  CHECK(bench.book().known_cells() == 8);
  CHECK(missing_share(bench, 0) == Approx(0.90).epsilon(0.001));
  CHECK(missing_share(bench, 3) == Approx(0.85).epsilon(0.001));
  CHECK(missing_share(bench, 5) == Approx(0.05).epsilon(0.01));
  CHECK(bench.book().cell(3).capacity_uAs == 10 * uAs_per_Ah);
  // 1 mV at 2.45 mV a permille, and at 1.5.
  CHECK(static_cast<double>(bench.book().cell(0).uncertainty_uAs) == Approx(capacity_uAs * 0.001 / 2.45).epsilon(0.01));
  CHECK(static_cast<double>(bench.book().cell(5).uncertainty_uAs) == Approx(capacity_uAs * 0.001 / 1.5).epsilon(0.01));
}

TEST_CASE("on a flat stretch nothing is learned, and beyond the curve neither", "[unit][estimators][BMS_F.4]") {
  BalancingBench bench(flat_pack());
  bench.is_open = true;
  bench.soc = {0.3, 0.5, 0.7, 0.85, -0.01, 1.01, 0.1, 0.95};
  bench.run(200s);
  CHECK(bench.book().known_cells() == 2);
  for (std::size_t cell = 0; cell < 6; ++cell) CHECK_FALSE(bench.book().cell(cell).is_known);
}

TEST_CASE("hysteresis makes a voltage say less", "[unit][estimators][BMS_F.4]") {
  CoreConfig config = flat_pack();
  config.cell.hysteresis_V = 0.004;
  BalancingBench bench(config);
  bench.is_open = true;
  bench.soc.assign(8, 0.1);
  bench.run(200s);
  // 1 mV, and 4 mV plus the fifth by which cells differ.
  CHECK(static_cast<double>(bench.book().cell(0).uncertainty_uAs) ==
        Approx(capacity_uAs * 0.0058 / 2.45).epsilon(0.01));
  config.cell.hysteresis_V = 0.060;  // 61 mV: 25 permille either way
  BalancingBench blind(config);
  blind.is_open = true;
  blind.soc.assign(8, 0.1);
  blind.run(200s);
  CHECK(blind.book().known_cells() == 0);
}

TEST_CASE("no rest, nothing learned: closed, a current, something bleeding", "[unit][estimators][BMS_F.4]") {
  const auto learns = [](const std::function<void(BalancingBench&)>& change) {
    BalancingBench bench(flat_pack());
    bench.is_open = true;
    bench.soc.assign(8, 0.1);
    change(bench);
    bench.run(200s);
    return bench.book().known_cells() > 0;
  };
  CHECK(learns([](BalancingBench& bench) { bench.current_A = 0.2; }));
  CHECK(learns([](BalancingBench& bench) { bench.current_A = -0.2; }));
  CHECK_FALSE(learns([](BalancingBench& bench) { bench.current_A = 0.201; }));
  CHECK_FALSE(learns([](BalancingBench& bench) { bench.current_A = -0.201; }));
  CHECK_FALSE(learns([](BalancingBench& bench) { bench.is_open = false; }));
  CHECK_FALSE(learns([](BalancingBench& bench) {
    bench.told_switches = [](std::size_t module, std::uint16_t) {
      return module == 1 ? std::uint16_t{4} : std::uint16_t{0};
    };
  }));
}

TEST_CASE("charge that flows and charge that is bled keep the book", "[unit][estimators][BMS_F.4]") {
  BalancingBench bench(flat_pack());
  bench.is_open = true;
  bench.soc.assign(8, 0.1);
  bench.soc[2] = 0.12;
  bench.blockers = 1;
  bench.run(130s);
  bench.is_open = false;
  bench.current_A = -5.0;
  bench.run(1h);  // to the flat section
  CHECK(missing_share(bench, 0) == Approx(0.40).epsilon(0.001));
  CHECK(bench.soc[0] == Approx(0.60).epsilon(0.001));
  bench.current_A = 0.0;
  bench.blockers = 0;
  bench.run(30min);
  REQUIRE(bench.bled_uAs[2] > 0.0);
  CHECK(missing_share(bench, 2) == Approx(1.0 - bench.soc[2]).epsilon(0.001));
  // A twentieth of the bled charge is uncertain.
  const std::int64_t learned_uAs = bench.book().cell(0).uncertainty_uAs;
  CHECK(static_cast<double>(bench.book().cell(2).uncertainty_uAs - learned_uAs) ==
        Approx(bench.bled_uAs[2] / 20.0).epsilon(0.02));
}

TEST_CASE("what a cell may lose by itself makes the book unsure, and a better rest makes it sure again",
          "[unit][estimators][BMS_F.4]") {
  CoreConfig config = flat_pack();
  config.cell.self_discharge_permille_per_month = 30.0;
  BalancingBench bench(config);
  bench.is_open = true;
  bench.blockers = 1;
  bench.soc.assign(8, 0.1);
  bench.run(130s);
  const std::int64_t learned_uAs = bench.book().cell(0).uncertainty_uAs;
  bench.is_open = false;
  bench.run(24h);
  // The cell has lost between zero and 1 permille: half of that, with the same uncertainty.
  CHECK(static_cast<double>(bench.book().cell(0).uncertainty_uAs - learned_uAs) ==
        Approx(capacity_uAs * 0.0005).epsilon(0.01));
  CHECK(missing_share(bench, 0) == Approx(0.9005).epsilon(0.0001));
  bench.soc[0] = 0.095;  // it has, a little more than the others
  bench.is_open = true;
  bench.run(130s);
  CHECK(static_cast<double>(bench.book().cell(0).uncertainty_uAs) ==
        Approx(static_cast<double>(learned_uAs)).epsilon(0.01));
  CHECK(missing_share(bench, 0) == Approx(0.905).epsilon(0.001));
}

TEST_CASE("a rest that says it worse changes nothing, one that contradicts what is known counts",
          "[unit][estimators][BMS_F.4]") {
  const auto missing_after = [](double soc) {
    BalancingBench bench(flat_pack());
    bench.is_open = true;
    bench.blockers = 1;
    bench.soc.assign(8, 0.10);
    bench.error_uV.assign(8, 0.0);
    bench.run(130s);  // 0.4 permille either way
    bench.is_open = false;
    bench.current_A = -0.1;
    bench.run(60s);  // 0.2 permille of the capacity
    bench.current_A = 0.0;
    bench.is_open = true;
    bench.soc[0] = soc;
    bench.soc[1] = 0.97;  // 0.7 permille either way
    bench.run(200s);
    return missing_share(bench, 0);
  };
  CHECK(missing_after(0.10) == Approx(0.90).epsilon(0.001));
  CHECK(missing_after(0.97) == Approx(0.03).epsilon(0.01));
  CHECK(missing_after(0.15) == Approx(0.85).epsilon(0.001));
}

namespace {

/// Pack with cells of up to a tenth more or less capacity than in their file.
CoreConfig unlike_pack() {
  CoreConfig config = flat_pack();
  config.balancing.capacity_tolerance_permille = 100;
  return config;
}

void rest(BalancingBench& bench) {
  bench.current_A = 0.0;
  bench.is_open = true;
  bench.run(200s);
  bench.is_open = false;
}

/// Charges the pack with this charge within an hour.
void put(BalancingBench& bench, double Ah) {
  bench.current_A = -Ah;
  bench.run(1h);
  bench.current_A = 0.0;
}

bool is_within(const BalancingBench& bench, std::size_t cell, std::size_t other) {
  const CellCharge one = bench.book().cell(cell);
  const CellCharge two = bench.book().cell(other);
  const double really_uAs = bench.missing_uAs(cell) - bench.missing_uAs(other);
  const auto unsure_uAs = static_cast<double>(one.uncertainty_uAs + two.uncertainty_uAs);
  return std::abs(static_cast<double>(one.missing_uAs - two.missing_uAs) - really_uAs) <= unsure_uAs;
}

}  // namespace

TEST_CASE("near empty a line is unsure of what a cell's capacity may differ by, near full of hardly anything",
          "[unit][estimators][BMS_F.4]") {
  BalancingBench bench(unlike_pack());
  bench.blockers = 1;
  bench.capacity_share[2] = 0.9;
  bench.soc.assign(8, 0.10);
  bench.soc[5] = 0.95;
  rest(bench);
  REQUIRE(bench.book().known_cells() == 8);
  const double near_empty = static_cast<double>(bench.book().cell(2).uncertainty_uAs) / capacity_uAs;
  CHECK(near_empty == Approx(0.09 + 0.0011 / 2.45).epsilon(0.01));
  const double near_full = static_cast<double>(bench.book().cell(5).uncertainty_uAs) / capacity_uAs;
  CHECK(near_full == Approx(0.005 + 0.0011 / 1.5).epsilon(0.01));
  CHECK(is_within(bench, 2, 0));
  CHECK(is_within(bench, 2, 5));
}

TEST_CASE("two rests far apart show each cell's capacity, whatever the sensor's gain", "[unit][estimators][BMS_F.4]") {
  for (const double gain : {0.98, 1.0, 1.02}) {
    CAPTURE(gain);
    BalancingBench bench(unlike_pack());
    bench.blockers = 1;
    bench.sensor_gain = gain;
    for (std::size_t cell = 0; cell < 8; ++cell) {
      bench.capacity_share[cell] = 0.93 + 0.02 * static_cast<double>(cell);
      bench.soc[cell] = 0.96 - 8.5 / (10.0 * bench.capacity_share[cell]);
    }
    rest(bench);
    put(bench, 8.5);
    rest(bench);
    for (std::size_t cell = 0; cell < 8; ++cell) {
      CAPTURE(cell);
      const CellCharge charge = bench.book().cell(cell);
      CHECK(static_cast<double>(charge.capacity_uAs) ==
            Approx(capacity_uAs * bench.capacity_share[cell] * gain).epsilon(0.005));
      CHECK(is_within(bench, cell, 0));
      CHECK(is_within(bench, cell, 7));
    }
    // Discharged again, each cell by its own capacity: the missing charge is as certain as that capacity.
    put(bench, -8.5);
    rest(bench);
    for (std::size_t cell = 0; cell < 8; ++cell) {
      CHECK(static_cast<double>(bench.book().cell(cell).uncertainty_uAs) <= capacity_uAs * 0.03);
      CHECK(is_within(bench, cell, 7));
    }
  }
}

TEST_CASE("of two lines learned at different times the older is unsure of what the sensor may have miscounted",
          "[unit][estimators][BMS_F.4]") {
  CoreConfig config = flat_pack();
  BalancingBench bench(config);
  bench.blockers = 1;
  bench.sensor_gain = 0.98;
  bench.soc.assign(8, 0.15);
  bench.soc[0] = 0.10;
  rest(bench);
  const std::int64_t learned_uAs = bench.book().cell(0).uncertainty_uAs;
  put(bench, 7.8);  // cell 1 is at 0.88: not learned; the others at 0.93
  bench.soc[1] = 0.88;
  rest(bench);
  const CellCharge older = bench.book().cell(0);
  const double miscounted_uAs = 7.8 * uAs_per_Ah * 0.02 * 0.98 + 50e3 * (3'600.0 + 200.0);
  CHECK(static_cast<double>(older.uncertainty_uAs - learned_uAs) == Approx(miscounted_uAs).epsilon(0.02));
  CHECK(is_within(bench, 0, 4));
}

TEST_CASE("a module that is forgotten has no line, and the others keep theirs", "[unit][estimators][BMS_F.4]") {
  BalancingBench bench(unlike_pack());
  bench.blockers = 1;
  bench.soc.assign(8, 0.10);
  rest(bench);
  REQUIRE(bench.book().known_cells() == 8);
  CellChargeBook book = bench.book();
  book.forget_module(1);
  CHECK(book.known_cells() == 4);
  CHECK(book.cell(3).is_known);
  for (std::size_t cell = 4; cell < 8; ++cell) CHECK_FALSE(book.cell(cell).is_known);
  CellChargeRecords records;
  CHECK_FALSE(book.record(records));
}

TEST_CASE("a pack that was driven one way knows where hysteresis has pulled its cells", "[unit][estimators][BMS_F.4]") {
  CoreConfig config = flat_pack();
  config.cell.hysteresis_V = 0.010;
  config.cell.hysteresis_charge_permille = 50.0;
  BalancingBench bench(config);
  bench.blockers = 1;
  bench.soc.assign(8, 0.5);
  bench.soc[3] = 0.52;
  // Cells as different as permitted: in their initial hysteresis, and in its magnitude.
  for (std::size_t cell = 0; cell < 8; ++cell) {
    bench.hysteresis[cell] = cell % 2 == 0 ? 1.0 : -1.0;
    bench.hysteresis_V[cell] = cell % 3 == 0 ? 0.012 : 0.008;
  }
  bench.current_A = 4.0;
  bench.run(1h);  // 0.4 of the capacity, eight times the charge that hysteresis requires
  bench.current_A = 0.0;
  bench.is_open = true;
  bench.run(200s);
  REQUIRE(bench.book().known_cells() == 8);
  // 1 mV and a fifth of 10 mV, at 2.45 mV a permille. With unknown direction: 1 mV and 12.
  for (std::size_t cell = 0; cell < 8; ++cell) {
    const CellCharge charge = bench.book().cell(cell);
    CAPTURE(cell, bench.soc[cell], missing_share(bench, cell));
    CHECK(static_cast<double>(charge.uncertainty_uAs) == Approx(capacity_uAs * 0.003 / 2.45).epsilon(0.02));
    CHECK(std::abs(missing_share(bench, cell) - (1.0 - bench.soc[cell])) * capacity_uAs <=
          static_cast<double>(charge.uncertainty_uAs));
  }
}

TEST_CASE("a current that nobody has seen may have turned the hysteresis round", "[unit][estimators][BMS_F.4]") {
  HysteresisRange range;
  CellModel cell;
  cell.hysteresis_V = 0.010;
  cell.capacity_uAs = 10 * uAs_per_Ah;
  cell.hysteresis_charge_permille = 50.0;
  range.init(cell);
  const auto check = [&range](double least_mV, double most_mV) {
    CHECK(range.least_uV() == Approx(least_mV * 1e3).margin(1.0));
    CHECK(range.most_uV() == Approx(most_mV * 1e3).margin(1.0));
  };
  check(-12.0, 12.0);
  constexpr std::int64_t q0_uAs = uAs_per_Ah / 2;
  range.flow(q0_uAs, q0_uAs);  // 1/e of the way remains
  check(-12.0, -10.0 + 20.0 * std::exp(-1.0) + 2.0);
  for (int more = 0; more < 20; ++more) range.flow(q0_uAs, q0_uAs);
  check(-12.0, -8.0);
  SECTION("a charge turns both ends") {
    for (int more = 0; more < 20; ++more) range.flow(-q0_uAs, -q0_uAs);
    check(8.0, 12.0);
  }
  SECTION("a cell that is bled as much as it is charged stays where it is: the low end") {
    for (int more = 0; more < 20; ++more) range.flow(-q0_uAs, 0);
    check(-12.0, 12.0);
  }
  SECTION("what was not seen") {
    range.forget();
    check(-12.0, 12.0);
  }
}

// --- over a restart -------------------------------------------------------------------------------------------------

namespace {

/// Bench with charges learned at a tenth, charged to the middle of the flat section, closed; one cell has 2 % more.
BalancingBench on_the_flat(const CoreConfig& config) {
  BalancingBench bench(config);
  bench.blockers = 1;
  bench.is_open = true;
  bench.soc.assign(8, 0.1);
  bench.soc[2] = 0.12;
  bench.run(130s);
  REQUIRE(bench.book().known_cells() == 8);
  bench.is_open = false;
  bench.current_A = -5.0;
  bench.run(1h);
  bench.current_A = 0.0;
  bench.run(5s);
  return bench;
}

std::int64_t difference_uAs(const BalancingBench& bench, std::size_t one, std::size_t other) {
  return bench.book().cell(one).missing_uAs - bench.book().cell(other).missing_uAs;
}

CoreConfig leaking_pack() {
  CoreConfig config = flat_pack();
  config.cell.self_discharge_permille_per_month = 30.0;
  config.cell.voltage_max_uV = 3'650'000;
  return config;
}

}  // namespace

TEST_CASE("the book outlives the daemon: differences between cells stay known, less surely the older they are",
          "[unit][estimators][BMS_F.4]") {
  BalancingBench bench = on_the_flat(leaking_pack());
  const std::int64_t apart_uAs = difference_uAs(bench, 0, 2);
  const std::int64_t sure_uAs = bench.book().cell(2).uncertainty_uAs;
  const CellChargeRecords kept = bench.record();
  REQUIRE(kept.unix_time_ms == bench.unix_time_ms);
  bench.restart(kept, 10 * 24h);
  CHECK(bench.book().former() == FormerBook::waiting);
  CHECK(bench.book().known_cells() == 0);
  CHECK_FALSE(bench.book().cell(2).is_known);
  bench.run(2s);
  REQUIRE(bench.book().former() == FormerBook::in_use);
  CHECK(bench.book().known_cells() == 8);
  CHECK(difference_uAs(bench, 0, 2) == apart_uAs);
  // Ten days at 30 permille a month, and the charge that may have been bled between record and end: half of each.
  const double bled_uAs = 3.65 / bench.config.balancing.bleed_resistance_Ohm * 600.0 * 1e6;
  CHECK(static_cast<double>(bench.book().cell(2).uncertainty_uAs - sure_uAs) ==
        Approx(capacity_uAs * 0.005 + bled_uAs / 2.0).epsilon(0.05));
  // Balancing works: it bleeds the one cell above the others, on the flat section, without any rest.
  bench.blockers = 0;
  bench.run(20min);
  CHECK(bench.bled_uAs[2] > 0.0);
  CHECK(bench.bled_uAs[0] == 0.0);
}

TEST_CASE("a book of a former life is believed only when clock and modules say that it is of this pack",
          "[unit][estimators][BMS_F.4]") {
  BalancingBench bench = on_the_flat(leaking_pack());
  CellChargeRecords kept = bench.record();
  SECTION("no clock") {
    bench.restart(kept, 1h);
    bench.unix_time_ms = 0;
    bench.run(10s);
    CHECK(bench.book().former() == FormerBook::waiting);
    CHECK(bench.book().known_cells() == 0);
  }
  SECTION("a clock that says before it was written, until it is right") {
    bench.restart(kept, 1h);
    const std::int64_t right_ms = bench.unix_time_ms;
    bench.unix_time_ms = kept.unix_time_ms - 60'000;
    bench.run(10s);
    CHECK(bench.book().known_cells() == 0);
    bench.unix_time_ms = right_ms;
    bench.run(2s);
    CHECK(bench.book().known_cells() == 8);
    // A clock that is set back later does not reduce the uncertainty.
    const std::int64_t before_uAs = bench.book().cell(0).uncertainty_uAs;
    bench.unix_time_ms = kept.unix_time_ms;
    bench.run(10s);
    CHECK(bench.book().cell(0).uncertainty_uAs >= before_uAs);
  }
  SECTION("another module") {
    bench.restart(kept, 1h);
    bench.serial_numbers[1] = 4711;
    bench.run(2s);
    CHECK(bench.book().former() == FormerBook::foreign);
    CHECK(bench.book().known_cells() == 0);
  }
  SECTION("cells of another size") {
    kept.capacity_uAs += 1;
    bench.restart(kept, 1h);
    CHECK(bench.book().former() == FormerBook::foreign);
  }
  SECTION("a module more") {
    kept.modules[9] = kept.modules[1];
    bench.restart(kept, 1h);
    CHECK(bench.book().former() == FormerBook::foreign);
  }
  SECTION("numbers that cannot be") {
    kept.modules[1].cells[2].missing_uAs = 3 * kept.capacity_uAs;
    bench.restart(kept, 1h);
    CHECK(bench.book().former() == FormerBook::foreign);
  }
  SECTION("nothing kept") {
    bench.restart({}, 1h);
    CHECK(bench.book().former() == FormerBook::none);
  }
}

TEST_CASE("a book that the voltages contradict is thrown away, at the latest by the first rest",
          "[unit][estimators][BMS_F.4]") {
  CoreConfig config = leaking_pack();
  config.cell.rc_resistance_Ohm = 0.002;
  config.current.discharge_continuous_mA = 10'000;
  BalancingBench bench = on_the_flat(config);
  const CellChargeRecords kept = bench.record();
  SECTION("at once, when it is far off") {
    bench.restart(kept, 1h);
    bench.soc[5] = 0.02;  // emptied externally: half a volt
    bench.run(2s);
    CHECK(bench.book().former() == FormerBook::refused);
    CHECK(bench.book().known_cells() == 0);
  }
  SECTION("in a rest, when it is not") {
    bench.restart(kept, 1h);
    bench.soc[5] = 0.19;
    bench.run(2s);
    REQUIRE(bench.book().former() == FormerBook::in_use);
    bench.is_open = true;
    bench.run(200s);
    CHECK(bench.book().former() == FormerBook::refused);
    CHECK(bench.book().known_cells() <= 1);  // except for cells that can be learned
  }
  SECTION("not by a rest that it explains") {
    bench.restart(kept, 1h);
    bench.is_open = true;
    bench.run(200s);
    CHECK(bench.book().former() == FormerBook::in_use);
    CHECK(bench.book().known_cells() == 8);
  }
}

TEST_CASE("a rest near empty shows what has flowed unseen, and a former life's book is this one's again",
          "[unit][estimators][BMS_F.4]") {
  BalancingBench bench = on_the_flat(leaking_pack());
  const CellChargeRecords kept = bench.record();
  bench.restart(kept, 1h);
  for (double& soc : bench.soc) soc -= 0.45;  // discharged, and not recorded
  bench.run(2s);
  bench.is_open = true;
  bench.run(200s);
  CHECK(bench.book().former() == FormerBook::taken_over);
  for (std::size_t cell = 0; cell < 8; ++cell) {
    CAPTURE(cell);
    CHECK(missing_share(bench, cell) == Approx(1.0 - bench.soc[cell]).margin(0.001));
  }
}

TEST_CASE("a module that is replaced takes its lines with it", "[unit][estimators][BMS_F.4]") {
  BalancingBench bench = on_the_flat(leaking_pack());
  bench.serial_numbers[0] = 4711;
  bench.run(2s);
  CHECK(bench.book().known_cells() == 4);
  CHECK_FALSE(bench.book().cell(0).is_known);
  CHECK(bench.book().cell(4).is_known);
  CHECK(bench.record() == CellChargeRecords{});
}

TEST_CASE("written again is what changes between cells, not what all have in common", "[unit][estimators][BMS_F.4]") {
  BalancingBench bench = on_the_flat(flat_pack());
  const CellChargeRecords before = bench.record();
  CHECK(is_worth_recording({}, before));
  CHECK_FALSE(is_worth_recording(before, before));
  bench.current_A = 3.0;
  bench.run(30min);
  CHECK_FALSE(is_worth_recording(before, bench.record()));
  bench.current_A = 0.0;
  CellChargeRecords other = bench.record();
  other.modules[1].cells[1].missing_uAs += 10 * uAs_per_Ah / 10'000;
  CHECK(is_worth_recording(before, other));
  other = before;
  other.modules[2].cells[1].uncertainty_uAs += uAs_per_Ah;
  CHECK_FALSE(is_worth_recording(before, other));
  CHECK(is_worth_recording(other, before));
  other = before;
  other.modules[1].serial_number = 5;
  CHECK(is_worth_recording(before, other));
}
