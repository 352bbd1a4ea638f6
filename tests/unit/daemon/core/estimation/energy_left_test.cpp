// State of energy: compared with the integral by hand, reduced by load and cold, and its uncertainty.
#include "daemon/core/estimation/energy_left.hpp"

#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

/// 10 Ah, 3.2 V to 4.1 V linearly; 6 milliohm with settled RC elements; no charge transfer and no hysteresis.
CellDynamics plain_cell() {
  CellDynamics cell = test::sloped_cell();
  for (CellDynamics::Row& row : cell.rows) {
    row.kinetic_Ohm.fill(0.0);
    row.hysteresis_V.fill(0.0);
    row.slow_error_V = 0.0;
  }
  return cell;
}

/// 20 equal cells, half full, without any uncertainty.
EnergyLeftInput half_full() {
  return {.cell_count = 20,
          .soc_mean = 0.5,
          .capacity_mean_As = 36'000.0,
          .emptiest = {.is_known = true, .soc = 0.5, .sigma = 0.0},
          .emptiest_capacity_As = 36'000.0,
          .temperature_C = 25.0,
          .voltage_min_V = 2.0};
}

constexpr double cells_Ah = 20.0 * 10.0;

/// Mean voltage of a straight line between two states of charge, without load.
double mean_V(double low, double high) {
  return 3.2 + 0.9 * (low + high) / 2.0;
}

}  // namespace

TEST_CASE("the energy left is the integral of the voltage over the charge that is left", "[unit][energy][SOE_1]") {
  EnergyLeftInput input = half_full();
  const EnergyLeft rest = energy_left(plain_cell(), input);
  REQUIRE(rest.is_known);
  CHECK(rest.energy_Wh == Approx(cells_Ah * 0.5 * mean_V(0.0, 0.5)));
  CHECK(rest.load_A == 0.0);
  CHECK(rest.sigma_Wh == Approx(0.0).margin(1e-9));
  input.load_A = 10.0;  // 60 mV of each cell throughout
  const EnergyLeft loaded = energy_left(plain_cell(), input);
  CHECK(loaded.energy_Wh == Approx(cells_Ah * 0.5 * (mean_V(0.0, 0.5) - 0.06)));
  CHECK(loaded.load_A == 10.0);
  input.load_A = -10.0;  // a charge is no load
  CHECK(energy_left(plain_cell(), input).energy_Wh == Approx(rest.energy_Wh));
}

TEST_CASE("the energy ends where the load opens the pack, and not where the charge does", "[unit][energy][SOE_1]") {
  EnergyLeftInput input = half_full();
  input.load_A = 10.0;
  input.voltage_min_V = 3.23;  // 3.2 V + 0.9 V * z - 60 mV: at a tenth of the charge
  CHECK(energy_left(plain_cell(), input).energy_Wh == Approx(cells_Ah * 0.4 * (mean_V(0.1, 0.5) - 0.06)));
  input.voltage_min_V = 3.6;  // above the present voltage under load
  const EnergyLeft nothing = energy_left(plain_cell(), input);
  CHECK(nothing.is_known);
  CHECK(nothing.energy_Wh == 0.0);
}

TEST_CASE("the emptiest cell ends it for all, by its charge, its capacity and its resistance",
          "[unit][energy][SOE_1]") {
  EnergyLeftInput input = half_full();
  input.emptiest.soc = 0.2;
  CHECK(energy_left(plain_cell(), input).energy_Wh == Approx(cells_Ah * 0.2 * mean_V(0.3, 0.5)));
  input.emptiest_capacity_As = 18'000.0;  // a fifth of half the capacity
  CHECK(energy_left(plain_cell(), input).energy_Wh == Approx(cells_Ah * 0.1 * mean_V(0.4, 0.5)));
  input = half_full();
  input.load_A = 10.0;
  input.emptiest_share = 1.0;  // 120 mV for this cell
  input.voltage_min_V = 3.26;  // at 0.2 of its SOC
  CHECK(energy_left(plain_cell(), input).energy_Wh == Approx(cells_Ah * 0.3 * (mean_V(0.2, 0.5) - 0.06)));
  input.resistance_share_mean = 0.5;
  CHECK(energy_left(plain_cell(), input).energy_Wh == Approx(cells_Ah * 0.3 * (mean_V(0.2, 0.5) - 0.09)));
}

