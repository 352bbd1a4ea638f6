// Negative, precharge, positive; and the way back, which needs nothing.
//
//        wish, may close      contact there        link at the pack's        contact there
//   open ------------> main_negative -----> precharge -----------> main_positive -----> closed
//    ^                      |                   |    voltage, current     |                |
//    |                      |                   |    has fallen           |                |
//    +----------------------+-------------------+-------------------------+----------------+
//                from any phase, in the very tick in which the wish or the permission ends
//
// Each step waits for the contacts' own word, not for a time: the next contactor moves when all stand where they were
// told to. And each step needs everything that closing needs, not only what a closed pack may stay closed with.
//
// Precharge is measured: the link must follow the pack and the current must have fallen, or there is a short or a load
// behind it. A phase that does not get on within the time-out opens; in precharge that is a fault, and the step says
// so. A link that falls off again while the main contact is on its way to it is one, too.
//
// Everything here is constexpr; what must never happen is asserted over all phases at the end of this file.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/core_config.hpp"
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

enum class Phase : std::uint8_t { open, main_negative, precharge, main_positive, closed };
inline constexpr std::array all_phases{Phase::open, Phase::main_negative, Phase::precharge, Phase::main_positive,
                                       Phase::closed};

[[nodiscard]] constexpr std::string_view to_text(Phase phase) {
  switch (phase) {
    case Phase::open: return "open";
    case Phase::main_negative: return "main negative";
    case Phase::precharge: return "precharge";
    case Phase::main_positive: return "main positive";
    case Phase::closed: return "closed";
  }
  return "?";
}

struct SequenceState {
  Phase phase = Phase::open;
  TimePoint entered_at{};
};

struct SequenceInputs {
  TimePoint now{};
  bool close_wanted = false;
  bool close_permitted = false;   // to begin, from open; to stay, from everywhere else
  bool may_advance = false;       // nothing speaks against closing right now
  bool contacts_settled = false;  // all stand where they were told to
  bool is_measured = false;  // pack, link and current are known and plausible; the four below mean nothing otherwise
  TimePoint measured_at{};   // the oldest of them
  std::int32_t pack_mV = 0;
  std::int32_t link_mV = 0;
  std::int32_t current_mA = 0;
};

struct SequenceStep {
  SequenceState state;
  ContactorOutputs outputs;
  bool precharge_failed = false;  // this step gave up because the link does not follow, or no longer
};

[[nodiscard]] constexpr ContactorOutputs outputs_for(Phase phase) {
  switch (phase) {
    case Phase::open: return {};
    case Phase::main_negative: return {.main_negative = true};
    case Phase::precharge: return {.main_negative = true, .precharge = true};
    case Phase::main_positive: return {.main_positive = true, .main_negative = true, .precharge = true};
    case Phase::closed: return {.main_positive = true, .main_negative = true};
  }
  return {};
}

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

/// The link follows and the current has fallen, all seen after the precharge contactor had its time to close: what was
/// measured before says nothing about this precharge.
[[nodiscard]] constexpr bool is_precharged(const SequenceState& state, const SequenceInputs& in,
                                           const ContactorConfig& config) {
  const std::int64_t magnitude_mA = in.current_mA < 0 ? -std::int64_t{in.current_mA} : in.current_mA;
  const bool current_has_fallen = magnitude_mA <= config.precharge_current_max_mA;
  const bool is_of_this_precharge = in.measured_at >= state.entered_at + config.settle;
  return in.is_measured && is_of_this_precharge && link_follows(in.pack_mV, in.link_mV, config) && current_has_fallen;
}

[[nodiscard]] constexpr bool has_lost_link(const SequenceInputs& in, const ContactorConfig& config) {
  return in.is_measured && !link_follows(in.pack_mV, in.link_mV, config);
}

[[nodiscard]] constexpr Phase next_phase(const SequenceState& state, const SequenceInputs& in,
                                         const ContactorConfig& config) {
  if (!in.close_wanted || !in.close_permitted) return Phase::open;
  const Duration since = in.now - state.entered_at;
  const bool gives_up = since >= config.precharge_timeout;
  const bool is_ready = since >= config.settle && in.may_advance && in.contacts_settled;
  switch (state.phase) {
    case Phase::open: return Phase::main_negative;
    case Phase::main_negative:
      if (gives_up) return Phase::open;
      return is_ready ? Phase::precharge : Phase::main_negative;
    case Phase::precharge:
      if (gives_up) return Phase::open;
      return is_ready && is_precharged(state, in, config) ? Phase::main_positive : Phase::precharge;
    case Phase::main_positive:
      if (gives_up || has_lost_link(in, config)) return Phase::open;
      return is_ready ? Phase::closed : Phase::main_positive;
    case Phase::closed: return Phase::closed;
  }
  return Phase::open;
}

/// One tick. Without permission or wish the outputs are all open in the same tick, from every phase.
[[nodiscard]] constexpr SequenceStep step(const SequenceState& state, const SequenceInputs& in,
                                          const ContactorConfig& config) {
  const Phase phase = next_phase(state, in, config);
  SequenceStep result{.state = state, .outputs = outputs_for(phase)};
  if (phase != state.phase) result.state = {.phase = phase, .entered_at = in.now};
  const bool gave_up = phase == Phase::open && in.close_wanted && in.close_permitted;
  const bool lost_link = state.phase == Phase::main_positive && has_lost_link(in, config);
  result.precharge_failed = gave_up && (state.phase == Phase::precharge || lost_link);
  return result;
}

namespace detail {

[[nodiscard]] consteval bool positive_never_without_negative() {
  for (const Phase phase : all_phases) {
    if (outputs_for(phase).main_positive && !outputs_for(phase).main_negative) return false;
  }
  return true;
}

[[nodiscard]] consteval bool opens_at_once_from_every_phase() {
  for (const Phase phase : all_phases) {
    for (const bool wanted : {false, true}) {
      for (const bool permitted : {false, true}) {
        const SequenceInputs in{.close_wanted = wanted, .close_permitted = permitted};
        const bool may_stay = wanted && permitted;
        if (!may_stay && step({.phase = phase}, in, {}).outputs.any_contactor()) return false;
      }
    }
  }
  return true;
}

[[nodiscard]] consteval bool positive_only_after_precharge() {
  for (const Phase phase : all_phases) {
    const SequenceInputs unmeasured{.now = TimePoint{1s},
                                    .close_wanted = true,
                                    .close_permitted = true,
                                    .may_advance = true,
                                    .contacts_settled = true};
    const bool was_closed = outputs_for(phase).main_positive;
    if (!was_closed && step({.phase = phase}, unmeasured, {}).outputs.main_positive) return false;
  }
  return true;
}

[[nodiscard]] consteval bool no_step_without_contacts_or_reason() {
  for (const Phase phase : {Phase::main_negative, Phase::precharge, Phase::main_positive}) {
    for (const bool settled : {false, true}) {
      const SequenceInputs in{.now = TimePoint{1s},
                              .close_wanted = true,
                              .close_permitted = true,
                              .may_advance = !settled,
                              .contacts_settled = settled,
                              .is_measured = true,
                              .measured_at = TimePoint{1s},
                              .pack_mV = 1,
                              .link_mV = 1};
      if (step({.phase = phase}, in, {}).state.phase != phase) return false;
    }
  }
  return true;
}

}  // namespace detail

static_assert(detail::no_step_without_contacts_or_reason());
static_assert(detail::positive_never_without_negative());
static_assert(detail::opens_at_once_from_every_phase());
static_assert(detail::positive_only_after_precharge());

}  // namespace bmu
