#include "tools/bmucell/fit/fit_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tools/bmucell/data/score_terms.hpp"

namespace bmu::cell {

namespace {

constexpr double slow_curve_factor = 3.0;
/// Distance from an end of the charge, as a share of the capacity, within which a recording counts as having reached
/// it.
constexpr double end_reached = 0.1;

struct ChargeReach {
  double min = 1.0;
  double max = 0.0;

  [[nodiscard]] bool has_empty_end() const { return min <= end_reached; }
  [[nodiscard]] bool has_full_end() const { return max >= 1.0 - end_reached; }
};

ChargeReach reach_of(const std::vector<FitSeries>& data) {
  ChargeReach reach;
  for (const FitSeries& one : data) {
    for (const SeriesRow& row : one.series.rows) {
      if (!std::isfinite(row.soc)) continue;
      reach.min = std::min(reach.min, row.soc);
      reach.max = std::max(reach.max, row.soc);
    }
  }
  return reach;
}

template <class... Values>
std::string text_of(const char* form, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), form, values...);
  return text.data();
}

std::string misses_too_much(const FitQuality& quality, double rmse_max_V) {
  constexpr double mV_per_V = 1e3;
  if (quality.rows == 0) {
    return quality.name + ": found no row with current, voltage, temperature and charge, expected some to fit to";
  }
  const double bound_V = rmse_max_V * (quality.is_slow_curve ? slow_curve_factor : 1.0);
  if (quality.rmse_V <= bound_V) return "";
  return quality.name + text_of(
                            ": the model misses it by %.0f mV RMSE, expected at most %.0f; another cell than the "
                            "other recordings', another charge at its begin, or other units?",
                            quality.rmse_V * mV_per_V, bound_V * mV_per_V);
}

/// Voltage range of any cell.
constexpr double ocv_min_V = 0.5;
constexpr double ocv_max_V = 6.0;

std::string is_no_cell(const Fit& fit) {
  for (const CellDynamics::Row& row : fit.cell.rows) {
    if (row.ocv_V.front() >= ocv_min_V && row.ocv_V.back() <= ocv_max_V) continue;
    return text_of(
        "what was fitted: the open-circuit voltage at %.0f C goes from %.3f to %.3f V, expected 0.5 to 6; recordings "
        "of a "
        "small part of the charge, or time in minutes or hours?",
        row.temperature_C, row.ocv_V.front(), row.ocv_V.back());
  }
  return "";
}

std::string spans_too_little(const Fit& fit, const ChargeReach& reach, const CellModel& base) {
  constexpr double whole_span_min = 0.2;
  constexpr double part_span_min = 0.05;
  constexpr double V_per_uV = 1e-6;
  const bool is_whole = reach.has_empty_end() && reach.has_full_end();
  const double base_min_V = base.voltage_min_uV * V_per_uV;
  const double base_max_V = base.voltage_max_uV * V_per_uV;
  const double span_min_V = (is_whole ? whole_span_min : part_span_min) * (base_max_V - base_min_V);
  for (const CellDynamics::Row& row : fit.cell.rows) {
    if (row.ocv_V.back() - row.ocv_V.front() >= span_min_V) continue;
    return text_of(
        "what was fitted: the open-circuit voltage at %.0f C goes from %.3f to %.3f V, expected a span of "
        "%.2f V or more of the base's %.2f to %.2f; recordings of a small part of the charge, or of another "
        "cell than the base?",
        row.temperature_C, row.ocv_V.front(), row.ocv_V.back(), span_min_V, base_min_V, base_max_V);
  }
  return "";
}

}  // namespace

std::string implausible_fit(const Fit& fit, const std::vector<FitSeries>& data, const CellModel& base,
                            double rmse_max_V) {
  for (const FitQuality& quality : fit.quality) {
    std::string problem = misses_too_much(quality, rmse_max_V);
    if (!problem.empty()) return problem;
  }
  const std::string problem = is_no_cell(fit);
  return problem.empty() ? spans_too_little(fit, reach_of(data), base) : problem;
}

std::vector<std::string> remarks_on(const Fit& fit, const std::vector<FitSeries>& data) {
  std::vector<std::string> remarks;
  for (std::size_t k = 0; k < data.size(); ++k) {
    const std::string& name = data[k].series.name;
    const std::size_t rows = data[k].series.rows.size();
    const std::size_t left_out = rows - fit.quality[k].rows;
    if (left_out > 0) {
      remarks.push_back(name + text_of(": %zu of %zu rows left out: without current, voltage, temperature or charge",
                                       left_out, rows));
    }
    if (data[k].assumed_begin_soc) {
      remarks.push_back("warning: " + name +
                        text_of(": no column 'ref_soc_pct': its charge is counted from %.0f %%, an assumption; give "
                                "--begin-soc with what it began at",
                                *data[k].assumed_begin_soc * percent));
    }
  }
  const ChargeReach reach = reach_of(data);
  const auto remark_on_end = [&remarks](bool is_reached, const char* side, double soc) {
    if (is_reached) return;
    remarks.push_back(
        text_of("warning: no recording has a charge %s %.0f %%: the tables are carried on there, without "
                "a measurement",
                side, soc * percent));
  };
  remark_on_end(reach.has_empty_end(), "below", reach.min);
  remark_on_end(reach.has_full_end(), "above", reach.max);
  return remarks;
}

}  // namespace bmu::cell
