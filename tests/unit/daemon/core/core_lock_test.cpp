// Latched faults over the end of the daemon, on the bench: which ones persist, which data is kept, and how they are
// restored.
#include "daemon/core/core.hpp"
#include "daemon/shell/status/advice.hpp"
#include "daemon/shell/status/why_json.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

const FaultRecord& record_of(const CoreBench& bench, FaultId id) {
  return bench.core().persistent().faults[static_cast<std::size_t>(id)];
}

const FaultState& state_of(const CoreBench& bench, FaultId id) {
  return bench.core().faults().state(id);
}

bool has_any_lock(const CoreBench& bench) {
  const FaultRecords& faults = bench.core().persistent().faults;
  return std::any_of(faults.begin(), faults.end(), [](const FaultRecord& record) { return record.is_locked; });
}

/// Persistent state with a latched overvoltage, with its freeze frame or without.
PersistentState remembered(bool has_frame) {
  PersistentState state;
  FaultRecord& record = state.faults[static_cast<std::size_t>(FaultId::cell_overvoltage)];
  record = {.count = 1, .is_locked = true};
  if (has_frame) {
    record.frame = FreezeFrame{
        .value = 4'321'000, .threshold = 4'200'000, .element = {.module_node = 2, .number = 3, .pack_number = 7}};
  }
  return state;
}

std::string why_text(const CoreBench& bench) {
  return why_json({.core = bench.core(), .now = bench.now()}).dump();
}

}  // namespace

TEST_CASE("an emergency stop holds over a restart, refuses to close, and is cleared like any other",
          "[unit][core][RL]") {
  CoreBench first(small_pack());
  REQUIRE(first.close());
  first.inputs.estop_1_released = false;
  first.run(100ms);
  REQUIRE(record_of(first, FaultId::emergency_stop).is_locked);

  CoreBench next(small_pack());
  next.restore(first.core().persistent());
  next.run(3s);
  CHECK(state_of(next, FaultId::emergency_stop).stage == FaultStage::latched);
  CHECK_FALSE(next.close());
  CHECK(next.has_event(EventId::close_refused));
  next.give(Command::clear_faults);
  next.run(20ms);
  CHECK(state_of(next, FaultId::emergency_stop).stage == FaultStage::good);
  CHECK_FALSE(record_of(next, FaultId::emergency_stop).is_locked);
  next.inputs.vehicle_on = false;
  next.run(1s);
  CHECK(next.close());
}

TEST_CASE("a module that is lost from a closed pack is a lock, from an open one or while ending it is none",
          "[unit][core][RL]") {
  CoreBench bench(small_pack());
  bool is_lock = false;
  SECTION("closed") {
    REQUIRE(bench.close());
    is_lock = true;
  }
  SECTION("open") {
    bench.run(3s);
  }
  SECTION("closed, and told to end") {
    REQUIRE(bench.close());
    bench.current_mA = 20'000;
    bench.run(300ms);
    bench.modules[1].talks = false;
    bench.run(200ms);
    bench.give(Command::shut_down);
  }
  bench.modules[1].talks = false;
  bench.run(1s);
  REQUIRE(record_of(bench, FaultId::module_lost).count == 1);
  CHECK(record_of(bench, FaultId::module_lost).is_locked == is_lock);
}

TEST_CASE("an end by command, modules that fall silent after it or before, and a start without them leave no lock",
          "[unit][core][RL]") {
  CoreBench first(small_pack());
  REQUIRE(first.close());
  first.inputs.vehicle_on = false;
  first.run(2s);
  first.give(Command::shut_down);
  for (auto& module : first.modules) module.talks = false;
  first.sensor_talks = first.voltage_talks = first.pdu_talks = false;
  first.run(2s);
  CHECK(record_of(first, FaultId::module_lost).count == 1);
  CHECK_FALSE(has_any_lock(first));

  CoreBench next(small_pack());
  next.restore(first.core().persistent());
  for (auto& module : next.modules) module.talks = false;
  next.sensor_talks = next.voltage_talks = next.pdu_talks = false;
  next.run(5s);
  CHECK(record_of(next, FaultId::module_lost).count == 2);
  CHECK(record_of(next, FaultId::pdu_lost).count == 2);
  CHECK_FALSE(has_any_lock(next));

  CoreBench last(small_pack());
  last.restore(next.core().persistent());
  CHECK(last.close());
}

TEST_CASE("a silence of an open pack does not take away the lock that a closed one left", "[unit][core][RL]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[1].talks = false;
  bench.run(1s);
  bench.modules[1].talks = true;
  bench.run(3s);
  REQUIRE(state_of(bench, FaultId::module_lost).stage == FaultStage::latched);
  bench.modules[1].talks = false;
  bench.run(1s);
  CHECK(record_of(bench, FaultId::module_lost).count == 2);
  CHECK(record_of(bench, FaultId::module_lost).is_locked);
}

TEST_CASE("a row that no longer latches has no lock, whatever the state says", "[unit][core]") {
  PersistentState state;
  state.faults[static_cast<std::size_t>(FaultId::internal_bus_down)].is_locked = true;
  CoreBench bench(small_pack());
  bench.restore(state);
  CHECK_FALSE(state_of(bench, FaultId::internal_bus_down).is_present());
}

