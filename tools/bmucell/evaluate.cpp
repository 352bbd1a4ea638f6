#include "tools/bmucell/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "daemon/core/estimation/soc/cell_estimate.hpp"
#include "daemon/core/estimation/soc/published_soc.hpp"
#include "tools/bmucell/data/score_terms.hpp"

namespace bmu::cell {

namespace {

constexpr double begin_sigma_min = 0.10;
constexpr double settled_within = 0.03;
constexpr double settling_s = 1200.0;

/// Applies the errors of a worse sensor to the recording.
class WorseSensor {
 public:
  explicit WorseSensor(const EvaluationPlan& plan) : plan_(plan), random_(plan.seed) {}
  SeriesRow seen(SeriesRow row) {
    row.current_A =
        row.current_A * plan_.sensor_gain + plan_.sensor_offset_A + plan_.current_noise_A * normal_(random_);
    row.voltage_V += plan_.voltage_noise_V * normal_(random_);
    return row;
  }

 private:
  const EvaluationPlan& plan_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

/// Accumulates the deviation of an estimator.
class Scorer {
 public:
  void add(double since_begin_s, double error, double sigma) {
    const double off = std::abs(error);
    all_.add(off);
    if (since_begin_s > settling_s) later_.add(off);
    if (off <= band_sigmas * sigma) inside_ += 1.0;
    if (off > settled_within) {
      settled_s_.reset();
    } else if (!settled_s_) {
      settled_s_ = since_begin_s;
    }
  }
  [[nodiscard]] Score score() const {
    Score score{.rows = static_cast<std::size_t>(all_.count),
                .rmse_pct = all_.rmse_pct(),
                .max_pct = all_.most * percent,
                .settle_3pct_s = settled_s_,
                .inside_uncertainty_pct = inside_ / all_.count * percent};
    if (later_.count > 0.0) {
      score.rmse_after_20min_pct = later_.rmse_pct();
      score.max_after_20min_pct = later_.most * percent;
    }
    return score;
  }

 private:
  struct Sums {
    double squares = 0.0;
    double most = 0.0;
    double count = 0.0;

