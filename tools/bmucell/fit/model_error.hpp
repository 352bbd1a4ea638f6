// Remaining model error of a fit, by row of temperature: the slow part, over minutes, and the fast part, over seconds.
// The filter needs the distinction: an error of seconds averages out, a lasting one does not.
#pragma once

#include <cstddef>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"

namespace bmu::cell {

class ModelError {
 public:
  explicit ModelError(const CellDynamics& cell) : cell_(cell), sums_(cell.rows.size()) {}

  /// Adds the model errors of the rows of one series, about a second apart, and their temperatures.
  void add(const std::vector<double>& off_V, const std::vector<double>& temperatures_C);
  /// Writes the errors into the rows; a row without enough data gets those of its warmer neighbour, or else its colder.
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
