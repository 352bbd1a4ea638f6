// A short belongs to the fuse: contactors are not asked to break more than they can, and wait for it for 250 ms and no
// longer. Row 91 of the catalogue, at the packs of six cells as shipped.
#include <algorithm>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

/// Closed, and then a load that draws `share` times what the contactors break.
struct Shorted {
  explicit Shorted(const std::string& name, const std::string& patch = "{}", double share = 2.0)
      : rated(test::patched_pack("{}", name + ".json")), run(test::patched_pack(patch, name + ".json")) {
    run.apply("pack soc_permille 800");
    run.run_to(3.0);
    run.apply("vehicle on");
    run.run_to(9.0);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    REQUIRE(rated.contactors.break_current_max_mA > 0);
    const bool has_throttle = rated.auxiliary.throttle_on_permille > 0;  // which is not pressed
    REQUIRE(run.core().outputs().auxiliary == !has_throttle);
    draw(share);
  }
  /// In shares of what the contactors break.
  void draw(double share) {
    run.apply("load current_A " + std::to_string(share * rated.contactors.break_current_max_mA / 1e3));
  }
  [[nodiscard]] bool run_until_confirmed() {
    return run_while([this] { return !faults().state(FaultId::discharge_overcurrent).is_present(); });
  }
  [[nodiscard]] bool run_until_open() {
    return run_while([this] { return run.core().sequence().phase != Phase::open; });
  }
  /// Of the faults that open, at once or after a grace, the one that was confirmed first.
  [[nodiscard]] FaultId first_fault() const {
    const FaultRow* first = nullptr;
    for (const FaultRow& row : fault_table()) {
      if (!faults().state(row.id).is_present() || row.reaction < Reaction::open_after_grace) continue;
      if (first == nullptr || confirmed_at(row.id) < confirmed_at(first->id)) first = &row;
    }
    REQUIRE(first != nullptr);
    return first->id;
  }
  [[nodiscard]] Duration waited() const { return run.core().last_opening().at - confirmed_at(first_fault()); }
  [[nodiscard]] const FaultMemory& faults() const { return run.core().faults(); }
  [[nodiscard]] TimePoint confirmed_at(FaultId id) const { return faults().state(id).confirmed_at; }

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
  // From about 400 A on the voltages of cells and link collapse, and the cells warm by kelvins a second.
  const double share = GENERATE(2.0, 5.4, 7.0, 9.4, 13.3);
  CAPTURE(name, share);
  Shorted pack(name, "{}", share);
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
  CHECK(core.last_opening().fault == pack.first_fault());
  CHECK(core.faults().state(FaultId::discharge_overcurrent).is_present());
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
