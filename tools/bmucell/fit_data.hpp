// The recordings of a fit, read and made ready: with the charge of every row, and the temperatures they are at.
#pragma once

#include <string>
#include <vector>

#include "protocol/result.hpp"
#include "tools/bmucell/fit_plan.hpp"

namespace bmu::cell {

struct FitSource {
  std::vector<std::string> files;
  std::vector<std::string> slow_files;
  double capacity_Ah = 0.0;
  double begin_soc = 1.0;  // of series without ref_soc_pct: those are counted from there
};

/// The error is that of the first file that is wrong, or without temperatures.
[[nodiscard]] Result<std::vector<FitSeries>, std::string> read_fit_data(const FitSource& source);

/// Where the series are: their typical temperatures, those that are near each other as one, rising.
[[nodiscard]] std::vector<double> temperatures_of(const std::vector<FitSeries>& data);

}  // namespace bmu::cell