TEST_CASE("the cold leaves less energy, and charge transfer and hysteresis take their part", "[unit][energy][SOE_1]") {
  EnergyLeftInput input = half_full();
  input.load_A = 20.0;
  input.voltage_min_V = 3.0;
  const double warm_Wh = energy_left(plain_cell(), input).energy_Wh;
  input.temperature_C = -10.0;
  CHECK(energy_left(plain_cell(), input).energy_Wh < 0.9 * warm_Wh);
  CellDynamics cell = test::sloped_cell();  // 10 mV of hysteresis, 2 milliohm of charge transfer with 20 A
  input = half_full();
  input.load_A = 20.0;
  const double drop_V = 20.0 * 0.006 + 0.002 * 20.0 * std::asinh(1.0) + 0.01;
  CHECK(energy_left(cell, input).energy_Wh == Approx(cells_Ah * 0.5 * (mean_V(0.0, 0.5) - drop_V)));
}

TEST_CASE("the uncertainty of the energy has the charge's, the model's and the resistance's", "[unit][energy][SOE_1]") {
  CellDynamics cell = plain_cell();
  EnergyLeftInput input = half_full();
  input.emptiest.sigma = 0.1;
  // From 0.6 and from 0.4 down to zero: half the difference.
  const double by_soc_Wh = cells_Ah * (0.6 * mean_V(0.0, 0.6) - 0.4 * mean_V(0.0, 0.4)) / 2.0;
  CHECK(energy_left(cell, input).sigma_Wh == Approx(by_soc_Wh));
  for (CellDynamics::Row& row : cell.rows) row.slow_error_V = 0.05;
  const double by_model_Wh = cells_Ah * 0.5 * 0.05;
  CHECK(energy_left(cell, input).sigma_Wh == Approx(std::hypot(by_soc_Wh, by_model_Wh)));
  input.emptiest.sigma = 0.0;
  input.load_A = 10.0;
  input.voltage_min_V = 3.23;
  input.emptiest_share_sigma = 0.5;  // 30 mV more: it opens at 0.1333 instead of 0.1
  const double end = 0.1 + 0.03 / 0.9;
  const double by_resistance_Wh =
      cells_Ah * (0.4 * (mean_V(0.1, 0.5) - 0.06) - (0.5 - end) * (mean_V(end, 0.5) - 0.06));
  CHECK(energy_left(cell, input).sigma_Wh == Approx(std::hypot(cells_Ah * 0.4 * 0.05, by_resistance_Wh)));
}

TEST_CASE("without temperature, charge or tables nothing is said of the energy", "[unit][energy][SOE_1]") {
  const auto is_known = [](auto&& change) {
    EnergyLeftInput input = half_full();
    change(input);
    return energy_left(plain_cell(), input).is_known;
  };
  CHECK(is_known([](EnergyLeftInput&) {}));
  CHECK_FALSE(is_known([](EnergyLeftInput& input) { input.temperature_C = not_measured; }));
  CHECK_FALSE(is_known([](EnergyLeftInput& input) { input.emptiest.is_known = false; }));
  CHECK_FALSE(is_known([](EnergyLeftInput& input) { input.capacity_mean_As = 0.0; }));
  CHECK_FALSE(is_known([](EnergyLeftInput& input) { input.emptiest_capacity_As = 0.0; }));
  CHECK_FALSE(is_known([](EnergyLeftInput& input) { input.cell_count = 0; }));
  CHECK_FALSE(energy_left(CellDynamics{}, half_full()).is_known);
}

TEST_CASE("energy is published in whole mWh", "[unit][energy][SOE_1]") {
  CHECK(in_mWh(1.2344) == 1'234);
  CHECK(in_mWh(0.0016) == 2);
}
