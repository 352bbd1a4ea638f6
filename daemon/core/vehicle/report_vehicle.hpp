// The traction-pack messages 620h to 628h, in the dialect of the pack file: each once a second, 10 ms after the one
// before. An unknown or stale value is sent as the invalid code, never as 0 and never as the last value.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/estimation/health/pack_totals.hpp"
#include "daemon/core/estimation/pack_estimate.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/vehicle/vehicle_state.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

struct VehicleView {
  ModeInputs mode;
  Duration uptime{};
  TroubleCodes codes;     // iha, original
  ElithionFaults faults;  // elithion
  bool interlock_tripped = false;
  bool close_requested = false;
  const PackState* pack = nullptr;
  const CurrentLimits* limits = nullptr;
  Temperature_dC intake_air_dC{};  // not valid: no sensor, or it reports none
  std::optional<std::int32_t> soc_permille{};
  std::optional<std::int32_t> soc_2_permille{};  // of a second pack
  std::optional<std::int64_t> depth_of_discharge_uAs{};
  std::int64_t capacity_uAs = 0;           // from the cell file
  std::optional<PackTotals> totals{};      // not given: no persistent state
  std::optional<std::uint32_t> starts{};   // not given: not counted yet, or no persistent state
  const PackEstimate* estimate = nullptr;  // null: the state of health is unknown
};

inline constexpr std::size_t vehicle_message_count = 9;

/// The state in 622h, in the numbering of the dialect.
[[nodiscard]] std::uint8_t vehicle_state(VehicleDialect dialect, const ModeInputs& mode);

/// Flag byte of the dialect `elithion`: .0 charger connected, .1 vehicle on, .2 interlock tripped, .3 closing requested
/// by wire, .4 by CAN, which is not supported here, .5 charging not permitted, .6 discharging not permitted, .7 fan on.
[[nodiscard]] std::uint8_t elithion_flags(const VehicleView& view);

/// Message `index` (0: 620h … 8: 628h) at the default base identifier moved to `config.base_id`.
[[nodiscard]] CanFrame vehicle_frame(std::size_t index, const VehicleView& view, const VehicleConfig& config);

class VehicleReporter {
 public:
  void init(TimePoint started_at) { next_at_ = started_at + period; }
  [[nodiscard]] bool is_due(TimePoint now) const { return now >= next_at_; }
  /// The message due at `now`, or none. Deadlines advance by their period; after a gap they start from now.
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
