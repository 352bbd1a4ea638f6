// The terminal voltage of each row of a series as a sum of unknowns: the linear equations that a fit is made of.
//
// The voltage of an RC element is a filtered current times a resistance; if that resistance is a table, it is the sum
// over the entries of the filtered current that flowed at each, times the entry. So the filtered current is kept for
// each entry.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tools/bmucell/fit/fit_plan.hpp"
#include "tools/bmucell/fit/normal_equations.hpp"

namespace bmu::cell {

/// Correction of the charge axis of a series: slow curves are shifted and stretched, others stay unchanged.
struct ChargeAxis {
  double at_full = 0.0;   // added to the charge of a full cell
  double at_empty = 0.0;  // added to that of an empty one; linear in between

  [[nodiscard]] double of(double soc) const { return soc + at_empty + (at_full - at_empty) * soc; }
};
/// For the halves of a slow curve: discharge, then charge.
using ChargeAxes = std::array<ChargeAxis, 2>;

/// The half of a slow curve that each row of a series belongs to: 1 from the first charging current on.
[[nodiscard]] std::vector<std::size_t> halves_of(const Series& series, double capacity_Ah);

class VoltageTerms {
 public:
  /// `frame`: rows by temperature, time constants, exchange currents; its tables are not read. `typical_Ohm`: unit of
  /// the resistances at 25 C.
  VoltageTerms(const CellDynamics& frame, double typical_Ohm);

  /// Unit of the resistances of a row of temperature.
  [[nodiscard]] double unit_Ohm(std::size_t row) const { return units_Ohm_[row]; }

  using Use = std::function<void(const SeriesRow& row, double passed_s, const std::vector<Term>& voltage)>;
  /// Calls `use` for each row in turn. The series starts at rest, charged last. Rows with a missing value are skipped;
  /// a time that does not rise counts as no elapsed time.
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
