// Inputs of a fit: the data, the nonlinear parameters of the model, and the regularisation of the tables.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

/// A recorded test, with the charge known at every row.
struct FitSeries {
  Series series;
  /// A slow discharge and charge for the open-circuit curve. Counters that run for days are off by a few percent, so
  /// its own charge axis is not used: its halves are aligned to the curve of the other series, and have weight only
  /// where no other series has data.
  bool is_slow_curve = false;
  std::optional<double> assumed_begin_soc{};  // assumed start of the charge count, if none was given
};

/// Parameters that a linear fit cannot find. These values performed best on four kinds of cells, measured on recordings
/// that were not part of the fit; a search for the best fit to one recording gives worse results on the next.
struct FitPlan {
  double capacity_Ah = 0.0;                  // above 0
  std::vector<double> temperatures_C{25.0};  // of the rows, rising, at most CellDynamics::temperatures_max
  std::array<double, CellDynamics::pairs> pair_time_constant_s{6.0, 60.0, 350.0};
  double activation_K = 4000.0;
  double exchange_current_C = 0.5;  // at 25 C, in multiples of the 1C current; above 0
  double exchange_activation_K = 5000.0;
  double hysteresis_charge = 0.03;
  double charge_efficiency = 1.0;
};

/// Regularisation of the tables where the data determine little: one standard deviation of each term. Resistances are
/// in multiples of `typical_Ohm` by Arrhenius' law, so that a row of all 1 is a typical cell.
struct FitWishes {
  double typical_Ohm = 0.020;
  double curve_bend_V = 0.004;    // second difference of an open-circuit curve
  double curve_step_V = 0.015;    // difference of two rows of temperature
  double curve_tilt_V = 0.003;    // change of that difference from point to point
  double resistance_bend = 0.08;  // second difference
  double resistance_step = 0.30;  // difference of two rows
  double resistance_size = 1.5;
  double hysteresis_V = 0.020;  // size; second difference and row difference are this times those of the resistances
  double voltage_V = 0.004;     // standard deviation of a row from the model
  double slow_curve_V = 0.300;  // the same for a row of a slow curve
  double same_story_s = 60.0;   // correlation time: rows nearer than this to each other count as one
};

}  // namespace bmu::cell
