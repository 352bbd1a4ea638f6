// State of energy: the energy that the pack delivers from now on until it is empty, at the present load and
// temperature.
//
// All cells in series carry the same charge, so that with q the charge that has left the pack
//
//   E = integral from 0 to q_end of  N * v(z - q / Q) dq
//   v(z) = OCV(z, T) - H(z, T) - (1 + s) * (I * (R0 + R1 + R2 + R3) + K(z, T) * asinh(I / I0(T)) * I0(T))
//
// v is the terminal voltage of a cell that has carried the load I for so long that its RC elements have settled, on the
// discharge curve (cell_dynamics.hpp); s is the relative deviation of its resistance from the model's. N cells count
// with the means of z, Q and s. The end is where the emptiest cell is empty, or where its voltage under the load falls
// to the threshold that opens the pack, whichever comes first: in the cold, and under load, much of the charge cannot
// be taken. (Energy as the integral of the voltage over the remaining charge: G. L. Plett, Battery Management Systems,
// Vol. II, Artech House 2016, chapter 1.)
//
// The uncertainty, one standard deviation, has three independent parts:
//   - the state of charge: half of the difference of E between one standard deviation more and less of it, for all
//     cells;
//   - the model: the voltages of all cells may be off by its slow error at the same time;
//   - the emptiest cell's resistance: the decrease of E by one standard deviation more of it.
// It contains no change of the load or of the temperature.
//
// Evaluated when it is queried, once a second or less; no state. Cost: at most 8 * energy_steps evaluations of the
// model and a pass over the cells, some 20 us. Pure and without allocation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/pack_estimate.hpp"

namespace bmu {

/// Number of equal steps in which the remaining charge is integrated.
inline constexpr int energy_steps = 50;

struct EnergyLeftInput {
  std::size_t cell_count = 0;           // in series, at least 1
  double soc_mean = 0.0;                // of all cells, 0 to 1
  double capacity_mean_As = 0.0;        // of all cells, above 0
  double resistance_share_mean = 0.0;   // of all cells: 0.4 is 40 % more than the model
  SocEstimate emptiest{};               // the cell that is empty first
  double emptiest_capacity_As = 0.0;    // above 0
  double emptiest_share = 0.0;          // its resistance, as above
  double emptiest_share_sigma = 0.0;    // one standard deviation of it, 0 or more
  double load_A = 0.0;                  // out of the pack; a charging current counts as no load
  double temperature_C = not_measured;  // of the coldest module
  double voltage_min_V = 0.0;           // of a cell, at which the pack opens
};

struct EnergyLeft {
  bool is_known = false;  // false: the other members mean nothing
  double energy_Wh = 0.0;
  double sigma_Wh = 0.0;  // one standard deviation
  double load_A = 0.0;    // the load that it is valid for, 0 or more
};

/// Not known for a model without tables, for a temperature or a state of charge that is not known, and for capacities
/// that are not above 0.
[[nodiscard]] EnergyLeft energy_left(const CellDynamics& cell, const EnergyLeftInput& input);

/// Of the pack as estimated, at its mean current of the last minute. Not known until the state of charge of each cell
/// and the temperature of each module are.
[[nodiscard]] EnergyLeft energy_left(const PackEstimate& estimate, const CoreConfig& config);

/// Input of the function above.
[[nodiscard]] EnergyLeftInput energy_left_input(const PackEstimate& estimate, const CoreConfig& config);

/// Unit of status, history and report.
[[nodiscard]] std::int64_t in_mWh(double energy_Wh);

}  // namespace bmu
