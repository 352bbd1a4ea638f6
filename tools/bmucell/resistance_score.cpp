#include "tools/bmucell/resistance_score.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/core/estimation/health/resistance_tracker.hpp"
#include "daemon/core/estimation/health/step_average.hpp"
#include "tools/bmucell/data/score_terms.hpp"

namespace bmu::cell {

namespace {

constexpr double good_share = 0.05;
constexpr double read_after_s = 10.0;

/// The 2013 method, applied to a recording.
class RecordedSteps {
 public:
  RecordedSteps(const Series& series, const ExpectedResistance& expected)
      : series_(series),
        expected_(expected),
        step_min_A_(std::max(step_floor_A, expected.hour_current_A() * step_share)) {}

  void update(std::size_t row) {
    if (!is_steady(row)) return;
    const SeriesRow& now = series_.rows[row];
    if (last_ != nullptr) compare(*last_, now);
    last_ = &now;
  }
  [[nodiscard]] std::optional<ToldResistance> told() const {
    if (!average_.is_known()) return std::nullopt;
    return ToldResistance{average_.resistance_uOhm * 1e-6};
  }

 private:
  static constexpr double step_floor_A = 1.0;
  static constexpr double step_share = 0.1;
  static constexpr double steady_share = 0.1;  // of a step
  static constexpr double neighbours_max_s = 2.5;

  [[nodiscard]] bool is_same_current(std::size_t one, std::size_t other) const {
    return std::abs(series_.rows[one].current_A - series_.rows[other].current_A) < step_min_A_ * steady_share;
  }
  [[nodiscard]] bool is_steady(std::size_t row) const {
    const bool is_as_before = row > 0 && is_same_current(row, row - 1);
    const bool is_as_behind = row + 1 < series_.rows.size() && is_same_current(row, row + 1);
    return std::isfinite(series_.rows[row].voltage_V) && (is_as_before || is_as_behind);
  }
  void compare(const SeriesRow& before, const SeriesRow& now) {
    const double step_A = now.current_A - before.current_A;
    const double apart_s = now.time_s - before.time_s;
    const double model_Ohm = expected_.at_reference_Ohm() * expected_.factor(now.temperature_C);
    const bool is_step = std::abs(step_A) >= step_min_A_ && apart_s > 0.0 && apart_s <= neighbours_max_s;
    if (!is_step || !is_measured(model_Ohm)) return;
    average_.take(std::llround((before.voltage_V - now.voltage_V) * 1e6), std::llround(step_A * 1e3),
                  std::llround(model_Ohm * 1e6));
  }

  const Series& series_;
  const ExpectedResistance& expected_;
  double step_min_A_;
  const SeriesRow* last_ = nullptr;
  StepAverage average_;
};

/// The last row within `read_after_s` after the pulse.
std::size_t reading_of(const Series& series, const FoundPulse& pulse) {
  const double until_s = series.rows[pulse.end - 1].time_s + read_after_s;
  std::size_t row = pulse.end - 1;
  while (row + 1 < series.rows.size() && series.rows[row + 1].time_s <= until_s) ++row;
  return row;
}

std::vector<PulseResult> run_over(const CellDynamics& cell, const Series& series,
                                  const std::vector<FoundPulse>& pulses) {
  const ExpectedResistance expected(cell);
  ResistanceTracker tracker;
  tracker.begin(expected);
  RecordedSteps steps(series, expected);
  std::vector<PulseResult> results;
  auto pulse = pulses.begin();
  double before_s = series.rows.front().time_s - 1.0;
  for (std::size_t row = 0; row < series.rows.size() && pulse != pulses.end(); ++row) {
    const SeriesRow& now = series.rows[row];
    tracker.update({.passed_s = now.time_s - before_s,
                    .current_A = now.current_A,
                    .voltage_V = now.voltage_V,
                    .temperature_C = now.temperature_C});
    before_s = now.time_s;
    steps.update(row);
    if (row < reading_of(series, *pulse)) continue;
    PulseResult result{.time_s = series.rows[pulse->first].time_s, .reference = pulse->told};
    const ResistanceEstimate estimate = tracker.estimate(pulse->told.temperature_C);
    if (estimate.is_known) result.told[0] = ToldResistance{estimate.resistance_Ohm, estimate.sigma_Ohm};
    result.told[1] = steps.told();
    results.push_back(result);
    ++pulse;
  }
  return results;
}

ResistanceScore score_of(const std::vector<PulseResult>& pulses, ResistanceMethod method, bool is_all) {
  ResistanceScore score{.method = method, .is_all = is_all};
  double squares = 0.0;
  double sum = 0.0;
  double most = 0.0;
  std::size_t inside = 0;
  bool tells_sigma = false;
  for (const PulseResult& pulse : pulses) {
    if (!is_all && pulse.reference.soc <= nearly_empty_soc) continue;
    ++score.pulses;
    const auto& told = pulse.told.at(static_cast<std::size_t>(method));
    if (!told) continue;
    const double off = told->resistance_Ohm / pulse.reference.resistance_Ohm - 1.0;
    const double off_Ohm = std::abs(told->resistance_Ohm - pulse.reference.resistance_Ohm);
    ++score.told;
    squares += off * off;
    sum += off;
    most = std::max(most, std::abs(off));
    if (std::abs(off) <= good_share) ++score.within_5_pct;
    tells_sigma = tells_sigma || told->sigma_Ohm.has_value();
    if (told->sigma_Ohm && off_Ohm <= band_sigmas * *told->sigma_Ohm) ++inside;
  }
  if (score.told == 0) return score;
  const auto count = static_cast<double>(score.told);
  score.rms_pct = std::sqrt(squares / count) * percent;
  score.max_pct = most * percent;
  score.mean_pct = sum / count * percent;
  if (tells_sigma) score.inside_uncertainty_pct = static_cast<double>(inside) / count * percent;
  return score;
}

}  // namespace

Result<ResistanceEvaluation, std::string> evaluate_resistance(const CellDynamics& cell, const Series& series,
                                                              const PulseTable& table) {
  if (!series.has_temperature) return failure(series.name + ": no column 'temp_C'; resistance follows the temperature");
  const Result<std::vector<FoundPulse>, std::string> found = find_pulses(table, series);
  if (!found) return failure(found.error());
  ResistanceEvaluation evaluation{.pulses = run_over(cell, series, *found)};
  for (const ResistanceMethod method : {ResistanceMethod::recursive, ResistanceMethod::steps}) {
    for (const bool is_all : {true, false}) evaluation.scores.push_back(score_of(evaluation.pulses, method, is_all));
  }
  return evaluation;
}

}  // namespace bmu::cell
