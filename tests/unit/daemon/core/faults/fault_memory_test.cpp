// Confirmation and healing of a fault: debounce time, samples, warnings and remembered data, to the nanosecond. The
// contract of every row of the table is tested in fault_contract_test.cpp.
#include "daemon/core/faults/fault_memory.hpp"

#include <set>
#include <vector>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

using Kind = FaultChange::Kind;

constexpr Element cell_1{.module_node = 1, .number = 1, .pack_number = 1};
constexpr Element cell_2{.module_node = 1, .number = 2, .pack_number = 2};
constexpr std::int32_t open_uV = 4'200'000;
constexpr std::int32_t warn_uV = 4'150'000;
constexpr std::int32_t good_uV = 3'700'000;
constexpr std::int32_t between_uV = 4'190'000;  // below the limit, but within the hysteresis of 20 mV

/// Fault memory that receives the highest cell. Confirms in 150 ms, clears in 1 s.
class CellBench {
 public:
  /// Advances the time, then tests a sample: its value, its cell, and its age.
  FaultChanges see(Duration later, std::int32_t max_uV, const Element& cell = cell_1, Duration age = {}) {
    now_ += later;
    return judge({.is_known = true, .value = max_uV, .element = cell, .taken_at = now_ - age});
  }
  /// Tests a reading with a value that is not known.
  FaultChanges see_unknown(Duration later, std::int32_t max_uV = 0) {
    now_ += later;
    return judge({.value = max_uV, .element = cell_1, .taken_at = now_});
  }
  FaultChanges see_partial(Duration later, std::int32_t max_uV) {
    now_ += later;
    return judge({.is_known = true, .value = max_uV, .element = cell_1, .taken_at = now_, .is_partial = true});
  }
  FaultChanges judge(const Reading& reading, FaultId id = FaultId::cell_overvoltage) {
    FaultChanges changes;
    memory_.judge(row_of(id), reading, limits_, now_, changes);
    return changes;
  }
  FaultChanges clear(Authority authority = Authority::service) { return memory_.clear_latched(authority); }
  void pass(Duration later) { now_ += later; }
  void confirm() {
    (void)see(10ms, open_uV);
    (void)see(150ms, open_uV);
  }
  void latch() {
    (void)see(10ms, good_uV);
    (void)see(1s, good_uV);
  }
  [[nodiscard]] FaultMemory& memory() { return memory_; }
  [[nodiscard]] const FaultState& state(FaultId id = FaultId::cell_overvoltage) const { return memory_.state(id); }
  [[nodiscard]] FaultStage stage() const { return state().stage; }
  [[nodiscard]] TimePoint now() const { return now_; }

