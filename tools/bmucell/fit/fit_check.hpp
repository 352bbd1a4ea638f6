// Plausibility of a fit: each recording may be plausible, but not all of one cell, or may start at another charge than
// the one it was counted from.
#pragma once

#include <string>
#include <vector>

#include "daemon/core/cell/cell_model.hpp"
#include "tools/bmucell/fit/fit.hpp"

namespace bmu::cell {

/// The default of --rmse-max-mV. The largest error over the measured drives that the shipped cell files are fitted to
/// is 47 mV.
inline constexpr double rmse_max_default_V = 0.100;

/// The error with its likely cause; "": none. Each recording must have rows to fit to; its model error must not exceed
/// `rmse_max_V`, for slow curves, which have little weight, three times that; at each temperature the open-circuit
/// voltage must be within 0.5 to 6 V and span a fifth of the cell's window from `base`, or a twentieth if no recording
/// reached both ends.
[[nodiscard]] std::string implausible_fit(const Fit& fit, const std::vector<FitSeries>& data, const CellModel& base,
                                          double rmse_max_V);

/// Remarks for the user on a fit that is written nevertheless, a line each: omitted rows, a charge that was counted
/// from an assumption, an end of the charge that no recording reached.
[[nodiscard]] std::vector<std::string> remarks_on(const Fit& fit, const std::vector<FitSeries>& data);

}  // namespace bmu::cell
