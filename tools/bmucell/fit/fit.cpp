#include "tools/bmucell/fit/fit.hpp"

#include <algorithm>
#include <cmath>

#include "tools/bmucell/fit/fit_unknowns.hpp"
#include "tools/bmucell/fit/fit_wishes.hpp"
#include "tools/bmucell/fit/model_error.hpp"
#include "tools/bmucell/fit/normal_equations.hpp"
#include "tools/bmucell/fit/slow_curve.hpp"
#include "tools/bmucell/fit/voltage_terms.hpp"

namespace bmu::cell {

namespace {

constexpr int pin_turns_max = 12;
constexpr double pin_sigma = 1e-5;
/// Minimum rise between neighbouring points of a curve; without it the voltage would not determine the charge.
constexpr double curve_rise_min_V = 0.0002;
/// Minimum of the cell file: no cell has zero resistance.
constexpr double series_min_Ohm = 1e-5;

CellDynamics frame_of(const FitPlan& plan) {
  CellDynamics frame{.pair_time_constant_s = plan.pair_time_constant_s,
                     .activation_K = plan.activation_K,
                     .hysteresis_charge = plan.hysteresis_charge,
                     .charge_efficiency = plan.charge_efficiency,
                     .capacity_As = plan.capacity_Ah * 3600.0};
  for (const double temperature_C : plan.temperatures_C) {
    const double factor = resistance_factor(plan.exchange_activation_K, temperature_C);
    frame.rows.push_back(
        {.temperature_C = temperature_C, .exchange_current_A = plan.exchange_current_C * plan.capacity_Ah / factor});
  }
  return frame;
}

/// Pins every negative value to 0 and every fall of a curve to the minimum rise; true if any was not pinned yet.
bool pin_what_cannot_be(NormalEquations& equations, std::vector<bool>& pinned, const Eigen::VectorXd& x,
                        std::size_t rows) {
  bool has_new = false;
  const auto value = [&x](std::size_t at) { return x[static_cast<Eigen::Index>(at)]; };
  const auto pin = [&](std::size_t at, const std::vector<Term>& terms, double wanted) {
    if (pinned[at]) return;
    pinned[at] = true;
    has_new = true;
    equations.add(terms, wanted, pin_sigma);
  };
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t point = 1; point < Unknowns::curve_points; ++point) {
      const std::size_t here = Unknowns::curve(row, point);
      if (value(here) - value(here - 1) < curve_rise_min_V)
        pin(here, {{here, 1.0}, {here - 1, -1.0}}, curve_rise_min_V);
    }
    for (std::size_t table = 0; table < Unknowns::tables; ++table) {
      for (std::size_t point = 0; point < Unknowns::table_points; ++point) {
        const std::size_t here = Unknowns::table(row, table, point);
        if (value(here) < 0.0) pin(here, {{here, 1.0}}, 0.0);
      }
    }
  }
  return has_new;
}

class Fitter {
 public:
  Fitter(const FitPlan& plan, const FitWishes& wishes, const std::vector<FitSeries>& data)
      : wishes_(wishes), data_(data), cell_(frame_of(plan)), terms_(cell_, wishes.typical_Ohm) {
    for (const FitSeries& one : data) {
      std::vector<double>& charge = charge_.emplace_back();
      for (const SeriesRow& row : one.series.rows) charge.push_back(row.soc);
    }
  }

  Fit run() {
    const bool has_others = std::any_of(data_.begin(), data_.end(), [](const auto& one) { return !one.is_slow_curve; });
    const bool has_slow = std::any_of(data_.begin(), data_.end(), [](const auto& one) { return one.is_slow_curve; });
    if (has_others && has_slow) {
      solve(false);
      lay_slow_curves();
    }
    Fit result{.misfit = solve(true)};
    judge(result);
    result.cell = cell_;
    return result;
  }

 private:
  [[nodiscard]] double sigma_V(const FitSeries& one, double passed_s) const {
    const double alike = std::max(1.0, wishes_.same_story_s / std::max(passed_s, 0.1));
    return (one.is_slow_curve ? wishes_.slow_curve_V : wishes_.voltage_V) * std::sqrt(alike);
  }

