// What a fit means for a cell file: its tables as "dynamics", and the few numbers of the file as what the tables say at
// 25 C and half full, so that the emulated pack, balancing and diagnosis live by the same cell.
#pragma once

#include "config/cell_file/cell_config.hpp"
#include "tools/bmucell/fit/fit.hpp"

namespace bmu::cell {

/// `file` with what was fitted. Limits and heat stay as they are.
[[nodiscard]] CellFile with_fit(CellFile file, const Fit& fit);

}  // namespace bmu::cell