 private:
  LimitsConfig limits_{.cell_undervoltage = {.warn = 3'100'000, .open = 2'900'000, .hysteresis = 50'000},
                       .cell_overvoltage = {.warn = warn_uV, .open = open_uV, .hysteresis = 20'000}};
  FaultMemory memory_;
  TimePoint now_{100s};
};

constexpr Reading bad{.is_known = true, .value = 1};
constexpr Reading good{.is_known = true, .value = 0};

std::vector<Kind> kinds_of(const FaultChanges& changes, FaultId id = FaultId::cell_overvoltage) {
  std::vector<Kind> kinds;
  for (const FaultChange& change : changes) {
    if (change.id == id) kinds.push_back(change.kind);
  }
  return kinds;
}

}  // namespace

TEST_CASE("the stages of a fault have names of their own, and no other number has one", "[unit][faults]") {
  std::set<std::string_view> names;
  for (const FaultStage stage : {FaultStage::good, FaultStage::suspected, FaultStage::active, FaultStage::latched}) {
    names.insert(to_text(stage));
  }
  CHECK(names == std::set<std::string_view>{"good", "suspected", "active", "latched"});
  CHECK(to_text(static_cast<FaultStage>(99)) == "?");
}

TEST_CASE("before anything was judged no fault is there, nor known not to be", "[unit][faults]") {
  const FaultMemory memory;
  for (const FaultState& state : memory.states()) {
    CHECK(state.stage == FaultStage::good);
    CHECK_FALSE(state.is_present());
    CHECK_FALSE(state.is_warning);
    CHECK(state.judged == Verdict::unknown);
    CHECK(state.count == 0);
    CHECK(state.samples == 0);
    CHECK(state.threshold == 0);
    CHECK_FALSE(state.is_restored);
    CHECK_FALSE(state.is_doubtful());
  }
}

TEST_CASE("the same sample seen again is no second one, the next one of that cell is", "[unit][faults][F2]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV);
  (void)bench.see(200ms, open_uV, cell_1, 200ms);
  CHECK(bench.stage() == FaultStage::suspected);
  CHECK(bench.state().samples == 1);
  (void)bench.see(0ms, open_uV, cell_1, 200ms - 1ns);
  CHECK(bench.stage() == FaultStage::active);
  CHECK(bench.state().samples == 2);
}

TEST_CASE("a sample that was taken before the first one is no second one", "[unit][faults][F2]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV);
  (void)bench.see(200ms, open_uV, cell_1, 201ms);
  (void)bench.see(0ms, open_uV, cell_2, 300ms);
  CHECK(bench.stage() == FaultStage::suspected);
}

TEST_CASE("another cell's sample counts if it comes 50 ms later, and not from the same poll", "[unit][faults][F2]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV, cell_1);
  (void)bench.see(150ms, open_uV, cell_2, 100ms + 1ns);
  CHECK(bench.stage() == FaultStage::suspected);
  (void)bench.see(0ms, open_uV, cell_2, 100ms);
  CHECK(bench.stage() == FaultStage::active);
}

TEST_CASE("a second sample is compared with the last one that counted", "[unit][faults][F2]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV, cell_1);
  (void)bench.see(60ms, open_uV, cell_2);
  CHECK(bench.state().samples == 2);
  (void)bench.see(40ms, open_uV, cell_1);
  CHECK(bench.state().samples == 2);
  (void)bench.see(10ms, open_uV, cell_1);
  CHECK(bench.state().samples == 3);
}

TEST_CASE("a good sample in between is not counted", "[unit][faults][F2]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV);
  (void)bench.see(100ms, good_uV);
  CHECK(bench.state().samples == 1);
}

TEST_CASE("evidence grows while the value is beyond, shrinks half as fast while it is not, and waits while unknown",
          "[unit][faults][F2][F9]") {
  for (const std::int32_t not_beyond_uV : {good_uV, between_uV}) {
    CellBench bench;
    (void)bench.see(0ms, open_uV);
    CHECK(bench.state().evidence == 0ms);
    (void)bench.see(100ms, not_beyond_uV);
    CHECK(bench.state().evidence == 100ms);
    (void)bench.see_unknown(60ms);
    CHECK(bench.state().evidence == 70ms);
    (void)bench.see(1h, open_uV);
    CHECK(bench.state().evidence == 70ms);
    (void)bench.see(80ms - 1ns, open_uV);
    CHECK(bench.stage() == FaultStage::suspected);
    (void)bench.see(1ns, open_uV);
    CHECK(bench.stage() == FaultStage::active);
  }
}

TEST_CASE("more evidence than confirms is not kept, so a lone bad sample is forgotten after twice the confirm time",
          "[unit][faults][F2]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV);
  (void)bench.see(1h, good_uV);
  CHECK(bench.state().evidence == 150ms);
  (void)bench.see(300ms - 2ns, good_uV);
  CHECK(bench.stage() == FaultStage::suspected);
  (void)bench.see(2ns, good_uV);
  CHECK(bench.stage() == FaultStage::good);
  CHECK(bench.state().evidence == 0ms);
}

TEST_CASE("an unknown value ends no suspicion, even one without evidence", "[unit][faults][F9]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV);
  (void)bench.see_unknown(0ms);
  CHECK(bench.stage() == FaultStage::suspected);
  (void)bench.see(0ms, good_uV);
  CHECK(bench.stage() == FaultStage::good);
}

TEST_CASE("a new suspicion starts without evidence and with its first sample", "[unit][faults]") {
  CellBench bench;
  bench.confirm();
  bench.latch();
  (void)bench.clear();
  REQUIRE(bench.stage() == FaultStage::good);
  (void)bench.see(10ms, open_uV);
  CHECK(bench.state().suspected_since == bench.now());
  CHECK(bench.state().evidence == 0ms);
  CHECK(bench.state().samples == 1);
  CHECK(bench.stage() == FaultStage::suspected);
}

TEST_CASE("what was seen when a fault was confirmed is kept, and the first time it was", "[unit][faults][I7]") {
  CellBench bench;
  (void)bench.see(0ms, open_uV);
  CHECK(bench.state().count == 0);
  CHECK(kinds_of(bench.see(150ms, open_uV + 7'000, cell_1)) == std::vector{Kind::confirmed});
  const TimePoint first_at = bench.now();
  CHECK(bench.state().first_at == first_at);
  CHECK(bench.state().last_at == first_at);
  CHECK(bench.state().confirmed_at == first_at);
  CHECK(bench.state().confirmed.value == open_uV + 7'000);
  CHECK(bench.state().confirmed.element == cell_1);
  CHECK(bench.state().threshold == open_uV);
  CHECK(bench.state().count == 1);
  CHECK(bench.see(10ms, open_uV + 9'000).empty());
  CHECK(bench.state().confirmed.value == open_uV + 7'000);
  CHECK(bench.state().latest.value == open_uV + 9'000);
  CHECK(bench.state().last_at == bench.now());
  const TimePoint last_at = bench.now();
  bench.latch();
  CHECK(bench.state().last_at == last_at);
  (void)bench.clear();
  bench.confirm();
  CHECK(bench.state().count == 2);
  CHECK(bench.state().first_at == first_at);
  CHECK(bench.state().last_at == bench.now());
  CHECK(bench.state().confirmed_at == bench.now());
}

TEST_CASE("a cause is gone after 1 s of good values without a break", "[unit][faults][I10]") {
  CellBench bench;
  bench.confirm();
  (void)bench.see(10ms, good_uV);
  CHECK(bench.state().good_since == bench.now());
  CHECK(bench.see(999ms, good_uV).empty());
  CHECK(bench.stage() == FaultStage::active);
  SECTION("a value within the hysteresis is a break") {
    (void)bench.see(1ms - 1ns, between_uV);
  }
  SECTION("an unknown value is a break") {
    (void)bench.see_unknown(1ms - 1ns);
  }
  SECTION("a value that does not speak for every cell is a break") {
    (void)bench.see_partial(1ms - 1ns, good_uV);
  }
  CHECK(bench.state().good_since == TimePoint{});
  (void)bench.see(10ms, good_uV);
  CHECK(bench.see(1s - 1ns, good_uV).empty());
  CHECK(bench.stage() == FaultStage::active);
  CHECK(kinds_of(bench.see(1ns, good_uV)) == std::vector{Kind::cause_gone});
  CHECK(bench.stage() == FaultStage::latched);
}

TEST_CASE("a latched fault whose cause is back is confirmed anew, as the first time, and counted",
          "[unit][faults][I10]") {
  CellBench bench;
  bench.confirm();
  bench.latch();
  REQUIRE(bench.stage() == FaultStage::latched);
  const FaultState before = bench.state();
  (void)bench.see_unknown(10ms);
  (void)bench.see(10ms, good_uV);
  CHECK_FALSE(bench.state().is_doubtful());
  CHECK(kinds_of(bench.see(10ms, open_uV)) == std::vector{Kind::warned});
  const TimePoint back_at = bench.now();
  CHECK(bench.stage() == FaultStage::latched);
  CHECK(bench.state().is_present());
  CHECK(bench.state().is_doubtful());
  CHECK(bench.state().returning_since == back_at);
  CHECK(bench.state().suspected_since == before.suspected_since);
  CHECK(bench.state().samples == 1);
  CHECK(bench.see(150ms - 1ns, open_uV, cell_2).empty());
  CHECK(bench.state().confirmed_at == before.confirmed_at);
  CHECK(bench.state().count == 1);
  CHECK(kinds_of(bench.see(1ns, open_uV, cell_2)) == std::vector{Kind::confirmed});
  CHECK(bench.stage() == FaultStage::active);
  CHECK_FALSE(bench.state().is_doubtful());
  CHECK(bench.state().suspected_since == back_at);
  CHECK(bench.state().confirmed_at == bench.now());
  CHECK(bench.state().confirmed.element == cell_2);
  CHECK(bench.state().last_at == bench.now());
  CHECK(bench.state().count == 2);
  CHECK(bench.state().first_at == before.first_at);
  (void)bench.see(10ms, good_uV);
  (void)bench.see(1s - 1ns, good_uV);  // the full time applies again
  CHECK(bench.stage() == FaultStage::active);
}

TEST_CASE("a latched fault that seems to be back is not cleared, one that only seemed so stays latched and can be",
          "[unit][faults][I10]") {
  CellBench bench;
  bench.confirm();
  bench.latch();
  (void)bench.see(10ms, open_uV);
  (void)bench.see(100ms, open_uV, cell_1, 100ms);  // the same sample for 100 ms
  CHECK(bench.clear().empty());
  (void)bench.see(10ms, good_uV);
  CHECK(bench.state().judged == Verdict::good);
  CHECK(bench.clear().empty());  // the debounce time must end first, at half its rate
  (void)bench.see(219ms, good_uV);
  CHECK(bench.state().is_doubtful());
  (void)bench.see(1ms, good_uV);
  CHECK_FALSE(bench.state().is_doubtful());
  CHECK(bench.stage() == FaultStage::latched);
  CHECK(bench.state().count == 1);
  CHECK(kinds_of(bench.clear()) == std::vector{Kind::cleared});
  CHECK(bench.stage() == FaultStage::good);
}

TEST_CASE("a latched fault within the hysteresis is neither back nor to be cleared", "[unit][faults][I10]") {
  CellBench bench;
  bench.confirm();
  bench.latch();
  CHECK(kinds_of(bench.see(10ms, between_uV)) == std::vector{Kind::warned});
  CHECK(bench.stage() == FaultStage::latched);
  CHECK_FALSE(bench.state().is_doubtful());
  CHECK(bench.clear().empty());
}

TEST_CASE("a lock of a former life has what was seen then, and loses it to what is confirmed now", "[unit][faults]") {
  CellBench bench;
  const Reading then{.is_known = true, .value = 4'321'000, .element = cell_2};
  bench.memory().restore_lock(FaultId::cell_overvoltage, then, open_uV, TimePoint{7s});
  CHECK(bench.state().is_restored);
  CHECK(bench.state().confirmed.is_known);
  CHECK(bench.state().confirmed.value == 4'321'000);
  CHECK(bench.state().confirmed.element == cell_2);
  CHECK(bench.state().threshold == open_uV);
  CHECK(bench.state().count == 0);
  bench.confirm();
  CHECK_FALSE(bench.state().is_restored);
  CHECK(bench.state().confirmed.value == open_uV);
  CHECK(bench.state().count == 1);
  CHECK(bench.state().first_at == bench.now());
}

TEST_CASE("a clear takes what is latched and known to be good, and nothing else", "[unit][faults][I10]") {
  CellBench bench;
  CHECK(bench.clear().empty());
  bench.confirm();
  (void)bench.see(10ms, good_uV);
  CHECK(bench.clear().empty());
  CHECK(bench.stage() == FaultStage::active);
  bench.latch();
  (void)bench.see_unknown(10ms);
  CHECK(bench.clear().empty());
  CHECK(bench.stage() == FaultStage::latched);
  (void)bench.see(10ms, good_uV);
  CHECK(kinds_of(bench.clear()) == std::vector{Kind::cleared});
  CHECK(bench.stage() == FaultStage::good);
  CHECK_FALSE(bench.state().is_present());
}

TEST_CASE("a row without confirm time is believed at once, and one that does not latch clears by itself",
          "[unit][faults]") {
  CellBench bench;
  const FaultId id = FaultId::internal_bus_down;
  CHECK(kinds_of(bench.judge(bad, id), id) == std::vector{Kind::confirmed});
  bench.pass(10ms);
  CHECK(bench.judge(good, id).empty());
  bench.pass(1s - 1ns);
  CHECK(bench.judge(good, id).empty());
  bench.pass(1ns);
  CHECK(kinds_of(bench.judge(good, id), id) == std::vector{Kind::cleared});
  CHECK(bench.state(id).stage == FaultStage::good);
  CHECK_FALSE(bench.state(id).is_warning);
}

TEST_CASE("a lock that takes authority is not cleared without", "[unit][faults][I10]") {
  for (const FaultRow& row : fault_table()) {
    if (row.latch == Latch::none) continue;
    FaultMemory memory;
    memory.restore_lock(row.id, {}, 0, TimePoint{7s});
    CHECK(memory.state(row.id).is_restored);
    CHECK_FALSE(memory.state(row.id).confirmed.is_known);
    CHECK(memory.state(row.id).stage == FaultStage::latched);
    CHECK(memory.state(row.id).confirmed_at == TimePoint{7s});
    CHECK(memory.state(row.id).last_at == TimePoint{7s});
    CHECK(memory.clear_latched(Authority::service).empty());  // its cause has not been tested yet
    FaultChanges changes;
    const LimitsConfig nothing_asked_for;
    Reading harmless{.is_known = true, .value = row.sense == Sense::at_or_above ? -1'000'000'000 : 1'000'000'000};
    if (row.has_limit()) {
      memory.judge(row, harmless, nothing_asked_for, TimePoint{8s}, changes);
    } else {
      memory.judge(row, good, nothing_asked_for, TimePoint{8s}, changes);
    }
    REQUIRE(memory.state(row.id).judged == Verdict::good);
    const bool anybody = row.latch == Latch::until_cleared;
    CHECK(memory.clear_latched(Authority::user).size() == (anybody ? 1 : 0));
    CHECK(memory.state(row.id).stage == (anybody ? FaultStage::good : FaultStage::latched));
    CHECK(memory.clear_latched(Authority::service).size() == (anybody ? 0 : 1));
    CHECK(memory.state(row.id).stage == FaultStage::good);
  }
}

TEST_CASE("a warning is told once, and once that it is over", "[unit][faults]") {
  CellBench bench;
  CHECK(bench.see(0ms, warn_uV - 1).empty());
  CHECK_FALSE(bench.state().warning.is_known);
  CHECK(kinds_of(bench.see(10ms, warn_uV)) == std::vector{Kind::warned});
  CHECK(bench.state().warning_since == bench.now());
  CHECK(bench.see(10ms, warn_uV + 1'000).empty());
  CHECK(bench.see(10ms, warn_uV - 1).empty());
  CHECK(bench.see_unknown(10ms).empty());
  CHECK(bench.state().is_warning);
  CHECK(kinds_of(bench.see(10ms, good_uV)) == std::vector{Kind::warning_over});
  CHECK(bench.see(10ms, good_uV).empty());
}

TEST_CASE("of a warning the worst value is kept, and of equal ones the first", "[unit][faults]") {
  CellBench bench;
  (void)bench.see(0ms, warn_uV + 1'000);
  const TimePoint first_at = bench.now();
  (void)bench.see(10ms, warn_uV + 1'000, cell_2);
  CHECK(bench.state().warning.taken_at == first_at);
  CHECK(bench.state().warning.element == cell_1);
  (void)bench.see(10ms, warn_uV);
  CHECK(bench.state().warning.value == warn_uV + 1'000);
  (void)bench.see_unknown(10ms, warn_uV + 9'000);
  CHECK(bench.state().warning.value == warn_uV + 1'000);
  (void)bench.see(10ms, warn_uV + 2'000, cell_2);
  CHECK(bench.state().warning.value == warn_uV + 2'000);
  CHECK(bench.state().warning.element == cell_2);
}

TEST_CASE("a warning that is confirmed takes the evidence of the fault, and ends with the first good sample",
          "[unit][faults][F14]") {
  constexpr FaultId id = FaultId::module_voltage_mismatch;  // warns from 100 mV, confirms in 500 ms, hysteresis 50 mV
  CellBench bench;
  const auto see = [&bench](Duration later, std::int64_t apart_mV) {
    bench.pass(later);
    return kinds_of(bench.judge({.is_known = true, .value = apart_mV, .taken_at = bench.now()}, id), id);
  };
  const auto see_unknown = [&bench](Duration later) {
    bench.pass(later);
    return kinds_of(bench.judge({}, id), id);
  };
  CHECK(see(0ms, 100).empty());
  CHECK(see(500ms - 1ns, 100).empty());
  CHECK(see(1ns, 150) == std::vector{Kind::warned});
  CHECK(bench.state(id).warning_since == bench.now());
  CHECK(bench.state(id).warning.value == 150);
  CHECK(see(10ms, 51).empty());
  CHECK(see(10ms, 50) == std::vector{Kind::warning_over});
  // The debounce time shrinks half as fast as it grows, and stays while nothing is known.
  CHECK(see(200ms, 100).empty());    // 395 ms are left
  CHECK(see(100ms, 50).empty());     // 495
  CHECK(see_unknown(10ms).empty());  // 490
  CHECK(see(10s, 100).empty());
  CHECK(see(10ms - 1ns, 100).empty());
  CHECK(see(1ns, 100) == std::vector{Kind::warned});
}

TEST_CASE("of a warning of a lower limit the lowest value is kept", "[unit][faults]") {
  CellBench bench;
  const auto see = [&bench](std::int32_t min_uV, const Element& cell) {
    (void)bench.judge({.is_known = true, .value = min_uV, .element = cell}, FaultId::cell_undervoltage);
    return bench.state(FaultId::cell_undervoltage).warning;
  };
  CHECK(see(3'100'000, cell_1).value == 3'100'000);
  CHECK(see(3'100'000, cell_2).element == cell_1);
  CHECK(see(3'099'999, cell_2).value == 3'099'999);
  CHECK(see(3'100'000, cell_1).value == 3'099'999);
}

TEST_CASE("a reading against a threshold: at it is beyond, behind the hysteresis is good", "[unit][faults]") {
  const auto upper = [](std::int64_t value) {
    return evaluate({.is_known = true, .value = value}, Sense::at_or_above, 100, 10);
  };
  CHECK(upper(101) == Verdict::beyond);
  CHECK(upper(100) == Verdict::beyond);
  CHECK(upper(99) == Verdict::between);
  CHECK(upper(91) == Verdict::between);
  CHECK(upper(90) == Verdict::good);
  const auto lower = [](std::int64_t value) {
    return evaluate({.is_known = true, .value = value}, Sense::at_or_below, 100, 10);
  };
  CHECK(lower(99) == Verdict::beyond);
  CHECK(lower(100) == Verdict::beyond);
  CHECK(lower(101) == Verdict::between);
  CHECK(lower(109) == Verdict::between);
  CHECK(lower(110) == Verdict::good);
  CHECK(evaluate({.value = 1'000}, Sense::at_or_above, 100, 10) == Verdict::unknown);
  CHECK(evaluate({.value = 1'000}, Sense::at_or_below, 100, 10) == Verdict::unknown);
}

TEST_CASE("a row has its thresholds from the configuration, or is true or not", "[unit][faults]") {
  LimitsConfig limits;
  limits.cell_overvoltage = {.warn = 1, .open = 2, .hysteresis = 3, .confirm = 4ms, .clear = 5ms};
  const Thresholds configured = thresholds_of({.limit = &LimitsConfig::cell_overvoltage}, limits);
  CHECK(configured.warn == 1);
  CHECK(configured.open == 2);
  CHECK(configured.hysteresis == 3);
  CHECK(configured.has_warning);
  CHECK(configured.warn_confirm == 0ms);
  CHECK(configured.confirm == 4ms);
  CHECK(configured.clear == 5ms);
  const Thresholds confirming =
      thresholds_of({.limit = &LimitsConfig::cell_overvoltage, .confirms_warning = true}, limits);
  CHECK(confirming.warn_confirm == 4ms);
  limits.confirm.open_wire = 14ms;
  const Thresholds timed = thresholds_of({.confirm_time = &ConfirmTimes::open_wire, .clear = 7ms}, limits);
  CHECK(timed.open == 1);
  CHECK_FALSE(timed.has_warning);
  CHECK(timed.confirm == 14ms);
  CHECK(timed.clear == 7ms);
  const Thresholds unfilled;
  CHECK(unfilled.warn == 0);
  CHECK(unfilled.open == 1);
  CHECK(unfilled.hysteresis == 0);
  CHECK_FALSE(unfilled.has_warning);
  const Thresholds simple = thresholds_of({.confirm = 6ms, .clear = 7ms}, limits);
  CHECK(simple.warn == 1);
  CHECK(simple.open == 1);
  CHECK(simple.hysteresis == 0);
  CHECK_FALSE(simple.has_warning);
  CHECK(simple.confirm == 6ms);
  CHECK(simple.clear == 7ms);
}
