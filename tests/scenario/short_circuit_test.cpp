// The fuse clears a short circuit: contactors are not opened above their breaking capacity, and wait for the fuse for
// at most 250 ms. Row 91 of the catalogue, with the packs of six cells as shipped.
#include <algorithm>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

/// A closed pack, and then a load that draws twice the breaking capacity of the contactors.
struct Shorted {
  explicit Shorted(const std::string& name, const std::string& patch = "{}")
      : rated(test::patched_pack("{}", name + ".json")), run(test::patched_pack(patch, name + ".json")) {
    run.apply("pack soc_permille 800");
    run.run_to(3.0);
    run.apply("vehicle on");
    run.run_to(9.0);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    REQUIRE(rated.contactors.break_current_max_mA > 0);
    const bool has_throttle = rated.auxiliary.throttle_on_permille > 0;  // which is not pressed
    REQUIRE(run.core().outputs().auxiliary == !has_throttle);
    draw(2.0);
  }
  /// `share`: of the breaking capacity of the contactors.
  void draw(double share) {
    run.apply("load current_A " + std::to_string(share * rated.contactors.break_current_max_mA / 1e3));
  }
  [[nodiscard]] bool run_until_confirmed() {
    return run_while([this] { return !faults().state(FaultId::discharge_overcurrent).is_present(); });
  }
  [[nodiscard]] bool run_until_open() {
    return run_while([this] { return run.core().sequence().phase != Phase::open; });
  }
  /// Time from the first fault that opens to the opening.
  [[nodiscard]] Duration waited() const {
    TimePoint first = TimePoint::max();
    for (const FaultRow& row : fault_table()) {
      const FaultState& state = faults().state(row.id);
      if (state.is_present() && row.reaction == Reaction::open_now) first = std::min(first, state.confirmed_at);
    }
    return run.core().last_opening().at - first;
  }
  [[nodiscard]] const FaultMemory& faults() const { return run.core().faults(); }

  CoreConfig rated;
  test::SimRun run;

 private:
  template <class Condition>
  [[nodiscard]] bool run_while(Condition condition) {
    const double end = run.seconds() + 2.0;
    while (condition() && run.seconds() < end) run.run_to(run.seconds() + 0.001);
    return !condition();
  }
};

}  // namespace

TEST_CASE("a short: zero current is asked for at once, and the pack opens after 250 ms", "[scenario][F91][PB_F.1]") {
  const std::string name = GENERATE("lipo-6s-24v", "shell-eco-6s");
  CAPTURE(name);
  Shorted pack(name);
  REQUIRE(pack.run_until_confirmed());
  const Core& core = pack.run.core();
  CHECK(core.sequence().phase == Phase::closed);
  CHECK(core.limits().discharge.limit_mA == 0);
  CHECK(core.limits().charge.limit_mA == 0);
  CHECK(core.limits().discharge.cause == LimitCause::fault);
  CHECK_FALSE(core.outputs().auxiliary);  // the motor's enable
  REQUIRE(pack.run_until_open());
  CHECK(pack.waited() >= 240ms);
  CHECK(pack.waited() <= 250ms + tick_period);
  CHECK(core.last_opening().fault == FaultId::discharge_overcurrent);
  CHECK_FALSE(core.outputs().any_contactor());
}

TEST_CASE(
    "a short that the fuse or the controller ends: the contactors break what they can, in the tick in which it is seen",
    "[scenario][F91][PB_F.1]") {
  const std::string name = GENERATE("lipo-6s-24v", "shell-eco-6s");
  CAPTURE(name);
  Shorted pack(name);
  REQUIRE(pack.run_until_confirmed());
  pack.run.run_to(pack.run.seconds() + 0.05);
  REQUIRE(pack.run.core().sequence().phase == Phase::closed);
  const double fell_at = pack.run.seconds();
  pack.draw(0.9);
  REQUIRE(pack.run_until_open());
  CHECK(pack.run.seconds() - fell_at <= 0.04);  // two periods of the sensor
  CHECK(pack.run.core().last_opening().current_mA.value <= pack.rated.contactors.break_current_max_mA);
}

TEST_CASE(
    "a short does not keep an emergency stop from opening, nor a pack whose file does not say what its contactors "
    "break",
    "[scenario][F91][F93][PB_F.1]") {
  SECTION("emergency stop") {
    Shorted pack("lipo-6s-24v");
    REQUIRE(pack.run_until_confirmed());
    const double pressed_at = pack.run.seconds();
    pack.run.apply("estop 1 pressed");
    REQUIRE(pack.run_until_open());
    CHECK(pack.run.seconds() - pressed_at <= 0.02);
  }
  SECTION("no rating") {
    Shorted pack("lipo-6s-24v", R"({"contactors": {"break_current_max_mA": 0}})");
    REQUIRE(pack.run_until_open());
    CHECK(pack.waited() <= tick_period);
  }
  SECTION("a sensor that falls silent") {
    Shorted pack("lipo-6s-24v");
    REQUIRE(pack.run_until_confirmed());
    pack.run.apply("sensor current silent");
    REQUIRE(pack.run_until_open());
    CHECK(pack.waited() <= 250ms + tick_period);
  }
}
