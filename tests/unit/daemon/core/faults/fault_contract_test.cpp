// Contract of every fault row, tested on every row: rows inherit these tests, a new one needs no tests of its own.
#include <algorithm>

#include "daemon/core/faults/fault_memory.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

/// Fault memory fed with constructed readings of one row.
class RowBench {
 public:
  RowBench(FaultId id, const CoreConfig& config) : row_(row_of(id)), config_(config) {}

  /// Feeds a value in the row's unit; each call is a new sample unless `new_sample` is false.
  void feed(std::int64_t value, bool new_sample = true) {
    if (new_sample) taken_at_ = now_;
    judge({.is_known = true, .value = value, .element = {.module_node = 1, .number = 2}, .taken_at = taken_at_});
  }
  void feed_unknown() { judge({}); }
  void pass(Duration duration) { now_ += duration; }
  void clear(Authority authority = Authority::service) { (void)memory_.clear_latched(authority); }
  [[nodiscard]] const FaultState& state() const { return memory_.state(row_.id); }

 private:
  void judge(const Reading& reading) {
    FaultChanges changes;
    memory_.judge(row_, reading, config_.limits, now_, changes);
  }

  const FaultRow& row_;
  CoreConfig config_;
  FaultMemory memory_;
  TimePoint now_{100s};
  TimePoint taken_at_{100s};
};

/// Pack with a configured threshold for everything that can be monitored.
CoreConfig watchful_pack() {
  CoreConfig config = test::small_pack();
  LimitsConfig& limits = config.limits;
  limits.cell_deep_discharge = {.warn = 2'700'000, .open = 2'500'000, .hysteresis = 100'000};
  limits.cell_imbalance = {.warn = 300'000, .open = 800'000, .hysteresis = 50'000, .confirm = 300ms};
  limits.charge_overtemperature = {.warn = 400, .open = 450, .hysteresis = 20, .confirm = 300ms};
  limits.charge_undertemperature = {.warn = 50, .open = 0, .hysteresis = 20, .confirm = 300ms};
  limits.current_sensors_disagree = {.warn = 2'000, .open = 5'000, .hysteresis = 1'000, .confirm = 500ms};
  limits.temperature_rise = LimitsConfig{}.temperature_rise;
  limits.temperature_spread = LimitsConfig{}.temperature_spread;
  limits.insulation_low = {.warn = 100'000, .open = 42'000, .hysteresis = 5'000, .confirm = 500ms};
  return config;
}

struct LimitCase {
  const FaultRow& row;
  LimitConfig limit;
  std::int64_t inwards;  // one count towards passing
};

const LimitConfig& limit_of(const FaultRow& row, const LimitsConfig& limits) {
  return limits.*row.limit;
}

std::vector<LimitCase> all_limits(const CoreConfig& config) {
  std::vector<LimitCase> cases;
  for (const FaultRow& row : fault_table()) {
    if (!row.has_limit()) continue;
    cases.push_back({row, limit_of(row, config.limits), row.sense == Sense::at_or_above ? -1 : 1});
  }
  return cases;
}

/// Rows that need time and more than one sample to be confirmed; a mere warning may need neither.
std::vector<LimitCase> limit_cases(const CoreConfig& config) {
  std::vector<LimitCase> cases;
  for (const LimitCase& one : all_limits(config)) {
    if (one.row.samples >= 2 && one.limit.confirm > 0ns) cases.push_back(one);
  }
  return cases;
}

/// Feeds this value with a new sample every 50 ms until the confirm time has elapsed.
void confirm(RowBench& bench, const LimitCase& one, std::int64_t value) {
  bench.feed(value);
  for (Duration passed{}; passed < one.limit.confirm; passed += 50ms) {
    bench.pass(50ms);
    bench.feed(value);
  }
}

}  // namespace

TEST_CASE("every limit: one count inside never confirms, at the limit does", "[unit][faults][contract][F3]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : all_limits(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench inside(one.row.id, config);
      for (int repeat = 0; repeat < 200; ++repeat) {
        inside.feed(one.limit.open + one.inwards);
        inside.pass(50ms);
      }
      CHECK(inside.state().stage == FaultStage::good);
      RowBench at(one.row.id, config);
      confirm(at, one, one.limit.open);
      CHECK(at.state().stage == FaultStage::active);
      CHECK(at.state().confirmed.value == one.limit.open);
      CHECK(at.state().threshold == one.limit.open);
      CHECK(at.state().count == 1);
    }
  }
}

TEST_CASE("every limit: confirmed after its time, and not a moment before", "[unit][faults][contract]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed(one.limit.open);
      bench.pass(one.limit.confirm - 1ns);
      bench.feed(one.limit.open);
      CHECK(bench.state().stage == FaultStage::suspected);
      bench.pass(1ns);
      bench.feed(one.limit.open);
      CHECK(bench.state().stage == FaultStage::active);
    }
  }
}

