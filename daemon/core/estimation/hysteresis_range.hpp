// Range of the hysteresis in the rest voltages of the pack's cells: minimum and maximum, for all of them together.
//
//   h = -1 after enough discharge, +1 after enough charge; each charge q that flows moves it (cell_model.hpp):
//   h -> -1 + (h + 1) * exp(-q / q0) while q leaves the cell, 1 + (h - 1) * exp(-q / q0) while it enters
//
// At first, and after charge that was not measured, h is unknown: -1 to 1. Both ends then follow the charge that flows,
// and converge: one direction for three q0 leaves a twentieth of the range. A cell that is bled has lost more than its
// neighbours, so the low end follows the cell that lost most, the high end the one that lost least.
//
// The difference between cells is small, though each hysteresis is large, because all cells were driven the same way.
// Cells are not identical: the hysteresis of one may differ from that of the file by `hysteresis_spread`.
#pragma once

#include <cstdint>

#include "daemon/core/cell/cell_model.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Share of the file's hysteresis, either way: between one cell and another, and between the model and any of them.
inline constexpr double hysteresis_spread = 0.2;

class HysteresisRange {
 public:
  void init(const CellModel& cell);
  /// Makes the range unknown: charge has flowed that was not measured.
  void forget();
  /// Adds the charge that has left each cell since the last call: at least the first value, at most the second (least
  /// <= most); negative: it has entered. For small steps: charge that leaves and returns between two calls is not seen.
  void flow(std::int64_t least_uAs, std::int64_t most_uAs);

  /// Rest voltage minus open-circuit voltage of any cell, minimum and maximum.
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
