// How far hysteresis may pull the rest voltages of the pack's cells: between what and what, for all of them at once.
//
//   h = -1 after enough discharge, +1 after enough charge; each charge q that flows moves it (cell_model.hpp):
//   h -> -1 + (h + 1) * exp(-q / q0) while q leaves the cell, 1 + (h - 1) * exp(-q / q0) while it enters
//
// At first, and after anything nobody has seen, h is unknown: -1 to 1. Both ends then follow what flows, and meet: one
// direction for three q0 leaves a twentieth of the range. A cell that is bled has lost more than its neighbours, so the
// low end goes with the cell that lost most, the high end with the one that lost least.
//
// That all cells were driven the same way is what makes their difference small, though each hysteresis is large. Cells
// are not one like the other: how far one is pulled may differ from what the file says by `hysteresis_spread`.
#pragma once

#include <cstdint>

#include "daemon/core/cell/cell_model.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Of the file's hysteresis, either way: between one cell and another, and between the model and any of them.
inline constexpr double hysteresis_spread = 0.2;

class HysteresisRange {
 public:
  void init(const CellModel& cell);
  /// Something has flowed that was not seen.
  void forget();
  /// What has left each cell since the last call: not less than the one, not more than the other (least <= most);
  /// negative was put in. For small steps: what goes out and in again between two calls is not seen.
  void flow(std::int64_t least_uAs, std::int64_t most_uAs);

  /// Rest voltage less open-circuit voltage of any cell, at the least and at the most.
  [[nodiscard]] double least_uV() const { return (low_ - hysteresis_spread) * hysteresis_uV_; }
  [[nodiscard]] double most_uV() const { return (high_ + hysteresis_spread) * hysteresis_uV_; }

 private:
  [[nodiscard]] double after(double h, std::int64_t left_uAs) const;

  double hysteresis_uV_ = 0.0;
  double charge_uAs_ = 1.0;  // q0
  double low_ = -1.0;
  double high_ = 1.0;
  [[nodiscard]] bool are_fields_possible() const {
    return low_ >= -1.0 && low_ <= 1.0 && high_ >= -1.0 && high_ <= 1.0;
  }
  BMU_FIELDS(skipped(hysteresis_uV_), skipped(charge_uAs_), low_, high_)
};

}  // namespace bmu
