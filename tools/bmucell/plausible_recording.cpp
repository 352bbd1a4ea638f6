#include "tools/bmucell/plausible_recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "tools/bmucell/median.hpp"
#include "tools/bmucell/score_terms.hpp"

namespace bmu::cell {

namespace {

constexpr double voltage_min_V = 0.5;
constexpr double voltage_max_V = 6.0;
/// No cell is tested beyond these, whatever a cell file permits.
constexpr double temperature_min_C = -60.0;
constexpr double temperature_max_C = 150.0;
/// Chambers and self-heating go beyond what a cell file permits by so much.
constexpr double temperature_tolerance_C = 5.0;
/// Time that goes back by less is the rounding of a logger.
constexpr double time_back_max_s = 1.0;

/// As many digits as a measurement has.
std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::string percent_text(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.0f %%", share * percent);
  return text.data();
}

/// Minimum and maximum of what was measured.
struct Range {
  double min = std::nan("");
  double max = std::nan("");

  void add(double value) {
    min = std::fmin(min, value);
    max = std::fmax(max, value);
  }
  [[nodiscard]] bool has_value() const { return min <= max; }
  [[nodiscard]] double size() const { return has_value() ? max - min : 0.0; }
  [[nodiscard]] std::string text() const {
    return has_value() ? number_text(min) + " to " + number_text(max) : "nothing";
  }
};

Range range_of(const Series& series, double SeriesRow::*member) {
  Range range;
  for (const SeriesRow& row : series.rows) range.add(row.*member);
  return range;
}

std::string time_problem(const Series& series, bool begins_in_each_cycle) {
  const SeriesRow* latest = nullptr;
  for (const SeriesRow& row : series.rows) {
    const bool is_begin = latest == nullptr || (begins_in_each_cycle && row.cycle != latest->cycle);
    if (!is_begin && row.time_s < latest->time_s - time_back_max_s) {
      const std::string line = row.line == 0 ? "" : std::to_string(row.line) + ":";
      return ":" + line + " time_s: found " + number_text(row.time_s) + " after " + number_text(latest->time_s) +
             ", expected a time that goes forward; the time of each step in place of the whole test's?";
    }
    if (is_begin || row.time_s > latest->time_s) latest = &row;
  }
  const Range time_s = range_of(series, &SeriesRow::time_s);
  if (begins_in_each_cycle || series.rows.size() < 2 || time_s.size() > 0.0) return "";
  return ": time_s: found " + number_text(time_s.min) + " in every row, expected a time that goes forward";
}

const char* cause_of_voltages(const Range& voltage_V) {
  constexpr double mV_per_V = 1e3;
  const double middle_mV = (voltage_V.min + voltage_V.max) / 2.0;
  if (middle_mV > voltage_min_V * mV_per_V && middle_mV < voltage_max_V * mV_per_V) return "; in mV?";
  if (voltage_V.max > voltage_max_V) return "; of more than one cell?";
  return voltage_V.has_value() ? "; a field that was not measured has to be empty, not 0" : "";
}

std::string voltage_problem(const Series& series) {
  const Range voltage_V = range_of(series, &SeriesRow::voltage_V);
  if (voltage_V.min >= voltage_min_V && voltage_V.max <= voltage_max_V) return "";
  return ": voltage_V: found " + voltage_V.text() + ", expected volts of one cell, 0.5 to 6" +
         cause_of_voltages(voltage_V);
}

std::optional<double> median_temperature_C(const Series& series) {
  std::vector<double> measured_C;
  for (const SeriesRow& row : series.rows) {
    if (std::isfinite(row.temperature_C)) measured_C.push_back(row.temperature_C);
  }
  return median(std::move(measured_C));
}

double celsius_of_fahrenheit(double temperature_F) {
  return (temperature_F - 32.0) * 5.0 / 9.0;
}

bool is_within(double value, double min, double max) {
  return value >= min && value <= max;
}

const char* cause_of_temperature(double found, double min_C, double max_C) {
  constexpr double freezing_K = 273.15;
  constexpr double dC_per_C = 10.0;
  if (is_within(found - freezing_K, min_C, max_C)) return "; in K?";
  if (is_within(celsius_of_fahrenheit(found), min_C, max_C)) return "; in degrees Fahrenheit?";
  return is_within(found / dC_per_C, min_C, max_C) ? "; in tenths of a degree?" : "";
}

std::string temperature_problem(const Series& series, double min_C, double max_C) {
  const std::optional<double> typical_C = median_temperature_C(series);
  if (!typical_C || is_within(*typical_C, min_C, max_C)) return "";
  return ": temp_C: found mostly " + number_text(*typical_C) + ", expected degrees Celsius within " +
         number_text(min_C) + " to " + number_text(max_C) + cause_of_temperature(*typical_C, min_C, max_C);
}

/// How often the voltage falls when more flows out of the cell, of all steps of the current, and answers to it, that
/// are no noise.
struct Steps {
  double count = 0.0;
  double falling = 0.0;

