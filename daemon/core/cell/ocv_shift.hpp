// How far the open-circuit voltage of a cell comes when a charge flows, whatever its state of charge is: between the
// flattest and the steepest stretch of its curve. Needs no estimate of the charge, so none can be wrong.
#pragma once

#include <cstdint>

#include "daemon/core/cell/cell_model.hpp"

namespace bmu {

struct OcvShift {
  double least_uV = 0.0;
  double most_uV = 0.0;
};

/// For this much charge, either way, 0 or more. Beyond the capacity: from one end of the curve to the other.
/// Cost: each of the curve's points against the curve.
[[nodiscard]] OcvShift ocv_shift(const CellModel& cell, std::int64_t charge_uAs);

/// The least charge that moves the voltage by this much wherever the cell stands, to 1/1000 of the capacity; 0: none
/// does.
[[nodiscard]] std::int64_t charge_for_shift_uAs(const CellModel& cell, double least_uV);

}  // namespace bmu
