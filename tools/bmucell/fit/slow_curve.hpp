// Aligns the halves of a slow discharge and charge to an open-circuit curve from another source.
//
// A tester's counter with an error of five thousandths of its range counts a day of a C/20 test wrong by several
// percent, and the cell has another age on that day. Only the shape of such a test is reliable. So each half is shifted
// and stretched along the charge until its shape is that of the curve; a constant difference (the hysteresis) does not
// count.
#pragma once

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tools/bmucell/fit/voltage_terms.hpp"

namespace bmu::cell {

/// For both halves; a half without enough rows within the curve is not shifted. `cell` has the curve and resistances.
[[nodiscard]] ChargeAxes lay_onto(const CellDynamics& cell, const Series& slow);

}  // namespace bmu::cell
