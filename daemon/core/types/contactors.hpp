// Contactor types shared by all stages: commanded outputs, phases of the sequence with its state and inputs, and the
// comparison of the DC link with the pack voltage.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/types/contactor_id.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Commanded contactors and outputs. All false: everything open, the default state.
struct ContactorOutputs {
  bool main_positive = false;
  bool main_negative = false;
  bool precharge = false;
  bool charge = false;
  bool auxiliary = false;
  bool fan = false;
  bool heater = false;

  [[nodiscard]] constexpr bool any_contactor() const { return main_positive || main_negative || precharge || charge; }
  friend constexpr bool operator==(const ContactorOutputs&, const ContactorOutputs&) = default;
};

enum class Phase : std::uint8_t { open, main_negative, precharge, main_positive, closed, ramp_down, breaking };
inline constexpr std::array all_phases{Phase::open,   Phase::main_negative, Phase::precharge, Phase::main_positive,
                                       Phase::closed, Phase::ramp_down,     Phase::breaking};

[[nodiscard]] constexpr std::string_view to_text(Phase phase) {
  switch (phase) {
    case Phase::open: return "open";
    case Phase::main_negative: return "main negative";
    case Phase::precharge: return "precharge";
    case Phase::main_positive: return "main positive";
    case Phase::closed: return "closed";
    case Phase::ramp_down: return "ramp down";
    case Phase::breaking: return "breaking";
  }
  return "?";
}

/// Reason why a closing failed.
enum class PrechargeFailure : std::uint8_t {
  none,
  too_slow,
  too_fast,
  overcurrent,
  welded,  // before the precharge: DC link at pack voltage with main negative alone
};

/// Current that contactors break without wear; up to it, current counts as none where none is permitted.
inline constexpr std::int32_t small_current_mA = 1'000;

[[nodiscard]] constexpr bool is_small_current(std::int32_t current_mA) {
  return current_mA <= small_current_mA && current_mA >= -small_current_mA;
}

struct SequenceState {
  Phase phase = Phase::open;
  TimePoint entered_at{};
  bool is_charge_closed = false;                          // commanded
  ContactorId breaks_first = ContactorId::main_positive;  // meaningful while breaking
  std::int32_t link_at_start_mV = 0;                      // when the precharge started
  TimePoint suspected_at{};                               // first bad sample of this phase; zero: none
  bool must_be_discharged = false;  // this closing started at least `link_decay` after the last opening
};

struct SequenceInputs {
  TimePoint now{};
  bool close_wanted = false;
  bool close_permitted = false;   // phase open: to start closing; any other phase: to stay closed
  bool may_advance = false;       // no close inhibit at present
  bool contacts_settled = false;  // all feedback matches the command, and has done so for `settle`
  TimePoint contacts_since{};     // when the last contact reached its position; valid while settled
  bool is_unplugged = false;      // no close request, and the charger that requested last is gone
  bool charge_wanted = false;     // a charger is connected and requests
  bool charge_permitted = false;
  bool resistor_is_hot = false;  // the precharge resistor exceeds its energy rating
  bool is_current_known = false;
  std::int32_t current_mA = 0;
  TimePoint current_at{};
  // Pack and DC link voltage and current are valid and plausible, and the sum of cells matches the pack voltage;
  // otherwise the members below have no meaning.
  bool is_measured = false;
  std::int32_t cells_mV = 0;  // sum of the cells
  std::int32_t pack_mV = 0;   // of the sensor
  TimePoint pack_at{};
  std::int32_t pack_before_mV = 0;  // previous sample; 0: unknown
  std::int32_t link_mV = 0;
  TimePoint link_at{};
};

/// Maximum difference between DC link and pack voltage at which the DC link counts as being at pack voltage.
[[nodiscard]] constexpr std::int64_t link_apart_max_mV(std::int32_t pack_mV, const ContactorConfig& config) {
  return std::int64_t{pack_mV} * (1000 - config.precharge_done_permille) / 1000;
}

/// DC link within the configured share of the pack voltage, above or below it; false without a pack voltage.
[[nodiscard]] constexpr bool link_follows(std::int32_t pack_mV, std::int32_t link_mV, const ContactorConfig& config) {
  const std::int64_t allowed_mV = link_apart_max_mV(pack_mV, config);
  const std::int64_t apart_mV = std::int64_t{pack_mV} - link_mV;
  return pack_mV > 0 && apart_mV <= allowed_mV && apart_mV >= -allowed_mV;
}

/// Maximum interval between results of the same instant: the sensor sends these back to back.
inline constexpr Duration same_instant_max = 5ms;

/// DC link and pack voltage were both measured at `since` or later, and the pack voltage at the instant of the DC link
/// voltage or after it.
[[nodiscard]] constexpr bool are_taken_together_since(TimePoint since, TimePoint pack_at, TimePoint link_at) {
  return pack_at >= link_at - same_instant_max && link_at >= since && pack_at >= since;
}

}  // namespace bmu
