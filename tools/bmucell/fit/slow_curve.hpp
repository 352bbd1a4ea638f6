// Lays the halves of a slow discharge and charge onto an open-circuit curve that is known from elsewhere.
//
// A tester's counter that is off by five thousandths of its range counts a day of a C/20 test wrong by several percent,
// and the cell of that day has another age. What such a test knows is the shape. So each half is shifted and stretched
// along the charge until its shape is that of the curve; a difference that is the same all along (the hysteresis) does
// not count.
#pragma once

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tools/bmucell/fit/voltage_terms.hpp"

namespace bmu::cell {

/// For both halves; a half without enough rows within the curve stays where it is. `cell` has the curve and
/// resistances.
[[nodiscard]] ChargeAxes lay_onto(const CellDynamics& cell, const Series& slow);

}  // namespace bmu::cell