  [[nodiscard]] double falling_share() const { return falling / count; }
};

/// Three standard deviations of the difference between two rows, whose mean size is 0.8 of one.
constexpr double noise_differences = 3.0 / 0.798;

Steps steps_of(const Series& series, double capacity_Ah) {
  const double step_min_A = 0.2 * capacity_Ah;
  const double answer_min_V = noise_differences * voltage_noise(series.rows, capacity_Ah).usual_V;
  Steps steps;
  for (std::size_t k = 1; k < series.rows.size(); ++k) {
    const double by_A = series.rows[k].current_A - series.rows[k - 1].current_A;
    const double by_V = series.rows[k].voltage_V - series.rows[k - 1].voltage_V;
    if (!(std::abs(by_A) >= step_min_A) || !(std::abs(by_V) > answer_min_V)) continue;
    steps.count += 1.0;
    if ((by_A > 0.0) == (by_V < 0.0)) steps.falling += 1.0;
  }
  return steps;
}

/// Correlation of voltage and charge that left: -1 to 1. 0 where either hardly changes.
double trend_of(const Series& series, const std::vector<double>& out) {
  constexpr double charge_range_min = 0.1;
  constexpr double voltage_range_min_V = 0.010;
  Range charge;
  Range voltage_V;
  double count = 0.0;
  double charge_sum = 0.0;
  double voltage_sum_V = 0.0;
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (!std::isfinite(series.rows[k].voltage_V)) continue;
    charge.add(out[k]);
    voltage_V.add(series.rows[k].voltage_V);
    charge_sum += out[k];
    voltage_sum_V += series.rows[k].voltage_V;
    count += 1.0;
  }
  if (charge.size() < charge_range_min || voltage_V.size() < voltage_range_min_V) return 0.0;
  double both = 0.0;
  double charge_squares = 0.0;
  double voltage_squares = 0.0;
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (!std::isfinite(series.rows[k].voltage_V)) continue;
    const double off = out[k] - charge_sum / count;
    const double off_V = series.rows[k].voltage_V - voltage_sum_V / count;
    both += off * off_V;
    charge_squares += off * off;
    voltage_squares += off_V * off_V;
  }
  return both / std::sqrt(charge_squares * voltage_squares);
}

/// How far ref_soc_pct rises above its lowest before, and falls below its highest before, as shares.
struct Moves {
  double up = 0.0;
  double down = 0.0;
};

Moves moves_of(const Series& series) {
  constexpr double jump_min = 0.02;  // another test in the same file
  double level = 0.0;
  Range reached{.min = 0.0, .max = 0.0};
  Moves moves;
  for (std::size_t k = 1; k < series.rows.size(); ++k) {
    const double by_soc = series.rows[k].soc - series.rows[k - 1].soc;
    if (!(std::abs(by_soc) < jump_min)) continue;
    level += by_soc;
    reached.add(level);
    moves.up = std::max(moves.up, level - reached.min);
    moves.down = std::max(moves.down, reached.max - level);
  }
  return moves;
}

constexpr const char* sign_missing = "; the current without its sign?";

/// Two figures of a recording that should be the same: what their ratio hints at.
struct Cause {
  double counted_by_reference = 1.0;
  const char* text = "";
};
constexpr std::array causes{
    Cause{1e3, "; current in mA, or time in ms?"},
    Cause{1e6, "; current in mA and time in ms?"},
    Cause{1.0 / 60.0, "; time in minutes?"},
    Cause{1.0 / 3600.0, "; time in hours?"},
    Cause{1e3 / 3600.0, "; current in mA and time in hours?"},
    Cause{1e-3, "; current in kA?"},
    Cause{100.0, "; a fraction in place of percent?"},
    Cause{-1.0, "; a current that is positive into the cell, or the depth of discharge in place of the charge?"},
    Cause{-1e3, "; current in mA and positive into the cell?"},
};

const char* cause_of(double ratio) {
  constexpr double near = 0.35;
  for (const Cause& cause : causes) {
    if (std::abs(ratio / cause.counted_by_reference - 1.0) <= near) return cause.text;
  }
  return "; another capacity?";
}