TEST_CASE("of a lock of a former life it is told what was seen, or that it is not known", "[unit][core][why]") {
  const bool has_frame = GENERATE(true, false);
  Core core(small_pack(), TimePoint{1s});
  core.restore(remembered(has_frame));
  static_cast<void>(core.decide(TimePoint{1s}));  // no module has answered yet
  const std::string early = why_json({.core = core, .now = TimePoint{1s}}).dump();
  INFO(early);
  const std::string seen = has_frame ? "cell 2.3 (no. 7): 4.3210 V" : "value unknown";
  CHECK(early.find("(" + seen + ", from an earlier session), state of the cause unknown") != std::string::npos);
  CHECK(early.find("0.0000 V") == std::string::npos);
  CoreBench bench(small_pack());
  bench.restore(remembered(has_frame));
  bench.run(3s);
  CHECK(why_text(bench).find(", cause gone, waiting for `bmuctl clear`") != std::string::npos);
}

TEST_CASE("a cause that is there again after a restart takes its confirm time and is counted", "[unit][core][RL]") {
  CoreBench bench(small_pack());
  bench.restore(remembered(true));
  bench.run(3s);
  CHECK(state_of(bench, FaultId::cell_overvoltage).stage == FaultStage::latched);
  const TimePoint back_at = bench.now();
  bench.modules[1].cell_voltage_uV[2] = known(4'500'000);
  REQUIRE(bench.run_until([&] { return state_of(bench, FaultId::cell_overvoltage).is_doubtful(); }, 300ms));
  CHECK(state_of(bench, FaultId::cell_overvoltage).stage == FaultStage::latched);
  CHECK(record_of(bench, FaultId::cell_overvoltage).count == 1);
  CHECK(why_text(bench).find("cause recurring") != std::string::npos);
  REQUIRE(
      bench.run_until([&] { return state_of(bench, FaultId::cell_overvoltage).stage == FaultStage::active; }, 450ms));
  CHECK(bench.now() - back_at >= small_pack().limits.cell_overvoltage.confirm);
  CHECK(record_of(bench, FaultId::cell_overvoltage).count == 2);
  CHECK(record_of(bench, FaultId::cell_overvoltage).is_locked);
  CHECK(record_of(bench, FaultId::cell_overvoltage).frame->value == 4'500'000);
  CHECK_FALSE(state_of(bench, FaultId::cell_overvoltage).is_restored);
  CHECK_FALSE(bench.close());
}

TEST_CASE("an opening for a lock of a former life says so, with no times it cannot know",
          "[unit][core][why][BMS_F.10]") {
  PersistentState state;
  const bool has_frame = GENERATE(true, false);
  FaultRecord& record = state.faults[static_cast<std::size_t>(FaultId::cell_undervoltage)];
  record = {.count = 1, .is_locked = true};
  if (has_frame) record.frame = FreezeFrame{.value = 2'700'000, .threshold = 2'900'000, .element = {.module_node = 1}};
  CoreBench bench(small_pack());
  bench.restore(state);
  bench.run(1s);
  bench.inputs.charger_connected = true;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
  bench.inputs.vehicle_on = true;
  bench.run(200ms);
  REQUIRE(bench.core().sequence().phase == Phase::closed);
  bench.inputs.charger_connected = false;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::open; }, 1s));
  const OpeningRecord& opening = bench.core().last_opening();
  CHECK(opening.cause == OpeningCause::fault);
  CHECK(opening.fault == FaultId::cell_undervoltage);
  CHECK(opening.is_restored);
  const Json why = opening_json({.core = bench.core(), .now = bench.now()});
  INFO(why.dump(2));
  const std::string seen = has_frame ? "module 1: 2.7000 V" : "value unknown";
  CHECK(why.at("reason") == "cell voltage too low: " + seen + ", confirmed in an earlier session, not cleared since");
  REQUIRE(why.at("steps").size() == 3);
  const Json& signal = why.at("steps").at(0);
  CHECK(signal.at("text") == "cell voltage too low: " + seen + ", confirmed in an earlier session");
  CHECK(signal.at("value_uV") == (has_frame ? Json(2'700'000) : Json(nullptr)));
  CHECK(signal.at("taken_ago_ms").is_null());
  CHECK(signal.at("taken_before_opening_ms").is_null());
  CHECK(why.at("steps").at(1).at("confirmed_before_opening_ms").is_null());
}

TEST_CASE("why says what may be done about each fault against closing, else about the foremost reason",
          "[unit][core][why]") {
  CoreBench bench(small_pack());
  bench.run(3s);
  CHECK(why_json({.core = bench.core(), .now = bench.now()})["to_do"].empty());
  bench.inputs.estop_1_released = false;
  bench.run(100ms);
  const Json pressed = why_json({.core = bench.core(), .now = bench.now()});
  REQUIRE(pressed["to_do"].size() == 1);
  CHECK(pressed["to_do"][0]["about"] == "emergency_stop");
  CHECK(pressed["to_do"][0]["remedy"] == row_of(FaultId::emergency_stop).remedy);
  CHECK(pressed["text"].dump().find(
            "Action: find the reason, release the emergency stop, then clear (emergency_stop).") != std::string::npos);

  CoreBench young(small_pack());
  const auto& blockers = young.core().permission().blockers;
  REQUIRE(young.run_until([&] { return !blockers.empty() && *blockers.begin() != Blocker::fault; }, 3s));
  const Json early = why_json({.core = young.core(), .now = young.now()})["to_do"];
  REQUIRE(early.size() == 1);
  CHECK(early[0]["about"] == to_text(*blockers.begin()));
  CHECK(early[0]["remedy"] == advice_on(*blockers.begin()).remedy);
}
