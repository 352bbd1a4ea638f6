#include "mmu/devices/thermistor.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace bmu {

namespace {

constexpr double celsius_zero_K = 273.15;
constexpr double nominal_Ohm = 10e3;

constexpr double table_step_C = 5.0;
constexpr std::array<double, 26> table_Ohm{26444, 21493, 17586, 14481, 11998, 10000, 8355, 7004, 5891,
                                           4972,  4211,  3579,  3053,  2613,  2244,  1934, 1672, 1451,
                                           1263,  1103,  966,   849,   748,   661,   586,  521};
constexpr double table_last_C = table_step_C * (table_Ohm.size() - 1);

constexpr bool table_falls() {
  for (std::size_t row = 1; row < table_Ohm.size(); ++row) {
    if (table_Ohm[row] >= table_Ohm[row - 1]) return false;
  }
  return true;
}
static_assert(table_falls(), "a colder thermistor has more resistance");
static_assert(table_Ohm[5] == nominal_Ohm, "25 C");

// --- Steinhart-Hart -------------------------------------------------------------------------------------------------

constexpr double coefficient_a = 3.3538111236e-3;
constexpr double coefficient_b = 2.998583413e-4;
constexpr double coefficient_c = 4.477412345e-6;
constexpr double coefficient_d = 4.105990548e-8;

double formula_C(double resistance_Ohm) {
  const double log = std::log(resistance_Ohm / nominal_Ohm);
  return 1.0 / (coefficient_a + log * (coefficient_b + log * (coefficient_c + log * coefficient_d))) - celsius_zero_K;
}

/// Newton's method from the linear solution: the cubic is nearly linear, four steps leave less than a micro-ohm in a
/// kilo-ohm.
double formula_Ohm(double temperature_C) {
  const double wanted = 1.0 / (temperature_C + celsius_zero_K) - coefficient_a;
  double log = wanted / coefficient_b;
  for (int step = 0; step < 4; ++step) {
    const double value = log * (coefficient_b + log * (coefficient_c + log * coefficient_d));
    const double slope = coefficient_b + log * (2.0 * coefficient_c + log * 3.0 * coefficient_d);
    log -= (value - wanted) / slope;
  }
  return nominal_Ohm * std::exp(log);
}

// --- the table ------------------------------------------------------------------------------------------------------

double table_C(double resistance_Ohm) {
  if (resistance_Ohm > table_Ohm.front()) return formula_C(resistance_Ohm) - formula_C(table_Ohm.front());
  if (resistance_Ohm < table_Ohm.back()) {
    return formula_C(resistance_Ohm) - formula_C(table_Ohm.back()) + table_last_C;
  }
  std::size_t row = 1;
  while (resistance_Ohm < table_Ohm[row]) ++row;
  const double share = (table_Ohm[row - 1] - resistance_Ohm) / (table_Ohm[row - 1] - table_Ohm[row]);
  return table_step_C * (static_cast<double>(row - 1) + share);
}

double table_resistance_Ohm(double temperature_C) {
  if (temperature_C < 0.0) return formula_Ohm(temperature_C + formula_C(table_Ohm.front()));
  if (temperature_C >= table_last_C) return formula_Ohm(temperature_C - table_last_C + formula_C(table_Ohm.back()));
  const auto row = static_cast<std::size_t>(temperature_C / table_step_C);
  const double share = temperature_C / table_step_C - static_cast<double>(row);
  return table_Ohm[row] + share * (table_Ohm[row + 1] - table_Ohm[row]);
}

}  // namespace

double thermistor_Ohm(ThermistorCurve curve, double temperature_C) {
  return curve == ThermistorCurve::table ? table_resistance_Ohm(temperature_C) : formula_Ohm(temperature_C);
}

double thermistor_C(ThermistorCurve curve, double resistance_Ohm) {
  return curve == ThermistorCurve::table ? table_C(resistance_Ohm) : formula_C(resistance_Ohm);
}

SignalValue temperature_dC(ThermistorCurve curve, std::uint16_t input_raw, std::uint16_t reference_raw) {
  if (reference_raw == 0) return not_known();
  const double share = static_cast<double>(input_raw) / reference_raw;
  if (share >= divider_share(thermistor_open_above_Ohm)) return not_known(Validity::open_circuit);
  if (share <= divider_share(thermistor_short_below_Ohm)) return not_known(Validity::short_circuit);
  const double resistance_Ohm = divider_resistance_Ohm * share / (1.0 - share);
  return known(std::lround(thermistor_C(curve, resistance_Ohm) * 10.0));
}

}  // namespace bmu
