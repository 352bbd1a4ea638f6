// Cell model between its tables: every figure here is calculated by hand or from a closed form.
#include "daemon/core/cell/cell_dynamics.hpp"

#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

double arrhenius(double activation_K, double temperature_C) {
  return std::exp(activation_K * (1.0 / (temperature_C + 273.15) - 1.0 / 298.15));
}

/// 3 V to 4 V linearly at 0 C, and 3.1 V to 4.1 V at 40 C; resistances that follow Arrhenius' law and rise along the
/// charge from R to 2 R.
CellDynamics even_cell() {
  CellDynamics cell;
  cell.activation_K = 2500.0;
  cell.capacity_As = 3600.0;
  for (const double temperature_C : {0.0, 40.0}) {
    const double factor = arrhenius(2500.0, temperature_C);
    CellDynamics::Row row{.temperature_C = temperature_C, .exchange_current_A = 2.0};
    for (std::size_t point = 0; point < CellDynamics::curve_points; ++point) {
      row.ocv_V[point] = (temperature_C > 20.0 ? 3.1 : 3.0) + static_cast<double>(point) / 50.0;
    }
    for (std::size_t point = 0; point < CellDynamics::resistance_points; ++point) {
      const double share = 1.0 + static_cast<double>(point) / 20.0;
      row.hysteresis_V[point] = 0.01 * share;
      row.series_Ohm[point] = 0.010 * share * factor;
      row.kinetic_Ohm[point] = 0.004 * share * factor;
      for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
        row.pair_Ohm[pair][point] = 0.001 * static_cast<double>(pair + 1) * share * factor;
      }
    }
    row.slow_error_V = temperature_C > 20.0 ? 0.01 : 0.03;
    row.fast_error_V = temperature_C > 20.0 ? 0.02 : 0.04;
    cell.rows.push_back(row);
  }
  return cell;
}

