#include "tools/bmucell/fit/slow_curve.hpp"

#include <cmath>
#include <limits>
#include <numeric>

namespace bmu::cell {

namespace {

// Search ranges, which are the largest counter errors, and their increments.
constexpr double at_full_max = 0.06;
constexpr double at_full_step = 0.005;
constexpr double at_empty_max = 0.12;
constexpr double at_empty_step = 0.01;
/// Standard deviations of both shifts and of the voltages: they decide if the shape does not.
constexpr double at_full_sigma = 0.03;
constexpr double at_empty_sigma = 0.06;
constexpr double shape_sigma_V = 0.001;
// Range in which curves are known best and bend least.
constexpr double soc_min = 0.12;
constexpr double soc_max = 0.97;
constexpr std::size_t rows_min = 30;

struct Point {
  double soc = 0.0;
  double open_V = 0.0;  // without the voltage drop of the current
  double temperature_C = 0.0;
};

std::vector<Point> points_of(const CellDynamics& cell, const Series& slow, std::size_t half) {
  const double capacity_Ah = cell.capacity_As / 3600.0;
  constexpr double current_min_C = 0.01;
  const std::vector<std::size_t> halves = halves_of(slow, capacity_Ah);
  std::vector<Point> points;
  for (std::size_t k = 0; k < slow.rows.size(); ++k) {
    const SeriesRow& row = slow.rows[k];
    if (halves[k] != half || !(std::abs(row.current_A) >= current_min_C * capacity_Ah)) continue;
    const CellPoint here = at(cell, row.soc, row.temperature_C);
    const double resistance_Ohm = std::accumulate(here.pair_Ohm.begin(), here.pair_Ohm.end(), here.series_Ohm);
    const double open_V = row.voltage_V + resistance_Ohm * row.current_A + kinetic_V(here, row.current_A);
    if (std::isfinite(open_V)) points.push_back({row.soc, open_V, row.temperature_C});
  }
  return points;
}

/// Mean square of the deviation after removal of its mean, plus the penalty for the shift.
double misfit(const CellDynamics& cell, const std::vector<Point>& points, const ChargeAxis& axis) {
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (const Point& point : points) {
    const double soc = axis.of(point.soc);
    if (soc < soc_min || soc > soc_max) continue;
    const double off_V = point.open_V - at(cell, soc, point.temperature_C).ocv_V;
    sum += off_V;
    squares += off_V * off_V;
    count += 1.0;
  }
  if (count < static_cast<double>(rows_min)) return std::numeric_limits<double>::infinity();
  const double full = axis.at_full / at_full_sigma;
  const double empty = axis.at_empty / at_empty_sigma;
  return (squares - sum * sum / count) / count / (shape_sigma_V * shape_sigma_V) + full * full + empty * empty;
}

ChargeAxis best_axis(const CellDynamics& cell, const std::vector<Point>& points) {
  ChargeAxis best;
  double least = std::numeric_limits<double>::infinity();
  const int full_steps = static_cast<int>(std::lround(at_full_max / at_full_step));
  const int empty_steps = static_cast<int>(std::lround(at_empty_max / at_empty_step));
  for (int full = -full_steps; full <= full_steps; ++full) {
    for (int empty = -empty_steps; empty <= empty_steps; ++empty) {
      const ChargeAxis axis{.at_full = full * at_full_step, .at_empty = empty * at_empty_step};
      const double off = misfit(cell, points, axis);
      if (off >= least) continue;
      least = off;
      best = axis;
    }
  }
  return best;
}

}  // namespace

ChargeAxes lay_onto(const CellDynamics& cell, const Series& slow) {
  ChargeAxes axes;
  for (std::size_t half = 0; half < axes.size(); ++half) axes[half] = best_axis(cell, points_of(cell, slow, half));
  return axes;
}

}  // namespace bmu::cell