TEST_CASE("every limit: one sample alone is never believed, however long it stands", "[unit][faults][contract][F2]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed(one.limit.open - 1000 * one.inwards);
      for (int repeat = 0; repeat < 100; ++repeat) {
        bench.pass(10ms);
        bench.feed(one.limit.open - 1000 * one.inwards, false);
      }
      CHECK(bench.state().stage == FaultStage::suspected);
    }
  }
}

TEST_CASE("every limit: a suspicion that ends before its time leaves no fault", "[unit][faults][contract]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed(one.limit.open);
      bench.pass(one.limit.confirm / 2);
      bench.feed(one.limit.open + one.inwards);
      CHECK(bench.state().stage == FaultStage::suspected);  // not reset at once
      bench.pass(one.limit.confirm - 1ns);
      bench.feed(one.limit.open + one.inwards);
      CHECK(bench.state().stage == FaultStage::suspected);
      bench.pass(2ns);
      bench.feed(one.limit.open + one.inwards);
      CHECK(bench.state().stage == FaultStage::good);  // after twice the time beyond the limit
      bench.feed(one.limit.open);
      bench.pass(one.limit.confirm / 2);
      bench.feed(one.limit.open);
      CHECK(bench.state().stage == FaultStage::suspected);  // the debounce time has restarted
    }
  }
}

TEST_CASE("every limit: what keeps coming back is believed, what comes now and then is not",
          "[unit][faults][contract][F2]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      const Duration tick = one.limit.confirm / 20;
      const auto confirms = [&](int good_samples, std::int64_t good) {
        RowBench bench(one.row.id, config);
        const auto show = [&](std::int64_t value) {  // one sample covers half the confirm time, tested every tick
          for (int repeat = 0; repeat < 10; ++repeat) {
            bench.feed(value, repeat == 0);
            bench.pass(tick);
          }
        };
        for (int round = 0; round < 100 && bench.state().stage != FaultStage::active; ++round) {
          show(one.limit.open);
          for (int repeat = 0; repeat < good_samples; ++repeat) show(good);
        }
        return bench.state().stage == FaultStage::active;
      };
      CHECK(confirms(1, one.limit.open + one.inwards));                                   // every second sample
      CHECK(confirms(1, one.limit.open + one.inwards * (one.limit.hysteresis + 1'000)));  // whatever the others are
      CHECK_FALSE(confirms(2, one.limit.open + one.inwards));
      CHECK_FALSE(confirms(3, one.limit.open + one.inwards));
    }
  }
}

TEST_CASE("every limit: a bad value that hides behind missing ones is believed", "[unit][faults][contract][F9]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      for (int round = 0; round < 6; ++round) {
        bench.feed(one.limit.open);
        bench.pass(one.limit.confirm / 2);
        bench.feed_unknown();
        bench.pass(one.limit.confirm / 2);
      }
      CHECK(bench.state().stage == FaultStage::active);
    }
  }
}

