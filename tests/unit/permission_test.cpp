// Whether contactors may close or stay closed: each reason by itself, and the edges of what opens early.
#include "daemon/core/permission.hpp"

#include <set>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};

/// Everything as a pack that may close has it.
struct Situation {
  PermissionInputs inputs{.now = start,
                          .internal_bus_up = true,
                          .pdu_fresh = true,
                          .inputs_healthy = true,
                          .modules_set_up = true,
                          .commands_are_on_bus = true,
                          .contacts_settled = true,
                          .complete_cycles = 3,
                          .locked_out_until = start};
  PackState pack{.cell_voltage_uV = {.min = 3'700'000, .max = 3'700'000, .count = 8, .expected = 8},
                 .cell_temperature_dC = {.min = 250, .max = 250, .count = 4, .expected = 4},
                 .pack_voltage_mV = {30'000, start, Validity::valid},
                 .link_voltage_mV = {30'000, start, Validity::valid},
                 .current_mA = {0, start, Validity::valid},
                 .modules_answering = 2,
                 .modules_expected = 2};
  FaultMemory faults;

  [[nodiscard]] Permission judge() const { return evaluate_permission(inputs, pack, faults); }
  [[nodiscard]] std::vector<Blocker> blockers() const {
    const Permission permission = judge();
    return {permission.blockers.begin(), permission.blockers.end()};
  }
};

/// Shows a memory these conditions, over so many ticks.
void show(FaultMemory& faults, const CoreFlags& flags, std::int32_t coldest_dC = 250, int ticks = 1,
          const ModuleTable* modules = nullptr) {
  static const CoreConfig config = test::small_pack();
  ModuleTable healthy;
  healthy.init(config);
  const SensorTable sensors;
  PackState pack;
  for (int tick = 0; tick < ticks; ++tick) {
    const TimePoint now = start - 1s + tick * 50ms;
    pack.cell_temperature_dC = {
        .min = coldest_dC, .max = 250, .min_taken_at = now, .max_taken_at = now, .count = 4, .expected = 4};
    (void)faults.update({.now = now,
                         .config = &config,
                         .pack = &pack,
                         .modules = modules != nullptr ? modules : &healthy,
                         .sensors = &sensors,
                         .flags = flags});
  }
}

constexpr CoreFlags calm{.internal_bus_up = true};

}  // namespace

TEST_CASE("with nothing against it a pack may close, close on and stay closed", "[unit][permission]") {
  const Permission permission = Situation{}.judge();
  CHECK(permission.may_close);
  CHECK(permission.may_advance);
  CHECK(permission.may_stay_closed);
  CHECK(permission.blockers.empty());
}

TEST_CASE("permission is not there before it was granted", "[unit][permission]") {
  const Permission permission;
  CHECK_FALSE(permission.may_close);
  CHECK_FALSE(permission.may_advance);
  CHECK_FALSE(permission.may_stay_closed);
  const Permission nothing_known = evaluate_permission({}, {}, {});
  CHECK_FALSE(nothing_known.may_close);
  CHECK_FALSE(nothing_known.may_advance);
  CHECK_FALSE(nothing_known.may_stay_closed);
  const std::vector<Blocker> wanted{Blocker::internal_bus_down,  Blocker::pdu_unknown,   Blocker::modules_incomplete,
                                    Blocker::sensors_incomplete, Blocker::not_qualified, Blocker::modules_not_set_up,
                                    Blocker::commands_not_on_bus};
  CHECK(std::vector<Blocker>(nothing_known.blockers.begin(), nothing_known.blockers.end()) == wanted);
  Situation only_heard;
  only_heard.inputs = {.now = start, .pdu_fresh = true};
  CHECK(only_heard.inputs.complete_cycles == 0);
  CHECK(only_heard.blockers() == std::vector{Blocker::internal_bus_down, Blocker::inputs_unhealthy,
                                             Blocker::not_qualified, Blocker::modules_not_set_up,
                                             Blocker::commands_not_on_bus, Blocker::contacts_unsettled});
}

TEST_CASE("each single reason keeps an open pack open and is named, and some open a closed one",
          "[unit][permission][F32]") {
  struct Case {
    Blocker blocker;
    bool opens;
    void (*spoil)(Situation& situation);
  };
  const std::vector<Case> cases{
      {Blocker::shutting_down, true, [](Situation& it) { it.inputs.is_shutting_down = true; }},
      {Blocker::fault, true, [](Situation& it) { show(it.faults, {}); }},
      {Blocker::internal_bus_down, true, [](Situation& it) { it.inputs.internal_bus_up = false; }},
      {Blocker::pdu_unknown, true, [](Situation& it) { it.inputs.pdu_fresh = false; }},
      {Blocker::inputs_unhealthy, false, [](Situation& it) { it.inputs.inputs_healthy = false; }},
      {Blocker::modules_incomplete, false, [](Situation& it) { it.pack.modules_answering = 1; }},
      {Blocker::modules_incomplete, false, [](Situation& it) { it.pack.cell_voltage_uV.count = 7; }},
      {Blocker::modules_incomplete, false, [](Situation& it) { it.pack.cell_temperature_dC.count = 3; }},
      {Blocker::sensors_incomplete, false, [](Situation& it) { it.pack.current_mA = {}; }},
      {Blocker::sensors_incomplete, false, [](Situation& it) { it.pack.pack_voltage_mV = {}; }},
      {Blocker::sensors_incomplete, false, [](Situation& it) { it.pack.link_voltage_mV = {}; }},
      {Blocker::not_qualified, false, [](Situation& it) { it.inputs.complete_cycles = 2; }},
      {Blocker::modules_not_set_up, false, [](Situation& it) { it.inputs.modules_set_up = false; }},
      {Blocker::suspicion, false,
       [](Situation& it) { show(it.faults, {.internal_bus_up = true, .contactors_disobey = true}); }},
      {Blocker::commands_not_on_bus, false, [](Situation& it) { it.inputs.commands_are_on_bus = false; }},
      {Blocker::contacts_unsettled, false, [](Situation& it) { it.inputs.contacts_settled = false; }},
      {Blocker::contactor_closed, false, [](Situation& it) { it.inputs.contactor_closed_though_open = true; }},
      {Blocker::locked_out, false, [](Situation& it) { it.inputs.locked_out_until = start + 1ns; }},
  };
  for (const Case& one : cases) {
    DYNAMIC_SECTION(to_text(one.blocker)) {
      Situation situation;
      one.spoil(situation);
      const Permission permission = situation.judge();
      CHECK(situation.blockers() == std::vector{one.blocker});
      CHECK_FALSE(permission.may_close);
      CHECK(permission.may_advance == (one.blocker == Blocker::not_qualified));
      CHECK(permission.may_stay_closed == !one.opens);
    }
  }
}

TEST_CASE("a closing under way goes on without new poll cycles, and stops for anything more", "[unit][permission]") {
  Situation situation;
  situation.inputs.complete_cycles = 0;
  CHECK(situation.judge().may_advance);
  situation.inputs.contacts_settled = false;
  CHECK_FALSE(situation.judge().may_advance);
}

TEST_CASE("what a silent unit last said is no reason of its own", "[unit][permission]") {
  Situation situation;
  situation.inputs.pdu_fresh = false;
  situation.inputs.inputs_healthy = false;
  situation.inputs.contacts_settled = false;
  CHECK(situation.blockers() == std::vector{Blocker::pdu_unknown});
}

TEST_CASE("three complete cycles qualify, and a wait is over at its end", "[unit][permission]") {
  Situation situation;
  situation.inputs.complete_cycles = 3;
  situation.inputs.locked_out_until = start;
  CHECK(situation.judge().may_close);
}

TEST_CASE("a fault that only warns forbids nothing, confirmed or suspected", "[unit][permission]") {
  Situation confirmed;
  show(confirmed.faults, {.internal_bus_up = true, .frames_lost_seen = true});
  REQUIRE(confirmed.faults.state(FaultId::frames_lost).is_present());
  CHECK(confirmed.judge().may_close);
  CHECK(confirmed.judge().may_stay_closed);

  ModuleTable modules;
  modules.init(test::small_pack());
  CanFrame status = make_frame(internal_bus::status, 1);
  write<internal_bus::status, "cell_count">(status, 4);
  write<internal_bus::status, "board_too_hot">(status, 1);
  modules.observe(internal_bus::status, 1, status, start - 1s);
  Situation suspected;
  show(suspected.faults, calm, 250, 1, &modules);
  REQUIRE(suspected.faults.state(FaultId::module_warning).stage == FaultStage::suspected);
  CHECK(suspected.judge().may_close);
}

TEST_CASE("a fault with a grace asks for zero current while it is present, others and suspicions do not",
          "[unit][permission]") {
  FaultMemory cold;
  CHECK_FALSE(demands_zero_current(cold));
  show(cold, calm, -200);
  REQUIRE(cold.state(FaultId::cell_undertemperature).stage == FaultStage::suspected);
  CHECK_FALSE(demands_zero_current(cold));
  show(cold, calm, -200, 4);
  REQUIRE(cold.state(FaultId::cell_undertemperature).is_present());
  CHECK(demands_zero_current(cold));
  FaultMemory down;
  show(down, {});
  REQUIRE(down.state(FaultId::internal_bus_down).is_present());
  CHECK_FALSE(demands_zero_current(down));
}

TEST_CASE("a present fault opens at once, after its grace, or not at all, as its row says", "[unit][permission]") {
  PackState pack;
  pack.current_mA = {5'000, start, Validity::valid};
  const FaultRow now_row{.reaction = Reaction::open_now, .grace = 250ms};  // means nothing there
  const FaultRow grace_row{.reaction = Reaction::open_after_grace, .grace = 250ms};
  const FaultRow warn_row{.reaction = Reaction::warn};
  for (const FaultStage stage : {FaultStage::active, FaultStage::latched}) {
    const FaultState present{.stage = stage, .confirmed_at = start};
    CHECK(demands_opening(now_row, present, pack, start));
    CHECK_FALSE(demands_opening(warn_row, present, pack, start + 1h));
    CHECK_FALSE(demands_opening(grace_row, present, pack, start + 250ms - 1ns));
    CHECK(demands_opening(grace_row, present, pack, start + 250ms));
  }
  for (const FaultStage stage : {FaultStage::good, FaultStage::suspected}) {
    for (const FaultRow& row : {now_row, grace_row, warn_row}) {
      CHECK_FALSE(demands_opening(row, {.stage = stage}, pack, start + 1h));
    }
  }
}

TEST_CASE("within the grace a current of up to 1 A, either way, or an unknown one opens", "[unit][permission]") {
  const FaultRow row{.reaction = Reaction::open_after_grace, .grace = 250ms};
  const FaultState present{.stage = FaultStage::active, .confirmed_at = start};
  const auto opens_at = [&](std::int32_t current_mA, Validity validity = Validity::valid) {
    PackState pack;
    pack.current_mA = {current_mA, start, validity};
    return demands_opening(row, present, pack, start);
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
