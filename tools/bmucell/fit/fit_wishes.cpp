#include "tools/bmucell/fit/fit_wishes.hpp"

#include "tools/bmucell/fit/fit_unknowns.hpp"

namespace bmu::cell {

namespace {

double share_of(std::size_t point, std::size_t points) {
  return static_cast<double>(point) / static_cast<double>(points - 1);
}

double curve_freedom(double soc) {
  if (soc < 0.12) return 6.0;
  return soc > 0.96 ? 3.0 : 1.0;
}

double table_freedom(double soc) {
  return soc < 0.16 ? 4.0 : 1.0;
}

void wish_curve(NormalEquations& equations, const FitWishes& wishes, std::size_t row) {
  for (std::size_t point = 1; point + 1 < Unknowns::curve_points; ++point) {
    equations.add({{Unknowns::curve(row, point - 1), 1.0},
                   {Unknowns::curve(row, point), -2.0},
                   {Unknowns::curve(row, point + 1), 1.0}},
                  0.0, wishes.curve_bend_V * curve_freedom(share_of(point, Unknowns::curve_points)));
  }
}

void wish_curve_like_next(NormalEquations& equations, const FitWishes& wishes, std::size_t row) {
  for (std::size_t point = 0; point < Unknowns::curve_points; ++point) {
    const Term here{Unknowns::curve(row, point), 1.0};
    const Term next{Unknowns::curve(row + 1, point), -1.0};
    equations.add({here, next}, 0.0, wishes.curve_step_V);
    if (point == 0) continue;
    equations.add({here, next, {Unknowns::curve(row, point - 1), -1.0}, {Unknowns::curve(row + 1, point - 1), 1.0}},
                  0.0, wishes.curve_tilt_V);
  }
}

void wish_table(NormalEquations& equations, const FitWishes& wishes, std::size_t row, std::size_t table,
                bool has_next) {
  const bool is_voltage = table == static_cast<std::size_t>(Table::hysteresis);
  const double unit = is_voltage ? wishes.hysteresis_V : 1.0;
  for (std::size_t point = 0; point < Unknowns::table_points; ++point) {
    const Term here{Unknowns::table(row, table, point), 1.0};
    equations.add({here}, 0.0, unit * (is_voltage ? 1.0 : wishes.resistance_size));
    if (has_next) {
      equations.add({here, {Unknowns::table(row + 1, table, point), -1.0}}, 0.0, unit * wishes.resistance_step);
    }
    if (point == 0 || point + 1 == Unknowns::table_points) continue;
    equations.add(
        {{Unknowns::table(row, table, point - 1), 1.0}, {here.at, -2.0}, {Unknowns::table(row, table, point + 1), 1.0}},
        0.0, unit * wishes.resistance_bend * table_freedom(share_of(point, Unknowns::table_points)));
  }
}

}  // namespace

void add_wishes(NormalEquations& equations, const FitWishes& wishes, std::size_t rows) {
  for (std::size_t row = 0; row < rows; ++row) {
    const bool has_next = row + 1 < rows;
    wish_curve(equations, wishes, row);
    if (has_next) wish_curve_like_next(equations, wishes, row);
    for (std::size_t table = 0; table < Unknowns::tables; ++table) wish_table(equations, wishes, row, table, has_next);
  }
}

}  // namespace bmu::cell
