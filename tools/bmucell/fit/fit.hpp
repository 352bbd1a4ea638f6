// Fits the tables of a CellDynamics to recorded tests.
//
// With the charge known from the recording, the terminal voltage is a linear function of everything in the tables: of
// the open-circuit voltages, of the instantaneous resistances, and, since the voltage of an RC element is its current
// through a filter of known time constant, of the RC resistances too. So a fit is one system of linear equations with
// one solution: least squares over all rows of all series, with a regularisation that keeps tables smooth where the
// data determine little (Tikhonov regularisation; P. C. Hansen, Discrete Inverse Problems, SIAM 2010, chapter 8). No
// initial guess is needed, and the same data give the same tables. Negative resistances and falling curves are then
// pinned and the remaining unknowns solved again, until none is left.
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
  std::size_t rows = 0;  // rows without missing values
};

struct Fit {
  CellDynamics cell;
  double misfit = 0.0;  // sum of squared residuals in units of their sigma, over all rows and regularisation terms
  std::vector<FitQuality> quality;
};

/// `data`: at least one series with temperature and charge. `plan`: within the ranges of its comments.
[[nodiscard]] Fit fit(const FitPlan& plan, const FitWishes& wishes, const std::vector<FitSeries>& data);

}  // namespace bmu::cell