TEST_CASE("a reading with holes can be bad news but not good news", "[unit][faults]") {
  const Reading partial{.is_known = true, .value = 100, .is_partial = true};
  CHECK(evaluate(partial, Sense::at_or_above, 100, 10) == Verdict::beyond);
  CHECK(evaluate(partial, Sense::at_or_above, 101, 10) == Verdict::unknown);
  CHECK(evaluate(partial, Sense::at_or_above, 1'000, 10) == Verdict::unknown);
}

TEST_CASE("every limit: cleared only behind the hysteresis, for the whole time, and latched if the row says so",
          "[unit][faults][contract][I10]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      confirm(bench, one, one.limit.open);
      REQUIRE(bench.state().stage == FaultStage::active);
      for (int repeat = 0; repeat < 100; ++repeat) {
        bench.pass(100ms);
        bench.feed(one.limit.open + one.inwards * (one.limit.hysteresis - 1));
      }
      CHECK(bench.state().stage == FaultStage::active);
      const std::int64_t good = one.limit.open + one.inwards * one.limit.hysteresis;
      bench.feed(good);
      bench.pass(one.limit.clear - 1ns);
      bench.feed(good);
      CHECK(bench.state().stage == FaultStage::active);
      bench.clear();
      CHECK(bench.state().stage == FaultStage::active);  // a persisting cause is never cleared
      bench.pass(1ns);
      bench.feed(good);
      const bool latches = one.row.latch != Latch::none;
      CHECK(bench.state().stage == (latches ? FaultStage::latched : FaultStage::good));
      bench.clear();
      CHECK(bench.state().stage == FaultStage::good);
    }
  }
}

TEST_CASE("every limit: an unknown value neither raises nor clears", "[unit][faults][contract]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed_unknown();
      CHECK(bench.state().stage == FaultStage::good);
      confirm(bench, one, one.limit.open);
      for (int repeat = 0; repeat < 100; ++repeat) {
        bench.pass(100ms);
        bench.feed_unknown();
      }
      CHECK(bench.state().stage == FaultStage::active);
    }
  }
}

TEST_CASE("every limit: a latched fault whose cause comes back stays, and is confirmed and counted anew",
          "[unit][faults][contract]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    if (one.row.latch == Latch::none) continue;
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      confirm(bench, one, one.limit.open);
      const std::int64_t good = one.limit.open + one.inwards * one.limit.hysteresis;
      bench.feed(good);
      bench.pass(one.limit.clear);
      bench.feed(good);
      REQUIRE(bench.state().stage == FaultStage::latched);
      bench.pass(10ms);
      bench.feed(one.limit.open);
      CHECK(bench.state().is_present());
      CHECK(bench.state().count == 1);
      confirm(bench, one, one.limit.open);
      CHECK(bench.state().stage == FaultStage::active);
      CHECK(bench.state().count == 2);
    }
  }
}

TEST_CASE("every limit: warns at its warning threshold, and until behind the hysteresis", "[unit][faults][contract]") {
  const CoreConfig config = watchful_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed(one.limit.warn + one.inwards);
      CHECK_FALSE(bench.state().is_warning);
      bench.feed(one.limit.warn);
      if (one.row.confirms_warning) {
        bench.pass(one.limit.confirm - 1ns);
        bench.feed(one.limit.warn);
        CHECK_FALSE(bench.state().is_warning);
        bench.pass(1ns);
        bench.feed(one.limit.warn);
      }
      CHECK(bench.state().is_warning);
      bench.feed(one.limit.warn + one.inwards * (one.limit.hysteresis - 1));
      CHECK(bench.state().is_warning);
      bench.feed(one.limit.warn + one.inwards * one.limit.hysteresis);
      CHECK_FALSE(bench.state().is_warning);
      CHECK(bench.state().stage == FaultStage::good);
    }
  }
}

