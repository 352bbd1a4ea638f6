// What every fault row promises, tried on every row: the rows inherit these tests, a new one brings none of its own.
#include "daemon/core/fault_memory.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

/// A memory fed with made-up readings of one row, everything else good.
class RowBench {
 public:
  RowBench(FaultId id, const CoreConfig& config) : id_(id), config_(config) {
    modules_.init(config_);
    pack_.modules_expected = pack_.modules_answering = 2;
  }

  /// Value in the row's unit, seen `age` ago; fresh sample each call unless said otherwise.
  void feed(std::int64_t value, bool new_sample = true) {
    if (new_sample) taken_at_ = now_;
    const auto measured = Measured<std::int32_t>{static_cast<std::int32_t>(value), taken_at_, Validity::valid};
    Spread spread{.min = measured.value,
                  .max = measured.value,
                  .min_at = {1, 2, 2},
                  .max_at = {1, 2, 2},
                  .min_taken_at = taken_at_,
                  .max_taken_at = taken_at_,
                  .count = 8,
                  .expected = 8};
    switch (id_) {
      case FaultId::cell_undervoltage:
      case FaultId::cell_overvoltage: pack_.cell_voltage_uV = spread; break;
      case FaultId::cell_overtemperature:
      case FaultId::cell_undertemperature: pack_.cell_temperature_dC = spread; break;
      case FaultId::discharge_overcurrent: pack_.current_mA = measured; break;
      case FaultId::charge_overcurrent:
        pack_.current_mA = measured;
        pack_.current_mA.value = -measured.value;
        break;
      case FaultId::pack_voltage_mismatch:
        pack_.cell_voltage_sum_mV = {100'000, taken_at_, Validity::valid};
        pack_.pack_voltage_mV = {100'000 - measured.value, taken_at_, Validity::valid};
        break;
      default: FAIL("a row with a limit needs a line here"); break;
    }
    update();
  }
  void feed_unknown() {
    pack_ = PackState{.modules_answering = 2, .modules_expected = 2};
    update();
  }
  void pass(Duration duration) { now_ += duration; }
  void clear() { (void)memory_.clear_latched(); }
  [[nodiscard]] const FaultState& state() const { return memory_.state(id_); }

 private:
  void update() {
    CoreFlags flags;
    flags.internal_bus_up = true;
    (void)memory_.update(
        {.now = now_, .config = &config_, .pack = &pack_, .modules = &modules_, .sensors = &sensors_, .flags = flags});
  }

  FaultId id_;
  CoreConfig config_;
  ModuleTable modules_;
  SensorTable sensors_;
  PackState pack_;
  FaultMemory memory_;
  TimePoint now_{100s};
  TimePoint taken_at_{100s};
};

struct LimitCase {
  const FaultRow& row;
  LimitConfig limit;
  std::int64_t inwards;  // one count towards good
};

std::vector<LimitCase> limit_cases(const CoreConfig& config) {
  std::vector<LimitCase> cases;
  for (const FaultRow& row : fault_table()) {
    if (row.limit == nullptr) continue;
    cases.push_back({row, config.limits.*row.limit, row.sense == Sense::at_or_above ? -1 : 1});
  }
  return cases;
}

/// Beyond the limit with a new sample every 50 ms until the confirm time has passed.
void confirm(RowBench& bench, const LimitCase& one, std::int64_t value) {
  bench.feed(value);
  for (Duration passed{}; passed < one.limit.confirm; passed += 50ms) {
    bench.pass(50ms);
    bench.feed(value);
  }
}

}  // namespace

TEST_CASE("every limit: one count inside never confirms, at the limit does", "[unit][faults][contract][F3]") {
  const CoreConfig config = test::small_pack();
  for (const LimitCase& one : limit_cases(config)) {
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
  const CoreConfig config = test::small_pack();
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
  const CoreConfig config = test::small_pack();
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
  const CoreConfig config = test::small_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed(one.limit.open);
      bench.pass(one.limit.confirm / 2);
      bench.feed(one.limit.open + one.inwards);
      CHECK(bench.state().stage == FaultStage::suspected);  // not forgotten at once
      bench.pass(one.limit.confirm - 1ns);
      bench.feed(one.limit.open + one.inwards);
      CHECK(bench.state().stage == FaultStage::suspected);
      bench.pass(2ns);
      bench.feed(one.limit.open + one.inwards);
      CHECK(bench.state().stage == FaultStage::good);  // twice as long as it was beyond
      bench.feed(one.limit.open);
      bench.pass(one.limit.confirm / 2);
      bench.feed(one.limit.open);
      CHECK(bench.state().stage == FaultStage::suspected);  // the clock has started anew
    }
  }
}

