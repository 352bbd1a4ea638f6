// Sleep after an undervoltage: its start, its end, and the behaviour of the pack meanwhile.
#include "daemon/core/contactors/rest_mode.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;

namespace {

constexpr TimePoint start{100s};
constexpr RestConfig rest_config{.after = 10s, .look_every = 60s};
constexpr RestInputs alone{.is_undervoltage = true, .is_open = true};

struct Rested {
  Rested() { mode.init(rest_config); }

  RestPhase at(Duration since, RestInputs in = alone) {
    in.now = start + since;
    const RestPhase before = mode.phase();
    const bool has_changed = mode.step(in);
    CHECK(has_changed == (mode.phase() != before));
    if (has_changed) CHECK(mode.since() == in.now);
    return mode.phase();
  }
  void rest() {
    at(0s);
    REQUIRE(at(10s) == RestPhase::resting);
    REQUIRE(mode.is_resting());
  }

  RestMode mode;
};

}  // namespace

TEST_CASE("rest begins when an empty pack has been open and alone for a while, all the time", "[unit][rest][BMS_F.9]") {
  CHECK(Rested().at(0s) == RestPhase::awake);
  Rested waiting;
  waiting.at(0s);
  CHECK(waiting.at(10s - 1ns) == RestPhase::awake);
  CHECK(waiting.at(10s) == RestPhase::resting);
  const std::array<void (*)(RestInputs&), 3> hindrances{[](RestInputs& in) { in.is_undervoltage = false; },
                                                        [](RestInputs& in) { in.is_open = false; },
                                                        [](RestInputs& in) { in.charger_connected = true; }};
  for (const auto hinder : hindrances) {
    RestInputs in = alone;
    hinder(in);
    Rested hindered;
    for (int second = 0; second < 30; ++second) CHECK(hindered.at(second * 1s, in) == RestPhase::awake);
    hindered.at(30s);  // the time restarts here
    CHECK(hindered.at(40s - 1ns) == RestPhase::awake);
    CHECK(hindered.at(40s) == RestPhase::resting);
  }
}

TEST_CASE("a vehicle that was left on does not keep an empty pack awake", "[unit][rest][BMS_F.9]") {
  Rested left_on;
  RestInputs in = alone;
  in.vehicle_on = true;
  left_on.at(0s, in);  // its edge wakes, its level does not
  left_on.at(1s, in);
  CHECK(left_on.at(11s - 1ns, in) == RestPhase::awake);
  CHECK(left_on.at(11s, in) == RestPhase::resting);
}

TEST_CASE("a look comes now and then, and ends with a complete view or after two seconds", "[unit][rest][BMS_F.9]") {
  Rested rested;
  rested.rest();
  CHECK(rested.at(70s - 1ns) == RestPhase::resting);
  CHECK(rested.at(70s) == RestPhase::looking);
  CHECK_FALSE(rested.mode.is_resting());
  CHECK(rested.at(72s - 1ns) == RestPhase::looking);
  CHECK(rested.at(72s) == RestPhase::resting);
  CHECK(rested.at(132s) == RestPhase::looking);
  RestInputs seen = alone;
  seen.has_complete_view = true;
  CHECK(rested.at(132s + 10ms, seen) == RestPhase::resting);
  CHECK(rested.at(192s + 10ms, seen) == RestPhase::looking);
}

TEST_CASE("button, charger, vehicle and command wake, and the time to the rest begins anew", "[unit][rest][BMS_F.9]") {
  const std::array<bool RestInputs::*, 3> wakers{&RestInputs::resume_button, &RestInputs::charger_connected,
                                                 &RestInputs::vehicle_on};
  for (const auto waker : wakers) {
    Rested rested;
    rested.rest();
    RestInputs in = alone;
    in.*waker = true;
    CHECK(rested.at(11s, in) == RestPhase::awake);
    rested.at(12s);
    CHECK(rested.at(22s - 1ns) == RestPhase::awake);
    CHECK(rested.at(22s) == RestPhase::resting);
    CHECK(rested.at(82s) == RestPhase::looking);
    CHECK(rested.at(82s + 10ms, in) == RestPhase::awake);
  }
  Rested held;
  RestInputs in = alone;
  in.resume_button = true;
  held.at(0s, in);
  held.at(1s, in);
  CHECK(held.at(11s - 1ns, in) == RestPhase::awake);
  CHECK(held.at(11s, in) == RestPhase::resting);  // the button is held: its edge has been handled
  held.mode.wake();
  CHECK(held.at(12s, in) == RestPhase::awake);
  CHECK(held.at(13s, in) == RestPhase::awake);
  CHECK(held.at(23s, in) == RestPhase::resting);  // a command wakes once
}

TEST_CASE("without the undervoltage there is nothing to rest for", "[unit][rest][BMS_F.9]") {
  Rested rested;
  rested.rest();
  RestInputs in = alone;
  in.is_undervoltage = false;
  CHECK(rested.at(11s, in) == RestPhase::awake);
}

