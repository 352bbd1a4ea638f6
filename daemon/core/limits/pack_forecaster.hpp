// Current limits by the predicted voltages (pack_forecast.hpp), updated with each sample set.
//
// Where the cells are estimated each is queried with its complete state. Until then they count as equal: the lowest is
// the first that would fall too low, and the highest the first that would rise too high. A stale sample set
// (ages.cell_voltage) is not used, and the result is incomplete.
//
// Cost: two comparisons on most ticks; with each sample set PackForecast::add() for each cell. Pure, no allocation.
#pragma once

#include <array>

#include "daemon/core/estimation/pack_estimate.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Precondition: all are set.
struct ForecasterInputs {
  TimePoint now{};
  const PackEstimate* estimate = nullptr;
  const PackState* pack = nullptr;
  const SensorTable* sensors = nullptr;
};

class PackForecaster {
 public:
  /// Once a tick, after the estimate.
  void update(const ForecasterInputs& in, const CoreConfig& config);

  /// Not known before the first sample set, and where the cell file has no tables.
  [[nodiscard]] const PredictedLimits& limits() const { return limits_; }

 private:
  /// Sample times of the lowest and the highest cell.
  using MeasuredAt = std::array<TimePoint, 2>;

  void ask_estimated(const ForecasterInputs& in, const CoreConfig& config);
  void ask_measured(const ForecasterInputs& in, const CoreConfig& config);
  void keep(const PredictedLimits& limits, TimePoint now, const MeasuredAt& of);

  PredictedLimits limits_;
  TimePoint asked_at_{};
  MeasuredAt asked_for_{};
  BMU_FIELDS(limits_, asked_at_, asked_for_)
};

}  // namespace bmu
