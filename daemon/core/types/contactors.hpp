// The contactors as all stages know them: what is commanded, the phases of the sequence with its state and inputs, and
// when the DC link counts as following the pack.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/types/contactor_id.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// What is to be closed or driven. All false: everything open, the state of rest.
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

/// How a closing ended that did not succeed.
enum class PrechargeFailure : std::uint8_t {
  none,
  too_slow,
  too_fast,
  overcurrent,
  welded,  // before the precharge: the link follows with main negative alone
};

/// What contactors break without wear, and what counts as no current where none may flow.
inline constexpr std::int32_t small_current_mA = 1'000;

[[nodiscard]] constexpr bool is_small_current(std::int32_t current_mA) {
  return current_mA <= small_current_mA && current_mA >= -small_current_mA;
}

struct SequenceState {
  Phase phase = Phase::open;
  TimePoint entered_at{};
  bool is_charge_closed = false;                          // commanded
  ContactorId breaks_first = ContactorId::main_positive;  // meaningful while breaking
  std::int32_t link_at_start_mV = 0;                      // when the precharge began
  TimePoint suspected_at{};                               // first bad sample of this phase; zero: none
  bool must_be_discharged = false;  // this closing began `link_decay` after the last opening, or later
};

struct SequenceInputs {
  TimePoint now{};
  bool close_wanted = false;
  bool close_permitted = false;   // to begin, from open; to stay, from everywhere else
  bool may_advance = false;       // nothing speaks against closing right now
  bool contacts_settled = false;  // all stand where they are commanded, and have done so for `settle`
  TimePoint contacts_since{};     // when the last of them was seen there; meaningful while settled
  bool is_unplugged = false;      // nobody asks, and the charger that asked last is not there any more
  bool charge_wanted = false;     // a charger is there and asks
  bool charge_permitted = false;
  bool resistor_is_hot = false;  // the precharge resistor has had more than it bears
  bool is_current_known = false;
  std::int32_t current_mA = 0;
  TimePoint current_at{};
  // Pack, link and current are known and plausible, and the cells' sum agrees; what follows means nothing otherwise.
  bool is_measured = false;
  std::int32_t cells_mV = 0;  // their sum
  std::int32_t pack_mV = 0;   // the sensor's
  TimePoint pack_at{};
  std::int32_t pack_before_mV = 0;  // the sample before it; 0: not known
  std::int32_t link_mV = 0;
  TimePoint link_at{};
};

/// How far the link may be from the pack to count as following it.
[[nodiscard]] constexpr std::int64_t link_apart_max_mV(std::int32_t pack_mV, const ContactorConfig& config) {
  return std::int64_t{pack_mV} * (1000 - config.precharge_done_permille) / 1000;
}

/// Link within the configured share of the pack, on either side of it, and a pack to compare with.
[[nodiscard]] constexpr bool link_follows(std::int32_t pack_mV, std::int32_t link_mV, const ContactorConfig& config) {
  const std::int64_t allowed_mV = link_apart_max_mV(pack_mV, config);
  const std::int64_t apart_mV = std::int64_t{pack_mV} - link_mV;
  return pack_mV > 0 && apart_mV <= allowed_mV && apart_mV >= -allowed_mV;
}

/// The sensor sends the results of one instant one behind the other; further apart they are of two instants.
inline constexpr Duration same_instant_max = 5ms;

/// Link and pack were both measured at `since` or later, and the pack at the link's instant or after it.
[[nodiscard]] constexpr bool are_taken_together_since(TimePoint since, TimePoint pack_at, TimePoint link_at) {
  return pack_at >= link_at - same_instant_max && link_at >= since && pack_at >= since;
}

}  // namespace bmu
