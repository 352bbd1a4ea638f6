#include "tools/bmucell/steady_current.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>

#include "tools/bmucell/plausible_recording.hpp"

namespace bmu::cell {

namespace {

using Rows = std::span<const SeriesRow>;

constexpr double current_min_C = 0.02;
constexpr double steady_share = 0.05;
constexpr double noise_C = 0.002;
/// What of the polarisation is fast is over: five times 60 s.
constexpr double fast_s = 300.0;
constexpr double span_min_s = 600.0;
constexpr double settled_s = 1800.0;
constexpr double move_min_V = 0.010;
/// Five standard deviations: of a slow curve hundreds of spans are looked at. Of normal noise the mean size of the
/// difference between two rows is 1.13 of its standard deviations.
constexpr double noise_factor = 5.0 / 1.128;
/// Of a polarisation of 600 s a span of 600 s leaves 37 %.
constexpr double kept_share = 0.5;
constexpr double cold_C = 10.0;
constexpr double warmed_C = 2.0;

/// A move of the voltage that the current cannot have made.
struct Move {
  const SeriesRow* first = nullptr;
  double from_s = 0.0;
  double to_s = 0.0;
  double by_V = 0.0;
};

/// Of the voltages that were measured from `from_s` to `to_s`; not a number without any.
struct Mean {
  double voltage_V = 0.0;
  double count = 0.0;
};

Mean mean_of(Rows rows, double from_s, double to_s) {
  const auto begin = std::lower_bound(rows.begin(), rows.end(), from_s,
                                      [](const SeriesRow& row, double at) { return row.time_s < at; });
  double sum_V = 0.0;
  double count = 0.0;
  for (auto row = begin; row != rows.end() && row->time_s <= to_s; ++row) {
    if (!std::isfinite(row->voltage_V)) continue;
    sum_V += row->voltage_V;
    count += 1.0;
  }
  return {.voltage_V = sum_V / count, .count = count};
}

/// What a difference of two means has to exceed to be none of noise.
double noise_V(const Mean& one, const Mean& other, double difference_V) {
  return noise_factor * difference_V * std::sqrt(1.0 / one.count + 1.0 / other.count);
}

/// Against the current, in the second of two spans that begin at `from_s`. `difference_V`: the usual one
/// of the stretch.
std::optional<Move> move_in(Rows stretch, double from_s, double span_s, double difference_V) {
  const double averaged_s = span_s / 5.0;
  const double to_s = from_s + 2.0 * span_s;
  const Mean begin = mean_of(stretch, from_s, from_s + averaged_s);
  const Mean middle = mean_of(stretch, from_s + span_s - averaged_s / 2.0, from_s + span_s + averaged_s / 2.0);
  const Mean end = mean_of(stretch, to_s - averaged_s, to_s);
  const double against = stretch.front().current_A > 0.0 ? 1.0 : -1.0;
  const double before_V = against * (middle.voltage_V - begin.voltage_V);
  const double by_V = against * (end.voltage_V - middle.voltage_V);
  const bool goes_on = span_s >= settled_s || by_V >= kept_share * before_V;
  const double least_V = std::max(move_min_V, noise_V(middle, end, difference_V));
  if (!(by_V >= least_V) || !goes_on) return std::nullopt;
  return Move{.first = &stretch.front(), .from_s = from_s + span_s, .to_s = to_s, .by_V = against * by_V};
}

bool is_judged(Rows stretch, double capacity_Ah) {
  const double warmed_by_C = stretch.back().temperature_C - stretch.front().temperature_C;
  const bool warms_itself = stretch.front().temperature_C < cold_C && warmed_by_C > warmed_C;
  return std::abs(stretch.front().current_A) >= current_min_C * capacity_Ah && !warms_itself;
}

std::optional<Move> first_move(Rows stretch, double capacity_Ah) {
  const double difference_V = voltage_noise(stretch, capacity_Ah).usual_V;
  const double begin_s = stretch.front().time_s + fast_s;
  const double end_s = stretch.back().time_s;
  for (double span_s = span_min_s; begin_s + 2.0 * span_s <= end_s; span_s *= 2.0) {
    for (double from_s = begin_s; from_s + 2.0 * span_s <= end_s; from_s += span_s / 2.0) {
      if (const auto move = move_in(stretch, from_s, span_s, difference_V)) return move;
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
    const auto move = is_judged(stretch, capacity_Ah) ? first_move(stretch, capacity_Ah) : std::nullopt;
    if (move) {
      return text_of(*move, has_one_sign(series, capacity_Ah) ? "the current without its sign?"
                                                              : "the current with the other sign there?");
    }
    begin = k;
  }
  return "";
}

}  // namespace bmu::cell
