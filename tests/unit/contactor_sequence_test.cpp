// The contactor sequence, one step at a time: what each condition alone holds up, and each time to the nanosecond.
#include "daemon/core/contactor_sequence.hpp"

#include <set>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};
constexpr ContactorConfig config{
    .settle = 100ms, .precharge_timeout = 3s, .precharge_done_permille = 950, .precharge_current_max_mA = 500};
constexpr Phase closing[] = {Phase::main_negative, Phase::precharge, Phase::main_positive};

/// Everything as it takes to go on, `since` after the phase began at `start`.
SequenceInputs ready(Duration since) {
  return {.now = start + since,
          .close_wanted = true,
          .close_permitted = true,
          .may_advance = true,
          .contacts_settled = true,
          .is_measured = true,
          .measured_at = start + since,
          .pack_mV = 100'000,
          .link_mV = 100'000};
}

Phase after(Phase phase, const SequenceInputs& in) {
  return step({phase, start}, in, config).state.phase;
}

constexpr auto no_phase = static_cast<Phase>(99);

}  // namespace

TEST_CASE("each condition alone holds up every step", "[unit][contactors][I4]") {
  for (const Phase phase : closing) {
    SequenceInputs in = ready(200ms);
    REQUIRE(after(phase, in) != phase);
    in.may_advance = false;
    CHECK(after(phase, in) == phase);
    in = ready(200ms);
    in.contacts_settled = false;
    CHECK(after(phase, in) == phase);
    CHECK(after(phase, ready(100ms - 1ns)) == phase);
    CHECK(after(phase, ready(100ms)) != phase);
  }
}

TEST_CASE("without the wish or the permission every phase ends at once, and that is no failed precharge",
          "[unit][contactors][I4]") {
  for (const Phase phase : all_phases) {
    for (const bool wanted : {false, true}) {
      SequenceInputs in = ready(200ms);
      in.close_wanted = wanted;
      in.close_permitted = !wanted;
      in.link_mV = 0;
      const SequenceStep result = step({phase, start}, in, config);
      CHECK(result.state.phase == Phase::open);
      CHECK(result.outputs == ContactorOutputs{});
      CHECK_FALSE(result.precharge_failed);
    }
  }
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
    CHECK(result.precharge_failed == (phase == Phase::precharge));
  }
  SequenceInputs before_precharge = ready(3s);
  before_precharge.contacts_settled = false;
  before_precharge.link_mV = 0;  // nobody has charged it yet
  const SequenceStep result = step({Phase::main_negative, start}, before_precharge, config);
  CHECK(result.state.phase == Phase::open);
  CHECK_FALSE(result.precharge_failed);
}

TEST_CASE("a closed pack stays closed, an open one begins with the negative contactor", "[unit][contactors]") {
  SequenceInputs in = ready(1h);
  in.link_mV = 0;
  in.may_advance = false;
  in.contacts_settled = false;
  const SequenceStep closed = step({Phase::closed, start}, in, config);
  CHECK(closed.state.phase == Phase::closed);
  CHECK(closed.state.entered_at == start);
  CHECK_FALSE(closed.precharge_failed);
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
  SequenceInputs in = ready(200ms);
  in.measured_at = start + 100ms - 1ns;
  CHECK(after(Phase::precharge, in) == Phase::precharge);
  in.measured_at = start + 100ms;
  CHECK(after(Phase::precharge, in) == Phase::main_positive);
}

TEST_CASE("a link that falls off on the way to the main contact is a failed precharge, an unknown one is not",
          "[unit][contactors][I4]") {
  SequenceInputs in = ready(10ms);
  in.link_mV = 94'999;
  const SequenceStep lost = step({Phase::main_positive, start}, in, config);
  CHECK(lost.state.phase == Phase::open);
  CHECK(lost.precharge_failed);
  in.link_mV = 95'000;
  const SequenceStep kept = step({Phase::main_positive, start}, in, config);
  CHECK(kept.state.phase == Phase::main_positive);
  CHECK_FALSE(kept.precharge_failed);
  in.link_mV = 0;
  in.is_measured = false;
  const SequenceStep unknown = step({Phase::main_positive, start}, in, config);
  CHECK(unknown.state.phase == Phase::main_positive);
  CHECK_FALSE(unknown.precharge_failed);
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
  CHECK(outputs_for(Phase::open) == ContactorOutputs{});
  CHECK(outputs_for(Phase::main_negative) == ContactorOutputs{.main_negative = true});
  CHECK(outputs_for(Phase::precharge) == ContactorOutputs{.main_negative = true, .precharge = true});
  CHECK(outputs_for(Phase::main_positive) ==
        ContactorOutputs{.main_positive = true, .main_negative = true, .precharge = true});
  CHECK(outputs_for(Phase::closed) == ContactorOutputs{.main_positive = true, .main_negative = true});
  CHECK(outputs_for(no_phase) == ContactorOutputs{});
  CHECK(after(no_phase, ready(200ms)) == Phase::open);
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
  for (const bool input : {in.close_wanted, in.close_permitted, in.may_advance, in.contacts_settled, in.is_measured}) {
    CHECK_FALSE(input);
  }
  CHECK(in.pack_mV == 0);
  CHECK(in.link_mV == 0);
  CHECK(in.current_mA == 0);
  CHECK(SequenceState{}.phase == Phase::open);
  CHECK_FALSE(SequenceStep{}.precharge_failed);
}

TEST_CASE("the phases have names of their own, and no other number has one", "[unit][contactors]") {
  std::set<std::string_view> names;
  for (const Phase phase : all_phases) names.insert(to_text(phase));
  CHECK(names == std::set<std::string_view>{"open", "main negative", "precharge", "main positive", "closed"});
  CHECK(to_text(no_phase) == "?");
}
