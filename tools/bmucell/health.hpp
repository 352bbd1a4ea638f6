// Scores the estimation of a cell's capacity from its charges (ChargePlateau, CapacityEstimate), using charges that are
// followed by a capacity test: the charges pass through the estimators sample by sample, as the daemon would feed them,
// and their estimate before the test is compared with its result. Also fits the required model to another cell.
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
  std::size_t charges = 0;  // number of charges of the fit
  double rmse_As = 0.0;     // over these charges
};

/// Fits the two weights and sigma of `model`, least squares, to all charges with a test of their own up to
/// `until_cycle`. The charge above the plateau is expected to count in full: above_weight is held near 1 within
/// `above_weight_sigma`, because a few charges of one age could not separate the two weights. The error names the
/// missing data.
inline constexpr double above_weight_sigma = 0.1;
/// Minimum reported sigma, as a share of `rated_As`. A fit to a few charges of one age misses later differences.
inline constexpr double sigma_share_min = 0.015;
[[nodiscard]] Result<PlateauFit, std::string> fit_plateau(const AgeingData& data, const ChargePlateauModel& model,
                                                          double rated_As, double until_cycle);

struct HealthPlan {
  ChargePlateauModel model;
  double rated_As = 0.0;
  double loss_share_per_cycle = 0.01;  // see CapacityPrior
  PluggedIn when;
  bool scores_all_tests = false;  // including those without their own charge, which reuse that of another test
};

/// A capacity test, and the estimates before it.
struct HealthRow {
  double cycle = 0.0;
  double true_As = 0.0;
  std::optional<double> single_As{};  // from the charge before it, if that charge was usable
  double single_sigma_As = 0.0;
  std::optional<double> told_As{};  // from all charges so far, if at least one was usable
  double told_sigma_As = 0.0;
};

/// In percent of the rated capacity.
struct HealthScore {
  std::size_t tests = 0;  // number of scored tests
  double rmse_pct = 0.0;
  double max_pct = 0.0;
  double inside_uncertainty_pct = 0.0;  // true capacity within two of the estimated standard deviations
};

struct HealthResult {
  std::string file;
  std::vector<HealthRow> rows{};
  HealthScore single;
  HealthScore told;
};

[[nodiscard]] HealthResult score_health(const HealthPlan& plan, const AgeingData& data);

}  // namespace bmu::cell
