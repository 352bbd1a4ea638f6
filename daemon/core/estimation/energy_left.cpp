#include "daemon/core/estimation/energy_left.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr double s_per_h = 3600.0;
constexpr double uV_per_V = 1e6;
constexpr double mWh_per_Wh = 1e3;

/// Deviation from the nominal input, for the integrals of the uncertainty.
struct Variation {
  double soc = 0.0;             // added to that of all cells
  double emptiest_share = 0.0;  // added to that of the emptiest cell
};

struct Integral {
  double charge_As = 0.0;
  double energy_Wh = 0.0;
};

class Discharge {
 public:
  Discharge(const CellDynamics::Row& row, const EnergyLeftInput& input)
      : row_(row),
        input_(input),
        load_A_(std::max(input.load_A, 0.0)),
        kinetic_A_(kinetic_A(row.exchange_current_A, load_A_)) {}

  [[nodiscard]] Integral integral(const Variation& variation) const {
    const double mean = std::clamp(input_.soc_mean + variation.soc, 0.0, 1.0);
    const double emptiest = std::clamp(input_.emptiest.soc + variation.soc, 0.0, 1.0);
    const double share = input_.emptiest_share + variation.emptiest_share;
    const double step_As = emptiest * input_.emptiest_capacity_As / energy_steps;
    Integral sum;
    double before_V = loaded_V(emptiest, share);
    for (int step = 0; step < energy_steps && before_V > input_.voltage_min_V; ++step) {
      const double after_As = step_As * (step + 1);
      const double after_V = loaded_V(emptiest - after_As / input_.emptiest_capacity_As, share);
      // The step that reaches the voltage at which the pack opens counts up to there.
      const double part =
          after_V >= input_.voltage_min_V ? 1.0 : (before_V - input_.voltage_min_V) / (before_V - after_V);
      const double middle_As = sum.charge_As + part * step_As / 2.0;
      const double cell_V = loaded_V(mean - middle_As / input_.capacity_mean_As, input_.resistance_share_mean);
      sum.charge_As += part * step_As;
      sum.energy_Wh += part * step_As * cell_V * static_cast<double>(input_.cell_count) / s_per_h;
      before_V = after_V;
    }
    return sum;
  }

  [[nodiscard]] double load_A() const { return load_A_; }

 private:
  /// Voltage of a cell that has carried the load for long.
  [[nodiscard]] double loaded_V(double soc, double resistance_share) const {
    const CellPoint point = at(row_, std::clamp(soc, 0.0, 1.0));
    const double resistance_Ohm = point.series_Ohm + point.pair_Ohm[0] + point.pair_Ohm[1] + point.pair_Ohm[2];
    const double drop_V = load_A_ * resistance_Ohm + kinetic_A_ * point.kinetic_Ohm;
    return point.ocv_V - point.hysteresis_V - (1.0 + resistance_share) * drop_V;
  }

  const CellDynamics::Row& row_;
  const EnergyLeftInput& input_;
  double load_A_;
  double kinetic_A_;
};

bool is_usable(const CellDynamics& cell, const EnergyLeftInput& input) {
  return !cell.rows.empty() && input.cell_count > 0 && input.emptiest.is_known && is_measured(input.temperature_C) &&
         input.capacity_mean_As > 0.0 && input.emptiest_capacity_As > 0.0;
}

double measured_or_none(double value) {
  return is_measured(value) ? value : 0.0;
}

}  // namespace

EnergyLeft energy_left(const CellDynamics& cell, const EnergyLeftInput& input) {
  if (!is_usable(cell, input)) return {};
  const CellDynamics::Row row = row_at(cell, input.temperature_C);
  const Discharge discharge(row, input);
  const Integral nominal = discharge.integral({});
  const double more_Wh = discharge.integral({.soc = input.emptiest.sigma}).energy_Wh;
  const double less_Wh = discharge.integral({.soc = -input.emptiest.sigma}).energy_Wh;
  const double worse_Wh = discharge.integral({.emptiest_share = input.emptiest_share_sigma}).energy_Wh;
  const double by_soc_Wh = (more_Wh - less_Wh) / 2.0;
  const double by_model_Wh = nominal.charge_As * static_cast<double>(input.cell_count) * row.slow_error_V / s_per_h;
  const double by_resistance_Wh = nominal.energy_Wh - worse_Wh;
  return {
      .is_known = true,
      .energy_Wh = std::max(nominal.energy_Wh, 0.0),
      .sigma_Wh = std::sqrt(by_soc_Wh * by_soc_Wh + by_model_Wh * by_model_Wh + by_resistance_Wh * by_resistance_Wh),
      .load_A = discharge.load_A()};
}

EnergyLeftInput energy_left_input(const PackEstimate& estimate, const CoreConfig& config) {
  const PackSoc& pack = estimate.pack();
  if (!pack.is_known) return {};
  EnergyLeftInput input{.cell_count = estimate.size(),
                        .emptiest = estimate.cell_soc(pack.emptiest),
                        .emptiest_capacity_As = estimate.cell_health(pack.emptiest).capacity_As(),
                        .load_A = estimate.load_A(),
                        .voltage_min_V = config.limits.cell_undervoltage.open / uV_per_V};
  const auto count = static_cast<double>(input.cell_count);
  double coldest_C = not_measured;
  bool are_all_measured = true;
  for (std::size_t number = 0; number < input.cell_count; ++number) {
    const CellForecastInput cell = estimate.forecast_input(number);
    input.soc_mean += cell.soc.soc / count;
    input.capacity_mean_As += estimate.cell_health(number).capacity_As() / count;
    input.resistance_share_mean += measured_or_none(cell.resistance_share) / count;
    are_all_measured = are_all_measured && is_measured(cell.temperature_C);
    coldest_C = number == 0 ? cell.temperature_C : std::min(coldest_C, cell.temperature_C);
    if (number != pack.emptiest) continue;
    input.emptiest_share = measured_or_none(cell.resistance_share);
    input.emptiest_share_sigma = measured_or_none(cell.resistance_sigma);
  }
  if (are_all_measured) input.temperature_C = coldest_C;
  return input;
}

EnergyLeft energy_left(const PackEstimate& estimate, const CoreConfig& config) {
  return energy_left(estimate.model(), energy_left_input(estimate, config));
}

std::int64_t in_mWh(double energy_Wh) {
  return std::llround(energy_Wh * mWh_per_Wh);
}

}  // namespace bmu