    void add(double off) {
      squares += off * off;
      most = std::max(most, off);
      count += 1.0;
    }
    [[nodiscard]] double rmse_pct() const { return std::sqrt(squares / count) * percent; }
  };
  Sums all_;
  Sums later_;
  double inside_ = 0.0;
  std::optional<double> settled_s_;
};

std::size_t first_row(const EvaluationPlan& plan, const Series& series) {
  std::size_t first = 0;
  while (first < series.rows.size() && !(series.rows[first].soc <= plan.from_soc)) ++first;
  return first;
}

SocBegin begin_of(const EvaluationPlan& plan, const SeriesRow& row) {
  const bool is_at_start = plan.from_soc >= 1.0;
  return {.soc = std::clamp(row.soc + plan.soc_error, 0.0, 1.0),
          .sigma = std::max(begin_sigma_min, std::abs(plan.soc_error)),
          .is_rested = is_at_start,
          .hysteresis = is_at_start ? 1.0 : -1.0};  // the SOC fell to this value
}

CellSample sample_of(const SeriesRow& row, double passed_s, bool is_counted) {
  return {.passed_s = passed_s,
          .mean_current_A = is_counted ? row.current_A : not_measured,
          .current_A = row.current_A,
          .voltage_V = row.voltage_V,
          .temperature_C = row.temperature_C};
}

/// Checks that the series has a reference to score against. Returns the error, "" for none.
std::string problem_of(const Series& series) {
  if (!series.has_soc) return "no column 'ref_soc_pct', which says what the charge really was";
  const bool is_fraction = std::all_of(series.rows.begin(), series.rows.end(),
                                       [](const SeriesRow& row) { return !(row.soc * percent > 1.0); });
  return is_fraction ? "ref_soc_pct: found nothing above 1, expected percent, from 0 to 100" : "";
}

}  // namespace

Result<Evaluation, std::string> evaluate(const EvaluationPlan& plan, const CellDynamics& cell, const Series& series) {
  const std::string problem = problem_of(series);
  if (!problem.empty()) return failure(series.name + ": " + problem);
  const std::size_t first = first_row(plan, series);
  if (first == series.rows.size()) return failure(series.name + ": ref_soc_pct is never as low as --from-soc");

  const double one_hour_A = cell.capacity_As / 3600.0;
  const CurrentSensorError sensor{
      .gain = plan.gain_sigma, .offset_A = plan.offset_sigma_C * one_hour_A, .unknown_current_A = one_hour_A};
  const SocBegin begin = begin_of(plan, series.rows[first]);
  const ChargeEndConfig ends = charge_ends_of(cell);
  const double gap_s = gap_of(series);
  CellEstimate estimator;
  ModelMemo memo;
  estimator.begin(cell, sensor, begin, series.rows[first].temperature_C);
  PublishedSoc published;
  published.begin(begin.soc);
  WorseSensor worse(plan);
  Scorer scorer;
  Evaluation result;
  RowsLeftOut left_out{.before_start = first};
  const double begin_s = series.rows[first].time_s;
  double before_s = begin_s;
  SocEstimate estimate{.is_known = true, .soc = begin.soc, .sigma = begin.sigma};
  for (std::size_t k = first; k < series.rows.size(); ++k) {
    const SeriesRow row = worse.seen(series.rows[k]);
    const double passed_s = row.time_s - before_s;
    // The reference of the first row already includes the charge before it.
    if (k > first) {
      if (!(passed_s > 0.0)) {
        ++left_out.time_not_forward;
        continue;
      }
      before_s = row.time_s;
      const CellSample sample = sample_of(row, passed_s, passed_s <= gap_s);
      static_cast<void>(estimator.update(sample, ends, memo));
      estimate = estimator.estimate(plan.method);
      result.score.misfit = std::max(result.score.misfit, estimator.filter().misfit());
      const double flowed_As = is_measured(sample.mean_current_A) ? sample.mean_current_A * passed_s : 0.0;
      published.update(passed_s, flowed_As / cell.capacity_As, estimate.soc);
    }
    if (!std::isfinite(row.soc)) {
      ++left_out.without_reference;
      continue;
    }
    scorer.add(row.time_s - begin_s, published.soc() - row.soc, estimate.sigma);
    result.trace.push_back(
        {row.time_s, row.current_A, row.voltage_V, row.temperature_C, row.soc, published.soc(), estimate.sigma});
  }
  if (result.trace.empty()) return failure(series.name + ": no row with a reference from there on");
  const double misfit = result.score.misfit;
  result.score = scorer.score();
  result.score.misfit = misfit;
  result.score.left_out = left_out;
  result.score.file = series.name;
  result.score.method = plan.method;
  return result;
}

namespace {

template <class Figure>
std::optional<double> mean_figure(const std::vector<Score>& scores, Figure figure) {
  double sum = 0.0;
  double count = 0.0;
  for (const Score& one : scores) {
    const std::optional<double> value = figure(one);
    if (!value) continue;
    sum += *value;
    count += 1.0;
  }
  if (count == 0.0) return std::nullopt;
  return sum / count;
}

}  // namespace

Score mean_of(const std::vector<Score>& scores) {
  const auto mean = [&scores](auto member) {
    return mean_figure(scores, [member](const Score& one) { return std::optional<double>(one.*member); });
  };
  Score score{.file = "mean", .method = scores.empty() ? SocMethod::ekf : scores.front().method};
  for (const Score& one : scores) {
    score.rows += one.rows;
    score.left_out.before_start += one.left_out.before_start;
    score.left_out.time_not_forward += one.left_out.time_not_forward;
    score.left_out.without_reference += one.left_out.without_reference;
  }
  score.rmse_pct = mean(&Score::rmse_pct).value_or(0.0);
  score.max_pct = mean(&Score::max_pct).value_or(0.0);
  score.rmse_after_20min_pct = mean(&Score::rmse_after_20min_pct);
  score.max_after_20min_pct = mean(&Score::max_after_20min_pct);
  // The time is omitted if one estimate never settled: a mean would hide that.
  const bool have_all_settled =
      std::all_of(scores.begin(), scores.end(), [](const Score& one) { return one.settle_3pct_s.has_value(); });
  if (have_all_settled) score.settle_3pct_s = mean(&Score::settle_3pct_s);
  for (const Score& one : scores) score.misfit = std::max(score.misfit, one.misfit);
  score.inside_uncertainty_pct = mean(&Score::inside_uncertainty_pct).value_or(0.0);
  return score;
}

}  // namespace bmu::cell
