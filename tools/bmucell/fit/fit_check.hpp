// Whether what a fit found can be a cell: the recordings may be plausible each, and not be of one cell, or begin at
// another charge than they were counted from.
#pragma once

#include <string>
#include <vector>

#include "daemon/core/cell/cell_model.hpp"
#include "tools/bmucell/fit/fit.hpp"

namespace bmu::cell {

/// The default of --rmse-max-mV. Of the measured drives that the shipped cell files are fitted to, none is missed by
/// more than 47 mV.
inline constexpr double rmse_max_default_V = 0.100;

/// What is wrong, with the likely cause; "": nothing. Each recording has rows to fit to; the model misses none by more
/// than `rmse_max_V`, slow curves, which count for little, by three times that; at each temperature the open-circuit
/// voltage is within 0.5 to 6 V and spans a fifth of the cell's window from `base`, or a twentieth where no recording
/// reached both ends.
[[nodiscard]] std::string implausible_fit(const Fit& fit, const std::vector<FitSeries>& data, const CellModel& base,
                                          double rmse_max_V);

/// What a user has to know of a fit that is written nevertheless, a line each: rows left out, a charge that was counted
/// from an assumption, an end of the charge that no recording reached.
[[nodiscard]] std::vector<std::string> remarks_on(const Fit& fit, const std::vector<FitSeries>& data);

}  // namespace bmu::cell
