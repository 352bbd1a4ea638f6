// Contactor sequence: negative, precharge, positive; and the two ways back: ramped down, and unconditional.
//
//        request, may close   contact there,       link at the pack's        contact there
//   open ------------> main_negative -----> precharge -----------> main_positive -----> closed
//    ^                      |    link is not    |    voltage, current     | link there     |
//    |                      |    at the pack's  |    has fallen           |                | request ended
//    |                      |                   |                         |                v
//    +----------------------+-------------------+-------------------------+---------- ramp_down --grace--> breaking
//    |                                                                                     |                  |
//    +-------------------------------------------------------------- current is small -----+------- gap ------+
//
// Without permission every phase ends in open, in the same tick in which the permission ends.
//
// Closing: each step waits for the feedback of the contacts, not for a time, and needs everything that closing needs,
// not only the conditions for a closed pack to stay closed. Precharge is measured, in a window of time: the DC link
// must follow the pack and the current must have fallen; a DC link that follows immediately is not connected, one that
// never does indicates a short circuit or a load. The pack is closed when DC link and pack have been seen together
// since main positive was seen to close. A phase that does not advance within the timeout opens.
//
// Two voltages are compared only if both are the sensor's and were sampled in the phase that they are evidence for. To
// grant a step, or to detect a lost DC link or a weld, both must be of one instant, or the pack's later than the DC
// link's; a precharge is too fast also by an earlier pack voltage that stood still. The sum of the cells is of another
// instant, up to a poll cycle before: it may inhibit a step, and never grants one.
//
// With main negative alone nothing may charge the DC link: one that follows the pack is charged through a welded main
// positive, whatever its auxiliary contact reports. A residual charge is measured there, too, where the sensor measures
// against the pack's minus and sees the DC link with main negative only: it is less than the pack's voltage, and soon
// after an opening, where it need not be, the sequence waits for it to decay.
//
// Opening because the request ended: a current of zero is requested, and the current has `zero_current_grace` to fall.
// If it still flows then, one contactor breaks it, the one with the arc chute for that direction: main positive while
// discharging, while charging the charge contactor where it is closed, else main negative. The others follow without
// load, one gap later. A charging plug that is pulled gets no grace, as its contacts part under the current that still
// flows: the current is broken in the tick in which its input ends.
//
// The charge contactor is between DC link and charger. It closes after the pack, for a charger that is connected and
// may charge, and opens in the tick in which either ends.
//
// Everything here is constexpr; forbidden states are asserted over all phases at the end of this file, and a test walks
// through every combination of phases, inputs and times.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/types/contactors.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct SequenceStep {
  SequenceState state;
  ContactorOutputs outputs;
  PrechargeFailure precharge_failure = PrechargeFailure::none;  // reason for which this step aborted
};

[[nodiscard]] constexpr ContactorOutputs breaking_outputs(const SequenceState& state) {
  switch (state.breaks_first) {
    case ContactorId::main_negative: return {.main_positive = true};
    case ContactorId::charge: return {.main_positive = true, .main_negative = true};
    case ContactorId::main_positive:
    case ContactorId::precharge: return {.main_negative = true};
  }
  return {};
}

[[nodiscard]] constexpr ContactorOutputs outputs_for(const SequenceState& state) {
  switch (state.phase) {
    case Phase::open: return {};
    case Phase::main_negative: return {.main_negative = true};
    case Phase::precharge: return {.main_negative = true, .precharge = true};
    case Phase::main_positive: return {.main_positive = true, .main_negative = true, .precharge = true};
    case Phase::closed:
    case Phase::ramp_down: return {.main_positive = true, .main_negative = true, .charge = state.is_charge_closed};
    case Phase::breaking: return breaking_outputs(state);
  }
  return {};
}

[[nodiscard]] constexpr bool is_pair_since(TimePoint since, const SequenceInputs& in) {
  return in.is_measured && are_taken_together_since(since, in.pack_at, in.link_at);
}

/// With main negative alone commanded the DC link follows the pack: another path connects it, or it is still charged.
[[nodiscard]] constexpr bool follows_through_nothing(const SequenceState& state, const SequenceInputs& in,
                                                     const ContactorConfig& config) {
  return is_pair_since(state.entered_at + 1ns, in) && link_follows(in.pack_mV, in.link_mV, config);
}

/// Two such samples, of a DC link that has had its time to discharge.
[[nodiscard]] constexpr bool is_welded(const SequenceState& state, const SequenceInputs& in,
                                       const ContactorConfig& config) {
  const bool is_second = state.suspected_at != TimePoint{} && in.link_at > state.suspected_at;
  return state.must_be_discharged && is_second && follows_through_nothing(state, in, config);
}

