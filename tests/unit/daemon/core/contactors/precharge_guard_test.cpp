// Attempts of a precharge, and the heat in its resistor.
#include "daemon/core/contactors/precharge_guard.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// Resistor of 100 Ohm, rated 100 J, that dissipates them in 10 s: at 100 V it takes 100 W.
constexpr ContactorConfig resistor{
    .precharge_tries = 3, .precharge_cool_down = 10s, .precharge_resistance_Ohm = 100, .precharge_energy_J = 100};

class Guarded {
 public:
  explicit Guarded(const ContactorConfig& config = resistor) {
    guard.init(config);
    tick(false, 0);
  }
  void tick(bool is_precharging, std::int32_t across_mV, bool is_measured = true) {
    guard.update(now, is_precharging, is_measured, 100'000, 100'000 - across_mV);
    now += 10ms;
  }
  void run(Duration duration, bool is_precharging, std::int32_t across_mV = 100'000) {
    for (Duration passed{}; passed < duration; passed += 10ms) tick(is_precharging, across_mV);
  }

  PrechargeGuard guard;
  TimePoint now = start;
};

}  // namespace

TEST_CASE("a precharge that was too slow has its tries, one that failed otherwise has none",
          "[unit][contactors][F86]") {
  PrechargeGuard guard;
  guard.init(resistor);
  CHECK_FALSE(guard.is_retrying());
  CHECK(guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::none);
  CHECK(guard.is_retrying());
  CHECK(guard.tries_failed() == 1);
  CHECK(guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::none);
  CHECK(guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::too_slow);
  CHECK_FALSE(guard.is_retrying());  // now a fault, and the next request starts with all attempts
  CHECK(guard.tries_failed() == 0);
  CHECK(guard.note_end(PrechargeFailure::too_fast) == PrechargeFailure::too_fast);
  CHECK(guard.note_end(PrechargeFailure::overcurrent) == PrechargeFailure::overcurrent);
  CHECK(guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::none);
  CHECK(guard.note_end(PrechargeFailure::none) == PrechargeFailure::none);
  CHECK(guard.tries_failed() == 0);
  (void)guard.note_end(PrechargeFailure::too_slow);
  guard.forget_tries();
  CHECK_FALSE(guard.is_retrying());
  CHECK(guard.tries_failed() == 0);
}

TEST_CASE("a single try is a fault when it fails", "[unit][contactors][F86]") {
  PrechargeGuard guard;
  guard.init({.precharge_tries = 1});
  CHECK(guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::too_slow);
}