CellModel sheet() {
  CellModel model;
  for (const OcvPoint point :
       {OcvPoint{0, 3'000'000}, OcvPoint{200, 3'500'000}, OcvPoint{800, 3'800'000}, OcvPoint{1'000, 4'200'000}}) {
    model.ocv.push_back(point);
  }
  model.capacity_uAs = 9'000'000'000;
  model.series_resistance_Ohm = 0.002;
  model.rc_resistance_Ohm = 0.001;
  model.rc_time_constant_s = 30.0;
  model.slow_rc_resistance_Ohm = 0.003;
  model.slow_rc_time_constant_s = 700.0;
  model.resistance_activation_K = 3200.0;
  model.hysteresis_V = 0.012;
  model.hysteresis_charge_permille = 40.0;
  model.self_discharge_permille_per_month = 20.0;
  return model;
}

}  // namespace

TEST_CASE("a place in a table is between two entries, at its ends and beyond them too", "[unit][estimators]") {
  CHECK(table_place(21, 0.0).from == 0);
  CHECK(table_place(21, 0.0).share == 0.0);
  CHECK(table_place(21, 0.525).from == 10);
  CHECK(table_place(21, 0.525).share == Approx(0.5));
  CHECK(table_place(21, 0.999).from == 19);
  CHECK(table_place(21, 0.999).share == Approx(0.98));
  CHECK(table_place(21, 1.0).from == 19);
  CHECK(table_place(21, 1.0).share == 1.0);
  CHECK(table_place(21, -3.0).from == 0);
  CHECK(table_place(21, -3.0).share == 0.0);
  CHECK(table_place(21, 7.0).from == 19);
  CHECK(table_place(21, 7.0).share == 1.0);
}

TEST_CASE("between the points of the charge everything is a straight line", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  const double factor = arrhenius(2500.0, 0.0);
  for (const double soc : {0.0, 0.013, 0.3, 0.5555, 0.981, 1.0}) {
    CAPTURE(soc);
    const CellPoint point = at(cell, soc, 0.0);
    CHECK(point.ocv_V == Approx(3.0 + soc).epsilon(1e-12));
    CHECK(point.ocv_slope_V == Approx(1.0).epsilon(1e-9));
    CHECK(point.hysteresis_V == Approx(0.01 * (1.0 + soc)).epsilon(1e-12));
    CHECK(point.series_Ohm == Approx(0.010 * (1.0 + soc) * factor).epsilon(1e-12));
    CHECK(point.kinetic_Ohm == Approx(0.004 * (1.0 + soc) * factor).epsilon(1e-12));
    CHECK(point.pair_Ohm[2] == Approx(0.003 * (1.0 + soc) * factor).epsilon(1e-12));
  }
}

TEST_CASE("a curve with a knee is followed on both sides of it", "[unit][estimators]") {
  CellDynamics cell = even_cell();
  cell.rows[0].ocv_V[10] = 3.1;  // at 20 %, where it was 3.2 V
  CHECK(at(cell, 0.19, 0.0).ocv_V == Approx(0.5 * (3.18 + 3.1)));
  CHECK(at(cell, 0.19, 0.0).ocv_slope_V == Approx((3.1 - 3.18) * 50.0));
  CHECK(at(cell, 0.21, 0.0).ocv_V == Approx(0.5 * (3.22 + 3.1)));
  CHECK(at(cell, 0.21, 0.0).ocv_slope_V == Approx((3.22 - 3.1) * 50.0));
}

TEST_CASE("a resistance follows Arrhenius' law between the rows and beyond them", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  for (const double temperature_C : {-35.0, -10.0, 0.0, 7.0, 20.0, 25.0, 39.9, 40.0, 60.0}) {
    CAPTURE(temperature_C);
    const double factor = arrhenius(2500.0, temperature_C);
    const CellPoint point = at(cell, 0.5, temperature_C);
    CHECK(point.series_Ohm == Approx(0.015 * factor).epsilon(1e-9));
    CHECK(point.kinetic_Ohm == Approx(0.006 * factor).epsilon(1e-9));
    CHECK(point.pair_Ohm[0] == Approx(0.0015 * factor).epsilon(1e-9));
  }
}

TEST_CASE("beyond the rows the curves stay and the exchange current follows the resistance", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  CHECK(at(cell, 0.5, -30.0).ocv_V == Approx(3.5));
  CHECK(at(cell, 0.5, 70.0).ocv_V == Approx(3.6));
  CHECK(at(cell, 0.5, -30.0).slow_error_V == Approx(0.03));
  CHECK(at(cell, 0.5, 70.0).fast_error_V == Approx(0.02));
  CHECK(at(cell, 0.5, -30.0).exchange_current_A ==
        Approx(2.0 * arrhenius(2500.0, 0.0) / arrhenius(2500.0, -30.0)).epsilon(1e-9));
  CHECK(at(cell, 0.5, 70.0).exchange_current_A ==
        Approx(2.0 * arrhenius(2500.0, 40.0) / arrhenius(2500.0, 70.0)).epsilon(1e-9));
}

TEST_CASE("between the rows a curve moves as Arrhenius' factor does", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  const double cold = arrhenius(2500.0, 0.0);
  const double warm = arrhenius(2500.0, 40.0);
  const double share = (cold - arrhenius(2500.0, 15.0)) / (cold - warm);
  CHECK(share > 0.45);  // more than the 15/40 of a straight line in the temperature
  CHECK(at(cell, 0.5, 15.0).ocv_V == Approx(3.5 + 0.1 * share).epsilon(1e-9));
  CHECK(at(cell, 0.5, 15.0).slow_error_V == Approx(0.03 - 0.02 * share).epsilon(1e-9));
}

TEST_CASE("without an activation the temperature counts by itself", "[unit][estimators]") {
  CellDynamics cell = even_cell();
  // 1e-14 is so small that both rows have the same factor.
  for (const double activation_K : {0.0, 1e-14}) {
    CAPTURE(activation_K);
    cell.activation_K = activation_K;
    CHECK(at(cell, 0.5, 10.0).ocv_V == Approx(3.525).epsilon(1e-9));
    CHECK(at(cell, 0.5, -20.0).series_Ohm == Approx(cell.rows[0].series_Ohm[10]));
  }
}

TEST_CASE("the rows meet: no step of the model where one ends", "[unit][estimators]") {
  CellDynamics cell = even_cell();
  CellDynamics::Row hot = cell.rows[1];
  hot.temperature_C = 55.0;
  for (double& ocv_V : hot.ocv_V) ocv_V += 0.2;
  for (double& series_Ohm : hot.series_Ohm) series_Ohm *= 0.3;
  cell.rows.push_back(hot);
  for (const double edge_C : {0.0, 40.0, 55.0}) {
    CAPTURE(edge_C);
    const CellPoint below = at(cell, 0.37, edge_C - 1e-7);
    const CellPoint above = at(cell, 0.37, edge_C + 1e-7);
    CHECK(below.ocv_V == Approx(above.ocv_V).epsilon(1e-8));
    CHECK(below.series_Ohm == Approx(above.series_Ohm).epsilon(1e-7));
    CHECK(below.exchange_current_A == Approx(above.exchange_current_A).epsilon(1e-8));
  }
  CHECK(at(cell, 0.37, 55.0).ocv_V == Approx(3.67));
}

TEST_CASE("beyond full and empty the curve goes on, and never flatter than 0.8 V", "[unit][estimators]") {
  CellDynamics cell = even_cell();
  CHECK(at(cell, 1.05, 0.0).ocv_V == Approx(4.05));
  CHECK(at(cell, -0.05, 0.0).ocv_V == Approx(2.95));
  CHECK(at(cell, 1.05, 0.0).ocv_slope_V == Approx(1.0));
  cell.rows[0].ocv_V[49] = cell.rows[0].ocv_V[50];  // flat at the end of the curve
  CHECK(at(cell, 1.0, 0.0).ocv_slope_V == Approx(0.0).margin(1e-9));
  CHECK(at(cell, 1.05, 0.0).ocv_slope_V == Approx(0.8));
  CHECK(at(cell, 1.05, 0.0).ocv_V == Approx(4.0 + 0.8 * 0.05));
  CHECK(at(cell, 1.05, 0.0).series_Ohm == at(cell, 1.0, 0.0).series_Ohm);
  CHECK(at(cell, -0.05, 0.0).series_Ohm == at(cell, 0.0, 0.0).series_Ohm);
}

TEST_CASE("the charge transfer is a resistance for a small current and a logarithm for a large one",
          "[unit][estimators]") {
  const CellPoint point{.kinetic_Ohm = 0.01, .exchange_current_A = 2.0};
  CHECK(kinetic_V(point, 0.0) == 0.0);
  CHECK(kinetic_V(point, 0.002) == Approx(0.01 * 0.002).epsilon(1e-6));
  // asinh(x) = ln(2 x) for a large x; each tenfold current adds the same voltage.
  CHECK(kinetic_V(point, 2000.0) == Approx(0.02 * std::log(2000.0)).epsilon(1e-6));
  CHECK(kinetic_V(point, 20'000.0) - kinetic_V(point, 2000.0) == Approx(0.02 * std::log(10.0)).epsilon(1e-6));
  // asinh(3/4) = ln(3/4 + 5/4)
  CHECK(kinetic_V(point, 1.5) == Approx(0.02 * std::log(2.0)).epsilon(1e-12));
  for (const double current_A : {0.01, 1.0, 30.0, 500.0}) {
    CHECK(kinetic_V(point, -current_A) == -kinetic_V(point, current_A));
  }
}

TEST_CASE("a rested voltage tells the charge it belongs to, whichever way it came", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  // After discharging or charging: V = 3 + z + h * 0.01 * (1 + z)
  for (const double hysteresis : {-1.0, 0.0, 0.4, 1.0}) {
    for (const double soc : {0.02, 0.3, 0.77, 0.98}) {
      CAPTURE(hysteresis, soc);
      const double voltage_V = 3.0 + soc + hysteresis * 0.01 * (1.0 + soc);
      CHECK(soc_from_ocv(cell, voltage_V, 0.0, hysteresis) == Approx(soc).margin(1e-12));
    }
  }
  CHECK(soc_from_ocv(cell, 3.6, 40.0, 0.0) == Approx(0.5).margin(1e-12));
}

TEST_CASE("a voltage of no charge at all is that of the nearest end, exactly", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  CHECK(soc_from_ocv(cell, 2.9, 0.0, 0.0) == 0.0);
  CHECK(soc_from_ocv(cell, 0.0, 0.0, 0.0) == 0.0);
  CHECK(soc_from_ocv(cell, 4.1, 0.0, 0.0) == 1.0);
  CHECK(soc_from_ocv(cell, 60.0, 0.0, 0.0) == 1.0);
}

TEST_CASE("the model of a sheet is the same cell in the tables", "[unit][estimators]") {
  const CellModel model = sheet();
  const CellDynamics cell = dynamics_of(model);
  for (const double temperature_C : {-10.0, 10.0, 25.0, 40.0}) {
    const double factor = arrhenius(3200.0, temperature_C);
    for (const double soc : {0.0, 0.1, 0.2, 0.5, 0.8, 0.97, 1.0}) {
      CAPTURE(temperature_C, soc);
      const CellPoint point = at(cell, soc, temperature_C);
      const double expected_V = soc < 0.2   ? 3.0 + 2.5 * soc
                                : soc < 0.8 ? 3.5 + 0.5 * (soc - 0.2)
                                            : 3.8 + 2.0 * (soc - 0.8);
      CHECK(point.ocv_V == Approx(expected_V).epsilon(1e-9));
      CHECK(point.hysteresis_V == Approx(0.012));
      CHECK(point.series_Ohm == Approx(0.002 * factor).epsilon(1e-9));
      CHECK(point.pair_Ohm[0] == Approx(0.001 * factor).epsilon(1e-9));
      CHECK(point.pair_Ohm[1] == Approx(0.003 * factor).epsilon(1e-9));
      CHECK(point.pair_Ohm[2] == 0.0);
      CHECK(kinetic_V(point, 100.0) == 0.0);
    }
  }
  CHECK(cell.capacity_As == Approx(9000.0));
  CHECK(cell.pair_time_constant_s[0] == 30.0);
  CHECK(cell.pair_time_constant_s[1] == 700.0);
  CHECK(cell.hysteresis_charge == Approx(0.04));
  CHECK(cell.self_discharge_per_month == Approx(0.02));
  CHECK(cell.charge_efficiency == 1.0);
  // The model error increases with falling temperature.
  CHECK(at(cell, 0.5, -15.0).slow_error_V > at(cell, 0.5, 25.0).slow_error_V);
}

TEST_CASE("a cell loses twice as much by itself every ten degrees", "[unit][estimators]") {
  CellDynamics cell = even_cell();
  cell.self_discharge_per_month = 0.03;
  const double month_s = 30.0 * 86'400.0;
  CHECK(self_discharge_A(cell, 25.0) * month_s == Approx(0.03 * 3600.0));
  CHECK(self_discharge_A(cell, 45.0) * month_s == Approx(0.12 * 3600.0));
  CHECK(self_discharge_A(cell, 5.0) * month_s == Approx(0.0075 * 3600.0));
}

TEST_CASE("an absurd temperature makes no absurd loss, and none where there is none", "[unit][estimators]") {
  CellDynamics cell = even_cell();
  for (const double temperature_C : {-1e300, -273.15, 1e4, 1e300, std::numeric_limits<double>::max()}) {
    CAPTURE(temperature_C);
    cell.self_discharge_per_month = 0.0;
    CHECK(self_discharge_A(cell, temperature_C) == 0.0);
    cell.self_discharge_per_month = 0.03;
    CHECK(self_discharge_A(cell, temperature_C) >= 0.0);
    CHECK(self_discharge_A(cell, temperature_C) < cell.capacity_As / 3600.0);  // not empty within an hour
  }
}

TEST_CASE("an absurd temperature makes no absurd cell", "[unit][estimators]") {
  const CellDynamics cell = even_cell();
  for (const double temperature_C : {-1e300, -273.15, 1e4, 1e300}) {
    CAPTURE(temperature_C);
    const CellPoint point = at(cell, 0.5, temperature_C);
    CHECK(std::isfinite(point.ocv_V));
    CHECK((point.series_Ohm > 0.0 && point.series_Ohm < 1.0));
    CHECK((point.exchange_current_A > 0.0 && std::isfinite(point.exchange_current_A)));
  }
}
