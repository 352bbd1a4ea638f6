#include "daemon/core/estimation/hysteresis_range.hpp"

#include <cmath>

namespace bmu {

void HysteresisRange::init(const CellModel& cell) {
  constexpr double all_permille = 1'000.0;
  *this = {};
  hysteresis_uV_ = cell.hysteresis_V * 1e6;
  charge_uAs_ = static_cast<double>(cell.capacity_uAs) * cell.hysteresis_charge_permille / all_permille;
}

void HysteresisRange::forget() {
  low_ = -1.0;
  high_ = 1.0;
}

double HysteresisRange::after(double h, std::int64_t left_uAs) const {
  const double end = left_uAs > 0 ? -1.0 : 1.0;
  return end + (h - end) * std::exp(-std::fabs(static_cast<double>(left_uAs)) / charge_uAs_);
}

void HysteresisRange::flow(std::int64_t least_uAs, std::int64_t most_uAs) {
  if (hysteresis_uV_ <= 0.0) return;
  if (most_uAs != 0) low_ = after(low_, most_uAs);
  if (least_uAs != 0) high_ = after(high_, least_uAs);
}

}  // namespace bmu