/// Earliest time of a sample that may grant a step: the contacts had `settle` and were seen where they are commanded. A
/// slow contact closes after `settle`, and a sample from between the two would still be fresh when the contacts have
/// settled.
[[nodiscard]] constexpr TimePoint evidence_since(const SequenceState& state, const SequenceInputs& in,
                                                 const ContactorConfig& config) {
  return std::max(state.entered_at + config.settle, in.contacts_since);
}

/// Sampled after main negative closed: the DC link is isolated.
[[nodiscard]] constexpr bool is_by_itself(const SequenceState& state, const SequenceInputs& in,
                                          const ContactorConfig& config) {
  return is_pair_since(evidence_since(state, in, config), in) && !link_follows(in.pack_mV, in.link_mV, config) &&
         !link_follows(in.cells_mV, in.link_mV, config);
}

/// The DC link follows and the current has fallen, all sampled after the precharge contactor closed: earlier samples
/// are no evidence for this precharge.
[[nodiscard]] constexpr bool is_precharged(const SequenceState& state, const SequenceInputs& in,
                                           const ContactorConfig& config) {
  const TimePoint since = evidence_since(state, in, config);
  const std::int64_t magnitude_mA = in.current_mA < 0 ? -std::int64_t{in.current_mA} : in.current_mA;
  const bool current_has_fallen = in.current_at >= since && magnitude_mA <= config.precharge_current_max_mA;
  return is_pair_since(since, in) && link_follows(in.pack_mV, in.link_mV, config) &&
         link_follows(in.cells_mV, in.link_mV, config) && current_has_fallen;
}

/// The DC link has left the pack while main positive is closing. The contact closes at an instant that no sample shows,
/// and from then on a current may change both voltages: a DC link sample from before it and a pack sample from after
/// it, or the other way round, are not comparable. So the DC link sample is of this phase, and it counts as away from
/// the pack once it is away from the pack samples on both sides of it. Of two results that are received together the
/// later one decides.
[[nodiscard]] constexpr bool has_lost_link(const SequenceState& state, const SequenceInputs& in,
                                           const ContactorConfig& config) {
  const bool is_of_this_phase = in.link_at > state.entered_at;
  const bool is_enclosed = in.pack_at >= in.link_at - same_instant_max;
  const bool is_away =
      !link_follows(in.pack_mV, in.link_mV, config) && !link_follows(in.pack_before_mV, in.link_mV, config);
  return in.is_measured && is_of_this_phase && is_enclosed && is_away;
}

/// Main positive conducts: DC link and pack agree after it closed. Earlier voltages are no evidence for the contact
/// that the load current will flow through.
[[nodiscard]] constexpr bool is_joined(const SequenceState& state, const SequenceInputs& in,
                                       const ContactorConfig& config) {
  return is_pair_since(evidence_since(state, in, config), in) && link_follows(in.pack_mV, in.link_mV, config);
}

/// Minimum duration of this precharge: shorter for a DC link that still held a part of the voltage.
[[nodiscard]] constexpr Duration precharge_min(const SequenceState& state, std::int32_t pack_mV,
                                               const ContactorConfig& config) {
  const std::int64_t done_mV = std::int64_t{pack_mV} - link_apart_max_mV(pack_mV, config);
  const std::int64_t missing_mV = done_mV - state.link_at_start_mV;
  if (done_mV <= 0 || missing_mV <= 0) return Duration{};
  return missing_mV >= done_mV ? config.precharge_min : config.precharge_min * missing_mV / done_mV;
}

/// The DC link followed before the resistor can have charged it: a contactor is welded, or no DC link is connected. On
/// a bus with many modules their answers may arrive between the two results of an instant, and the next pair half a
/// period later. A pack voltage of this phase that is older than the DC link's also counts for that instant if it has
/// not moved: if the DC link follows the sample before it as well.
[[nodiscard]] constexpr bool is_too_fast(const SequenceState& state, const SequenceInputs& in,
                                         const ContactorConfig& config) {
  const TimePoint since = state.entered_at + 1ns;
  const bool is_of_this_precharge = in.is_measured && in.link_at >= since && in.pack_at >= since;
  const bool stood_still = link_follows(in.pack_before_mV, in.link_mV, config);
  const bool is_early = in.link_at < state.entered_at + precharge_min(state, in.pack_mV, config);
  return is_of_this_precharge && (is_pair_since(since, in) || stood_still) && is_early &&
         link_follows(in.pack_mV, in.link_mV, config);
}

