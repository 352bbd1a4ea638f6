#include "daemon/core/estimation/pack_health.hpp"

#include <array>

namespace bmu {

namespace {

/// The first cell with the smallest, or the largest, value of all; and whether all values were known.
class Extreme {
 public:
  explicit Extreme(double sign) : sign_(sign) {}

  void take(std::size_t cell, bool is_known, double value) {
    are_all_known_ = are_all_known_ && is_known;
    if (cell > 0 && sign_ * value <= sign_ * value_) return;
    value_ = value;
    cell_ = cell;
  }
  [[nodiscard]] bool are_all_known() const { return are_all_known_; }
  [[nodiscard]] std::size_t cell() const { return cell_; }
  [[nodiscard]] double value() const { return value_; }

 private:
  double sign_;
  bool are_all_known_ = true;
  std::size_t cell_ = 0;
  double value_ = 0.0;
};

}  // namespace

PackHealth pack_health(const PackEstimate& estimate) {
  Extreme weakest(-1.0);
  Extreme worst(1.0);
  Extreme lowest(-1.0);
  std::array<ResistanceEstimate, cells_max> resistances;
  for (std::size_t cell = 0; cell < estimate.size(); ++cell) {
    const CellHealth& health = estimate.cell_health(cell);
    const ResistanceEstimate at_reference = health.resistance(resistance_reference_C);
    const ResistanceEstimate here = resistances[cell] = estimate.cell_resistance(cell);
    weakest.take(cell, health.is_capacity_known(), health.capacity_As());
    worst.take(cell, at_reference.is_known, at_reference.resistance_Ohm);
    lowest.take(cell, here.is_known, here.resistance_Ohm);
  }
  const PackResistance resistance = pack_resistance({resistances.data(), estimate.size()});
  PackHealth health{.weakest_cell = weakest.cell(),
                    .worst_cell = worst.cell(),
                    .resistance = resistance,
                    .cell_resistance_min_Ohm = lowest.value(),
                    .cell_resistance_max_Ohm = resistances[resistance.worst_cell].resistance_Ohm,
                    .cell_resistance_min_cell = lowest.cell()};
  if (weakest.are_all_known()) health.by_capacity = estimate.cell_health(weakest.cell()).health().by_capacity;
  if (worst.are_all_known()) health.by_resistance = estimate.cell_health(worst.cell()).health().by_resistance;
  return health;
}

}  // namespace bmu
