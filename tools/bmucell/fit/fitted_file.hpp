// Converts a fit to a cell file: its tables as "dynamics", and the scalar values of the file from the tables at 25 C
// and half full, so that the emulated pack, balancing and diagnosis use the same cell.
#pragma once

#include "config/cell_file/cell_config.hpp"
#include "tools/bmucell/fit/fit.hpp"

namespace bmu::cell {

/// `file` with the fitted values. Limits and thermal parameters stay as they are.
[[nodiscard]] CellFile with_fit(CellFile file, const Fit& fit);

}  // namespace bmu::cell