  double solve(bool with_slow_curves) {
    NormalEquations equations(Unknowns::count(cell_.rows.size()));
    add_wishes(equations, wishes_, cell_.rows.size());
    for (std::size_t k = 0; k < data_.size(); ++k) {
      if (data_[k].is_slow_curve && !with_slow_curves) continue;
      terms_.walk(data_[k].series, charge_[k],
                  [&](const SeriesRow& row, double passed_s, const std::vector<Term>& voltage) {
                    equations.add(voltage, row.voltage_V, sigma_V(data_[k], passed_s));
                  });
    }
    std::vector<bool> pinned(Unknowns::count(cell_.rows.size()), false);
    solution_ = equations.solve();
    for (int turn = 0; turn < pin_turns_max && pin_what_cannot_be(equations, pinned, solution_, cell_.rows.size());
         ++turn) {
      solution_ = equations.solve();
    }
    store();
    return equations.misfit(solution_);
  }

  void store() {
    const auto value = [this](std::size_t at) { return solution_[static_cast<Eigen::Index>(at)]; };
    for (std::size_t row = 0; row < cell_.rows.size(); ++row) {
      CellDynamics::Row& tables = cell_.rows[row];
      const double unit_Ohm = terms_.unit_Ohm(row);
      for (std::size_t k = 0; k < Unknowns::curve_points; ++k) tables.ocv_V[k] = value(Unknowns::curve(row, k));
      for (std::size_t k = 0; k < Unknowns::table_points; ++k) {
        tables.hysteresis_V[k] = std::max(value(Unknowns::table(row, Table::hysteresis, k)), 0.0);
        tables.series_Ohm[k] = std::max(value(Unknowns::table(row, Table::series, k)) * unit_Ohm, series_min_Ohm);
        tables.kinetic_Ohm[k] = std::max(value(Unknowns::table(row, Table::kinetic, k)), 0.0) * unit_Ohm;
        for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
          tables.pair_Ohm[pair][k] = std::max(value(Unknowns::pair(row, pair, k)), 0.0) * unit_Ohm;
        }
      }
    }
  }

  void lay_slow_curves() {
    for (std::size_t k = 0; k < data_.size(); ++k) {
      if (!data_[k].is_slow_curve) continue;
      const ChargeAxes axes = lay_onto(cell_, data_[k].series);
      const std::vector<std::size_t> halves = halves_of(data_[k].series, cell_.capacity_As / 3600.0);
      for (std::size_t row = 0; row < halves.size(); ++row) charge_[k][row] = axes[halves[row]].of(charge_[k][row]);
    }
  }

  void judge(Fit& result) {
    ModelError error(cell_);
    for (std::size_t k = 0; k < data_.size(); ++k) {
      FitQuality quality{.name = data_[k].series.name, .is_slow_curve = data_[k].is_slow_curve};
      std::vector<double> off_V;
      std::vector<double> temperatures_C;
      double squares = 0.0;
      terms_.walk(data_[k].series, charge_[k], [&](const SeriesRow& row, double, const std::vector<Term>& voltage) {
        double off = row.voltage_V;
        for (const Term& term : voltage) off -= term.factor * solution_[static_cast<Eigen::Index>(term.at)];
        squares += off * off;
        quality.worst_V = std::max(quality.worst_V, std::abs(off));
        off_V.push_back(off);
        temperatures_C.push_back(row.temperature_C);
      });
      quality.rows = off_V.size();
      quality.rmse_V = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(quality.rows, 1)));
      result.quality.push_back(quality);
      if (!data_[k].is_slow_curve) error.add(off_V, temperatures_C);
    }
    error.write_to(cell_);
  }

  const FitWishes& wishes_;
  const std::vector<FitSeries>& data_;
  CellDynamics cell_;
  VoltageTerms terms_;
  std::vector<std::vector<double>> charge_;  // by series and row
  Eigen::VectorXd solution_;
};

}  // namespace

Fit fit(const FitPlan& plan, const FitWishes& wishes, const std::vector<FitSeries>& data) {
  return Fitter(plan, wishes, data).run();
}

}  // namespace bmu::cell
