#include "daemon/core/balancing/balancing_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "protocol/assert.hpp"
#include "protocol/row_order.hpp"

namespace bmu {

std::string_view to_text(PlanVerdict verdict) {
  switch (verdict) {
    case PlanVerdict::none: return "no plan yet";
    case PlanVerdict::planned: return "cells above the dead band";
    case PlanVerdict::balanced: return "all cells within the dead band";
    case PlanVerdict::below_top: return "no cell near the top of charge";
    case PlanVerdict::resistance_unknown: return "cell resistance unknown, required at this current";
    case PlanVerdict::charge_unknown: return "cell charge unknown; requires a rest near empty or full";
  }
  return "?";
}

std::int32_t left_by_voltage_uV(const CoreConfig& config) {
  constexpr double ends = 2.0;
  return config.balancing.dead_band_uV + static_cast<std::int32_t>(std::lround(ends * config.cell.hysteresis_V * 1e6));
}

namespace {

using Remove = std::span<std::int64_t>;

/// Tolerance of one voltage: two cells may be at the two ends of their hysteresis, and share the dead band.
double voltage_tolerance_uV(const CoreConfig& config) {
  return config.balancing.dead_band_uV / 2.0 + config.cell.hysteresis_V * 1e6;
}

PlanVerdict verdict_of(Remove remove_uAs) {
  const bool has_any = std::any_of(remove_uAs.begin(), remove_uAs.end(), [](std::int64_t one) { return one > 0; });
  return has_any ? PlanVerdict::planned : PlanVerdict::balanced;
}

/// Charge per microvolt where the curve is steepest, from this voltage on: the minimum charge of a voltage difference.
double least_uAs_per_uV(const CellModel& cell, std::int32_t from_uV) {
  double steepest_uV_per_permille = 0.0;
  for (std::size_t next = 1; next < cell.ocv.size(); ++next) {
    const OcvPoint& low = cell.ocv[next - 1];
    const OcvPoint& high = cell.ocv[next];
    if (high.ocv_uV <= from_uV && next + 1 < cell.ocv.size()) continue;
    const double slope = (high.ocv_uV - low.ocv_uV) / static_cast<double>(high.soc_permille - low.soc_permille);
    steepest_uV_per_permille = std::max(steepest_uV_per_permille, slope);
  }
  return static_cast<double>(cell.capacity_uAs) / 1'000.0 / steepest_uV_per_permille;
}

PlanVerdict plan_by_terminal_voltage(const BalancingView& view, const CoreConfig& config, Remove remove_uAs) {
  const auto by_voltage = [](const BalancingCell& one, const BalancingCell& other) {
    return one.voltage_uV < other.voltage_uV;
  };
  const auto [lowest, highest] = std::minmax_element(view.cells.begin(), view.cells.end(), by_voltage);
  if (highest->voltage_uV < config.balancing.top_uV) return PlanVerdict::below_top;
  const double least = least_uAs_per_uV(config.cell, std::min(config.balancing.top_uV, lowest->voltage_uV));
  const double floor_uV = lowest->voltage_uV + 2.0 * voltage_tolerance_uV(config);
  for (std::size_t cell = 0; cell < view.cells.size(); ++cell) {
    const double above_uV = std::max(view.cells[cell].voltage_uV - floor_uV, 0.0);
    remove_uAs[cell] = static_cast<std::int64_t>(above_uV * least);
  }
  return verdict_of(remove_uAs);
}

double factor_at(const CellModel& cell, std::int32_t temperature_dC) {
  constexpr double tenths = 10.0;
  return resistance_factor(cell.resistance_activation_K, temperature_dC / tenths);
}

bool knows_all_resistances(const BalancingView& view) {
  return std::all_of(view.cells.begin(), view.cells.end(),
                     [](const BalancingCell& one) { return one.resistance_uOhm > 0; });
}

double drop_at_once_uV(const CellModel& cell, std::int32_t current_mA) {
  return std::abs(current_mA) * cell.series_resistance_Ohm * 1e3;
}

/// At least the polarisation that the present current causes, if it continues.
double late_uV(const BalancingView& view, const CellModel& cell) {
  const double late_Ohm = cell.rc_resistance_Ohm + cell.slow_rc_resistance_Ohm;
  return std::max(view.late_uV, std::abs(view.current_mA) * late_Ohm * 1e3);
}

/// With a current too large for the dead band each cell must have a measured resistance of its own.
bool knows_enough_resistance(const BalancingView& view, const CoreConfig& config) {
  const double drop_uV = drop_at_once_uV(config.cell, view.current_mA) + late_uV(view, config.cell);
  return drop_uV * factor_at(config.cell, view.coldest_dC) <= config.balancing.dead_band_uV ||
         knows_all_resistances(view);
}

double ocv_uV(const BalancingCell& cell, std::int32_t current_mA) {
  return cell.voltage_uV + static_cast<double>(cell.resistance_uOhm) * current_mA * 1e-3;
}

/// Possible difference of two cells that their resistances, as measured, do not show.
class Unseen {
 public:
  Unseen(const BalancingView& view, const CellModel& cell)
      : is_asked_for_(knows_all_resistances(view) && cell.series_resistance_Ohm > 0.0),
        series_resistance_Ohm_(cell.series_resistance_Ohm),
        late_uV_(late_uV(view, cell)),
        whole_uV_(late_uV_ + drop_at_once_uV(cell, view.current_mA)),
        by_temperature_(factor_at(cell, view.coldest_dC) / factor_at(cell, view.warmest_dC) - 1.0) {}

