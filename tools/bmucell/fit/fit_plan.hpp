// What a fit is told: the data, what is not linear in the model, and how smooth tables are wished to be.
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
  /// its own charge axis is not believed: its halves are laid onto the curve that the other series gave, and count only
  /// for what no other series reached.
  bool is_slow_curve = false;
  std::optional<double> assumed_begin_soc{};  // counted from there, which was not given
};

/// What the model needs and no linear fit can find. These did best on four kinds of cells by what matters, recordings
/// that the fit had not seen; searching for those that fit one recording best makes it worse on the next.
struct FitPlan {
  double capacity_Ah = 0.0;                  // above 0
  std::vector<double> temperatures_C{25.0};  // of the rows, rising, at most CellDynamics::temperatures_max
  std::array<double, CellDynamics::pairs> pair_time_constant_s{6.0, 60.0, 350.0};
  double activation_K = 4000.0;
  double exchange_current_C = 0.5;  // at 25 C, in multiples of the current that empties the cell in an hour; above 0
  double exchange_activation_K = 5000.0;
  double hysteresis_charge = 0.03;
  double charge_efficiency = 1.0;
};

/// How tables are wished to be where the data say little: one standard deviation of each wish. Resistances count in
/// multiples of `typical_Ohm` by Arrhenius' law, so that a row that is all 1 is a cell like any other.
struct FitWishes {
  double typical_Ohm = 0.020;
  double curve_bend_V = 0.004;    // second difference of an open-circuit curve
  double curve_step_V = 0.015;    // difference of two rows of temperature
  double curve_tilt_V = 0.003;    // how that difference changes from point to point
  double resistance_bend = 0.08;  // second difference
  double resistance_step = 0.30;  // difference of two rows
  double resistance_size = 1.5;
  double hysteresis_V = 0.020;  // size; bends and steps are this times those of the resistances
  double voltage_V = 0.004;     // by which a row may miss the model
  double slow_curve_V = 0.300;  // by which a row of a slow curve may
  double same_story_s = 60.0;   // rows nearer than this to each other count as one
};

}  // namespace bmu::cell
