#include "tools/bmucell/data/steady_current.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>

#include "tools/bmucell/data/plausible_recording.hpp"

namespace bmu::cell {

namespace {

using Rows = std::span<const SeriesRow>;

constexpr double current_min_C = 0.02;
constexpr double steady_share = 0.05;
constexpr double noise_C = 0.002;
/// The fast polarisation has decayed after this time: five times 60 s.
constexpr double fast_s = 300.0;
constexpr double span_min_s = 600.0;
constexpr double settled_s = 1800.0;
constexpr double move_min_V = 0.010;
/// A span of 600 s leaves 37 % of a polarisation with a time constant of 600 s.
constexpr double kept_share = 0.5;
constexpr double cold_C = 10.0;
constexpr double warmed_C = 2.0;

/// A change of the voltage that the current cannot have caused.
struct Move {
  const SeriesRow* first = nullptr;
  double from_s = 0.0;
  double to_s = 0.0;
  double by_V = 0.0;
};

/// Mean of the voltages measured from `from_s` to `to_s`; not a number without any.
double mean_V(Rows rows, double from_s, double to_s) {
  const auto begin = std::lower_bound(rows.begin(), rows.end(), from_s,
                                      [](const SeriesRow& row, double at) { return row.time_s < at; });
  double sum_V = 0.0;
  double count = 0.0;
  for (auto row = begin; row != rows.end() && row->time_s <= to_s; ++row) {
    if (!std::isfinite(row->voltage_V)) continue;
    sum_V += row->voltage_V;
    count += 1.0;
  }
  return sum_V / count;
}

/// A voltage change against the current, in the second of two spans that start at `from_s`.
std::optional<Move> move_in(Rows stretch, double from_s, double span_s) {
  const double averaged_s = span_s / 5.0;
  const double to_s = from_s + 2.0 * span_s;
  const double begin_V = mean_V(stretch, from_s, from_s + averaged_s);
  const double middle_V = mean_V(stretch, from_s + span_s - averaged_s / 2.0, from_s + span_s + averaged_s / 2.0);
  const double end_V = mean_V(stretch, to_s - averaged_s, to_s);
  const double against = stretch.front().current_A > 0.0 ? 1.0 : -1.0;
  const double before_V = against * (middle_V - begin_V);
  const double by_V = against * (end_V - middle_V);
  const bool goes_on = span_s >= settled_s || by_V >= kept_share * before_V;
  if (!(by_V >= move_min_V) || !goes_on) return std::nullopt;
  return Move{.first = &stretch.front(), .from_s = from_s + span_s, .to_s = to_s, .by_V = end_V - middle_V};
}

bool is_judged(Rows stretch, double capacity_Ah) {
  const double warmed_by_C = stretch.back().temperature_C - stretch.front().temperature_C;
  const bool warms_itself = stretch.front().temperature_C < cold_C && warmed_by_C > warmed_C;
  return std::abs(stretch.front().current_A) >= current_min_C * capacity_Ah && !warms_itself;
}

std::optional<Move> first_move(Rows stretch) {
  const double begin_s = stretch.front().time_s + fast_s;
  const double end_s = stretch.back().time_s;
  for (double span_s = span_min_s; begin_s + 2.0 * span_s <= end_s; span_s *= 2.0) {
    for (double from_s = begin_s; from_s + 2.0 * span_s <= end_s; from_s += span_s / 2.0) {
      if (const auto move = move_in(stretch, from_s, span_s)) return move;
    }
  }
  return std::nullopt;
}

bool is_as_before(const SeriesRow& first, const SeriesRow& row, double capacity_Ah) {
  return std::abs(row.current_A - first.current_A) <= steady_share * std::abs(first.current_A) + noise_C * capacity_Ah;
}

std::string text_of(const Move& move, const char* cause) {
  const bool is_rise = move.by_V > 0.0;
  constexpr double mV_per_V = 1e3;
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(),
                ": current_A: from %.0f to %.0f s the voltage %s by %.0f mV at a steady %.4g A, expected it to %s; %s",
                move.from_s, move.to_s, is_rise ? "rises" : "falls", std::abs(move.by_V) * mV_per_V,
                move.first->current_A, is_rise ? "fall" : "rise", cause);
  const std::string line = move.first->line == 0 ? "" : ":" + std::to_string(move.first->line);
  return line + text.data();
}

}  // namespace

std::string implausible_steady_current(const Series& series, double capacity_Ah) {
  const Rows rows(series.rows);
  const double gap_s = gap_of(series);
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= rows.size(); ++k) {
    const bool goes_on = k < rows.size() && is_as_before(rows[begin], rows[k], capacity_Ah) &&
                         rows[k].time_s - rows[k - 1].time_s <= gap_s;
    if (goes_on) continue;
    const Rows stretch = rows.subspan(begin, k - begin);
    const auto move = is_judged(stretch, capacity_Ah) ? first_move(stretch) : std::nullopt;
    if (move) {
      return text_of(*move, has_one_sign(series, capacity_Ah) ? "the current without its sign?"
                                                              : "the current with the other sign there?");
    }
    begin = k;
  }
  return "";
}

}  // namespace bmu::cell
