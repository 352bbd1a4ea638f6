// Whether contactors may close or stay closed, and which current may flow: each reason by itself, each fault against
// each wish, and the edges of what opens early.
#include "daemon/core/permission.hpp"

#include <set>
#include <vector>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};
constexpr Wish nobody{};
constexpr Wish vehicle{.by_vehicle = true};
constexpr Wish charger{.by_charger = true};
constexpr Wish both{.by_vehicle = true, .by_charger = true};
/// A pack whose file says nothing about reactions.
const CoreConfig plain_pack;

/// Everything as a pack that may close has it.
struct Situation {
  PermissionInputs inputs{.now = start,
                          .may_command = true,
                          .internal_bus_up = true,
                          .pdu_fresh = true,
                          .inputs_healthy = true,
                          .insulation_known = true,
                          .modules_set_up = true,
                          .commands_are_on_bus = true,
                          .contacts_settled = true,
                          .precharge_is_cool = true,
                          .complete_cycles = 3,
                          .locked_out_until = start};
  PackState pack{.cell_voltage_uV = {.min = 3'700'000, .max = 3'700'000, .count = 8, .expected = 8},
                 .cell_temperature_dC = {.min = 250, .max = 250, .count = 4, .expected = 4},
                 .pack_voltage_mV = {30'000, start, Validity::valid},
                 .link_voltage_mV = {30'000, start, Validity::valid},
                 .current_mA = {50'000, start, Validity::valid},
                 .modules_answering = 2,
                 .modules_expected = 2};
  FaultMemory faults;
  CoreConfig config{};

  [[nodiscard]] Permission judge() const { return evaluate_permission(inputs, pack, faults, config); }
  [[nodiscard]] std::vector<Blocker> blockers() const {
    const Permission permission = judge();
    return {permission.blockers.begin(), permission.blockers.end()};
  }
};

/// One look at what this row watches, as bad as it can be, so long before the start.
void look(FaultMemory& faults, const FaultRow& row, Duration before) {
  const LimitsConfig limits;
  const std::int64_t worst = row.sense == Sense::at_or_above ? INT32_MAX : INT32_MIN;
  FaultChanges changes;
  faults.judge(row, {.is_known = true, .value = worst, .taken_at = start - before}, limits, start - before, changes);
}
/// Bad looks until it is believed, at the start.
void believe(FaultMemory& faults, const FaultRow& row) {
  look(faults, row, 20s);
  look(faults, row, 10s);
  look(faults, row, 0s);
  REQUIRE(faults.state(row.id).stage == FaultStage::active);
}
/// The same with two looks, so that one that takes two samples and 500 ms at most is believed at the start and not
/// before.
void believe_at_start(FaultMemory& faults, const FaultRow& row) {
  REQUIRE(row.samples == 2);
  look(faults, row, 500ms);
  look(faults, row, 0s);
  REQUIRE(faults.state(row.id).stage == FaultStage::active);
  REQUIRE(faults.state(row.id).confirmed_at == start);
}
/// Whether the row takes longer than one look.
bool can_be_suspected(const FaultRow& row) {
  FaultMemory faults;
  look(faults, row, 0s);
  return faults.state(row.id).stage == FaultStage::suspected;
}

/// The rule of BMS_F.10, written down once more.
bool forbids(Concerns concerns, const Wish& wish) {
  if (concerns == Concerns::all) return true;
  return concerns == Concerns::discharge ? !wish.by_charger : wish.by_charger && !wish.by_vehicle;
}

}  // namespace

TEST_CASE("with nothing against it a pack may close, close on, stay closed and be used", "[unit][permission]") {
  for (const Wish& wish : {nobody, vehicle, charger, both}) {
    Situation situation;
    situation.inputs.wish = wish;
    const Permission permission = situation.judge();
    CHECK(permission.may_close);
    CHECK(permission.may_advance);
    CHECK(permission.may_go_on);
    CHECK(permission.may_stay_closed);
    CHECK(permission.may_charge);
    CHECK(permission.may_discharge);
    CHECK(permission.blockers.empty());
  }
}

TEST_CASE("permission is not there before it was granted", "[unit][permission]") {
  for (const Permission& permission : {Permission{}, evaluate_permission({}, {}, {}, {})}) {
    CHECK_FALSE(permission.may_close);
    CHECK_FALSE(permission.may_advance);
    CHECK_FALSE(permission.may_go_on);
    CHECK_FALSE(permission.may_stay_closed);
    CHECK_FALSE(permission.may_charge);
    CHECK_FALSE(permission.may_discharge);
  }
  const Wish unfilled;
  CHECK_FALSE(unfilled.by_vehicle);
  CHECK_FALSE(unfilled.by_charger);
  Situation nothing_known;
  nothing_known.inputs = {};
  nothing_known.pack = {};
  CHECK(nothing_known.inputs.complete_cycles == 0);
  CHECK(nothing_known.blockers() == std::vector{Blocker::no_claim, Blocker::internal_bus_down, Blocker::pdu_unknown,
                                                Blocker::modules_incomplete, Blocker::sensors_incomplete,
                                                Blocker::not_qualified, Blocker::modules_not_set_up,
                                                Blocker::commands_not_on_bus, Blocker::precharge_hot});
  Situation only_heard;
  only_heard.inputs = {.now = start, .pdu_fresh = true};
  CHECK(only_heard.blockers() == std::vector{Blocker::no_claim, Blocker::internal_bus_down, Blocker::inputs_unhealthy,
                                             Blocker::insulation_unknown, Blocker::not_qualified,
                                             Blocker::modules_not_set_up, Blocker::commands_not_on_bus,
                                             Blocker::contacts_unsettled, Blocker::precharge_hot});
}

TEST_CASE("each single reason keeps an open pack open and is named, and some open a closed one",
          "[unit][permission][F32]") {
  struct Case {
    Blocker blocker;
    bool opens;
    void (*spoil)(Situation& situation);
  };
  const std::vector<Case> cases{
      {Blocker::shutting_down, false, [](Situation& it) { it.inputs.is_shutting_down = true; }},
      {Blocker::resting, true, [](Situation& it) { it.inputs.is_resting = true; }},
      {Blocker::internal_bus_down, true, [](Situation& it) { it.inputs.internal_bus_up = false; }},
      {Blocker::pdu_unknown, true, [](Situation& it) { it.inputs.pdu_fresh = false; }},
      {Blocker::inputs_unhealthy, false, [](Situation& it) { it.inputs.inputs_healthy = false; }},
      {Blocker::insulation_unknown, false, [](Situation& it) { it.inputs.insulation_known = false; }},
      {Blocker::modules_incomplete, false, [](Situation& it) { it.pack.modules_answering = 1; }},
      {Blocker::modules_incomplete, false, [](Situation& it) { it.pack.cell_voltage_uV.count = 7; }},
      {Blocker::modules_incomplete, false, [](Situation& it) { it.pack.cell_temperature_dC.count = 3; }},
      {Blocker::sensors_incomplete, false, [](Situation& it) { it.pack.current_mA = {}; }},
      {Blocker::sensors_incomplete, false, [](Situation& it) { it.pack.pack_voltage_mV = {}; }},
      {Blocker::sensors_incomplete, false, [](Situation& it) { it.pack.link_voltage_mV = {}; }},
      {Blocker::not_qualified, false, [](Situation& it) { it.inputs.complete_cycles = 2; }},
      {Blocker::modules_not_set_up, false, [](Situation& it) { it.inputs.modules_set_up = false; }},
      {Blocker::commands_not_on_bus, false, [](Situation& it) { it.inputs.commands_are_on_bus = false; }},
      {Blocker::contacts_unsettled, false, [](Situation& it) { it.inputs.contacts_settled = false; }},
      {Blocker::contactor_closed, false, [](Situation& it) { it.inputs.contactor_closed_though_open = true; }},
      {Blocker::link_follows, false, [](Situation& it) { it.inputs.link_follows_though_open = true; }},
      {Blocker::precharge_hot, false, [](Situation& it) { it.inputs.precharge_is_cool = false; }},
      {Blocker::locked_out, false, [](Situation& it) { it.inputs.locked_out_until = start + 1ns; }},
      {Blocker::no_claim, true, [](Situation& it) { it.inputs.may_command = false; }},
  };
  for (const Case& one : cases) {
    DYNAMIC_SECTION(to_text(one.blocker)) {
      Situation situation;
      one.spoil(situation);
      const Permission permission = situation.judge();
      CHECK(situation.blockers() == std::vector{one.blocker});
      CHECK_FALSE(permission.may_close);
      const bool may_advance = one.blocker == Blocker::not_qualified || one.blocker == Blocker::precharge_hot;
      CHECK(permission.may_advance == may_advance);
      CHECK(permission.may_go_on == (!one.opens && one.blocker != Blocker::modules_not_set_up));
      CHECK(permission.may_stay_closed == !one.opens);
      CHECK(permission.may_charge == !one.opens);
      CHECK(permission.may_discharge == !one.opens);
    }
  }
}

TEST_CASE("a closing under way goes on without new poll cycles and with a warm resistor, and stops for anything more",
          "[unit][permission]") {
  Situation situation;
  situation.inputs.complete_cycles = 0;
  situation.inputs.precharge_is_cool = false;
  CHECK(situation.judge().may_advance);
  situation.inputs.contacts_settled = false;
  CHECK_FALSE(situation.judge().may_advance);
}

TEST_CASE("what a silent unit last said is no reason of its own", "[unit][permission]") {
  Situation situation;
  situation.inputs.pdu_fresh = false;
  situation.inputs.inputs_healthy = false;
  situation.inputs.insulation_known = false;
  situation.inputs.contacts_settled = false;
  CHECK(situation.blockers() == std::vector{Blocker::pdu_unknown});
}

TEST_CASE("every fault: what it forbids follows from its reaction, what it concerns, and who asks",
          "[unit][permission][contract][BMS_F.10]") {
  for (const FaultRow& row : fault_table()) {
    for (const Wish& wish : {nobody, vehicle, charger, both}) {
      INFO(row.name << ", vehicle " << wish.by_vehicle << ", charger " << wish.by_charger);
      Situation situation;
      situation.inputs.wish = wish;
      believe(situation.faults, row);
      situation.inputs.now = start + row.grace;  // over, whatever the current
      const bool is_named = row.reaction != Reaction::warn && forbids(row.concerns, wish);
      CHECK(situation.blockers() == (is_named ? std::vector{Blocker::fault} : std::vector<Blocker>{}));
      const bool is_bad = row.reaction == Reaction::open_now || row.reaction == Reaction::open_after_grace;
      const bool opens = is_bad && forbids(row.concerns, wish);
      const Permission permission = situation.judge();
      CHECK(permission.may_go_on == !is_named);
      CHECK(permission.may_stay_closed == !opens);
      CHECK(permission.may_charge == !(opens || (is_bad && row.concerns != Concerns::discharge)));
      CHECK(permission.may_discharge == !(opens || (is_bad && row.concerns != Concerns::charge)));
    }
  }
}

TEST_CASE("every fault: a suspicion stops a closing whose wish it concerns, and opens nothing",
          "[unit][permission][contract]") {
  for (const FaultRow& row : fault_table()) {
    if (!can_be_suspected(row)) continue;
    for (const Wish& wish : {nobody, vehicle, charger, both}) {
      INFO(row.name << ", vehicle " << wish.by_vehicle << ", charger " << wish.by_charger);
      Situation situation;
      situation.inputs.wish = wish;
      look(situation.faults, row, 0s);
      const bool is_named = row.reaction != Reaction::warn && forbids(row.concerns, wish);
      CHECK(situation.blockers() == (is_named ? std::vector{Blocker::suspicion} : std::vector<Blocker>{}));
      CHECK(situation.judge().may_go_on);
      CHECK(situation.judge().may_stay_closed);
      CHECK(situation.judge().may_charge);
      CHECK(situation.judge().may_discharge);
    }
  }
}

TEST_CASE("every fault: asks for zero current while it is present and has a grace, of the current it concerns",
          "[unit][permission][contract]") {
  for (const FaultRow& row : fault_table()) {
    INFO(row.name);
    FaultMemory faults;
    if (can_be_suspected(row)) look(faults, row, 30s);
    CHECK_FALSE(demands_zero_current(faults, Concerns::charge, plain_pack));
    CHECK_FALSE(demands_zero_current(faults, Concerns::discharge, plain_pack));
    believe(faults, row);
    const bool has_grace = row.reaction == Reaction::open_after_grace;
    CHECK(demands_zero_current(faults, Concerns::charge, plain_pack) ==
          (has_grace && row.concerns != Concerns::discharge));
    CHECK(demands_zero_current(faults, Concerns::discharge, plain_pack) ==
          (has_grace && row.concerns != Concerns::charge));
  }
}

TEST_CASE("every fault: forbids one direction of current while it is present and concerns that one alone",
          "[unit][permission][contract][BMS_F.10]") {
  for (const FaultRow& row : fault_table()) {
    INFO(row.name);
    FaultMemory faults;
    if (can_be_suspected(row)) look(faults, row, 30s);
    CHECK_FALSE(forbids(faults, Concerns::charge));
    CHECK_FALSE(forbids(faults, Concerns::discharge));
    believe(faults, row);
    CHECK(forbids(faults, Concerns::charge) == (row.concerns == Concerns::charge));
    CHECK(forbids(faults, Concerns::discharge) == (row.concerns == Concerns::discharge));
  }
}

TEST_CASE("a fault that concerns discharging leaves the pack to a charger, one that concerns charging to the vehicle",
          "[unit][permission][BMS_F.10]") {
  for (const Wish& wish : {nobody, vehicle, charger, both}) {
    CHECK(speaks_against(Concerns::all, wish));
    CHECK(speaks_against(static_cast<Concerns>(99), wish));
  }
  CHECK(speaks_against(Concerns::discharge, nobody));
  CHECK(speaks_against(Concerns::discharge, vehicle));
  CHECK_FALSE(speaks_against(Concerns::discharge, charger));
  CHECK_FALSE(speaks_against(Concerns::discharge, both));
  CHECK_FALSE(speaks_against(Concerns::charge, nobody));
  CHECK_FALSE(speaks_against(Concerns::charge, vehicle));
  CHECK(speaks_against(Concerns::charge, charger));
  CHECK_FALSE(speaks_against(Concerns::charge, both));
}

TEST_CASE("what a plugged-in charger does by itself keeps everybody from closing, and a closed pack from nothing",
          "[unit][permission][F97]") {
  std::set<std::string_view> barring;
  for (const FaultRow& row : fault_table()) {
    if (!row.bars_while_plugged_in) continue;
    barring.insert(row.name);
    for (const Wish& wish : {nobody, vehicle, both}) {
      INFO(row.name);
      Situation plugged;
      plugged.inputs.wish = wish;
      believe(plugged.faults, row);
      CHECK(plugged.judge().may_close);
      plugged.inputs.is_plugged_in = true;
      CHECK(plugged.blockers() == std::vector{Blocker::fault});
      CHECK_FALSE(plugged.judge().may_go_on);
      CHECK(plugged.judge().may_stay_closed);
    }
  }
  CHECK(barring == std::set<std::string_view>{"charger_runaway", "foreign_charger_master"});
}

TEST_CASE("other faults that concern charging leave the pack to the vehicle while a charger is plugged in",
          "[unit][permission][BMS_F.10]") {
  int count = 0;
  for (const FaultRow& row : fault_table()) {
    if (row.concerns != Concerns::charge || row.bars_while_plugged_in || row.reaction == Reaction::warn) continue;
    INFO(row.name);
    ++count;
    Situation plugged;
    plugged.inputs.wish = vehicle;
    plugged.inputs.is_plugged_in = true;
    believe(plugged.faults, row);
    CHECK(plugged.judge().may_close);
  }
  CHECK(count > 0);
}

TEST_CASE("a present fault opens at once, after its grace, or not at all, as its row says", "[unit][permission]") {
  PackState pack;
  pack.current_mA = {5'000, start, Validity::valid};
  const FaultRow now_row{.reaction = Reaction::open_now, .grace = 250ms};  // means nothing there
  const FaultRow grace_row{.reaction = Reaction::open_after_grace, .grace = 250ms};
  const FaultRow refuse_row{.reaction = Reaction::refuse_close};
  const FaultRow warn_row{.reaction = Reaction::warn};
  for (const FaultStage stage : {FaultStage::active, FaultStage::latched}) {
    const FaultState present{.stage = stage, .confirmed_at = start};
    CHECK(demands_opening(now_row, present, pack, start, plain_pack));
    CHECK_FALSE(demands_opening(warn_row, present, pack, start + 1h, plain_pack));
    CHECK_FALSE(demands_opening(refuse_row, present, pack, start + 1h, plain_pack));
    CHECK_FALSE(demands_opening(grace_row, present, pack, start + 250ms - 1ns, plain_pack));
    CHECK(demands_opening(grace_row, present, pack, start + 250ms, plain_pack));
  }
  for (const FaultStage stage : {FaultStage::good, FaultStage::suspected}) {
    for (const FaultRow& row : {now_row, grace_row, refuse_row, warn_row}) {
      CHECK_FALSE(demands_opening(row, {.stage = stage}, pack, start + 1h, plain_pack));
    }
  }
}

TEST_CASE("within the grace a current of up to 1 A, either way, or an unknown one opens", "[unit][permission]") {
  const FaultRow row{.reaction = Reaction::open_after_grace, .grace = 250ms};
  const FaultState present{.stage = FaultStage::active, .confirmed_at = start};
  const auto opens_at = [&](std::int32_t current_mA, Validity validity = Validity::valid) {
    PackState pack;
    pack.current_mA = {current_mA, start, validity};
    return demands_opening(row, present, pack, start, plain_pack);
  };
  CHECK(opens_at(0));
  CHECK(opens_at(1'000));
  CHECK_FALSE(opens_at(1'001));
  CHECK(opens_at(-1'000));
  CHECK_FALSE(opens_at(-1'001));
  CHECK(opens_at(50'000, Validity::unknown));
  CHECK(opens_at(-50'000, Validity::out_of_range));
}

TEST_CASE("every reason has a text of its own, and no other number has one", "[unit][permission]") {
  std::set<std::string_view> texts;
  for (std::size_t index = 0; index < blocker_count; ++index) texts.insert(to_text(static_cast<Blocker>(index)));
  CHECK(texts.size() == blocker_count);
  CHECK_FALSE(texts.contains("?"));
  CHECK(to_text(static_cast<Blocker>(blocker_count)) == "?");
}

TEST_CASE("a stricter reaction of the pack file is what the fault does, from none to opening at once",
          "[unit][permission][reactions]") {
  struct Case {
    Reaction reaction;
    bool keeps_open;
    bool opens_at_once;
    bool opens_after_grace;
  };
  for (const Case& one :
       {Case{Reaction::refuse_close, true, false, false}, Case{Reaction::open_after_grace, true, false, true},
        Case{Reaction::open_now, true, true, true}}) {
    CAPTURE(to_text(one.reaction));
    const FaultRow& row = row_of(FaultId::module_warning);
    REQUIRE(row.reaction == Reaction::warn);
    Situation situation;
    situation.inputs.wish = vehicle;
    believe_at_start(situation.faults, row);
    CHECK(situation.judge().may_close);
    CHECK_FALSE(opens_for(row, situation.faults.state(row.id), vehicle, {}));
    CHECK_FALSE(keeps_open_for(row, situation.faults.state(row.id), vehicle, false, {}));

    const Duration grace = one.reaction == Reaction::open_after_grace ? 40ms : Duration{};
    situation.config.stricter_reactions.push_back({.fault = row.id, .reaction = one.reaction, .grace = grace});
    CHECK(situation.blockers() == std::vector{Blocker::fault});
    CHECK_FALSE(situation.judge().may_go_on);
    CHECK(situation.judge().may_stay_closed == !one.opens_at_once);
    CHECK(situation.judge().may_discharge == !one.opens_at_once);
    CHECK(demands_zero_current(situation.faults, Concerns::discharge, situation.config) ==
          (one.reaction == Reaction::open_after_grace));
    const StricterReactions& stricter = situation.config.stricter_reactions;
    CHECK(opens_for(row, situation.faults.state(row.id), vehicle, stricter) == one.opens_after_grace);
    CHECK(keeps_open_for(row, situation.faults.state(row.id), vehicle, false, stricter) == one.keeps_open);
    situation.inputs.now = start + 40ms - 1ns;
    CHECK(situation.judge().may_stay_closed == !one.opens_at_once);
    situation.inputs.now = start + 40ms;
    CHECK(situation.judge().may_stay_closed == !one.opens_after_grace);
  }
}

TEST_CASE("a fault that only warns is no sign against closing while it is suspected, one that is stricter is",
          "[unit][permission][reactions]") {
  Situation situation;
  look(situation.faults, row_of(FaultId::module_warning), 0s);
  REQUIRE(situation.faults.state(FaultId::module_warning).stage == FaultStage::suspected);
  CHECK(situation.judge().may_close);
  situation.config.stricter_reactions.push_back({.fault = FaultId::module_warning, .reaction = Reaction::refuse_close});
  CHECK(situation.blockers() == std::vector{Blocker::suspicion});
}

TEST_CASE("every fault: one that a short causes waits for a current that the contactors cannot break, no other does",
          "[unit][permission][contract][F91][PB_F.1]") {
  const std::set<std::string_view> waiting{
      "cell_undervoltage",       "cell_overvoltage",      "cell_deep_discharge",         "discharge_overcurrent",
      "charge_overcurrent",      "discharge_not_allowed", "charge_not_allowed",          "pack_voltage_mismatch",
      "module_voltage_mismatch", "link_not_following",    "module_reports_undervoltage", "front_end_supply_low",
      "temperature_rise",        "cell_overtemperature"};
  for (const FaultRow& row : fault_table()) {
    INFO(row.name);
    const bool waits = waiting.count(row.name) == 1;
    CHECK(row.waits_above_rating == waits);
    if (row.reaction != Reaction::open_now) continue;
    for (const std::int32_t current_mA : {75'001, -75'001, 75'000, -75'000, INT32_MIN}) {
      CAPTURE(current_mA);
      Situation situation;
      situation.inputs.wish = row.concerns == Concerns::charge ? charger : vehicle;
      situation.pack.current_mA.value = current_mA;
      if (waits) {
        believe_at_start(situation.faults, row);
      } else {
        believe(situation.faults, row);
      }
      CHECK_FALSE(situation.judge().may_stay_closed);  // without a rating nothing waits
      CHECK_FALSE(demands_zero_current(situation.faults, Concerns::charge, situation.config));
      CHECK_FALSE(demands_zero_current(situation.faults, Concerns::discharge, situation.config));

      situation.config.contactors.break_current_max_mA = 75'000;
      const bool is_too_much = current_mA != 75'000 && current_mA != -75'000;
      CHECK(situation.judge().may_stay_closed == (waits && is_too_much));
      CHECK_FALSE(situation.judge().may_go_on);  // one that is only closing opens
      CHECK(demands_zero_current(situation.faults, Concerns::charge, situation.config) ==
            (waits && row.concerns != Concerns::discharge));
      CHECK(demands_zero_current(situation.faults, Concerns::discharge, situation.config) ==
            (waits && row.concerns != Concerns::charge));
      CoreConfig barely_rated = situation.config;
      barely_rated.contactors.break_current_max_mA = 1;
      CHECK(demands_zero_current(situation.faults, Concerns::charge, barely_rated) ==
            (waits && row.concerns != Concerns::discharge));
      situation.inputs.now = start + 250ms - 1ns;
      CHECK(situation.judge().may_stay_closed == (waits && is_too_much));
      situation.inputs.now = start + 250ms;
      CHECK_FALSE(situation.judge().may_stay_closed);

      situation.inputs.now = start;
      for (const Validity validity : {Validity::doubtful, Validity::unknown, Validity::out_of_range}) {
        situation.pack.current_mA.validity = validity;
        CHECK_FALSE(situation.judge().may_stay_closed);
      }
    }
  }
}

TEST_CASE("a fault that does not wait opens at once, whatever else waits beside it",
          "[unit][permission][F91][PB_F.1]") {
  Situation situation;
  situation.inputs.wish = vehicle;
  situation.pack.current_mA.value = 300'000;
  situation.config.contactors.break_current_max_mA = 75'000;
  believe_at_start(situation.faults, row_of(FaultId::discharge_overcurrent));
  CHECK(situation.judge().may_stay_closed);
  believe(situation.faults, row_of(FaultId::emergency_stop));
  CHECK_FALSE(situation.judge().may_stay_closed);
}

TEST_CASE("a stricter reaction is that of its own fault and of no other", "[unit][permission][reactions]") {
  StricterReactions stricter;
  stricter.push_back({.fault = FaultId::cell_imbalance, .reaction = Reaction::open_after_grace, .grace = 20ms});
  stricter.push_back({.fault = FaultId::memory_low, .reaction = Reaction::refuse_close});
  for (const FaultRow& row : fault_table()) {
    INFO(row.name);
    const FaultReaction does = reaction_of(row, stricter);
    const bool is_one = row.id == FaultId::cell_imbalance || row.id == FaultId::memory_low;
    CHECK(does.is_stricter == is_one);
    if (row.id == FaultId::memory_low) CHECK(does.reaction == Reaction::refuse_close);
    if (row.id == FaultId::cell_imbalance) CHECK(does.grace == 20ms);
    if (!is_one) CHECK(does.reaction == row.reaction);
    if (!is_one) CHECK(does.grace == row.grace);
    const bool takes_one_sample = row.id == FaultId::cell_resistance || row.id == FaultId::pack_resistance;
    CHECK((strictest_reaction(row) == Reaction::refuse_close) == takes_one_sample);
  }
}
