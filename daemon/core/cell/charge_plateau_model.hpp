// Parameters for the capacity from a complete charge, of a cell type (charge_plateau.hpp).
#pragma once

namespace bmu {

/// Parameters of a cell type, validated when the cell file is read.
struct ChargePlateauModel {
  double plateau_weight = 0.0;
  double above_weight = 1.0;
  double sigma_As = 0.0;        // of a capacity from one charge, one standard deviation, above 0
  double current_A = 0.0;       // of the charges of the fit, above 0
  double full_voltage_V = 0.0;  // constant voltage of these charges
  double end_current_A = 0.0;   // end of charge current of these charges, above 0
  double temperature_min_C = 15.0;
  double temperature_max_C = 40.0;
};

}  // namespace bmu