TEST_CASE("heat is the square of the voltage over the resistor, for as long as it lasts, less what it gives off",
          "[unit][contactors][F86]") {
  Guarded guarded;
  guarded.run(500ms, true);
  CHECK(guarded.guard.heat_mJ() == 50'000 - 5'000);
  guarded.run(500ms, true, 50'000);  // half the voltage, a quarter of the power
  CHECK(guarded.guard.heat_mJ() == 45'000 + 12'500 - 5'000);
  guarded.run(1s, true, 0);
  CHECK(guarded.guard.heat_mJ() == 42'500);
  guarded.run(4'240ms, false);
  CHECK(guarded.guard.heat_mJ() == 100);
  guarded.run(1s, false);
  CHECK(guarded.guard.heat_mJ() == 0);
}

TEST_CASE("a voltage nobody knows counts as all of it", "[unit][contactors][F86]") {
  Guarded guarded;
  for (int tick = 0; tick < 50; ++tick) guarded.tick(true, 0, false);
  CHECK(guarded.guard.heat_mJ() == 45'000);
}

TEST_CASE("a stopped process heats and cools the resistor for a second at most", "[unit][contactors][F86]") {
  Guarded guarded;
  guarded.now += 1min;
  guarded.tick(true, 100'000);
  CHECK(guarded.guard.heat_mJ() == 90'000);  // as if all of the second had been spent at full voltage
}

TEST_CASE("too hot is more than the resistor bears", "[unit][contactors][F86]") {
  Guarded guarded;
  guarded.run(1'110ms, true);
  CHECK(guarded.guard.heat_mJ() == 99'900);
  CHECK_FALSE(guarded.guard.is_overheated());
  guarded.tick(true, 100'000);
  CHECK(guarded.guard.is_overheated());
}

TEST_CASE("exactly what the resistor bears is not too much", "[unit][contactors][F86]") {
  ContactorConfig slow = resistor;
  slow.precharge_cool_down = 200'000s;  // less than a microjoule a millisecond
  Guarded guarded(slow);
  guarded.run(1s, true);
  CHECK(guarded.guard.heat_mJ() == 100'000);
  CHECK(guarded.guard.is_cool());
  CHECK_FALSE(guarded.guard.is_overheated());
  guarded.tick(true, 1'000);  // 1 V: 0.1 mJ more
  CHECK(guarded.guard.is_overheated());
}

TEST_CASE("the next try waits until the resistor bears another one like the last", "[unit][contactors][F86]") {
  Guarded guarded;
  CHECK(guarded.guard.is_cool());
  guarded.run(600ms, true);
  guarded.tick(false, 0);
  CHECK_FALSE(guarded.guard.is_cool());  // 54 J are left of 60
  guarded.run(1'380ms, false);
  CHECK_FALSE(guarded.guard.is_cool());
  guarded.run(10ms, false);
  CHECK(guarded.guard.is_cool());  // 40 and 60 J, to the microjoule
}

TEST_CASE("after a try that used up all the resistor bears there is a next one, when it is cold",
          "[unit][contactors][F86]") {
  Guarded guarded;
  while (!guarded.guard.is_overheated()) guarded.tick(true, 100'000);
  guarded.run(9s, false);
  CHECK_FALSE(guarded.guard.is_cool());
  guarded.run(2s, false);
  CHECK(guarded.guard.is_cool());
}

TEST_CASE("a try is judged by the last one that ended, not by itself", "[unit][contactors][F86]") {
  Guarded guarded;
  guarded.run(100ms, true);
  guarded.run(1s, false);
  guarded.run(600ms, true);
  CHECK(guarded.guard.is_cool());  // 54 J, and the last attempt took 10
  guarded.tick(false, 0);
  CHECK_FALSE(guarded.guard.is_cool());
  guarded.run(10s, false);
  guarded.run(10ms, true);
  guarded.run(5s, false);
  guarded.run(650ms, true);
  guarded.tick(false, 0);
  guarded.run(2'300ms, false);
  CHECK_FALSE(guarded.guard.is_cool());
  guarded.run(200ms, false);
  CHECK(guarded.guard.is_cool());  // 33.4 and 65 J; earlier attempts do not count
}

TEST_CASE("the first tick has no time behind it, and a resistor that cools at once is cold a moment later",
          "[unit][contactors][F86]") {
  PrechargeGuard guard;
  guard.init(resistor);
  guard.update(start, true, true, 100'000, 0);
  CHECK(guard.heat_mJ() == 0);
  ContactorConfig quick = resistor;
  quick.precharge_cool_down = 0ms;
  guard.init(quick);
  TimePoint now = start;
  for (int tick = 0; tick <= 600; ++tick) {
    guard.update(now, true, true, 100'000, 0);
    now += 999us;  // shorter than its cooling time
  }
  CHECK(guard.heat_mJ() == 59'940);
  guard.update(now + 1us, false, true, 100'000, 0);
  CHECK(guard.heat_mJ() == 0);
}

TEST_CASE("a resistor of which nothing is known is not watched", "[unit][contactors][F86]") {
  for (const ContactorConfig& config : {ContactorConfig{.precharge_resistance_Ohm = 100},
                                        ContactorConfig{.precharge_energy_J = 100}, ContactorConfig{}}) {
    Guarded guarded(config);
    guarded.run(10s, true);
    CHECK(guarded.guard.heat_mJ() == 0);
    CHECK(guarded.guard.is_cool());
    CHECK_FALSE(guarded.guard.is_overheated());
  }
}

TEST_CASE("the largest pack and the smallest resistor do not overflow", "[unit][contactors]") {
  ContactorConfig config = resistor;
  config.precharge_resistance_Ohm = 1;
  config.precharge_energy_J = 1'000'000;
  PrechargeGuard guard;
  guard.init(config);
  guard.update(start, true, false, 2'000'000, 0);
  guard.update(start + 1s, true, false, 2'000'000, 0);
  CHECK(guard.heat_mJ() == 3'900'000'000);
}

TEST_CASE("heat, the last try and the tries outlive a process, and nothing of the heat is taken for given off",
          "[unit][contactors][F86]") {
  Guarded before;
  before.run(600ms, true);
  before.tick(false, 0);
  CHECK(before.guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::none);
  CHECK(before.guard.note_end(PrechargeFailure::too_slow) == PrechargeFailure::none);
  const PrechargeMemory memory = before.guard.memory(false);
  CHECK(memory == PrechargeMemory{.heat_uJ = 53'900'000, .last_try_uJ = 60'000'000, .tries_failed = 2});
  PrechargeGuard after;
  after.init(resistor);
  after.restore(memory);
  CHECK(after.memory(false) == memory);
  CHECK(after.heat_mJ() == 53'900);
  CHECK_FALSE(after.is_cool());
  CHECK_FALSE(after.is_cold());
  CHECK_FALSE(after.is_retrying());                                                 // no request is pending
  CHECK(after.note_end(PrechargeFailure::too_slow) == PrechargeFailure::too_slow);  // third attempt
  SECTION("a try under way is remembered as one that failed and took all") {
    CHECK(before.guard.memory(true) ==
          PrechargeMemory{.heat_uJ = 100'000'000, .last_try_uJ = 100'000'000, .tries_failed = 3});
    PrechargeGuard fresh;
    fresh.init(resistor);
    CHECK(fresh.memory(true).tries_failed == 1);
    CHECK(fresh.memory(false) == PrechargeMemory{});
    Guarded hot;
    while (hot.guard.heat_mJ() <= 150'000) hot.tick(true, 100'000);
    CHECK(hot.guard.memory(true).heat_uJ > 150'000'000);
    after.restore({.tries_failed = 3});  // all attempts, and the last one was not completed
    CHECK(after.note_end(PrechargeFailure::too_slow) == PrechargeFailure::too_slow);
    before.guard.restore({.tries_failed = 3});
    CHECK(before.guard.memory(true).tries_failed == 3);
  }
  SECTION("of a resistor that is not watched only the tries") {
    PrechargeGuard unwatched;
    unwatched.init({.precharge_tries = 3});
    unwatched.restore(memory);
    CHECK(unwatched.memory(false) == PrechargeMemory{.tries_failed = 2});
    CHECK(unwatched.is_cool());
  }
  SECTION("a heat below nothing is none") {
    after.restore({.heat_uJ = -1, .last_try_uJ = -1});
    CHECK(after.is_cold());
    CHECK(after.memory(false) == PrechargeMemory{});
  }
}

// --- in the core ----------------------------------------------------------------------------------------------------

namespace {

CoreConfig pack_with_tries(std::uint8_t tries) {
  CoreConfig config = test::small_pack();
  config.contactors.precharge_tries = tries;
  config.contactors.precharge_cool_down = 2s;
  return config;
}

int closings_begun(const test::CoreBench& bench) {
  return static_cast<int>(std::count_if(bench.events().begin(), bench.events().end(), [](const Event& event) {
    return event.id == EventId::phase_changed && event.phase_to == Phase::precharge;
  }));
}

}  // namespace

TEST_CASE("a link that never follows is tried as often as configured, then it is a fault", "[unit][core][F86]") {
  test::CoreBench bench(pack_with_tries(3));
  bench.link_rise_mV_per_ms = 0;
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::precharge_failed); }, 30s));
  CHECK(closings_begun(bench) == 3);
  bench.run(30s);
  CHECK(closings_begun(bench) == 3);
  CHECK_FALSE(bench.commanded().any_contactor());
}

TEST_CASE("a link that follows at the second try is closed, without a fault", "[unit][core][F86]") {
  test::CoreBench bench(pack_with_tries(3));
  bench.link_rise_mV_per_ms = 0;
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  REQUIRE(bench.run_until([&] { return bench.core().last_opening().cause == OpeningCause::precharge_retry; }, 5s));
  bench.link_rise_mV_per_ms = 200;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 5s));
  CHECK(closings_begun(bench) == 2);
  CHECK_FALSE(bench.is_active(FaultId::precharge_failed));
  CHECK_FALSE(bench.core().precharge_guard().is_retrying());
}

TEST_CASE("a link that falls again under the closed main is tried as often as configured, too", "[unit][core][F86]") {
  test::CoreBench bench(pack_with_tries(3));
  bench.main_positive_held_open = true;
  bench.feedback_lies = true;
  bench.each_ms = [&bench] {  // a load behind the precharge resistor starts to draw current
    if (bench.commanded().main_positive) bench.link_voltage_mV = 10'000;
  };
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  CHECK(bench.run_until([&] { return bench.is_active(FaultId::precharge_failed); }, 60s));
  CHECK(closings_begun(bench) == 3);
}

// --- over a restart -------------------------------------------------------------------------------------------------

namespace {

CoreConfig pack_with_resistor() {
  CoreConfig config = test::small_pack();  // 29.6 V
  config.contactors.precharge_resistance_Ohm = 10;
  config.contactors.precharge_energy_J = 200;
  config.contactors.precharge_tries = 3;
  config.contactors.precharge_cool_down = 60s;
  return config;
}

/// Daemon that restores the state of an earlier session; the key is switched on as soon as it is ready.
struct NextLife {
  explicit NextLife(const CoreConfig& config, const PersistentState& state) : bench(config, state) {
    bench.link_rise_mV_per_ms = 0;
    bench.run(1500ms);
    bench.inputs.vehicle_on = true;
  }
  [[nodiscard]] bool blocks(Blocker blocker) const {
    const auto& blockers = bench.core().permission().blockers;
    return std::find(blockers.begin(), blockers.end(), blocker) != blockers.end();
  }

  test::CoreBench bench;
};

}  // namespace

TEST_CASE("a daemon that ends again and again in a precharge heats the resistor no more than one that goes on",
          "[unit][core][state][F86]") {
  const CoreConfig config = pack_with_resistor();
  PersistentState state;
  int tries = 0;
  for (int life = 0; life < 20; ++life) {
    NextLife now(config, state);
    if (now.bench.run_until([&] { return now.bench.core().sequence().phase == Phase::precharge; }, 3s)) ++tries;
    now.bench.run(100ms);
    state = now.bench.core().persistent();  // and the process is killed
  }
  CHECK(tries == 1);
  NextLife last(config, state);
  CHECK(last.blocks(Blocker::precharge_hot));
  CHECK(last.bench.core().precharge_guard().tries_failed() == 1);
  last.bench.inputs.vehicle_on = false;
  last.bench.run(60s);
  CHECK_FALSE(last.blocks(Blocker::precharge_hot));
  CHECK(last.bench.core().persistent().closing.precharge.heat_uJ == 0);
  last.bench.inputs.vehicle_on = true;
  CHECK(last.bench.run_until([&] { return last.bench.core().sequence().phase == Phase::precharge; }, 3s));
}

TEST_CASE("a wait after an opening begins anew with the next life, and one that is over does not",
          "[unit][core][state]") {
  test::CoreBench bench(test::small_pack());
  REQUIRE(bench.close());
  CHECK(bench.core().persistent().closing.lockout_ms == 10'000);  // ending this session now would cause a lockout
  bench.inputs.estop_1_released = false;
  bench.run(9s);
  CHECK(bench.core().persistent().closing.lockout_ms == 10'000);
  const PersistentState within = bench.core().persistent();
  bench.run(2s);
  CHECK(bench.core().persistent().closing.lockout_ms == 0);
  bench.inputs.estop_1_released = true;
  bench.run(1500ms);
  bench.give(Command::clear_faults);  // otherwise the emergency stop stays latched in the next session
  const PersistentState after = bench.core().persistent();

  NextLife early(test::small_pack(), within);
  early.bench.link_rise_mV_per_ms = 200;
  CHECK(early.blocks(Blocker::locked_out));
  CHECK(early.bench.core().locked_out_until() == early.bench.core().started_at() + 10s);
  NextLife late(test::small_pack(), after);
  late.bench.link_rise_mV_per_ms = 200;
  CHECK_FALSE(late.blocks(Blocker::locked_out));
  CHECK(late.bench.run_until([&] { return late.bench.core().sequence().phase == Phase::closed; }, 3s));
  PersistentState absurd = within;
  absurd.closing.lockout_ms = INT64_MAX;
  NextLife patient(test::small_pack(), absurd);
  CHECK(patient.bench.core().locked_out_until() == patient.bench.core().started_at() + 600s);
}