/// The rows with the highest and the lowest reference, and what was counted between them.
struct ReferenceSpan {
  double highest = -1e9;
  double lowest = 1e9;
  double out_at_highest = 0.0;
  double out_at_lowest = 0.0;

  void add(double soc, double out) {
    if (soc > highest) {
      highest = soc;
      out_at_highest = out;
    }
    if (soc < lowest) {
      lowest = soc;
      out_at_lowest = out;
    }
  }
  [[nodiscard]] bool has_value() const { return highest >= lowest; }
  [[nodiscard]] double moved() const { return highest - lowest; }
  [[nodiscard]] double counted() const { return out_at_lowest - out_at_highest; }
};

/// What flowed out by the current, and over gaps by the reference: what flowed there is not recorded.
std::vector<double> charge_out_besides_gaps(const Series& series, double capacity_Ah) {
  std::vector<double> out = charge_out(series, capacity_Ah);
  const double gap_s = gap_of(series);
  double shift = 0.0;
  double before = 0.0;
  for (std::size_t k = 1; k < out.size(); ++k) {
    const double by_out = out[k] - before;
    before = out[k];
    const double by_soc = series.rows[k].soc - series.rows[k - 1].soc;
    const bool is_gap = series.rows[k].time_s - series.rows[k - 1].time_s > gap_s;
    if (is_gap && std::isfinite(by_soc)) shift -= by_soc + by_out;
    out[k] += shift;
  }
  return out;
}

std::string reference_problem(const Series& series, const std::vector<double>& out, double capacity_Ah) {
  constexpr double apart_share = 0.3;
  constexpr double apart_min = 0.03;  // a reference in whole percent
  constexpr double still_min = 0.1;
  constexpr double beyond_max = 0.15;
  ReferenceSpan span;
  Range counted;
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (std::isfinite(series.rows[k].soc)) span.add(series.rows[k].soc, out[k]);
    counted.add(out[k]);
  }
  if (!span.has_value()) return ": ref_soc_pct: found nothing; leave the column out to have the charge counted";
  if (std::abs(span.counted() - span.moved()) > apart_share * span.moved() + apart_min) {
    const double capacity_found_Ah = span.counted() / span.moved() * capacity_Ah;
    return ": ref_soc_pct: with the current it makes " + number_text(capacity_found_Ah) + " Ah, expected about " +
           number_text(capacity_Ah) + ", the capacity" + cause_of(span.counted() / span.moved());
  }
  if (counted.size() > span.moved() / apart_share + still_min) {
    return ": ref_soc_pct: moves by " + percent_text(span.moved()) + " while the current moves " +
           percent_text(counted.size()) + " of the capacity" + cause_of(counted.size() / std::max(span.moved(), 1e-9));
  }
  if (span.lowest < -beyond_max || span.highest > 1.0 + beyond_max) {
    return ": ref_soc_pct: found " + percent_text(span.lowest) + " to " + percent_text(span.highest) +
           ", expected 0 to 100";
  }
  return "";
}

std::string counted_problem(const Series& series, const std::vector<double>& out, double capacity_Ah, double begin) {
  constexpr double beyond_max = 0.15;
  constexpr double far_beyond = 20.0;
  Range soc;
  for (const double one : out) soc.add(begin - one);
  if (soc.min >= -beyond_max && soc.max <= 1.0 + beyond_max) return "";
  const char* cause = "; another capacity, or another charge at its begin (--begin-soc)?";
  if (soc.size() > far_beyond) {
    cause = "; current in mA, or time in ms?";
  } else if (soc.min >= -beyond_max) {
    cause = "; a current that is positive into the cell, or a lower charge at its begin (--begin-soc)?";
  } else if (has_one_sign(series, capacity_Ah)) {
    cause = "; the current without its sign, another capacity, or another charge at its begin (--begin-soc)?";
  }
  return ": current_A: counted from " + percent_text(begin) + " it makes a charge of " + percent_text(soc.min) +
         " to " + percent_text(soc.max) + ", expected 0 to 100 %" + cause;
}

}  // namespace

std::vector<double> charge_out(const Series& series, double capacity_Ah) {
  constexpr double s_per_h = 3600.0;
  std::vector<double> out;
  out.reserve(series.rows.size());
  double sum = 0.0;
  double latest_s = series.rows.empty() ? 0.0 : series.rows.front().time_s;
  for (const SeriesRow& row : series.rows) {
    const double elapsed_s = std::max(row.time_s - latest_s, 0.0);
    latest_s = std::max(row.time_s, latest_s);
    if (std::isfinite(row.current_A)) sum += row.current_A * elapsed_s / (capacity_Ah * s_per_h);
    out.push_back(sum);
  }
  return out;
}

