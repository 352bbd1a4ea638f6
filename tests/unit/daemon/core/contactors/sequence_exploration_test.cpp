// Exhaustive test of the contactor sequence: every phase with every combination of inputs, and every state that can be
// reached from open. Forbidden results are specified here a second time, independently of the code.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};
constexpr std::int32_t pack_mV = 100'000;

/// All times and currents differ, so that none can stand in for another.
constexpr ContactorConfig config_with(bool has_charge_contactor) {
  return {.settle = 100ms,
          .precharge_min = 150ms,
          .precharge_timeout = 3s,
          .precharge_current_max_mA = 500,
          .precharge_overcurrent_mA = 20'000,
          .zero_current_grace = 200ms,
          .break_gap = 40ms,
          .has_charge_contactor = has_charge_contactor};
}

constexpr std::array<Duration, 11> edges{0ns,   40ms - 1ns,  40ms,  100ms - 1ns, 100ms, 150ms - 1ns,
                                         150ms, 200ms - 1ns, 200ms, 3s - 1ns,    3s};
constexpr std::array<std::int32_t, 6> currents_mA{0, 500, 501, 1'001, -1'001, 20'001};
constexpr std::array<std::int32_t, 5> links_mV{0, 50'000, 95'000, 105'000, 105'001};
constexpr std::array<ContactorId, 4> breakers{ContactorId::main_positive, ContactorId::main_negative,
                                              ContactorId::precharge, ContactorId::charge};

/// Counts the tested steps and violations; keeps the first violation.
struct Findings {
  std::uint64_t tried = 0;
  std::uint64_t violations = 0;
  std::string first;

  void demand(bool holds, const char* what, Phase from, Phase to) {
    if (holds) return;
    if (violations++ == 0)
      first = std::string(what) + ": " + std::string(to_text(from)) + " to " + std::string(to_text(to));
  }
};

bool newly(bool before, bool after) {
  return after && !before;
}

// --- conditions of every single step --------------------------------------------------------------------------------

/// Whether the main contactors may close: this precharge has charged the DC link, and all other conditions are met.
bool has_reason_to_finish(const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config) {
  const std::int32_t apart_mV = in.pack_mV - in.link_mV;
  const bool is_close = 20 * std::abs(apart_mV) <= in.pack_mV;  // 5 %
  const bool is_fallen =
      in.current_mA <= config.precharge_current_max_mA && -in.current_mA <= config.precharge_current_max_mA;
  const TimePoint own_since = state.entered_at + config.settle;
  const bool is_own = in.link_at >= own_since && in.pack_at >= own_since && in.current_at >= own_since;
  const Duration since = in.now - state.entered_at;
  return state.phase == Phase::precharge && in.is_measured && is_close && is_fallen && is_own && in.close_wanted &&
         in.may_advance && in.contacts_settled && !in.resistor_is_hot && since >= config.settle &&
         since < config.precharge_timeout;
}

/// Whether the DC link is isolated with main negative alone, sampled after that contactor had its time to close.
bool is_seen_apart(const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config) {
  return in.is_measured && 20 * std::abs(in.pack_mV - in.link_mV) > in.pack_mV &&
         in.link_at - state.entered_at >= config.settle && in.pack_at - state.entered_at >= config.settle;
}

void check_closing(Findings& found, const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config,
                   const SequenceStep& result) {
  const ContactorOutputs before = outputs_for(state);
  const ContactorOutputs& after = result.outputs;
  const Phase to = result.state.phase;
  const auto demand = [&](bool holds, const char* what) { found.demand(holds, what, state.phase, to); };
  const Duration since = in.now - state.entered_at;
  demand(in.close_permitted || !after.any_contactor(), "closed without permission");
  demand(in.close_permitted || to == Phase::open, "not open without permission");
  demand(!newly(before.main_positive, after.main_positive) || has_reason_to_finish(state, in, config),
         "main positive closed without a precharge");
  const bool begins = state.phase == Phase::open && in.close_wanted && in.close_permitted;
  const TimePoint own_since = state.entered_at + config.settle;
  const bool is_joined = in.is_measured && in.link_at >= own_since && in.pack_at >= own_since &&
                         20 * std::abs(in.pack_mV - in.link_mV) <= in.pack_mV;
  demand(state.phase != Phase::main_positive || to != Phase::closed || is_joined,
         "closed without the link at the pack behind main positive");
  demand(!newly(before.main_negative, after.main_negative) || begins, "main negative closed in between");
  const bool goes_on = state.phase == Phase::main_negative && in.close_wanted && in.may_advance &&
                       in.contacts_settled && since >= config.settle && since < config.precharge_timeout &&
                       is_seen_apart(state, in, config);
  demand(!newly(before.precharge, after.precharge) || goes_on, "precharge closed out of order");
  const bool may_charge = state.phase == Phase::closed && to == Phase::closed && in.charge_wanted && in.may_advance &&
                          in.contacts_settled && since >= config.settle;
  demand(!newly(state.is_charge_closed, after.charge) || may_charge, "charge contactor closed out of order");
  const bool is_behind_mains = (to == Phase::closed || to == Phase::ramp_down || to == Phase::breaking) &&
                               after.main_positive && after.main_negative;
  demand(!after.charge || is_behind_mains, "charge contactor without the mains");
  demand(!after.charge || to != Phase::breaking, "charge contactor closed while breaking");
  demand(!after.charge || (in.charge_permitted && config.has_charge_contactor), "charge contactor without permission");
  demand(!(after.precharge && after.main_positive) || to == Phase::main_positive, "precharge beside a closed main");
  demand(!after.precharge || after.main_negative, "precharge without main negative");
  const bool may_stand_alone = to == Phase::breaking;
  demand(!after.main_positive || after.main_negative || may_stand_alone, "main positive alone");
}

void check_opening(Findings& found, const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config,
                   const SequenceStep& result) {
  const Phase to = result.state.phase;
  const auto demand = [&](bool holds, const char* what) { found.demand(holds, what, state.phase, to); };
  const Duration since = in.now - state.entered_at;
  const bool is_closing =
      state.phase == Phase::main_negative || state.phase == Phase::precharge || state.phase == Phase::main_positive;
  const bool is_without_load = !in.is_current_known || (in.current_mA <= 1'000 && in.current_mA >= -1'000);
  const bool is_charger_gone = in.is_unplugged && !in.close_wanted;
  if (!in.close_wanted) {
    demand(!is_closing || to == Phase::open, "a closing went on without a wish");
    const bool is_left = to == Phase::open || to == (in.is_unplugged ? Phase::breaking : Phase::ramp_down);
    demand(state.phase != Phase::closed || is_left, "closed without a wish");
    demand(state.phase != Phase::open || to == Phase::open, "began without a wish");
  }
  const bool is_opening = state.phase == Phase::ramp_down || state.phase == Phase::breaking;
  demand(!is_opening || to == Phase::open || to >= state.phase, "an opening turned back");
  demand(state.phase != Phase::ramp_down || !is_without_load || to == Phase::open, "waited without a load");
  demand(state.phase != Phase::ramp_down || since < config.zero_current_grace || to != Phase::ramp_down,
         "grace too long");
  demand(state.phase != Phase::ramp_down || !is_charger_gone || to != Phase::ramp_down,
         "grace for a plug that is pulled");
  demand(state.phase != Phase::breaking || since < config.break_gap || to == Phase::open, "gap too long");
  demand(!is_closing || since < config.precharge_timeout || to != state.phase, "a phase without an end");
  if (to == Phase::breaking && state.phase != Phase::breaking) {
    const ContactorOutputs expected = in.current_mA >= 0 ? ContactorOutputs{.main_negative = true}
                                      : state.is_charge_closed
                                          ? ContactorOutputs{.main_positive = true, .main_negative = true}
                                          : ContactorOutputs{.main_positive = true};
    demand(result.outputs == expected, "the wrong contactor breaks");
  }
}

void check_failure(Findings& found, const SequenceState& state, const SequenceInputs& in, const SequenceStep& result) {
  const Phase to = result.state.phase;
  const bool is_told = result.precharge_failure != PrechargeFailure::none;
  const bool is_closing =
      state.phase == Phase::main_negative || state.phase == Phase::precharge || state.phase == Phase::main_positive;
  const bool may_tell = is_closing && to == Phase::open && in.close_wanted && in.close_permitted;
  found.demand(!is_told || may_tell, "a failure out of nothing", state.phase, to);
  const bool is_weld_told = result.precharge_failure == PrechargeFailure::welded;
  const bool follows =
      in.is_measured && 20 * std::abs(in.pack_mV - in.link_mV) <= in.pack_mV && in.link_at > state.entered_at;
  const bool is_second = state.suspected_at != TimePoint{} && in.link_at > state.suspected_at;
  const bool is_weld = state.phase == Phase::main_negative && state.must_be_discharged && follows && is_second &&
                       in.close_wanted && in.close_permitted;
  found.demand(is_weld_told == is_weld, "a weld told without two samples, or not told", state.phase, to);
  // Main positive must not close onto a DC link that differs from the pack, sampled since the close command.
  const bool is_lost = state.phase == Phase::main_positive && in.is_measured && in.link_at > state.entered_at &&
                       20 * std::abs(in.pack_mV - in.link_mV) > in.pack_mV;
  found.demand(!is_lost || to == Phase::open, "main positive goes on without the link", state.phase, to);
  const bool is_loss_told = is_lost && in.close_wanted && in.close_permitted;
  found.demand(state.phase != Phase::main_positive || is_told == is_loss_told, "a lost link told, or not told",
               state.phase, to);
  // A precharge aborted although requested and permitted is a failure and must be reported.
  const bool gave_up = state.phase == Phase::precharge && to == Phase::open && in.close_wanted && in.close_permitted;
  found.demand(!gave_up || is_told, "a precharge given up in silence", state.phase, to);
}

void check_step(Findings& found, const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config) {
  const SequenceStep result = step(state, in, config);
  ++found.tried;
  check_closing(found, state, in, config, result);
  check_opening(found, state, in, config, result);
  check_failure(found, state, in, result);
  const bool has_moved = result.state.phase != state.phase;
  found.demand(result.state.entered_at == (has_moved ? in.now : state.entered_at), "entered at another time",
               state.phase, result.state.phase);
}

// --- every combination of inputs ------------------------------------------------------------------------------------

SequenceInputs flags_of(unsigned bits) {
  const auto bit = [bits](unsigned number) { return ((bits >> number) & 1U) != 0; };
  return {.close_wanted = bit(0),
          .close_permitted = bit(1),
          .may_advance = bit(2),
          .contacts_settled = bit(3),
          .charge_wanted = bit(4),
          .charge_permitted = bit(5),
          .resistor_is_hot = bit(6),
          .is_current_known = bit(7),
          .is_measured = bit(8),
          .cells_mV = pack_mV,
          .pack_mV = pack_mV,
          .pack_before_mV = pack_mV};
}
constexpr unsigned flag_combinations = 1U << 9;

/// Whether the flag is_unplugged, which flags_of omits, has an effect.
bool asks_who_is_unplugged(Phase phase) {
  return phase == Phase::closed || phase == Phase::ramp_down;
}

/// Calls `visit` with every set of flags, times and currents; unknown values are tested with two absurd values.
template <class Visit>
void for_each_input(Visit visit) {
  constexpr std::array<Duration, 4> sampled{-1ns, 0ns, 100ms - 1ns, 100ms};
  for (unsigned bits = 0; bits < flag_combinations; ++bits) {
    SequenceInputs in = flags_of(bits);
    const std::size_t currents = in.is_current_known || in.is_measured ? currents_mA.size() : 2;
    const std::size_t links = in.is_measured ? links_mV.size() : 1;
    const std::size_t samples = in.is_measured ? sampled.size() : 1;
    for (const Duration since : edges) {
      in.now = start + since;
      for (std::size_t current = 0; current < currents; ++current) {
        in.current_mA = currents_mA[currents_mA.size() - 1 - current];
        for (std::size_t link = 0; link < links; ++link) {
          in.link_mV = links_mV[links_mV.size() - 1 - link];
          for (std::size_t sample = 0; sample < samples; ++sample) {
            in.link_at = in.pack_at = in.current_at = start + sampled[sampled.size() - 1 - sample];
            visit(in);
          }
        }
      }
    }
  }
}

/// Sets members that are unused in this phase, and so must have no effect, to absurd values.
SequenceState with_leftovers(SequenceState state) {
  if (state.phase != Phase::breaking) state.breaks_first = ContactorId::charge;
  if (state.phase != Phase::precharge) state.link_at_start_mV = 95'000;
  if (state.phase != Phase::main_negative) state.must_be_discharged = !state.must_be_discharged;
  const bool has_suspicions = state.phase == Phase::main_negative || state.phase == Phase::precharge;
  if (!has_suspicions) state.suspected_at = start + 10ms;
  return state;
}

std::vector<SequenceState> all_states(bool has_charge_contactor) {
  std::vector<SequenceState> states;
  for (const Phase phase : all_phases) {
    for (const bool is_charge_closed : {false, true}) {
      if (is_charge_closed && !has_charge_contactor) continue;
      for (const ContactorId breaks_first : breakers) {
        if (phase != Phase::breaking && breaks_first != breakers[0]) continue;  // see with_leftovers
        states.push_back({phase, start, is_charge_closed, breaks_first});
      }
    }
  }
  return states;
}

}  // namespace

