// The traction-pack messages 620h to 628h: each once a second, 10 ms after the one before. What is not known, or too
// old, leaves as the invalid code, never as 0 and never as the last value.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/core_config.hpp"
#include "daemon/core/estimators/pack_estimate.hpp"
#include "daemon/core/limits.hpp"
#include "daemon/core/pack_state.hpp"
#include "daemon/core/pack_totals.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

struct VehicleView {
  vehicle_bus::State state = vehicle_bus::State::off_open;
  Duration uptime{};
  std::uint8_t dtc_1 = 0;
  std::uint8_t dtc_2 = 0;
  const PackState* pack = nullptr;
  const CurrentLimits* limits = nullptr;
  std::optional<std::int32_t> soc_permille{};
  std::optional<std::int64_t> depth_of_discharge_uAs{};
  std::int64_t capacity_uAs = 0;           // as the cell file has it
  std::optional<PackTotals> totals{};      // not given: nobody keeps them
  const PackEstimate* estimate = nullptr;  // not given: nothing is known of the cells' health
};

inline constexpr std::size_t vehicle_message_count = 9;

/// Message `index` (0: 620h … 8: 628h) at the default base identifier moved to `config.base_id`.
[[nodiscard]] CanFrame vehicle_frame(std::size_t index, const VehicleView& view, const VehicleConfig& config);

class VehicleReporter {
 public:
  void init(TimePoint started_at) { next_at_ = started_at + period; }
  /// The message due at `now`, or none. Deadlines advance by their period; after a gap they start anew.
  [[nodiscard]] std::optional<CanFrame> step(TimePoint now, const VehicleView& view, const VehicleConfig& config);

 private:
  static constexpr Duration period = 1s;
  static constexpr Duration spacing = 10ms;

  TimePoint next_at_{};
  std::size_t index_ = 0;
  [[nodiscard]] bool are_fields_possible() const { return index_ < vehicle_message_count; }
  BMU_FIELDS(next_at_, index_)
};

}  // namespace bmu
