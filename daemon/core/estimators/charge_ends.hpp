// The two states of charge that a cell tells by itself, whatever was counted: full, when it takes hardly any current at
// the voltage of a full cell; empty, when it has sunk to the voltage of an empty one though it gives but little.
//
//   full    voltage >= full_V and 0 < charging current <= full_current_A, for `end_held_s`
//   empty   voltage <= empty_V and 0 <= discharging current <= empty_current_A, for `end_held_s`
//
// A charger that ends a charge holds the voltage while the current fades, so at the end the voltage is nearly that of a
// rested cell; what the rest of the current takes makes the anchor less sure. With a large current nothing is said: a
// cold or worn cell reaches either voltage far from its end.
//
// Told once when an end is reached, and again only after the cell has left it.
// Cost: some comparisons; a look at the model when an end is reached.
#pragma once

#include <optional>

#include "daemon/core/cell_dynamics.hpp"
#include "daemon/core/estimators/soc_estimate.hpp"

namespace bmu {

/// What counts as an end of the charge; a current of 0 or below: that end is never told.
struct ChargeEndConfig {
  double full_V = 0.0;
  double full_current_A = 0.0;
  double empty_V = 0.0;
  double empty_current_A = 0.0;
};

inline constexpr double end_held_s = 20.0;
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
};

}  // namespace bmu