  /// Without resistances the whole drop is within the dead band.
  [[nodiscard]] double between_uV(const BalancingCell& one, const BalancingCell& other) const {
    if (!is_asked_for_) return 0.0;
    const double one_factor = factor(one);
    const double other_factor = factor(other);
    return late_share * std::abs(one_factor - other_factor) * late_uV_ +
           by_temperature_ * std::max(one_factor, other_factor) * whole_uV_;
  }

 private:
  [[nodiscard]] double factor(const BalancingCell& cell) const {
    return cell.resistance_uOhm * 1e-6 / series_resistance_Ohm_;
  }

  bool is_asked_for_;
  double series_resistance_Ohm_;
  double late_uV_;
  double whole_uV_;
  double by_temperature_;
};

/// Above the end of the curve its last slope continues: two cells that are charged past it are not equally full.
double charge_beyond_uAs(const CellModel& cell, double voltage_uV) {
  const std::int32_t end_uV = cell.ocv[cell.ocv.size() - 1].ocv_uV;
  const double above_uV = std::max(voltage_uV - end_uV, 0.0);
  return charge_at_uAs(cell, voltage_uV) + above_uV * least_uAs_per_uV(cell, end_uV);
}

PlanVerdict plan_by_ocv(const BalancingView& view, const CoreConfig& config, Remove remove_uAs) {
  if (!knows_enough_resistance(view, config)) return PlanVerdict::resistance_unknown;
  const auto by_ocv = [&view](const BalancingCell& one, const BalancingCell& other) {
    return ocv_uV(one, view.current_mA) < ocv_uV(other, view.current_mA);
  };
  const BalancingCell& lowest = *std::min_element(view.cells.begin(), view.cells.end(), by_ocv);
  const Unseen unseen(view, config.cell);
  // Where the curve bends, a tolerance at one end does not replace that at the other: the lowest may hold as much as
  // this.
  const double tolerance_uV = voltage_tolerance_uV(config);
  const double lowest_uAs = charge_beyond_uAs(config.cell, ocv_uV(lowest, view.current_mA) + tolerance_uV);
  for (std::size_t cell = 0; cell < view.cells.size(); ++cell) {
    const BalancingCell& one = view.cells[cell];
    const double sure_uV = ocv_uV(one, view.current_mA) - unseen.between_uV(one, lowest) - tolerance_uV;
    const double above_uAs = charge_beyond_uAs(config.cell, sure_uV) - lowest_uAs;
    remove_uAs[cell] = static_cast<std::int64_t>(std::max(above_uAs, 0.0));
  }
  return verdict_of(remove_uAs);
}

/// The target is that of the cell with the largest certain lack of charge: all others wait for it.
PlanVerdict plan_by_charge(const BalancingView& view, const CoreConfig& config, Remove remove_uAs) {
  const bool knows_all =
      std::all_of(view.cells.begin(), view.cells.end(), [](const BalancingCell& one) { return one.charge.is_known; });
  if (!knows_all) return PlanVerdict::charge_unknown;
  const auto surely_missing_uAs = [](const BalancingCell& one) {
    return one.charge.missing_uAs - one.charge.uncertainty_uAs;
  };
  std::int64_t target_uAs = surely_missing_uAs(view.cells[0]);
  for (const BalancingCell& cell : view.cells) target_uAs = std::max(target_uAs, surely_missing_uAs(cell));
  for (std::size_t cell = 0; cell < view.cells.size(); ++cell) {
    const CellCharge& charge = view.cells[cell].charge;
    const std::int64_t dead_band_uAs = charge.capacity_uAs / 1'000 * config.balancing.dead_band_permille;
    const std::int64_t at_most_missing_uAs = charge.missing_uAs + charge.uncertainty_uAs;
    remove_uAs[cell] = std::max<std::int64_t>(target_uAs - at_most_missing_uAs - dead_band_uAs, 0);
  }
  return verdict_of(remove_uAs);
}

struct PlannerRow {
  BalancingMethod method;
  PlanVerdict (*plan)(const BalancingView&, const CoreConfig&, Remove);
};
constexpr std::array planners{
    PlannerRow{BalancingMethod::terminal_voltage, plan_by_terminal_voltage},
    PlannerRow{BalancingMethod::ocv, plan_by_ocv},
    PlannerRow{BalancingMethod::charge, plan_by_charge},
};
static_assert(rows_are_in_order(planners, &PlannerRow::method));

}  // namespace

PlanVerdict plan_balancing(const BalancingView& view, const CoreConfig& config, std::span<std::int64_t> remove_uAs) {
  BMU_ASSERT(!view.cells.empty() && remove_uAs.size() == view.cells.size());
  std::fill(remove_uAs.begin(), remove_uAs.end(), 0);
  return planners[static_cast<std::size_t>(config.balancing.method)].plan(view, config, remove_uAs);
}

std::uint8_t balancing_minutes(std::int64_t remove_uAs, std::int32_t voltage_uV, const BalancingConfig& config) {
  constexpr std::int64_t seconds_per_minute = 60;
  const std::int64_t a_minute_uAs = bleed_uA(voltage_uV, config) * seconds_per_minute;
  if (a_minute_uAs <= 0) return 0;
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(remove_uAs / a_minute_uAs, 0, balancing_minutes_max));
}

}  // namespace bmu
