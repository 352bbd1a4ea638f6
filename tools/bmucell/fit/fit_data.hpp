// Reads and prepares the recordings of a fit: the charge of every row, and the temperatures of the series.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/core/cell/cell_model.hpp"
#include "protocol/result.hpp"
#include "tools/bmucell/fit/fit_plan.hpp"

namespace bmu::cell {

struct FitSource {
  std::vector<std::string> files;
  std::vector<std::string> slow_files;
  double capacity_Ah = 0.0;
  CellModel cell{};                   // the base: its temperature range is the permitted one of a recording
  std::optional<double> begin_soc{};  // start of series without ref_soc_pct, from which they are counted; default: full
};

/// The error is that of the first file that cannot be read or is no test of a cell (plausible_recording.hpp), with the
/// likely cause.
[[nodiscard]] Result<std::vector<FitSeries>, std::string> read_fit_data(const FitSource& source);

/// The typical temperatures of the series, those near each other as one, rising.
[[nodiscard]] std::vector<double> temperatures_of(const std::vector<FitSeries>& data);

}  // namespace bmu::cell
