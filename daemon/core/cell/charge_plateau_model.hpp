// What a whole charge says of the capacity of a kind of cell (charge_plateau.hpp).
#pragma once

namespace bmu {

/// What is known of a kind of cell. The file that it comes from has checked it.
struct ChargePlateauModel {
  double plateau_weight = 0.0;
  double above_weight = 1.0;
  double sigma_As = 0.0;        // of a capacity from one charge, one standard deviation, above 0
  double current_A = 0.0;       // of the charges it was fitted to, above 0
  double full_voltage_V = 0.0;  // at which these were held
  double end_current_A = 0.0;   // at which these were full, above 0
  double temperature_min_C = 15.0;
  double temperature_max_C = 40.0;
};

}  // namespace bmu