/// More current than the resistor admits into anything but a short circuit.
[[nodiscard]] constexpr bool is_overcurrent(const SequenceState& state, const SequenceInputs& in,
                                            const ContactorConfig& config) {
  const std::int64_t magnitude_mA = in.current_mA < 0 ? -std::int64_t{in.current_mA} : in.current_mA;
  return config.precharge_overcurrent_mA > 0 && in.is_current_known && in.current_at > state.entered_at &&
         magnitude_mA > config.precharge_overcurrent_mA;
}

/// Reason for which a precharge fails. An overcurrent takes two samples.
[[nodiscard]] constexpr PrechargeFailure precharge_failure(const SequenceState& state, const SequenceInputs& in,
                                                           const ContactorConfig& config) {
  const bool is_second = state.suspected_at != TimePoint{} && in.current_at > state.suspected_at;
  if (is_second && is_overcurrent(state, in, config)) return PrechargeFailure::overcurrent;
  if (is_too_fast(state, in, config)) return PrechargeFailure::too_fast;
  const bool gives_up = in.resistor_is_hot || in.now - state.entered_at >= config.precharge_timeout;
  return gives_up ? PrechargeFailure::too_slow : PrechargeFailure::none;
}

/// Contactor that breaks the current if it does not end by itself.
[[nodiscard]] constexpr ContactorId breaker_of(const SequenceState& state, std::int32_t current_mA) {
  if (current_mA >= 0) return ContactorId::main_positive;
  return state.is_charge_closed ? ContactorId::charge : ContactorId::main_negative;
}

[[nodiscard]] constexpr Phase next_phase(const SequenceState& state, const SequenceInputs& in,
                                         const ContactorConfig& config) {
  if (!in.close_permitted) return Phase::open;
  const Duration since = in.now - state.entered_at;
  const bool gives_up = since >= config.precharge_timeout;
  const bool is_ready = since >= config.settle && in.may_advance && in.contacts_settled;
  const bool is_without_load = !in.is_current_known || is_small_current(in.current_mA);
  switch (state.phase) {
    case Phase::open: return in.close_wanted ? Phase::main_negative : Phase::open;
    case Phase::main_negative:
      if (!in.close_wanted || gives_up || is_welded(state, in, config)) return Phase::open;
      return is_ready && is_by_itself(state, in, config) ? Phase::precharge : Phase::main_negative;
    case Phase::precharge:
      if (!in.close_wanted || precharge_failure(state, in, config) != PrechargeFailure::none) return Phase::open;
      return is_ready && is_precharged(state, in, config) ? Phase::main_positive : Phase::precharge;
    case Phase::main_positive:
      if (!in.close_wanted || gives_up || has_lost_link(state, in, config)) return Phase::open;
      return is_ready && is_joined(state, in, config) ? Phase::closed : Phase::main_positive;
    case Phase::closed:
      if (in.close_wanted) return Phase::closed;
      if (is_without_load) return Phase::open;
      return in.is_unplugged ? Phase::breaking : Phase::ramp_down;
    case Phase::ramp_down:
      if (is_without_load) return Phase::open;
      return in.is_unplugged || since >= config.zero_current_grace ? Phase::breaking : Phase::ramp_down;
    case Phase::breaking: return since >= config.break_gap ? Phase::open : Phase::breaking;
  }
  return Phase::open;
}

[[nodiscard]] constexpr bool next_charge(const SequenceState& state, Phase phase, const SequenceInputs& in,
                                         const ContactorConfig& config) {
  if (!config.has_charge_contactor || !in.charge_permitted) return false;
  if (phase == Phase::ramp_down) return state.is_charge_closed;
  if (phase != Phase::closed || !in.charge_wanted) return false;
  const bool is_ready = state.phase == Phase::closed && in.now - state.entered_at >= config.settle && in.may_advance &&
                        in.contacts_settled;
  return state.is_charge_closed || is_ready;
}

/// Time of a bad sample of this phase, the first sign of a failure; zero: there is none.
[[nodiscard]] constexpr TimePoint suspicion_at(const SequenceState& state, const SequenceInputs& in,
                                               const ContactorConfig& config) {
  const bool follows = state.phase == Phase::main_negative && follows_through_nothing(state, in, config);
  if (follows) return in.link_at;
  return state.phase == Phase::precharge && is_overcurrent(state, in, config) ? in.current_at : TimePoint{};
}

