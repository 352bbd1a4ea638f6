// Contactor sequence, one step at a time: the effect of each condition alone, and each time to the nanosecond.
#include "daemon/core/contactors/contactor_sequence.hpp"

#include <array>
#include <set>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};
constexpr ContactorConfig config{.settle = 100ms,
                                 .precharge_timeout = 3s,
                                 .precharge_done_permille = 950,
                                 .precharge_current_max_mA = 500,
                                 .has_charge_contactor = true};
constexpr std::array closing{Phase::main_negative, Phase::precharge, Phase::main_positive};

/// Inputs that let a phase continue, `since` after the phase began at `start`.
SequenceInputs ready(Duration since) {
  return {.now = start + since,
          .close_wanted = true,
          .close_permitted = true,
          .may_advance = true,
          .contacts_settled = true,
          .is_current_known = true,
          .current_at = start + since,
          .is_measured = true,
          .cells_mV = 100'000,
          .pack_mV = 100'000,
          .pack_at = start + since,
          .pack_before_mV = 100'000,
          .link_mV = 100'000,
          .link_at = start + since};
}

/// With main negative alone the DC link is isolated.
SequenceInputs ready_in(Phase phase, Duration since) {
  SequenceInputs in = ready(since);
  if (phase == Phase::main_negative) in.link_mV = 0;
  return in;
}

Phase after(Phase phase, const SequenceInputs& in) {
  return step({phase, start}, in, config).state.phase;
}

constexpr auto no_phase = static_cast<Phase>(99);

}  // namespace

TEST_CASE("each condition alone holds up every step", "[unit][contactors][I4]") {
  for (const Phase phase : closing) {
    SequenceInputs in = ready_in(phase, 200ms);
    REQUIRE(after(phase, in) != phase);
    in.may_advance = false;
    CHECK(after(phase, in) == phase);
    in = ready_in(phase, 200ms);
    in.contacts_settled = false;
    CHECK(after(phase, in) == phase);
    CHECK(after(phase, ready_in(phase, 100ms - 1ns)) == phase);
    CHECK(after(phase, ready_in(phase, 100ms)) != phase);
  }
}

