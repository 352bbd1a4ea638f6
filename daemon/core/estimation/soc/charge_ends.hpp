// The two states of charge that a cell tells by itself, whatever was counted: full, when it takes hardly any current at
// the voltage of a full cell; empty, when it has sunk to the voltage of an empty one though it gives but little.
//
//   full    voltage >= full_V and 0 < charging current <= full_current_A, for `end_held_s`
//   empty   voltage <= empty_V and 0 <= discharging current <= empty_current_A, at empty_coldest_C or warmer, for
//           `end_held_s`
//
// A charger that ends a charge holds the voltage while the current fades, so at the end the voltage is nearly that of a
// rested cell; what the rest of the current takes makes the anchor less sure. With a large current nothing is said: a
// cold or worn cell reaches either voltage far from its end.
//
// Told once when an end is reached, and again only after the cell has left it.
// Cost: some comparisons; a look at the model when an end is reached.
#pragma once

#include <optional>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// What counts as an end of the charge; a current of 0 or below: that end is never told.
struct ChargeEndConfig {
  double full_V = 0.0;
  double full_current_A = 0.0;
  double empty_V = 0.0;
  double empty_current_A = 0.0;
};

/// Of a cell of this kind: a charge ends with a twentieth of an hour's rate, and one that sinks to the voltage of an
/// empty cell at a fifth of it or less is empty. The voltages are those of the curve at 25 C, and what modules measure
/// to.
[[nodiscard]] ChargeEndConfig charge_ends_of(const CellDynamics& cell);

inline constexpr double end_held_s = 20.0;
/// A colder cell that was driven down sinks to the voltage of an empty one with a tenth of its charge left, and stays
/// there for minutes with hardly a current: on the recordings of docs/accuracy.md.
inline constexpr double empty_coldest_C = 15.0;
/// What the voltage alone leaves open.
inline constexpr double full_sigma = 0.01;
inline constexpr double empty_sigma = 0.02;

struct ChargeAnchor {
  double soc = 0.0;
  double sigma = 1.0;  // one standard deviation
};

class ChargeEnds {
 public:
  /// `cell` is only looked at.
  [[nodiscard]] std::optional<ChargeAnchor> update(const CellDynamics& cell, const ChargeEndConfig& config,
                                                   const CellSample& sample);

 private:
  struct End {
    double held_s = 0.0;
    bool is_told = false;

    /// Whether this sample is the one with which it has been held long enough.
    [[nodiscard]] bool step(bool holds, double passed_s);
  };

  End full_;
  End empty_;
  BMU_FIELDS(full_, empty_)
};

}  // namespace bmu