TEST_CASE("what nobody filled in is a pack in no need of rest", "[unit][rest]") {
  const RestInputs in;
  for (const bool input :
       {in.is_undervoltage, in.is_open, in.has_complete_view, in.resume_button, in.charger_connected, in.vehicle_on}) {
    CHECK_FALSE(input);
  }
  const RestMode mode;
  CHECK(mode.phase() == RestPhase::awake);
  CHECK(mode.since() == TimePoint{});
}

TEST_CASE("each phase of the rest has its name", "[unit][rest]") {
  CHECK(to_text(RestPhase::awake) == "awake");
  CHECK(to_text(RestPhase::resting) == "resting");
  CHECK(to_text(RestPhase::looking) == "looking");
  CHECK(to_text(static_cast<RestPhase>(99)) == "?");
}

// --- the sleeping pack ----------------------------------------------------------------------------------------------

namespace {

CoreConfig pack_that_rests() {
  CoreConfig config = test::small_pack();
  config.rest = rest_config;
  return config;
}

/// Opens the pack by an empty cell, switches the key off and waits until it is asleep.
void empty_and_rest(CoreBench& bench) {
  REQUIRE(bench.close());
  bench.modules[0].cell_voltage_uV[1] = known(2'800'000);
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 2s));
  bench.inputs.vehicle_on = false;
  REQUIRE(bench.run_until([&] { return bench.core().rest().is_resting(); }, 20s));
}

std::ptrdiff_t sent_since(const CoreBench& bench, std::size_t first, std::uint16_t base_id) {
  const auto& sent = bench.sent();
  return std::count_if(sent.begin() + static_cast<std::ptrdiff_t>(first), sent.end(),
                       [&](const OutgoingFrame& out) { return out.port == Port::internal && out.frame.id == base_id; });
}

}  // namespace

TEST_CASE("an empty pack left alone sends its modules to sleep, asks nobody, and looks now and then",
          "[unit][core][rest][BMS_F.9]") {
  CoreBench bench(pack_that_rests());
  empty_and_rest(bench);
  bench.run(3s);  // the modules are commanded to sleep, and polled to verify it
  const std::size_t first = bench.sent().size();
  bench.run(56s);
  CHECK(bench.sent().size() == first);  // no poll, no command, no report
  CHECK(bench.is_active(FaultId::cell_undervoltage));
  CHECK_FALSE(bench.is_active(FaultId::module_lost));  // a sleeping module is not lost
  REQUIRE(bench.run_until([&] { return bench.core().rest().phase() == RestPhase::looking; }, 5s));
  REQUIRE(bench.run_until([&] { return bench.core().rest().is_resting(); }, 3s));
  CHECK(sent_since(bench, first, internal_bus::poll.base_id) > 0);
  CHECK_FALSE(bench.commanded().any_contactor());
}

TEST_CASE("a charger wakes a resting pack and closes it to be charged, current drawn meanwhile opens it again",
          "[unit][core][rest][BMS_F.10]") {
  CoreBench bench(pack_that_rests());
  empty_and_rest(bench);
  bench.inputs.charger_connected = true;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 10s));
  CHECK(bench.core().rest().phase() == RestPhase::awake);
  CHECK(bench.core().limits().discharge.limit_mA == 0);
  CHECK(bench.core().limits().charge.limit_mA > 0);
  bench.current_mA = -5'000;
  bench.run(5s);
  CHECK(bench.core().sequence().phase == Phase::closed);
  bench.current_mA = 5'000;
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 2s));
  CHECK(bench.core().last_opening().fault == FaultId::discharge_not_allowed);
}

TEST_CASE("an empty pack that is closed for charging is not emptied further by a small current",
          "[unit][core][rest][BMS_F.10]") {
  for (const std::int32_t tolerated_mA : {200, 500}) {
    CoreConfig config = pack_that_rests();
    config.contactors.charge_only_discharge_mA = tolerated_mA;
    CoreBench bench(config);
    empty_and_rest(bench);
    bench.inputs.charger_connected = true;
    REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 10s));
    bench.current_mA = tolerated_mA;
    bench.run(60s);
    CHECK(bench.core().sequence().phase == Phase::closed);
    bench.current_mA = tolerated_mA + 1;
    REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 500ms));
    CHECK(bench.core().last_opening().fault == FaultId::discharge_not_allowed);
  }
}

TEST_CASE("a key, a button or a command wakes a resting pack, and none of them closes it",
          "[unit][core][rest][BMS_F.9]") {
  const std::array<void (*)(CoreBench&), 3> wakers{[](CoreBench& bench) { bench.inputs.vehicle_on = true; },
                                                   [](CoreBench& bench) { bench.inputs.resume_button = true; },
                                                   [](CoreBench& bench) { bench.give(Command::wake); }};
  for (const auto wake : wakers) {
    CoreBench bench(pack_that_rests());
    empty_and_rest(bench);
    wake(bench);
    REQUIRE(bench.run_until([&] { return bench.core().rest().phase() == RestPhase::awake; }, 1s));
    bench.run(5s);
    CHECK_FALSE(bench.commanded().any_contactor());
    CHECK(bench.core().pack().is_complete());
    CHECK_FALSE(bench.is_active(FaultId::module_lost));
  }
}
