// Index of each number of the tables among the unknowns of a fit: one row of temperature after the other, in it the
// open-circuit curve first, then the tables over charge.
#pragma once

#include <cstddef>

#include "daemon/core/cell/cell_dynamics.hpp"

namespace bmu::cell {

enum class Table : std::size_t { hysteresis, series, kinetic, first_pair };

struct Unknowns {
  static constexpr std::size_t curve_points = CellDynamics::curve_points;
  static constexpr std::size_t table_points = CellDynamics::resistance_points;
  static constexpr std::size_t tables = static_cast<std::size_t>(Table::first_pair) + CellDynamics::pairs;
  static constexpr std::size_t row_size = curve_points + tables * table_points;

  [[nodiscard]] static constexpr std::size_t count(std::size_t rows) { return rows * row_size; }
  [[nodiscard]] static constexpr std::size_t curve(std::size_t row, std::size_t point) {
    return row * row_size + point;
  }
  [[nodiscard]] static constexpr std::size_t table(std::size_t row, std::size_t table, std::size_t point) {
    return row * row_size + curve_points + table * table_points + point;
  }
  [[nodiscard]] static constexpr std::size_t table(std::size_t row, Table which, std::size_t point) {
    return table(row, static_cast<std::size_t>(which), point);
  }
  [[nodiscard]] static constexpr std::size_t pair(std::size_t row, std::size_t pair, std::size_t point) {
    return table(row, static_cast<std::size_t>(Table::first_pair) + pair, point);
  }
};

}  // namespace bmu::cell
