// The recordings of a fit, read and made ready: with the charge of every row, and the temperatures they are at.
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
  CellModel cell{};                   // the base: its temperatures are those that a recording may have
  std::optional<double> begin_soc{};  // of series without ref_soc_pct: those are counted from there; default: full
};

/// The error is that of the first file that is wrong or no test of a cell (plausible_recording.hpp), with the likely
/// cause.
[[nodiscard]] Result<std::vector<FitSeries>, std::string> read_fit_data(const FitSource& source);

/// Where the series are: their typical temperatures, those that are near each other as one, rising.
[[nodiscard]] std::vector<double> temperatures_of(const std::vector<FitSeries>& data);

}  // namespace bmu::cell