VoltageNoise voltage_noise(std::span<const SeriesRow> rows, double capacity_Ah) {
  constexpr double same_C = 0.01;
  constexpr double same_V = 1e-6;
  VoltageNoise noise;
  double count = 0.0;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const double by_V = std::abs(rows[k].voltage_V - rows[k - 1].voltage_V);
    const bool is_same = std::abs(rows[k].current_A - rows[k - 1].current_A) <= same_C * capacity_Ah;
    if (!is_same || !std::isfinite(by_V)) continue;
    noise.usual_V += by_V;
    count += 1.0;
    if (by_V > same_V && (noise.least_V == 0.0 || by_V < noise.least_V)) noise.least_V = by_V;
  }
  if (count > 0.0) noise.usual_V /= count;
  return noise;
}

bool has_one_sign(const Series& series, double capacity_Ah) {
  const double noise_A = 0.005 * capacity_Ah;
  const Range current_A = range_of(series, &SeriesRow::current_A);
  return current_A.min >= -noise_A || current_A.max <= noise_A;
}

std::string implausible_time(const Series& series) {
  return time_problem(series, false);
}

std::string implausible_time_in_cycles(const Series& series) {
  return time_problem(series, series.has_cycle);
}

std::string implausible_values(const Series& series) {
  const std::string problem = voltage_problem(series);
  return problem.empty() ? temperature_problem(series, temperature_min_C, temperature_max_C) : problem;
}

std::string implausible_values(const Series& series, const CellModel& cell) {
  constexpr double dC_per_C = 10.0;
  std::string problem = voltage_problem(series);
  if (!problem.empty()) return problem;
  return temperature_problem(series, cell.temperature_min_dC / dC_per_C - temperature_tolerance_C,
                             cell.temperature_max_dC / dC_per_C + temperature_tolerance_C);
}

std::string implausible_current(const Series& series, double capacity_Ah) {
  constexpr double current_max_C = 200.0;
  constexpr double current_min_C = 0.002;
  constexpr double steps_min = 20.0;
  constexpr double mostly = 0.5;
  constexpr double nearly_always = 0.9;
  constexpr double rising_trend = 0.3;
  constexpr double move_min = 0.005;
  const Range current_A = range_of(series, &SeriesRow::current_A);
  const double current_peak_A = std::fmax(-current_A.min, current_A.max);
  if (!(current_peak_A >= current_min_C * capacity_Ah)) {
    return ": current_A: found " + current_A.text() + ", expected currents in A; a fit needs them";
  }
  if (current_peak_A > current_max_C * capacity_Ah) {
    return ": current_A: found " + current_A.text() + ", expected currents in A of a cell of " +
           number_text(capacity_Ah) + " Ah; in mA?";
  }
  const bool may_miss_sign = has_one_sign(series, capacity_Ah);
  const Steps steps = steps_of(series, capacity_Ah);
  const std::vector<double> out = charge_out(series, capacity_Ah);
  if ((steps.count > 0.0 && steps.falling_share() < mostly) || trend_of(series, out) > rising_trend) {
    return ": current_A: the voltage mostly rises with it or as charge leaves, expected a current that is positive out "
           "of the cell" +
           std::string(may_miss_sign ? sign_missing : "");
  }
  if (steps.count >= steps_min && steps.falling_share() < nearly_always) {
    return ": current_A: the voltage falls at " + percent_text(steps.falling_share()) +
           " of its steps upwards and rises at so many downwards, expected nearly all" +
           (may_miss_sign ? sign_missing : "; current and voltage of different times?");
  }
  const Moves moves = moves_of(series);
  if (series.has_soc && may_miss_sign && std::min(moves.up, moves.down) > move_min) {
    return ": current_A: found " + current_A.text() + ", but ref_soc_pct moves both ways" + sign_missing;
  }
  return "";
}

std::string implausible_charging(const Series& series) {
  const Range current_A = range_of(series, &SeriesRow::current_A);
  if (current_A.min < 0.0) return "";
  return ": current_A: found " + current_A.text() + ", expected charging currents, which are below 0" +
         (current_A.max > 0.0 ? "; a current that is positive into the cell?" : "");
}

std::string implausible_charge(const Series& series, double capacity_Ah, double begin_soc) {
  if (series.has_soc) return reference_problem(series, charge_out_besides_gaps(series, capacity_Ah), capacity_Ah);
  return counted_problem(series, charge_out(series, capacity_Ah), capacity_Ah, begin_soc);
}

}  // namespace bmu::cell
