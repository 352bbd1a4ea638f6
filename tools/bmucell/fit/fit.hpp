// Fits the tables of a CellDynamics to recorded tests.
//
// With the charge known from the recording, the terminal voltage is a linear function of everything in the tables: of
// the open-circuit voltages, of the resistances at once, and, since a pair's voltage is its current through a filter of
// known time constant, of the pairs' resistances too. So a fit is one system of linear equations with one answer: least
// squares over all rows of all series, with the wish that tables are smooth wherever the data say little (Tikhonov
// regularisation; P. C. Hansen, Discrete Inverse Problems, SIAM 2010, chapter 8). Nothing needs a first guess, and the
// same data give the same tables. Resistances below nothing and curves that fall are then pinned and the rest solved
// again, until none is left.
//
// Cost: a second or two for a hundred thousand rows and five temperatures.
#pragma once

#include <string>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tools/bmucell/fit/fit_plan.hpp"

namespace bmu::cell {

struct FitQuality {
  std::string name;
  bool is_slow_curve = false;
  double rmse_V = 0.0;
  double worst_V = 0.0;
  std::size_t rows = 0;  // that were whole
};

struct Fit {
  CellDynamics cell;
  double misfit = 0.0;  // squares of sigmas, of all rows and wishes
  std::vector<FitQuality> quality;
};

/// `data`: at least one series with temperature and charge. `plan` as its comments say.
[[nodiscard]] Fit fit(const FitPlan& plan, const FitWishes& wishes, const std::vector<FitSeries>& data);

}  // namespace bmu::cell