TEST_CASE("every limit: what keeps coming back is believed, what comes now and then is not",
          "[unit][faults][contract][F2]") {
  const CoreConfig config = test::small_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      const Duration tick = one.limit.confirm / 20;
      const auto confirms = [&](int good_samples, std::int64_t good) {
        RowBench bench(one.row.id, config);
        const auto show = [&](std::int64_t value) {  // one sample stands for half the confirm time, judged every tick
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
      CHECK(confirms(1, one.limit.open + one.inwards * (one.limit.hysteresis + 1'000)));  // however good the others
      CHECK_FALSE(confirms(2, one.limit.open + one.inwards));
      CHECK_FALSE(confirms(3, one.limit.open + one.inwards));
    }
  }
}

TEST_CASE("every limit: a bad value that hides behind missing ones is believed", "[unit][faults][contract][F9]") {
  const CoreConfig config = test::small_pack();
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
  const CoreConfig config = test::small_pack();
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
      CHECK(bench.state().stage == FaultStage::active);  // nothing clears what is still there
      bench.pass(1ns);
      bench.feed(good);
      const bool latches = one.row.latch == Latch::until_cleared;
      CHECK(bench.state().stage == (latches ? FaultStage::latched : FaultStage::good));
      bench.clear();
      CHECK(bench.state().stage == FaultStage::good);
    }
  }
}

TEST_CASE("every limit: an unknown value neither raises nor clears", "[unit][faults][contract]") {
  const CoreConfig config = test::small_pack();
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

TEST_CASE("every limit: a latched fault whose cause comes back is active again at once", "[unit][faults][contract]") {
  const CoreConfig config = test::small_pack();
  for (const LimitCase& one : limit_cases(config)) {
    if (one.row.latch != Latch::until_cleared) continue;
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
      CHECK(bench.state().stage == FaultStage::active);
    }
  }
}

TEST_CASE("every limit: warns at its warning threshold, and until behind the hysteresis", "[unit][faults][contract]") {
  const CoreConfig config = test::small_pack();
  for (const LimitCase& one : limit_cases(config)) {
    DYNAMIC_SECTION(one.row.name) {
      RowBench bench(one.row.id, config);
      bench.feed(one.limit.warn + one.inwards);
      CHECK_FALSE(bench.state().is_warning);
      bench.feed(one.limit.warn);
      CHECK(bench.state().is_warning);
      bench.feed(one.limit.warn + one.inwards * (one.limit.hysteresis - 1));
      CHECK(bench.state().is_warning);
      bench.feed(one.limit.warn + one.inwards * one.limit.hysteresis);
      CHECK_FALSE(bench.state().is_warning);
      CHECK(bench.state().stage == FaultStage::good);
    }
  }
}

TEST_CASE("fault names are unique, and only opening rows latch", "[unit][faults][contract]") {
  for (const FaultRow& row : fault_table()) {
    for (const FaultRow& other : fault_table()) {
      if (&row != &other) CHECK(row.name != other.name);
    }
    if (row.latch == Latch::until_cleared) CHECK(row.reaction != Reaction::warn);
  }
}
