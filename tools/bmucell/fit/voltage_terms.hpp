// The terminal voltage of each row of a series as a sum of unknowns: the linear equations that a fit is made of.
//
// A pair's voltage is a filtered current times a resistance, and where that resistance is a table it is the sum of the
// currents that flowed at each of its entries, filtered, times the entry. So for each entry the filtered current is
// kept.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tools/bmucell/fit/fit_plan.hpp"
#include "tools/bmucell/fit/normal_equations.hpp"

namespace bmu::cell {

/// Row `row` of a series was taken at this charge; slow curves are laid out anew, others as they say.
struct ChargeAxis {
  double at_full = 0.0;   // added to the charge of a full cell
  double at_empty = 0.0;  // and of an empty one, in between by a straight line

  [[nodiscard]] double of(double soc) const { return soc + at_empty + (at_full - at_empty) * soc; }
};
/// Of the halves of a slow curve: discharge, then charge.
using ChargeAxes = std::array<ChargeAxis, 2>;

/// Which half of a slow curve the rows of a series belong to: 1 from the first charging current on.
[[nodiscard]] std::vector<std::size_t> halves_of(const Series& series, double capacity_Ah);

class VoltageTerms {
 public:
  /// The frame: rows by temperature, time constants, exchange currents; its tables are not looked at. `typical_Ohm` at
  /// 25 C is what resistances are counted in.
  VoltageTerms(const CellDynamics& frame, double typical_Ohm);

  /// What resistances of a row of temperature are counted in.
  [[nodiscard]] double unit_Ohm(std::size_t row) const { return units_Ohm_[row]; }

  using Use = std::function<void(const SeriesRow& row, double passed_s, const std::vector<Term>& voltage)>;
  /// Calls for each row in turn. The series begins at rest, charged last. Rows with anything not measured are passed
  /// over, time that does not rise counts as none.
  void walk(const Series& series, const std::vector<double>& charge, const Use& use) const;

 private:
  struct Place;
  struct State;
  void follow(State& state, const Place& place, double current_A, double passed_s) const;
  void tell(const State& state, const Place& place, double current_A, std::vector<Term>& terms) const;
  [[nodiscard]] Place place_of(double soc, double temperature_C) const;

  const CellDynamics& frame_;
  std::vector<double> units_Ohm_;
};

}  // namespace bmu::cell