TEST_CASE("every condition: false never confirms, true does after its time and samples, and not before",
          "[unit][faults][contract]") {
  const CoreConfig config = watchful_pack();
  for (const FaultRow& row : fault_table()) {
    if (row.has_limit()) continue;
    const Duration confirm = thresholds_of(row, config.limits).confirm;
    DYNAMIC_SECTION(row.name) {
      RowBench bench(row.id, config);
      for (int repeat = 0; repeat < 100; ++repeat) {
        bench.feed(0);
        bench.pass(50ms);
      }
      CHECK(bench.state().stage == FaultStage::good);
      bench.feed(1);
      for (std::uint8_t sample = 1; sample < row.samples; ++sample) {
        CHECK(bench.state().stage == FaultStage::suspected);
        bench.pass(confirm);
        bench.feed(1);
      }
      if (row.samples == 1 && confirm > 0ns) {
        bench.pass(confirm - 1ns);
        bench.feed(1);
        CHECK(bench.state().stage == FaultStage::suspected);
        bench.pass(1ns);
        bench.feed(1);
      }
      CHECK(bench.state().stage == FaultStage::active);
    }
  }
}

TEST_CASE("every fault: what latches stays until it is cleared by somebody who may",
          "[unit][faults][contract][I10][BMU_9]") {
  const CoreConfig config = watchful_pack();
  for (const FaultRow& row : fault_table()) {
    DYNAMIC_SECTION(row.name) {
      const Thresholds thresholds = thresholds_of(row, config.limits);
      const std::int64_t inwards = row.sense == Sense::at_or_above ? -1 : 1;
      const std::int64_t good = thresholds.open + inwards * std::max<std::int64_t>(thresholds.hysteresis, 1);
      RowBench bench(row.id, config);
      for (Duration past{}; past < thresholds.confirm + 3s; past += 50ms) {
        bench.feed(thresholds.open);
        bench.pass(50ms);
      }
      REQUIRE(bench.state().stage == FaultStage::active);
      bench.clear();
      CHECK(bench.state().stage == FaultStage::active);  // the cause is still present
      bench.feed(good);
      bench.pass(thresholds.clear);
      bench.feed(good);
      if (row.latch == Latch::none) {
        CHECK(bench.state().stage == FaultStage::good);
        continue;
      }
      REQUIRE(bench.state().stage == FaultStage::latched);
      bench.clear(Authority::user);
      const bool needs_authority = row.latch == Latch::until_authorised;
      CHECK(bench.state().stage == (needs_authority ? FaultStage::latched : FaultStage::good));
      bench.clear(Authority::service);
      CHECK(bench.state().stage == FaultStage::good);
    }
  }
}

TEST_CASE("a lock of a former life holds until its cause is seen to be gone and authority clears it",
          "[unit][faults][F5]") {
  const CoreConfig config = watchful_pack();
  FaultMemory memory;
  memory.restore_lock(FaultId::cell_deep_discharge, {}, 0, TimePoint{1s});
  const FaultState& state = memory.state(FaultId::cell_deep_discharge);
  CHECK(state.is_present());
  CHECK(memory.clear_latched(Authority::service).empty());  // not tested yet
  FaultChanges changes;
  const FaultRow& row = row_of(FaultId::cell_deep_discharge);
  const auto judge = [&](std::int32_t voltage_uV, TimePoint now) {
    memory.judge(row, {.is_known = true, .value = voltage_uV, .taken_at = now}, config.limits, now, changes);
  };
  judge(3'300'000, TimePoint{2s});
  CHECK(memory.clear_latched(Authority::user).empty());
  CHECK(state.is_present());
  CHECK(memory.clear_latched(Authority::service).size() == 1);
  CHECK_FALSE(state.is_present());
}

TEST_CASE("fault names are unique, and only opening rows latch", "[unit][faults][contract]") {
  for (const FaultRow& row : fault_table()) {
    for (const FaultRow& other : fault_table()) {
      if (&row != &other) CHECK(row.name != other.name);
    }
    if (row.latch == Latch::until_cleared) CHECK(row.reaction != Reaction::warn);
  }
}
