// The two states of charge that a cell shows independently of the counted charge: full, when it takes hardly any
// current at the voltage of a full cell; empty, when it has fallen to the voltage of an empty one at a small current.
//
//   full    voltage >= full_V and 0 < charging current <= full_current_A, for `end_held_s`
//   empty   voltage <= empty_V and 0 <= discharging current <= empty_current_A, at empty_coldest_C or warmer, for
//           `end_held_s`
//
// A charger that ends a charge holds the voltage while the current tapers, so at the end the voltage is nearly that of
// a rested cell; the drop by the remaining current makes the anchor less accurate. With a large current there is no
// anchor: a cold or worn cell reaches either voltage far from its end.
//
// Reported once when an end is reached, and again only after the cell has left it.
// Cost: some comparisons; an evaluation of the model when an end is reached.
#pragma once

#include <optional>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Conditions of the ends of a charge. With a current below 0 that end is never reported, full also with 0.
struct ChargeEndConfig {
  double full_V = 0.0;
  double full_current_A = 0.0;
  double empty_V = 0.0;
  double empty_current_A = 0.0;
};

/// For a cell of this kind: a charge ends at C/20, and a cell that falls to the voltage of an empty one at C/5 or less
/// is empty. The voltages are those of the curve at 25 C, within the accuracy of the modules.
[[nodiscard]] ChargeEndConfig charge_ends_of(const CellDynamics& cell);

inline constexpr double end_held_s = 20.0;
/// A colder cell that was discharged falls to the voltage of an empty one with a tenth of its charge left, and stays
/// there for minutes with hardly any current: in the recordings of docs/accuracy.md.
inline constexpr double empty_coldest_C = 15.0;
/// Uncertainty of an end by the voltage alone.
inline constexpr double full_sigma = 0.01;
inline constexpr double empty_sigma = 0.02;

struct ChargeAnchor {
  double soc = 0.0;
  double sigma = 1.0;  // one standard deviation
};

class ChargeEnds {
 public:
  /// `cell` is used during the call only.
  [[nodiscard]] std::optional<ChargeAnchor> update(const CellDynamics& cell, const ChargeEndConfig& config,
                                                   const CellSample& sample);

 private:
  struct End {
    double held_s = 0.0;
    bool is_told = false;

    /// True if this sample is the one with which the condition has applied for long enough.
    [[nodiscard]] bool step(bool holds, double passed_s);
  };

  End full_;
  End empty_;
  BMU_FIELDS(full_, empty_)
};

}  // namespace bmu
