// What a fit left over, by row of temperature: how far the model is off for minutes, and how far for seconds. The
// filter lives by the difference: what passes within seconds averages out, what lasts does not.
#pragma once

#include <cstddef>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"

namespace bmu::cell {

class ModelError {
 public:
  explicit ModelError(const CellDynamics& cell) : cell_(cell), sums_(cell.rows.size()) {}

  /// What the model was off by in each row of one series, about a second apart, and the temperatures.
  void add(const std::vector<double>& off_V, const std::vector<double>& temperatures_C);
  /// Writes the errors into the rows; one without enough data gets those of its warmer neighbour, or else its colder.
  void write_to(CellDynamics& cell) const;

 private:
  struct Sums {
    double slow_V2 = 0.0;
    double blocks = 0.0;
    double fast_V2 = 0.0;
    double lagged_V2 = 0.0;
    double rows = 0.0;
  };
  void add_block(const double* off_V, double temperature_C);

  const CellDynamics& cell_;
  std::vector<Sums> sums_;
};

}  // namespace bmu::cell