/// Reason for which a requested and permitted closing is aborted in this step.
[[nodiscard]] constexpr PrechargeFailure failure_of(const SequenceState& state, const SequenceInputs& in,
                                                    const ContactorConfig& config) {
  if (!in.close_wanted || !in.close_permitted) return PrechargeFailure::none;
  switch (state.phase) {
    case Phase::main_negative: return is_welded(state, in, config) ? PrechargeFailure::welded : PrechargeFailure::none;
    case Phase::precharge: return precharge_failure(state, in, config);
    case Phase::main_positive:
      return has_lost_link(state, in, config) ? PrechargeFailure::too_slow : PrechargeFailure::none;
    case Phase::open:
    case Phase::closed:
    case Phase::ramp_down:
    case Phase::breaking: return PrechargeFailure::none;
  }
  return PrechargeFailure::none;
}

/// Executes one tick. Without permission the outputs are all open in the same tick, from every phase.
[[nodiscard]] constexpr SequenceStep step(const SequenceState& state, const SequenceInputs& in,
                                          const ContactorConfig& config) {
  const Phase phase = next_phase(state, in, config);
  SequenceStep result{.state = state};
  SequenceState& next = result.state;
  next.phase = phase;
  next.is_charge_closed = next_charge(state, phase, in, config);
  if (phase != state.phase) {
    next.entered_at = in.now;
    next.suspected_at = {};
    if (state.phase == Phase::open) next.must_be_discharged = in.now - state.entered_at >= config.link_decay;
    if (phase == Phase::precharge) next.link_at_start_mV = in.link_mV;
    if (phase == Phase::breaking) next.breaks_first = breaker_of(state, in.current_mA);
  } else if (state.suspected_at == TimePoint{}) {
    next.suspected_at = suspicion_at(state, in, config);
  }
  result.outputs = outputs_for(next);
  result.precharge_failure = failure_of(state, in, config);
  return result;
}

namespace detail {

[[nodiscard]] consteval bool positive_never_without_negative() {
  for (const Phase phase : all_phases) {
    if (phase == Phase::breaking) continue;  // in this phase one of the two opens first
    const ContactorOutputs outputs = outputs_for({.phase = phase});
    if (outputs.main_positive && !outputs.main_negative) return false;
  }
  return true;
}

[[nodiscard]] consteval bool opens_at_once_without_permission() {
  for (const Phase phase : all_phases) {
    for (const bool wanted : {false, true}) {
      const SequenceInputs in{.close_wanted = wanted, .charge_wanted = true, .charge_permitted = true};
      const SequenceState state{.phase = phase, .is_charge_closed = true};
      if (step(state, in, {.has_charge_contactor = true}).outputs.any_contactor()) return false;
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
    const bool was_closed = outputs_for({.phase = phase}).main_positive;
    if (!was_closed && step({.phase = phase}, unmeasured, {}).outputs.main_positive) return false;
  }
  return true;
}

[[nodiscard]] consteval bool no_precharge_of_a_link_that_follows() {
  for (const bool must_be_discharged : {false, true}) {
    const SequenceInputs in{.now = TimePoint{1s},
                            .close_wanted = true,
                            .close_permitted = true,
                            .may_advance = true,
                            .contacts_settled = true,
                            .is_measured = true,
                            .cells_mV = 1,
                            .pack_mV = 1,
                            .pack_at = TimePoint{1s},
                            .link_mV = 1,
                            .link_at = TimePoint{1s}};
    const SequenceState state{.phase = Phase::main_negative, .must_be_discharged = must_be_discharged};
    if (step(state, in, {}).outputs.precharge) return false;
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
                              .cells_mV = 1,
                              .pack_mV = 1,
                              .pack_at = TimePoint{1s},
                              .link_mV = phase == Phase::main_negative ? 0 : 1,
                              .link_at = TimePoint{1s}};
      if (step({.phase = phase}, in, {}).state.phase != phase) return false;
    }
  }
  return true;
}

[[nodiscard]] consteval bool closed_only_when_seen_joined() {
  const SequenceInputs unmeasured{.now = TimePoint{1s},
                                  .close_wanted = true,
                                  .close_permitted = true,
                                  .may_advance = true,
                                  .contacts_settled = true};
  return step({.phase = Phase::main_positive}, unmeasured, {}).state.phase == Phase::main_positive;
}

}  // namespace detail

static_assert(detail::closed_only_when_seen_joined());
static_assert(detail::no_precharge_of_a_link_that_follows());
static_assert(detail::no_step_without_contacts_or_reason());
static_assert(detail::positive_never_without_negative());
static_assert(detail::opens_at_once_without_permission());
static_assert(detail::positive_only_after_precharge());

}  // namespace bmu