TEST_CASE("a precharge begins when a sample of main negative alone shows a link that does not follow the pack",
          "[unit][contactors][I4]") {
  const auto next = [](std::int32_t link_mV, Duration measured, bool is_measured = true) {
    SequenceInputs in = ready(200ms);
    in.link_mV = link_mV;
    in.link_at = in.pack_at = start + measured;
    in.is_measured = is_measured;
    return after(Phase::main_negative, in);
  };
  CHECK(next(0, 100ms) == Phase::precharge);
  CHECK(next(94'999, 100ms) == Phase::precharge);  // residual charge
  CHECK(next(95'000, 100ms) == Phase::main_negative);
  CHECK(next(105'000, 100ms) == Phase::main_negative);
  CHECK(next(105'001, 100ms) == Phase::precharge);      // charged by another source: checked by the precharge
  CHECK(next(0, 100ms - 1ns) == Phase::main_negative);  // the contact may not be closed yet
  CHECK(next(0, 100ms, false) == Phase::main_negative);
}

TEST_CASE("a link that follows with main negative alone, in two samples, shows a weld and opens",
          "[unit][contactors][I4]") {
  SequenceState state{.phase = Phase::main_negative, .entered_at = start, .must_be_discharged = true};
  const auto show = [&state](Duration at, std::int32_t link_mV, bool is_measured = true) {
    SequenceInputs in = ready(at);
    in.now = start + 150ms;
    in.may_advance = false;
    in.link_mV = link_mV;
    in.is_measured = is_measured;
    const SequenceStep result = step(state, in, config);
    CHECK((result.state.phase == Phase::open) == (result.precharge_failure != PrechargeFailure::none));
    state = result.state;
    return result.precharge_failure;
  };
  CHECK(show(0ms, 95'000) == PrechargeFailure::none);  // sampled before the phase began
  CHECK(state.suspected_at == TimePoint{});
  CHECK(step(state, ready(1ns), config).state.suspected_at == start + 1ns);
  CHECK(show(10ms, 94'999) == PrechargeFailure::none);
  CHECK(state.suspected_at == TimePoint{});
  CHECK(show(20ms, 95'000, false) == PrechargeFailure::none);
  CHECK(state.suspected_at == TimePoint{});
  CHECK(show(30ms, 95'000) == PrechargeFailure::none);
  CHECK(state.suspected_at == start + 30ms);
  CHECK(show(30ms, 95'000) == PrechargeFailure::none);  // the same sample
  CHECK(show(40ms, 94'999) == PrechargeFailure::none);
  CHECK(show(50ms, 95'000, false) == PrechargeFailure::none);
  CHECK(state.suspected_at == start + 30ms);
  SECTION("and is told") {
    CHECK(show(60ms, 95'000) == PrechargeFailure::welded);
    CHECK(state.phase == Phase::open);
    CHECK(state.suspected_at == TimePoint{});
  }
  SECTION("but soon after an opening it may be the charge of before, and is waited for") {
    state.must_be_discharged = false;
    CHECK(show(60ms, 95'000) == PrechargeFailure::none);
    CHECK(state.phase == Phase::main_negative);
  }
  SECTION("of a closing that nobody wants any more it is not told") {
    SequenceInputs in = ready(60ms);
    in.close_wanted = false;
    const SequenceStep result = step(state, in, config);
    CHECK(result.state.phase == Phase::open);
    CHECK(result.precharge_failure == PrechargeFailure::none);
  }
}

TEST_CASE("a link must have discharged when the pack has been open for as long as that takes", "[unit][contactors]") {
  ContactorConfig slow = config;
  slow.link_decay = 7s;
  const auto must_be_discharged = [&slow](Duration open_for) {
    return step({Phase::open, start}, ready(open_for), slow).state.must_be_discharged;
  };
  CHECK_FALSE(must_be_discharged(7s - 1ns));
  CHECK(must_be_discharged(7s));
  // The flag keeps its value for the whole closing.
  for (const bool was : {false, true}) {
    const SequenceState state{.phase = Phase::main_negative, .entered_at = start, .must_be_discharged = was};
    CHECK(step(state, ready_in(Phase::main_negative, 200ms), slow).state.must_be_discharged == was);
    CHECK(step(state, ready(50ms), slow).state.must_be_discharged == was);
  }
}

TEST_CASE("without the permission every phase ends at once, and that is no failed precharge",
          "[unit][contactors][I4]") {
  for (const Phase phase : all_phases) {
    for (const bool wanted : {false, true}) {
      SequenceInputs in = ready(200ms);
      in.close_wanted = wanted;
      in.close_permitted = false;
      in.charge_wanted = in.charge_permitted = true;
      in.link_mV = 0;
      in.current_mA = 50'000;
      const SequenceStep result = step({.phase = phase, .entered_at = start, .is_charge_closed = true}, in, config);
      CHECK(result.state.phase == Phase::open);
      CHECK(result.outputs == ContactorOutputs{});
      CHECK_FALSE(result.state.is_charge_closed);
      CHECK(result.precharge_failure == PrechargeFailure::none);
    }
  }
}

TEST_CASE("without the wish a closing is broken off at once, and that is no failed precharge", "[unit][contactors]") {
  for (const Phase phase : closing) {
    SequenceInputs in = ready(1h);
    in.close_wanted = false;
    in.link_mV = 0;
    const SequenceStep result = step({phase, start}, in, config);
    CHECK(result.state.phase == Phase::open);
    CHECK_FALSE(result.outputs.any_contactor());
    CHECK(result.precharge_failure == PrechargeFailure::none);
  }
  SequenceInputs in = ready(1h);
  in.close_wanted = false;
  CHECK(after(Phase::open, in) == Phase::open);
}

TEST_CASE("a phase that does not get on opens after 3 s, and only the precharge calls that a failed one",
          "[unit][contactors][F86]") {
  for (const Phase phase : closing) {
    SequenceInputs in = ready(3s - 1ns);
    in.contacts_settled = false;
    CHECK(after(phase, in) == phase);
    in.now = start + 3s;
    const SequenceStep result = step({phase, start}, in, config);
    CHECK(result.state.phase == Phase::open);
    CHECK(result.state.entered_at == start + 3s);
    CHECK_FALSE(result.outputs.any_contactor());
    CHECK(result.precharge_failure ==
          (phase == Phase::precharge ? PrechargeFailure::too_slow : PrechargeFailure::none));
  }
  SequenceInputs before_precharge = ready(3s);
  before_precharge.contacts_settled = false;
  before_precharge.link_mV = 0;  // not charged yet
  const SequenceStep result = step({Phase::main_negative, start}, before_precharge, config);
  CHECK(result.state.phase == Phase::open);
  CHECK(result.precharge_failure == PrechargeFailure::none);
}

TEST_CASE("a closed pack stays closed, an open one begins with the negative contactor", "[unit][contactors]") {
  SequenceInputs in = ready(1h);
  in.link_mV = 0;
  in.may_advance = false;
  in.contacts_settled = false;
  const SequenceStep closed = step({Phase::closed, start}, in, config);
  CHECK(closed.state.phase == Phase::closed);
  CHECK(closed.state.entered_at == start);
  CHECK(closed.precharge_failure == PrechargeFailure::none);
  const SequenceStep begun = step({Phase::open, start}, ready(1h), config);
  CHECK(begun.state.phase == Phase::main_negative);
  CHECK(begun.state.entered_at == start + 1h);
}

TEST_CASE("a precharge that nobody can measure does not end", "[unit][contactors][I4]") {
  SequenceInputs in = ready(200ms);
  in.is_measured = false;
  CHECK(after(Phase::precharge, in) == Phase::precharge);
}

TEST_CASE("a precharge is judged by what was measured after its contactor had its time", "[unit][contactors][F86]") {
  for (TimePoint SequenceInputs::*const sample :
       {&SequenceInputs::link_at, &SequenceInputs::pack_at, &SequenceInputs::current_at}) {
    SequenceInputs in = ready(200ms);
    in.link_at = in.pack_at = start + 101ms;  // the pack sample must not be older than the DC link's
    in.*sample = start + 100ms - 1ns;
    CHECK(after(Phase::precharge, in) == Phase::precharge);
    in.*sample = start + 100ms;
    CHECK(after(Phase::precharge, in) == Phase::main_positive);
  }
}

TEST_CASE("a step is granted by voltages of one instant, or with the link's between two of the pack's",
          "[unit][contactors][I4]") {
  for (const Phase phase : closing) {
    SequenceInputs in = ready_in(phase, 200ms);
    in.pack_at = in.link_at - same_instant_max - 1ns;
    CHECK(after(phase, in) == phase);
    in.pack_at = in.link_at - same_instant_max;
    CHECK(after(phase, in) != phase);
    in = ready_in(phase, 200ms);
    in.link_at = start + 100ms;
    CHECK(after(phase, in) != phase);
  }
}

TEST_CASE("a step is granted by samples from after the contacts were seen to follow", "[unit][contactors][I4]") {
  for (const Phase phase : closing) {
    for (TimePoint SequenceInputs::*const sample :
         {&SequenceInputs::link_at, &SequenceInputs::pack_at, &SequenceInputs::current_at}) {
      if (sample == &SequenceInputs::current_at && phase != Phase::precharge) continue;
      SequenceInputs in = ready_in(phase, 300ms);
      in.contacts_since = start + 180ms;
      in.link_at = in.pack_at = start + 181ms;
      in.*sample = start + 180ms - 1ns;
      CHECK(after(phase, in) == phase);
      in.*sample = start + 180ms;
      CHECK(after(phase, in) != phase);
    }
  }
}

TEST_CASE("the sum of the cells forbids what it does not agree with, and grants nothing", "[unit][contactors][I4]") {
  SequenceInputs in = ready(200ms);
  in.cells_mV = 106'000;
  CHECK(after(Phase::precharge, in) == Phase::precharge);
  in.cells_mV = 94'000;
  CHECK(after(Phase::precharge, in) == Phase::precharge);
  in.cells_mV = 104'000;
  CHECK(after(Phase::precharge, in) == Phase::main_positive);
  in.link_mV = 106'000;  // matches the sum of the cells only
  CHECK(after(Phase::precharge, in) == Phase::precharge);
  // The DC link is isolated if it matches neither voltage.
  in = ready(200ms);
  in.link_mV = 95'000;
  in.cells_mV = 106'000;
  CHECK(after(Phase::main_negative, in) == Phase::main_negative);
  in.link_mV = 94'999;
  in.cells_mV = 94'999;
  CHECK(after(Phase::main_negative, in) == Phase::main_negative);
  in.cells_mV = 100'000;
  CHECK(after(Phase::main_negative, in) == Phase::precharge);
}

TEST_CASE("a pack is closed when link and pack were seen together since main positive had its time to close",
          "[unit][contactors][I4]") {
  for (TimePoint SequenceInputs::*const sample : {&SequenceInputs::link_at, &SequenceInputs::pack_at}) {
    SequenceInputs in = ready(200ms);
    in.link_at = in.pack_at = start + 101ms;
    in.*sample = start + 100ms - 1ns;
    CHECK(after(Phase::main_positive, in) == Phase::main_positive);
    in.*sample = start + 100ms;
    CHECK(after(Phase::main_positive, in) == Phase::closed);
  }
  SequenceInputs in = ready(200ms);
  in.is_measured = false;
  CHECK(after(Phase::main_positive, in) == Phase::main_positive);
  in.now = start + 3s;
  CHECK(after(Phase::main_positive, in) == Phase::open);
  // A DC link that matches the previous pack sample only is neither lost nor confirmed.
  in = ready(200ms);
  in.link_mV = 94'999;
  in.pack_before_mV = 99'000;
  CHECK(after(Phase::main_positive, in) == Phase::main_positive);
  in.link_mV = 95'000;
  CHECK(after(Phase::main_positive, in) == Phase::closed);
}

TEST_CASE("a link that falls off on the way to the main contact is a failed precharge, an unknown one is not",
          "[unit][contactors][I4]") {
  SequenceInputs in = ready(10ms);
  in.link_mV = 94'999;
  const SequenceStep lost = step({Phase::main_positive, start}, in, config);
  CHECK(lost.state.phase == Phase::open);
  CHECK(lost.precharge_failure == PrechargeFailure::too_slow);
  in.link_mV = 95'000;
  const SequenceStep kept = step({Phase::main_positive, start}, in, config);
  CHECK(kept.state.phase == Phase::main_positive);
  CHECK(kept.precharge_failure == PrechargeFailure::none);
  in.link_mV = 0;
  in.is_measured = false;
  const SequenceStep unknown = step({Phase::main_positive, start}, in, config);
  CHECK(unknown.state.phase == Phase::main_positive);
  CHECK(unknown.precharge_failure == PrechargeFailure::none);
}

TEST_CASE("a link counts as fallen off only between two pack voltages of the phase of main positive",
          "[unit][contactors][I4]") {
  SequenceInputs lost = ready(10ms);
  lost.link_mV = 94'999;
  REQUIRE(after(Phase::main_positive, lost) == Phase::open);
  // A sample from before the contactor command is checked by the precharge.
  SequenceInputs in = lost;
  in.link_at = start;
  CHECK(after(Phase::main_positive, in) == Phase::main_positive);
  in.link_at = start + 1ns;
  CHECK(after(Phase::main_positive, in) == Phase::open);
  // The pack voltage must be from the instant of the DC link sample, or later.
  in = lost;
  in.pack_at = in.link_at - same_instant_max - 1ns;
  CHECK(after(Phase::main_positive, in) == Phase::main_positive);
  in.pack_at = in.link_at - same_instant_max;
  CHECK(after(Phase::main_positive, in) == Phase::open);
  in.pack_at = in.link_at + 60ms;
  CHECK(after(Phase::main_positive, in) == Phase::open);
  // A contact that closes under a charging current raises the pack voltage, one that closes under load lowers it:
  // either before or after the DC link sample.
  for (std::int32_t SequenceInputs::*const near : {&SequenceInputs::pack_mV, &SequenceInputs::pack_before_mV}) {
    in = lost;
    in.*near = 99'998;
    CHECK(after(Phase::main_positive, in) == Phase::main_positive);
    in.link_mV = 94'998;
    CHECK(after(Phase::main_positive, in) == Phase::open);
    in.link_mV = 105'000;
    CHECK(after(Phase::main_positive, in) == Phase::main_positive);
    in.link_mV = 105'001;
    CHECK(after(Phase::main_positive, in) == Phase::open);
  }
  // Without a previous pack voltage the present one decides.
  in = lost;
  in.pack_before_mV = 0;
  CHECK(after(Phase::main_positive, in) == Phase::open);
  // The sum of the cells is from another instant.
  in = ready(10ms);
  in.link_mV = 95'000;
  in.cells_mV = 200'000;
  CHECK(after(Phase::main_positive, in) == Phase::main_positive);
}

TEST_CASE("a link follows within 5 % of the pack, either way, and only a pack that has a voltage",
          "[unit][contactors]") {
  CHECK(link_apart_max_mV(100'000, config) == 5'000);
  CHECK(link_apart_max_mV(99'999, config) == 4'999);
  CHECK(link_follows(100'000, 95'000, config));
  CHECK_FALSE(link_follows(100'000, 94'999, config));
  CHECK(link_follows(100'000, 105'000, config));
  CHECK_FALSE(link_follows(100'000, 105'001, config));
  CHECK(link_follows(1, 1, config));
  CHECK_FALSE(link_follows(0, 0, config));
  CHECK_FALSE(link_follows(-100'000, -100'000, config));
  CHECK_FALSE(link_follows(INT32_MAX, INT32_MIN, config));
  CHECK(link_apart_max_mV(INT32_MAX, config) == 107'374'182);
}

TEST_CASE("each phase has its contactors, and another number has none", "[unit][contactors][I4]") {
  const auto outputs = [](Phase phase, bool charge = false) {
    return outputs_for({.phase = phase, .is_charge_closed = charge});
  };
  const ContactorOutputs mains{.main_positive = true, .main_negative = true};
  const ContactorOutputs all_three{.main_positive = true, .main_negative = true, .charge = true};
  CHECK(outputs(Phase::open, true) == ContactorOutputs{});
  CHECK(outputs(Phase::main_negative, true) == ContactorOutputs{.main_negative = true});
  CHECK(outputs(Phase::precharge, true) == ContactorOutputs{.main_negative = true, .precharge = true});
  CHECK(outputs(Phase::main_positive, true) ==
        ContactorOutputs{.main_positive = true, .main_negative = true, .precharge = true});
  for (const Phase phase : {Phase::closed, Phase::ramp_down}) {
    CHECK(outputs(phase) == mains);
    CHECK(outputs(phase, true) == all_three);
  }
  CHECK(outputs(no_phase, true) == ContactorOutputs{});
  CHECK(after(no_phase, ready(200ms)) == Phase::open);
}

TEST_CASE("while breaking one contactor is open and the others still closed", "[unit][contactors]") {
  const auto breaking = [](ContactorId first) {
    return outputs_for({.phase = Phase::breaking, .is_charge_closed = true, .breaks_first = first});
  };
  CHECK(breaking(ContactorId::main_positive) == ContactorOutputs{.main_negative = true});
  CHECK(breaking(ContactorId::precharge) == ContactorOutputs{.main_negative = true});
  CHECK(breaking(ContactorId::main_negative) == ContactorOutputs{.main_positive = true});
  CHECK(breaking(ContactorId::charge) == ContactorOutputs{.main_positive = true, .main_negative = true});
  CHECK(breaking(static_cast<ContactorId>(99)) == ContactorOutputs{});
}

TEST_CASE("an opening that nobody hurries waits for the current, and without one opens at once", "[unit][contactors]") {
  const auto opened = [](std::int32_t current_mA, bool is_known = true) {
    SequenceInputs in = ready(1h);
    in.close_wanted = false;
    in.current_mA = current_mA;
    in.is_current_known = is_known;
    return after(Phase::closed, in);
  };
  CHECK(opened(0) == Phase::open);
  CHECK(opened(1'000) == Phase::open);
  CHECK(opened(-1'000) == Phase::open);
  CHECK(opened(1'001) == Phase::ramp_down);
  CHECK(opened(-1'001) == Phase::ramp_down);
  CHECK(opened(50'000, false) == Phase::open);
}

TEST_CASE("with a plug that is pulled the current is broken in the same tick", "[unit][contactors][F100]") {
  for (const Phase phase : {Phase::closed, Phase::ramp_down}) {
    CAPTURE(to_text(phase));
    SequenceInputs in = ready(0ns);
    in.close_wanted = false;
    in.is_unplugged = true;
    in.charge_wanted = in.charge_permitted = true;
    const auto opened = [&](std::int32_t current_mA, bool is_charge_closed) {
      in.current_mA = current_mA;
      return step({.phase = phase, .entered_at = start, .is_charge_closed = is_charge_closed}, in, {});
    };
    CHECK(opened(-80'000, false).state.phase == Phase::breaking);
    CHECK(opened(-80'000, false).outputs == ContactorOutputs{.main_positive = true});
    CHECK(opened(-80'000, true).outputs == ContactorOutputs{.main_positive = true, .main_negative = true});
    CHECK(opened(80'000, true).outputs == ContactorOutputs{.main_negative = true});
    CHECK(opened(-1'000, true).outputs == ContactorOutputs{});
    in.is_current_known = false;
    CHECK(opened(-80'000, true).outputs == ContactorOutputs{});
    // A closed pack with a close request stays closed.
    in.is_current_known = true;
    in.close_wanted = true;
    if (phase == Phase::closed) CHECK(opened(-80'000, false).state.phase == Phase::closed);
  }
}

TEST_CASE("the current has 200 ms to end, then one contactor breaks it, and 40 ms later the others open",
          "[unit][contactors]") {
  SequenceInputs in = ready(200ms - 1ns);
  in.close_wanted = false;
  in.current_mA = 50'000;
  CHECK(after(Phase::ramp_down, in) == Phase::ramp_down);
  in.now = start + 200ms;
  CHECK(after(Phase::ramp_down, in) == Phase::breaking);
  in.close_wanted = true;  // too late: an opening that has begun continues
  CHECK(after(Phase::ramp_down, in) == Phase::breaking);
  in.current_mA = 1'000;
  CHECK(after(Phase::ramp_down, in) == Phase::open);
  in.current_mA = 50'000;
  in.is_current_known = false;
  CHECK(after(Phase::ramp_down, in) == Phase::open);
  CHECK(after(Phase::breaking, ready(40ms - 1ns)) == Phase::breaking);
  CHECK(after(Phase::breaking, ready(40ms)) == Phase::open);
}

TEST_CASE("the contactor built for the current's direction breaks it", "[unit][contactors]") {
  const auto breaker = [](std::int32_t current_mA, bool charge) {
    SequenceInputs in = ready(200ms);
    in.close_wanted = false;
    in.charge_permitted = true;
    in.current_mA = current_mA;
    const SequenceStep result =
        step({.phase = Phase::ramp_down, .entered_at = start, .is_charge_closed = charge}, in, config);
    REQUIRE(result.state.phase == Phase::breaking);
    CHECK(result.state.entered_at == start + 200ms);
    CHECK_FALSE(result.state.is_charge_closed);
    return result.state.breaks_first;
  };
  CHECK(breaker(50'000, false) == ContactorId::main_positive);
  CHECK(breaker(50'000, true) == ContactorId::main_positive);
  CHECK(breaker(-50'000, true) == ContactorId::charge);
  CHECK(breaker(-50'000, false) == ContactorId::main_negative);
  CHECK(breaker_of({.is_charge_closed = true}, 0) == ContactorId::main_positive);
  CHECK(breaker_of({.is_charge_closed = true}, -1) == ContactorId::charge);
}

TEST_CASE("the charge contactor closes behind a settled pack, for a charger that is there and may charge",
          "[unit][contactors]") {
  struct Bench {
    SequenceInputs in = ready(100ms);
    SequenceState state{.phase = Phase::closed, .entered_at = start};
    ContactorConfig contactors = config;

    [[nodiscard]] bool closes() const { return step(state, in, contactors).outputs.charge; }
  };
  Bench good;
  good.in.charge_wanted = good.in.charge_permitted = true;
  CHECK(good.closes());
  const std::array<void (*)(Bench&), 6> spoilers{[](Bench& it) { it.in.charge_wanted = false; },
                                                 [](Bench& it) { it.in.charge_permitted = false; },
                                                 [](Bench& it) { it.in.now = start + 100ms - 1ns; },
                                                 [](Bench& it) { it.in.may_advance = false; },
                                                 [](Bench& it) { it.in.contacts_settled = false; },
                                                 [](Bench& it) { it.contactors.has_charge_contactor = false; }};
  for (std::size_t index = 0; index < spoilers.size(); ++index) {
    Bench spoiled = good;
    spoilers[index](spoiled);
    CHECK_FALSE(spoiled.closes());
    // A closed charge contactor stays closed unless the charge request or the permission is gone, or there is no such
    // contactor.
    spoiled.state.is_charge_closed = true;
    CHECK(spoiled.closes() == (index >= 2 && index <= 4));
  }
  Bench arriving = good;
  arriving.state.phase = Phase::main_positive;
  arriving.in.now = start + 1s;
  REQUIRE(step(arriving.state, arriving.in, config).state.phase == Phase::closed);
  CHECK_FALSE(arriving.closes());  // the main contactors have to settle first
}

TEST_CASE("while the current ramps down the charge contactor stays as it is, as long as charging is allowed",
          "[unit][contactors]") {
  for (const bool was_closed : {false, true}) {
    SequenceInputs in = ready(10ms);
    in.close_wanted = false;
    in.current_mA = -50'000;
    in.charge_permitted = true;
    const SequenceState state{.phase = Phase::ramp_down, .entered_at = start, .is_charge_closed = was_closed};
    CHECK(step(state, in, config).outputs.charge == was_closed);
    in.charge_permitted = false;
    CHECK_FALSE(step(state, in, config).outputs.charge);
  }
}

TEST_CASE("a link that follows before the resistor can have charged it fails the precharge", "[unit][contactors]") {
  ContactorConfig with_min = config;
  with_min.precharge_min = 400ms;
  const auto failure = [&with_min](Duration measured, std::int32_t link_mV, std::int32_t link_at_start_mV = 0) {
    const SequenceState state{.phase = Phase::precharge, .entered_at = start, .link_at_start_mV = link_at_start_mV};
    SequenceInputs in = ready(1s);
    in.contacts_settled = false;
    in.link_mV = link_mV;
    in.link_at = in.pack_at = start + measured;
    const SequenceStep result = step(state, in, with_min);
    CHECK((result.state.phase == Phase::open) == (result.precharge_failure != PrechargeFailure::none));
    return result.precharge_failure;
  };
  CHECK(failure(400ms - 1ns, 95'000) == PrechargeFailure::too_fast);
  CHECK(failure(400ms, 95'000) == PrechargeFailure::none);
  CHECK(failure(1ns, 95'000) == PrechargeFailure::too_fast);
  CHECK(failure(0ns, 95'000) == PrechargeFailure::none);  // sampled before this precharge
  CHECK(failure(200ms, 94'999) == PrechargeFailure::none);
  // Half of the voltage was present at the start, so half of the time is enough.
  CHECK(failure(200ms - 1ns, 95'000, 47'500) == PrechargeFailure::too_fast);
  CHECK(failure(200ms, 95'000, 47'500) == PrechargeFailure::none);
  CHECK(failure(1ns, 95'000, 95'000) == PrechargeFailure::none);
  CHECK(failure(1ns, 95'000, 99'000) == PrechargeFailure::none);
  CHECK(failure(400ms - 1ns, 95'000, -10'000) == PrechargeFailure::too_fast);  // never more than the full time
  CHECK(failure(400ms, 95'000, -10'000) == PrechargeFailure::none);
  const SequenceState begun{.phase = Phase::precharge, .entered_at = start};
  SequenceInputs early = ready(1ms);
  CHECK(is_too_fast(begun, early, with_min));
  early.is_measured = false;
  CHECK_FALSE(is_too_fast(begun, early, with_min));
  for (TimePoint SequenceInputs::*const sample : {&SequenceInputs::link_at, &SequenceInputs::pack_at}) {
    early = ready(1ms);
    early.*sample = start;
    CHECK_FALSE(is_too_fast(begun, early, with_min));
    early.*sample = start + 1ns;
    CHECK(is_too_fast(begun, early, with_min));
  }
  // A pack voltage of this precharge that is not from the instant of the DC link sample may have changed since, unless
  // it was constant.
  early = ready(50ms);
  for (const std::int32_t before_mV : {0, 80'000, 100'000}) {
    early.pack_before_mV = before_mV;
    early.pack_at = early.link_at - same_instant_max;
    CHECK(is_too_fast(begun, early, with_min));
    early.pack_at -= 1ns;
    CHECK(is_too_fast(begun, early, with_min) == (before_mV == 100'000));
    early.pack_at = early.link_at + 20ms;
    CHECK(is_too_fast(begun, early, with_min));
  }
  CHECK(precharge_min({}, 0, with_min) == 0ms);
  CHECK(precharge_min({.link_at_start_mV = -10'000}, 0, with_min) == 0ms);
  CHECK(precharge_min({}, 1, with_min) == 400ms);
  CHECK(precharge_min({.link_at_start_mV = 99'000}, 100'000, with_min) == 0ms);
  CHECK(precharge_min({.link_at_start_mV = 94'999}, 100'000, with_min) == 4'210ns);  // a millivolt of 95 V
}

TEST_CASE("the link at the start of a precharge is the measured one", "[unit][contactors]") {
  SequenceInputs in = ready(200ms);
  in.link_mV = 12'345;
  const SequenceState state{.phase = Phase::main_negative, .entered_at = start, .link_at_start_mV = 7};
  CHECK(step(state, in, config).state.link_at_start_mV == 12'345);
}

TEST_CASE("a second sample beyond the precharge current is a short, one alone is not", "[unit][contactors]") {
  ContactorConfig watched = config;
  watched.precharge_overcurrent_mA = 10'000;
  SequenceState state{.phase = Phase::precharge, .entered_at = start};
  const auto show = [&](Duration at, std::int32_t current_mA, bool is_known = true) {
    SequenceInputs in = ready(at);
    in.link_mV = 50'000;
    in.current_mA = current_mA;
    in.is_current_known = is_known;
    const SequenceStep result = step(state, in, watched);
    state = result.state;
    return result.precharge_failure;
  };
  for (const std::int32_t sign : {1, -1}) {
    state = {.phase = Phase::precharge, .entered_at = start};
    CHECK(show(0ms, sign * 10'001) == PrechargeFailure::none);  // sampled before the phase began
    CHECK(state.suspected_at == TimePoint{});
    CHECK(show(10ms, sign * 10'000) == PrechargeFailure::none);
    CHECK(state.suspected_at == TimePoint{});
    CHECK(show(20ms, sign * 10'001, false) == PrechargeFailure::none);
    CHECK(state.suspected_at == TimePoint{});
    CHECK(show(30ms, sign * 10'001) == PrechargeFailure::none);
    CHECK(state.suspected_at == start + 30ms);
    CHECK(show(30ms, sign * 10'001) == PrechargeFailure::none);  // the same sample
    CHECK(show(40ms, sign * 10'000) == PrechargeFailure::none);
    CHECK(state.suspected_at == start + 30ms);
    CHECK(show(50ms, sign * 10'001) == PrechargeFailure::overcurrent);
    CHECK(state.phase == Phase::open);
    CHECK(state.suspected_at == TimePoint{});
  }
  watched.precharge_overcurrent_mA = 0;  // not monitored
  state = {.phase = Phase::precharge, .entered_at = start, .suspected_at = start + 1ms};
  CHECK(show(10ms, INT32_MIN) == PrechargeFailure::none);
  watched.precharge_overcurrent_mA = 1;  // monitored with a low threshold
  CHECK(show(20ms, 2) == PrechargeFailure::overcurrent);
}

TEST_CASE("a large current of a closed pack is no suspicion of a short", "[unit][contactors]") {
  ContactorConfig watched = config;
  watched.precharge_overcurrent_mA = 10'000;
  SequenceInputs in = ready(10ms);
  in.current_mA = 80'000;
  const SequenceStep result = step({.phase = Phase::closed, .entered_at = start}, in, watched);
  CHECK(result.state.phase == Phase::closed);
  CHECK(result.state.suspected_at == TimePoint{});
}

TEST_CASE("a precharge whose resistor is hot has been too slow", "[unit][contactors]") {
  SequenceInputs in = ready(10ms);
  in.link_mV = 0;
  in.resistor_is_hot = true;
  const SequenceStep result = step({Phase::precharge, start}, in, config);
  CHECK(result.state.phase == Phase::open);
  CHECK(result.precharge_failure == PrechargeFailure::too_slow);
}

TEST_CASE("contactors are those that switch the pack's current, and nothing else is one", "[unit][contactors]") {
  CHECK(ContactorOutputs{.main_positive = true}.any_contactor());
  CHECK(ContactorOutputs{.main_negative = true}.any_contactor());
  CHECK(ContactorOutputs{.precharge = true}.any_contactor());
  CHECK(ContactorOutputs{.charge = true}.any_contactor());
  CHECK_FALSE(ContactorOutputs{.auxiliary = true, .fan = true, .heater = true}.any_contactor());
}

TEST_CASE("what nobody filled in is open, not wanted and not permitted", "[unit][contactors]") {
  const ContactorOutputs outputs;
  for (const bool output : {outputs.main_positive, outputs.main_negative, outputs.precharge, outputs.charge,
                            outputs.auxiliary, outputs.fan, outputs.heater}) {
    CHECK_FALSE(output);
  }
  const SequenceInputs in;
  CHECK(in.cells_mV == 0);
  CHECK(in.pack_before_mV == 0);
  for (const bool input :
       {in.close_wanted, in.close_permitted, in.may_advance, in.contacts_settled, in.is_measured, in.is_unplugged,
        in.charge_wanted, in.charge_permitted, in.resistor_is_hot, in.is_current_known}) {
    CHECK_FALSE(input);
  }
  CHECK(in.pack_mV == 0);
  CHECK(in.link_mV == 0);
  CHECK(in.current_mA == 0);
  CHECK(SequenceState{}.phase == Phase::open);
  CHECK(SequenceStep{}.precharge_failure == PrechargeFailure::none);
  CHECK_FALSE(SequenceState{}.is_charge_closed);
  CHECK(SequenceState{}.link_at_start_mV == 0);
  CHECK_FALSE(SequenceState{}.must_be_discharged);
}

TEST_CASE("the phases have names of their own, and no other number has one", "[unit][contactors]") {
  std::set<std::string_view> names;
  for (const Phase phase : all_phases) names.insert(to_text(phase));
  CHECK(names == std::set<std::string_view>{"open", "main negative", "precharge", "main positive", "closed",
                                            "ramp down", "breaking"});
  CHECK(to_text(no_phase) == "?");
}
