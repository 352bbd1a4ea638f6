#include "tools/bmucell/current_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <span>
#include <vector>

#include "tools/bmucell/plausible_recording.hpp"
#include "tools/bmucell/steady_current.hpp"

namespace bmu::cell {

namespace {

using Rows = std::span<const SeriesRow>;

constexpr double level_C = 0.01;
constexpr double step_min_C = 0.03;
constexpr double step_share_min = 0.2;
constexpr std::size_t averaged_max = 5;
constexpr double answer_min_V = 0.001;
/// Four standard deviations of a difference of means from which another one is taken off: 4 * sqrt(6). Of normal noise
/// the mean size of the difference between two rows is 1.13 of its standard deviations.
constexpr double noise_factor = 4.0 * 2.449 / 1.128;
constexpr double resolution_factor = 1.5;
constexpr double wrong_min = 2.0;
constexpr double wrong_share_min = 0.05;

/// Rows of a steady current without a gap, one level behind the other.
std::vector<Rows> levels_of(Rows rows, double capacity_Ah, double gap_s) {
  std::vector<Rows> levels;
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= rows.size(); ++k) {
    const bool goes_on = k < rows.size() &&
                         std::abs(rows[k].current_A - rows[begin].current_A) <= level_C * capacity_Ah &&
                         rows[k].time_s - rows[k - 1].time_s <= gap_s;
    if (goes_on) continue;
    levels.push_back(rows.subspan(begin, k - begin));
    begin = k;
  }
  return levels;
}

/// What a difference of voltages has to exceed to be none of noise or rounding.
double bound_V(const VoltageNoise& noise, std::size_t averaged) {
  const double by_noise_V = noise_factor * noise.usual_V / std::sqrt(static_cast<double>(averaged));
  return std::max({answer_min_V, by_noise_V, resolution_factor * noise.least_V});
}

/// Of rows that follow each other.
struct Mean {
  double time_s = 0.0;
  double voltage_V = 0.0;
};

Mean mean_of(Rows rows) {
  Mean mean;
  for (const SeriesRow& row : rows) {
    mean.time_s += row.time_s / static_cast<double>(rows.size());
    mean.voltage_V += row.voltage_V / static_cast<double>(rows.size());
  }
  return mean;
}

struct Step {
  const SeriesRow* first = nullptr;  // behind it
  double from_A = 0.0;
  double by_A = 0.0;
  double by_V = 0.0;  // not a number: not judged
  std::size_t averaged = 0;

  [[nodiscard]] bool is_wrong_way() const { return (by_A > 0.0) == (by_V > 0.0); }
};

/// The voltage's answer without what the voltage moved by itself, where that makes it a smaller one the wrong way.
Step step_between(Rows before, Rows behind) {
  Step step{.first = &behind.front(), .from_A = before.back().current_A};
  step.by_A = behind.front().current_A - step.from_A;
  step.averaged = std::min({before.size() / 2, behind.size(), averaged_max});
  if (step.averaged == 0) return step;
  const Mean earlier = mean_of(before.last(2 * step.averaged).first(step.averaged));
  const Mean from = mean_of(before.last(step.averaged));
  const Mean to = mean_of(behind.first(step.averaged));
  step.by_V = to.voltage_V - from.voltage_V;
  const double passed_s = from.time_s - earlier.time_s;
  const double by_itself_V =
      (from.voltage_V - earlier.voltage_V) * (passed_s > 0.0 ? (to.time_s - from.time_s) / passed_s : 1.0);
  if (!step.is_wrong_way() || by_itself_V * step.by_V <= 0.0) return step;
  step.by_V = std::abs(by_itself_V) < std::abs(step.by_V) ? step.by_V - by_itself_V : 0.0;
  return step;
}

bool is_judged(const Step& step, double capacity_Ah) {
  const double larger_A = std::max(std::abs(step.from_A), std::abs(step.from_A + step.by_A));
  const double by_A = std::abs(step.by_A);
  return step.averaged > 0 && by_A >= step_min_C * capacity_Ah && by_A >= step_share_min * larger_A;
}

std::string text_of(const Step& first, double wrong, double all, const char* cause) {
  const bool is_rise = first.by_V > 0.0;
  constexpr double mV_per_V = 1e3;
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(),
                ": current_A: at %.0f of %.0f steps the voltage goes the wrong way: first it %s by %.0f mV as the "
                "current goes from %.4g to %.4g A, expected it to %s; %s",
                wrong, all, is_rise ? "rises" : "falls", std::abs(first.by_V) * mV_per_V, first.from_A,
                first.from_A + first.by_A, is_rise ? "fall" : "rise", cause);
  const std::string line = first.first->line == 0 ? "" : ":" + std::to_string(first.first->line);
  return line + text.data();
}

}  // namespace

std::string implausible_current_steps(const Series& series, double capacity_Ah) {
  const double gap_s = gap_of(series);
  const std::vector<Rows> levels = levels_of(series.rows, capacity_Ah, gap_s);
  const VoltageNoise noise = voltage_noise(series.rows, capacity_Ah);
  Step first_wrong;
  double wrong = 0.0;
  double all = 0.0;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    if (levels[k].front().time_s - levels[k - 1].back().time_s > gap_s) continue;
    const Step step = step_between(levels[k - 1], levels[k]);
    if (!is_judged(step, capacity_Ah) || !(std::abs(step.by_V) > bound_V(noise, step.averaged))) continue;
    all += 1.0;
    if (!step.is_wrong_way()) continue;
    wrong += 1.0;
    if (first_wrong.first == nullptr) first_wrong = step;
  }
  if (wrong < wrong_min || wrong < wrong_share_min * all) return "";
  return text_of(
      first_wrong, wrong, all,
      has_one_sign(series, capacity_Ah) ? "the current without its sign?" : "the current with the other sign there?");
}

std::string implausible_answers(const Series& series, double capacity_Ah) {
  std::string problem = implausible_current(series, capacity_Ah);
  if (problem.empty()) problem = implausible_current_steps(series, capacity_Ah);
  if (problem.empty()) problem = implausible_steady_current(series, capacity_Ah);
  return problem;
}

}  // namespace bmu::cell
