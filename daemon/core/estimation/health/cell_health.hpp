// How one cell has aged: its resistance from what the current does (resistance_tracker.hpp), its capacity from the
// instants at which its charge was known (capacity_estimate.hpp) and from whole charges (charge_plateau.hpp), and what
// both make of its health (state_of_health.hpp). It is fed with the same samples as the estimators of the charge.
//
// A capacity is told once something has shown it, in this life or a former one; until then everybody counts with that
// of the cell file, and nothing is said of its health.
//
// Cost: that of ResistanceTracker, some additions, and two comparisons of ChargePlateau where the cell file has a model
// of it. With an anchor that makes a pair: CapacityEstimate::take. 1.2 kB a cell.
#pragma once

#include <optional>

#include "daemon/core/estimation/health/capacity_estimate.hpp"
#include "daemon/core/estimation/health/cell_health_record.hpp"
#include "daemon/core/estimation/health/charge_plateau.hpp"
#include "daemon/core/estimation/health/resistance_tracker.hpp"
#include "daemon/core/estimation/health/state_of_health.hpp"
#include "daemon/core/estimation/soc/charge_ends.hpp"
#include "daemon/core/estimation/soc/model_pointer.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// What all cells of a kind are held against.
struct HealthModel {
  ExpectedResistance expected;
  std::optional<ChargePlateauModel> plateau{};
  CurrentSensorError sensor;
  double rated_As = 0.0;  // the cell file's capacity
  double charge_efficiency = 1.0;
};

class CellHealth {
 public:
  /// `model` must outlive this. `former` as record() gave it; all 0: nothing is known.
  void begin(const HealthModel& model, const CellHealthRecord& former = {});
  void forget() { *this = {}; }
  /// The same model, where it lies now. Before begin(): nothing.
  void move_to(const HealthModel& model);
  [[nodiscard]] bool is_begun() const { return model_.is_set(); }

  /// Each sample of the cell; before begin(): nothing. `anchor`: its charge was known with this sample apart from
  /// counting.
  void take(const CellSample& sample, const std::optional<ChargeAnchor>& anchor = std::nullopt);
  /// Between the last sample and the next the cell begins or ceases to bleed.
  void restart_resistance() { resistance_.restart(); }

  [[nodiscard]] ResistanceEstimate resistance(double temperature_C) const {
    return resistance_.estimate(temperature_C);
  }
  /// Something has shown it; else capacity_As() is that of the cell file.
  [[nodiscard]] bool is_capacity_known() const { return is_capacity_restored_ || capacity_.pairs() > 0; }
  [[nodiscard]] double capacity_As() const { return capacity_As_; }
  /// One standard deviation. Cost: 51 exponentials.
  [[nodiscard]] double capacity_sigma_As() const { return capacity_.sigma_As(); }
  /// How many pairs of anchors, and whole charges, have shown it in this life, and how many were absurd.
  [[nodiscard]] std::uint32_t capacity_pairs() const { return capacity_.pairs(); }
  [[nodiscard]] std::uint32_t capacity_refused() const { return capacity_.refused(); }
  /// Cost: that of capacity_sigma_As().
  [[nodiscard]] StateOfHealth health() const;
  [[nodiscard]] CellHealthRecord record() const;

 private:
  void learn(const CapacityPair& pair);

  ModelPointer<HealthModel> model_;
  ResistanceTracker resistance_;
  CapacityEstimate capacity_;
  CapacityAnchors anchors_;
  ChargePlateau plateau_;
  bool is_capacity_restored_ = false;
  double capacity_As_ = 0.0;
  double counted_As_ = 0.0;  // what has left the cell
  double passed_s_ = 0.0;
  [[nodiscard]] bool are_fields_possible() const {
    return resistance_.is_begun() == is_begun() && is_within(capacity_As_, 0.0, charge_most_As);
  }
  BMU_FIELDS(model_, resistance_, capacity_, anchors_, plateau_, is_capacity_restored_, capacity_As_, counted_As_,
             passed_s_)
};

}  // namespace bmu
