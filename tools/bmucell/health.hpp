// How well a cell's capacity is estimated from its charges (ChargePlateau, CapacityEstimate), by charges with a
// capacity test behind them: the charges go through the estimators sample by sample, as the daemon would feed them, and
// what they say before the test is compared with what it found. And the model that this needs, fitted to another cell.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/estimation/health/capacity_estimate.hpp"
#include "daemon/core/estimation/health/charge_plateau.hpp"
#include "protocol/result.hpp"
#include "tools/bmucell/data/ageing_data.hpp"

namespace bmu::cell {

struct PlateauFit {
  ChargePlateauModel model;
  std::size_t charges = 0;  // that it was fitted to
  double rmse_As = 0.0;     // of these
};

/// Fits the two weights and sigma of `model`, least squares, to all charges with a test of their own up to
/// `until_cycle`. The charge above the plateau is expected to count as what it is: above_weight is held near 1 by what
/// `above_weight_sigma` allows, or else a few charges of one age could not tell one weight from the other. The error
/// says what is missing.
inline constexpr double above_weight_sigma = 0.1;
/// Told sigma, of `rated_As`: at least this. A fit to a few charges of one age misses what differs later.
inline constexpr double sigma_share_min = 0.015;
[[nodiscard]] Result<PlateauFit, std::string> fit_plateau(const AgeingData& data, const ChargePlateauModel& model,
                                                          double rated_As, double until_cycle);

struct HealthPlan {
  ChargePlateauModel model;
  double rated_As = 0.0;
  double loss_share_per_cycle = 0.01;  // see CapacityPrior
  PluggedIn when;
  bool scores_all_tests = false;  // also those without a charge of their own: the charge before was another one
};

/// A capacity test, and what was estimated before it.
struct HealthRow {
  double cycle = 0.0;
  double true_As = 0.0;
  std::optional<double> single_As{};  // from the charge before it, if that showed it
  double single_sigma_As = 0.0;
  std::optional<double> told_As{};  // from all charges so far, if one did
  double told_sigma_As = 0.0;
};

/// In percent of the rated capacity.
struct HealthScore {
  std::size_t tests = 0;  // that were scored
  double rmse_pct = 0.0;
  double max_pct = 0.0;
  double inside_uncertainty_pct = 0.0;  // truth within two of the told standard deviations
};

struct HealthResult {
  std::string file;
  std::vector<HealthRow> rows{};
  HealthScore single;
  HealthScore told;
};

[[nodiscard]] HealthResult score_health(const HealthPlan& plan, const AgeingData& data);

}  // namespace bmu::cell
