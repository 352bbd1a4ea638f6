#include "tools/bmucell/health.hpp"

#include <algorithm>
#include <cmath>

#include "tools/bmucell/data/score_terms.hpp"

namespace bmu::cell {

namespace {

/// Counting error of a bench; CapacityPrior::common_share adds that of a vehicle's sensor.
constexpr CurrentSensorError bench_sensor{.gain = 0.0, .offset_A = 0.0, .unknown_current_A = 0.0};
constexpr std::size_t charges_min = 8;

std::optional<PlateauCharge> shown_by(const ChargePlateauModel& model, const Charge& charge) {
  ChargePlateau plateau;
  plateau.begin(model);
  std::optional<PlateauCharge> shown;
  for (const CellSample& sample : charge.samples) {
    const std::optional<PlateauCharge> now = plateau.take(sample);
    if (now) shown = now;
  }
  return shown;
}

struct KnownCharge {
  PlateauCharge shown;
  double capacity_As = 0.0;
};

std::vector<KnownCharge> known_charges(const AgeingData& data, const ChargePlateauModel& model, double until_cycle) {
  std::vector<KnownCharge> known;
  for (const CapacityTest& test : data.tests) {
    if (!test.has_own_charge || test.cycle > until_cycle) continue;
    const std::optional<PlateauCharge> shown = shown_by(model, data.charge_before(test));
    if (shown) known.push_back({*shown, test.capacity_As});
  }
  return known;
}

/// Least squares of two unknowns, by Cramer's rule.
void solve(const std::vector<KnownCharge>& known, double error_As, ChargePlateauModel& model) {
  const double held = error_As / above_weight_sigma * (error_As / above_weight_sigma);
  double pp = 0.0;
  double pa = 0.0;
  double aa = held;
  double pc = 0.0;
  double ac = held;
  for (const auto& [shown, capacity_As] : known) {
    pp += shown.plateau_As * shown.plateau_As;
    pa += shown.plateau_As * shown.above_As;
    aa += shown.above_As * shown.above_As;
    pc += shown.plateau_As * capacity_As;
    ac += shown.above_As * capacity_As;
  }
  const double determinant = pp * aa - pa * pa;
  model.plateau_weight = (pc * aa - pa * ac) / determinant;
  model.above_weight = (pp * ac - pa * pc) / determinant;
}

/// Accumulates the deviation of an estimate.
class Scorer {
 public:
  explicit Scorer(double rated_As) : rated_As_(rated_As) {}

  void add(double estimate_As, double sigma_As, double true_As) {
    const double off_As = std::abs(estimate_As - true_As);
    squares_ += off_As * off_As;
    most_As_ = std::max(most_As_, off_As);
    if (off_As <= band_sigmas * sigma_As) inside_ += 1.0;
    ++count_;
  }
  [[nodiscard]] HealthScore score() const {
    if (count_ == 0) return {};
    const auto count = static_cast<double>(count_);
    return {.tests = count_,
            .rmse_pct = std::sqrt(squares_ / count) / rated_As_ * percent,
            .max_pct = most_As_ / rated_As_ * percent,
            .inside_uncertainty_pct = inside_ / count * percent};
  }

 private:
  double rated_As_;
  double squares_ = 0.0;
  double most_As_ = 0.0;
  double inside_ = 0.0;
  std::size_t count_ = 0;
};

/// Both estimates after each charge.
class Follower {
 public:
  explicit Follower(const HealthPlan& plan) : plan_(plan) {
    estimate_.begin(
        {.capacity_As = plan.rated_As, .rated_As = plan.rated_As, .loss_share_per_cycle = plan.loss_share_per_cycle});
  }

  /// Ages the estimate by the charge and by the discharge before it: the cell is emptied between two charges.
  void use(const Charge& charge) {
    for (const CellSample& sample : charge.samples) {
      estimate_.pass(sample.passed_s, 2.0 * std::abs(sample.mean_current_A) * sample.passed_s);
    }
  }
  [[nodiscard]] HealthRow after(const Charge& charge) {
    HealthRow row;
    const std::optional<PlateauCharge> shown = shown_by(plan_.model, charge);
    if (shown) {
      const CapacityPair pair = capacity_pair(plan_.model, *shown, bench_sensor);
      row.single_As = pair.charge_As;
      row.single_sigma_As = pair.charge_sigma_As;
      static_cast<void>(estimate_.take(pair));  // an implausible one is returned, and not learned
    }
    if (estimate_.pairs() > 0) {
      row.told_As = estimate_.capacity_As();
      row.told_sigma_As = estimate_.sigma_As();
    }
    return row;
  }

 private:
  const HealthPlan& plan_;
  CapacityEstimate estimate_;
};

}  // namespace

Result<PlateauFit, std::string> fit_plateau(const AgeingData& data, const ChargePlateauModel& model, double rated_As,
                                            double until_cycle) {
  const std::vector<KnownCharge> known = known_charges(data, model, until_cycle);
  if (known.size() < charges_min) {
    return failure(data.name + ": found " + std::to_string(known.size()) + " charges with a test that show a plateau " +
                   "and are full at the end, expected " + std::to_string(charges_min) + " to fit to");
  }
  PlateauFit fit{.model = model, .charges = known.size()};
  solve(known, sigma_share_min * rated_As, fit.model);
  double squares = 0.0;
  for (const auto& [shown, capacity_As] : known) {
    const double off_As = capacity_pair(fit.model, shown, bench_sensor).charge_As - capacity_As;
    squares += off_As * off_As;
  }
  fit.rmse_As = std::sqrt(squares / static_cast<double>(known.size()));
  fit.model.sigma_As = std::max(fit.rmse_As, sigma_share_min * rated_As);
  return fit;
}

HealthResult score_health(const HealthPlan& plan, const AgeingData& data) {
  HealthResult result{.file = data.name};
  Follower follower(plan);
  Scorer single(plan.rated_As);
  Scorer told(plan.rated_As);
  for (const CapacityTest& test : data.tests) {
    if (!test.has_own_charge && !plan.scores_all_tests) continue;
    const Charge& charge = data.charge_before(test);
    follower.use(charge);
    HealthRow row = follower.after(plugged_in(charge, test.capacity_As, plan.when));
    row.cycle = test.cycle;
    row.true_As = test.capacity_As;
    if (row.single_As) single.add(*row.single_As, row.single_sigma_As, row.true_As);
    if (row.told_As) told.add(*row.told_As, row.told_sigma_As, row.true_As);
    result.rows.push_back(row);
  }
  result.single = single.score();
  result.told = told.score();
  return result;
}

}  // namespace bmu::cell
