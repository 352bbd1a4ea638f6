#include "daemon/core/cell/ocv_shift.hpp"

#include <algorithm>

namespace bmu {

namespace {

constexpr double all_permille = 1'000.0;

}  // namespace

/// Of piecewise linear curves: the extremes are where one end of the charge interval is at a point of the curve.
OcvShift ocv_shift(const CellModel& cell, std::int64_t charge_uAs) {
  const double span_permille =
      std::min(static_cast<double>(charge_uAs) * all_permille / static_cast<double>(cell.capacity_uAs), all_permille);
  const double all_uV = cell.ocv[cell.ocv.size() - 1].ocv_uV - cell.ocv[0].ocv_uV;
  OcvShift shift{.least_uV = all_uV};
  const auto look = [&](double from_permille) {
    const double low_permille = std::clamp(from_permille, 0.0, all_permille - span_permille);
    const double moved_uV = ocv_uV(cell, low_permille + span_permille) - ocv_uV(cell, low_permille);
    shift = {std::min(shift.least_uV, moved_uV), std::max(shift.most_uV, moved_uV)};
  };
  for (const OcvPoint& point : cell.ocv) {
    look(point.soc_permille);
    look(point.soc_permille - span_permille);
  }
  return shift;
}

std::int64_t charge_for_shift_uAs(const CellModel& cell, double least_uV) {
  constexpr std::int64_t steps = 1'000;
  if (cell.ocv.size() < 2) return 0;
  for (std::int64_t step = 1; step <= steps; ++step) {
    const std::int64_t charge_uAs = cell.capacity_uAs / steps * step;
    if (ocv_shift(cell, charge_uAs).least_uV >= least_uV) return charge_uAs;
  }
  return 0;
}

}  // namespace bmu
