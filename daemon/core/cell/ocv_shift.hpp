// Change of the open-circuit voltage of a cell by a charge, at any SOC: between the flattest and the steepest section
// of its curve. It needs no estimate of the SOC, and so has no error from one.
#pragma once

#include <cstdint>

#include "daemon/core/cell/cell_model.hpp"

namespace bmu {

struct OcvShift {
  double least_uV = 0.0;
  double most_uV = 0.0;
};

/// For this charge, in either direction, 0 or more. Beyond the capacity: from one end of the curve to the other. Cost:
/// each of the curve's points against the curve.
[[nodiscard]] OcvShift ocv_shift(const CellModel& cell, std::int64_t charge_uAs);

/// Minimum charge that changes the voltage by this much at any SOC, to 1/1000 of the capacity; 0: none.
[[nodiscard]] std::int64_t charge_for_shift_uAs(const CellModel& cell, double least_uV);

}  // namespace bmu