TEST_CASE("every phase with every combination of inputs keeps the rules of closing and opening",
          "[unit][contactors][exhaustive]") {
  Findings found;
  for (const bool has_charge_contactor : {false, true}) {
    const ContactorConfig config = config_with(has_charge_contactor);
    for (const SequenceState& state : all_states(has_charge_contactor)) {
      const SequenceState with_more = with_leftovers(state);
      for_each_input([&](const SequenceInputs& in) {
        SequenceInputs unplugged = in;
        unplugged.is_unplugged = true;
        const bool is_asked = asks_who_is_unplugged(state.phase);
        check_step(found, state, in, config);
        if (is_asked) check_step(found, state, unplugged, config);
        const SequenceStep one = step(state, in, config);
        const SequenceStep other = step(with_more, is_asked ? in : unplugged, config);
        const bool is_alike = one.state.phase == other.state.phase && one.outputs == other.outputs &&
                              one.precharge_failure == other.precharge_failure;
        found.demand(is_alike, "leftovers of another phase matter", state.phase, one.state.phase);
      });
    }
  }
  WARN("steps tried: " << found.tried);
  INFO(found.first);
  CHECK(found.violations == 0);
  CHECK(found.tried >= 10'000'000);
}

TEST_CASE("a precharge with every combination of samples, suspicions and starting voltages keeps the rules",
          "[unit][contactors][exhaustive]") {
  constexpr std::array<Duration, 7> sampled{-1ns, 0ns, 1ns, 100ms - 1ns, 100ms, 150ms - 1ns, 150ms};
  constexpr std::array<TimePoint, 3> suspected{TimePoint{}, start + 10ms, start + 100ms};
  const ContactorConfig config = config_with(true);
  Findings found;
  std::array<std::uint64_t, 4> failures{};  // a weld is reported before the precharge
  const auto look = [&](const SequenceState& state, const SequenceInputs& in) {
    check_step(found, state, in, config);
    const SequenceStep result = step(state, in, config);
    ++failures.at(static_cast<std::size_t>(result.precharge_failure));
    const bool is_beyond = in.is_current_known && std::abs(in.current_mA) > 20'000 && in.current_at > state.entered_at;
    const bool is_second = state.suspected_at != TimePoint{} && in.current_at > state.suspected_at;
    const bool may_tell = in.close_wanted && in.close_permitted;
    found.demand((result.precharge_failure == PrechargeFailure::overcurrent) == (is_beyond && is_second && may_tell),
                 "overcurrent without two samples of it", state.phase, result.state.phase);
    const bool is_suspicion = result.state.phase == Phase::precharge && state.suspected_at == TimePoint{} && is_beyond;
    const TimePoint expected = result.state.phase != Phase::precharge ? TimePoint{}
                               : is_suspicion                         ? in.current_at
                                                                      : state.suspected_at;
    found.demand(result.state.suspected_at == expected, "a suspicion of another time", state.phase, result.state.phase);
  };
  for (const TimePoint suspected_at : suspected) {
    for (const std::int32_t link_at_start_mV : {0, 47'500, 95'000}) {
      const SequenceState state{Phase::precharge, start, false, {}, link_at_start_mV, suspected_at};
      for (unsigned bits = 0; bits < flag_combinations; ++bits) {
        SequenceInputs in = flags_of(bits);
        if (in.charge_wanted != in.charge_permitted) continue;  // neither has an effect here
        for (const Duration since :
             {Duration{}, 100ms - 1ns, Duration{100ms}, Duration{150ms}, 3s - 1ns, Duration{3s}}) {
          in.now = start + since;
          for (const std::int32_t current_mA : {0, -500, 501, -20'000, 20'001, -20'001}) {
            in.current_mA = current_mA;
            for (const Duration current_at : {Duration{-1}, Duration{10ms}, Duration{100ms}, 100ms + 1ns}) {
              in.current_at = start + current_at;
              for (const std::int32_t link_mV : {0, 94'999, 95'000, 105'001}) {
                in.link_mV = link_mV;
                for (const Duration measured_at : sampled) {
                  in.link_at = in.pack_at = start + measured_at;
                  look(state, in);
                }
              }
            }
          }
        }
      }
    }
  }
  WARN("steps tried: " << found.tried);
  INFO(found.first);
  CHECK(found.violations == 0);
  CHECK(found.tried >= 9'000'000);
  for (const std::uint64_t count : failures) CHECK(count > 0);
}

TEST_CASE("main negative alone with every combination of samples and suspicions keeps the rules",
          "[unit][contactors][exhaustive]") {
  const ContactorConfig config = config_with(true);
  Findings found;
  std::uint64_t welds = 0;
  for (const bool must_be_discharged : {false, true}) {
    for (const TimePoint suspected_at : {TimePoint{}, start + 10ms, start + 100ms}) {
      const SequenceState state{.phase = Phase::main_negative,
                                .entered_at = start,
                                .suspected_at = suspected_at,
                                .must_be_discharged = must_be_discharged};
      for_each_input([&](const SequenceInputs& in) {
        check_step(found, state, in, config);
        const SequenceStep result = step(state, in, config);
        welds += result.precharge_failure == PrechargeFailure::welded ? 1 : 0;
        found.demand(result.state.phase == Phase::open || result.state.must_be_discharged == must_be_discharged,
                     "forgot how long it had been open", state.phase, result.state.phase);
      });
    }
  }
  INFO(found.first);
  CHECK(found.violations == 0);
  CHECK(found.tried >= 1'000'000);
  CHECK(welds > 0);
}

TEST_CASE("a precharge from a charged link may end sooner, in proportion, and exactly then", "[unit][contactors]") {
  const ContactorConfig config = config_with(false);
  const SequenceInputs seen{.close_wanted = true,
                            .close_permitted = true,
                            .is_measured = true,
                            .cells_mV = pack_mV,
                            .pack_mV = pack_mV,
                            .link_mV = 95'000};
  for (const auto& [link_at_start_mV, least] :
       {std::pair{0, Duration{150ms}}, std::pair{47'500, Duration{75ms}}, std::pair{94'999, Duration{1'578}},
        std::pair{95'000, Duration{}}, std::pair{-1'000, Duration{150ms}}}) {
    const SequenceState state{Phase::precharge, start, false, {}, link_at_start_mV};
    CHECK(precharge_min(state, pack_mV, config) >= least - 200us);
    CHECK(precharge_min(state, pack_mV, config) <= least);
    SequenceInputs in = seen;
    in.now = start + 200ms;
    in.link_at = in.pack_at = start + precharge_min(state, pack_mV, config) - 1ns;
    const bool could_be_early = in.link_at > start;
    CHECK((step(state, in, config).precharge_failure == PrechargeFailure::too_fast) == could_be_early);
    in.link_at += 1ns;
    in.pack_at += 1ns;
    CHECK(step(state, in, config).precharge_failure == PrechargeFailure::none);
  }
}

// --- every reachable state ------------------------------------------------------------------------------------------

namespace {

constexpr Duration tick = 10ms;
constexpr int age_max = 9;  // in ticks: beyond every time below
constexpr int no_age = 15;

/// As config_with, but with times of a few ticks, so that all of them can be explored.
constexpr ContactorConfig short_config(bool has_charge_contactor) {
  ContactorConfig config = config_with(has_charge_contactor);
  config.settle = 2 * tick;
  config.precharge_min = 3 * tick;
  config.precharge_timeout = 8 * tick;
  config.zero_current_grace = 4 * tick;
  config.break_gap = 2 * tick;
  config.link_decay = 5 * tick;
  return config;
}
constexpr int unwished_max = 4 + 2 + 1;  // grace, break gap and a tick

/// State with its times as ages in ticks, and the part of its history that the checks need.
struct Reached {
  Phase phase = Phase::open;
  bool is_charge_closed = false;
  ContactorId breaks_first = ContactorId::main_positive;
  int age = age_max;
  int link_at_start = 0;       // index into explored_links_mV
  int suspected_age = no_age;  // age of the first bad sample in this phase
  bool must_be_discharged = false;
  bool has_precharged = false;  // the precharge of this closing has succeeded
  int unwished = 0;             // ticks since the close request ended, while not open
};

constexpr std::array<std::int32_t, 4> explored_links_mV{0, 50'000, 96'000, 110'000};

std::size_t index_of(const Reached& at) {
  std::size_t index = static_cast<std::size_t>(at.phase);
  const auto append = [&index](int value, std::size_t count) {
    index = index * count + static_cast<std::size_t>(value);
  };
  append(at.is_charge_closed ? 1 : 0, 2);
  append(static_cast<int>(at.breaks_first), 4);
  append(at.age, 16);
  append(at.link_at_start, 4);
  append(at.suspected_age, 16);
  append(at.must_be_discharged ? 1 : 0, 2);
  append(at.has_precharged ? 1 : 0, 2);
  append(at.unwished, 16);
  return index;
}
constexpr std::size_t index_count = all_phases.size() * 2 * 4 * 16 * 4 * 16 * 2 * 2 * 16;

SequenceState state_of(const Reached& at) {
  return {.phase = at.phase,
          .entered_at = start - at.age * tick,
          .is_charge_closed = at.is_charge_closed,
          .breaks_first = at.breaks_first,
          .link_at_start_mV = explored_links_mV[static_cast<std::size_t>(at.link_at_start)],
          .suspected_at = at.suspected_age == no_age ? TimePoint{} : start - at.suspected_age * tick,
          .must_be_discharged = at.must_be_discharged};
}

int age_of(TimePoint at) {
  return static_cast<int>(std::min<std::int64_t>((start - at) / tick, age_max));
}

/// State one tick later. Members that are unused in a phase are reset; the first test shows that they have no effect.
Reached reached_by(const Reached& from, const SequenceInputs& in, const SequenceStep& result) {
  const SequenceState& state = result.state;
  Reached to{.phase = state.phase, .is_charge_closed = state.is_charge_closed};
  to.age = std::min(age_of(state.entered_at) + 1, age_max);
  if (to.phase == Phase::breaking) to.breaks_first = state.breaks_first;
  if (to.phase == Phase::precharge) {
    while (explored_links_mV[static_cast<std::size_t>(to.link_at_start)] != state.link_at_start_mV) ++to.link_at_start;
  }
  if (to.phase == Phase::main_negative) to.must_be_discharged = state.must_be_discharged;
  if (state.suspected_at != TimePoint{}) to.suspected_age = std::min(age_of(state.suspected_at) + 1, age_max);
  if (to.phase == Phase::open) return to;
  to.has_precharged = from.has_precharged || (from.phase == Phase::precharge && to.phase == Phase::main_positive);
  to.unwished = in.close_wanted && from.unwished == 0 ? 0 : std::min(from.unwished + 1, 15);
  return to;
}

/// Visits every set of inputs at `start`; samples are from now, two ticks ago, or before the phase began. Building a
/// list of them for each state takes longer than the steps themselves.
template <class Visit>
void for_each_input_of(const SequenceState& state, Visit visit) {
  const TimePoint before = state.entered_at - 1ns;
  const bool is_asked = asks_who_is_unplugged(state.phase);
  for (unsigned bits = 0; bits < flag_combinations; ++bits) {
    SequenceInputs in = flags_of(bits);
    in.now = start;
    const std::size_t links = in.is_measured ? explored_links_mV.size() : 1;
    for (const std::int32_t current_mA : {0, 600, 2'000, -2'000, 30'000}) {
      if (!in.is_current_known && !in.is_measured && current_mA != -2'000) continue;
      in.current_mA = current_mA;
      for (const TimePoint current_at : {start, before}) {
        if (!in.is_current_known && current_at == before) continue;
        in.current_at = current_at;
        for (std::size_t link = 0; link < links; ++link) {
          in.link_mV = explored_links_mV[link];
          for (const TimePoint measured_at : {start, start - 2 * tick, before}) {
            if (!in.is_measured && measured_at != start) continue;
            in.link_at = in.pack_at = measured_at;
            for (const bool is_unplugged : {false, true}) {
              if (is_unplugged && !is_asked) continue;
              in.is_unplugged = is_unplugged;
              visit(std::as_const(in));
            }
          }
        }
      }
    }
  }
}

/// Checks the conditions of a reached state.
void check_reached(Findings& found, const Reached& from, const SequenceInputs& in, const Reached& to,
                   const SequenceStep& result) {
  const auto demand = [&](bool holds, const char* what) { found.demand(holds, what, from.phase, to.phase); };
  const bool is_before = from.phase == Phase::open || from.phase == Phase::main_negative;
  const bool is_apart = in.is_measured && 20 * std::abs(in.pack_mV - in.link_mV) > in.pack_mV;
  demand(!is_before || is_apart || !(result.outputs.precharge || result.outputs.main_positive),
         "went on although the link follows before the precharge");
  demand(!result.outputs.main_positive || to.has_precharged, "main positive without this closing's precharge");
  demand(to.unwished < unwished_max, "still not open although nobody asks");
  const bool is_told = result.precharge_failure != PrechargeFailure::none;
  demand(!is_told || to.phase == Phase::open, "told, and went on");  // the next closing starts without a failure
}

/// Explores breadth first from open; calls `look` for every step.
template <class Look>
std::vector<Reached> explore(const ContactorConfig& config, Look look) {
  std::vector<bool> seen(index_count);
  std::vector<Reached> states{Reached{}};
  seen[index_of(states.front())] = true;
  for (std::size_t next = 0; next < states.size(); ++next) {
    const Reached from = states[next];
    const SequenceState state = state_of(from);
    for_each_input_of(state, [&](const SequenceInputs& in) {
      const SequenceStep result = step(state, in, config);
      const Reached to = reached_by(from, in, result);
      look(from, in, to, result);
      if (seen[index_of(to)]) return;
      seen[index_of(to)] = true;
      states.push_back(to);
    });
  }
  return states;
}

/// Ticks until the sequence is open or closed, with permanently constant inputs.
int ticks_to_rest(SequenceState state, SequenceInputs in, const ContactorConfig& config, int at_most) {
  for (int ticks = 0; ticks <= at_most; ++ticks) {
    if (state.phase == Phase::open || state.phase == Phase::closed) return ticks;
    state = step(state, in, config).state;
    in.now += tick;
    in.link_at += tick;
    in.pack_at += tick;
    in.current_at += tick;
  }
  return at_most + 1;
}

}  // namespace

TEST_CASE("every state that can be reached from open keeps the rules, whatever the inputs do",
          "[unit][contactors][exhaustive]") {
  Findings found;
  std::size_t states_reached = 0;
  for (const bool has_charge_contactor : {false, true}) {
    const ContactorConfig config = short_config(has_charge_contactor);
    const std::vector<Reached> states = explore(
        config, [&](const Reached& from, const SequenceInputs& in, const Reached& to, const SequenceStep& result) {
          check_step(found, state_of(from), in, config);
          check_reached(found, from, in, to, result);
        });
    states_reached += states.size();
    for (const Phase phase : all_phases) {
      CHECK(std::any_of(states.begin(), states.end(), [phase](const Reached& at) { return at.phase == phase; }));
    }
    const bool charges =
        std::any_of(states.begin(), states.end(), [](const Reached& at) { return at.is_charge_closed; });
    CHECK(charges == has_charge_contactor);
  }
  WARN("states reached: " << states_reached << ", steps tried: " << found.tried);
  INFO(found.first);
  CHECK(found.violations == 0);
  CHECK(states_reached >= 380);
}

TEST_CASE("with inputs that stay as they are every reachable state comes to open or closed within the times",
          "[unit][contactors][exhaustive]") {
  constexpr int at_most = 3 * 8 + 4 + 2 + 1;  // three phases of closing, then grace, break gap and a tick
  const ContactorConfig config = short_config(true);
  const std::vector<Reached> states = explore(config, [](const auto&...) {});
  Findings found;
  int longest = 0;
  for (const Reached& at : states) {
    const SequenceState state = state_of(at);
    for_each_input_of(state, [&](const SequenceInputs& in) {
      ++found.tried;
      longest = std::max(longest, ticks_to_rest(state, in, config, at_most));
      // Closed stays closed as long as it is requested and permitted, and open stays open otherwise.
      const bool is_asked = in.close_wanted && in.close_permitted;
      const Phase next = step(state, in, config).state.phase;
      if (at.phase == Phase::closed) found.demand((next == Phase::closed) == is_asked, "left", at.phase, next);
      if (at.phase == Phase::open) found.demand((next == Phase::open) != is_asked, "left", at.phase, next);
    });
  }
  WARN("states and inputs tried: " << found.tried << ", longest way: " << longest << " ticks");
  INFO(found.first);
  CHECK(found.violations == 0);
  CHECK(longest <= at_most);
  CHECK(found.tried >= 1'000'000);
}
