// Health of one cell: its resistance from changes of the current (resistance_tracker.hpp), its capacity from instants
// with known charge (capacity_estimate.hpp) and from whole charges (charge_plateau.hpp), and the state of health by
// both (state_of_health.hpp). It gets the same samples as the estimators of the charge.
//
// A capacity is reported once it has been measured, in this session or a previous one; until then that of the cell file
// is used, and the health by capacity is unknown.
//
// Cost: that of ResistanceTracker, some additions, and two comparisons of ChargePlateau where the cell file has a model
// of it. With an anchor that completes a capacity sample: CapacityEstimate::take. 1.2 kB a cell.
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

/// Reference values of all cells of a kind.
struct HealthModel {
  ExpectedResistance expected;
  std::optional<ChargePlateauModel> plateau{};
  CurrentSensorError sensor;
  double rated_As = 0.0;  // the cell file's capacity
  double charge_efficiency = 1.0;
};

class CellHealth {
 public:
  /// `model` must outlive this. The record is that of record(); all 0: unknown.
  void begin(const HealthModel& model, const CellHealthRecord& former = {});
  void forget() { *this = {}; }
  /// Rebinds to the same model at its new address. Before begin(): no effect.
  void move_to(const HealthModel& model);
  [[nodiscard]] bool is_begun() const { return model_.is_set(); }

  /// Processes each sample of the cell; before begin(): no effect. `anchor`: state of charge that is known with this
  /// sample independently of counting.
  void take(const CellSample& sample, const std::optional<ChargeAnchor>& anchor = std::nullopt);
  /// Call if the cell starts or stops bleeding between the last sample and the next.
  void restart_resistance() { resistance_.restart(); }

  [[nodiscard]] ResistanceEstimate resistance(double temperature_C) const {
    return resistance_.estimate(temperature_C);
  }
  /// True if it has been measured; else capacity_As() is that of the cell file.
  [[nodiscard]] bool is_capacity_known() const { return is_capacity_restored_ || capacity_.pairs() > 0; }
  [[nodiscard]] double capacity_As() const { return capacity_As_; }
  /// One standard deviation. Cost: 51 exponentials.
  [[nodiscard]] double capacity_sigma_As() const { return capacity_.sigma_As(); }
  /// Number of samples (pairs of anchors, and whole charges) in this session, and of those rejected as implausible.
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
  double counted_As_ = 0.0;  // charge that has left the cell
  double passed_s_ = 0.0;
  [[nodiscard]] bool are_fields_possible() const {
    return resistance_.is_begun() == is_begun() && is_within(capacity_As_, 0.0, charge_most_As);
  }
  BMU_FIELDS(model_, resistance_, capacity_, anchors_, plateau_, is_capacity_restored_, capacity_As_, counted_As_,
             passed_s_)
};

}  // namespace bmu
