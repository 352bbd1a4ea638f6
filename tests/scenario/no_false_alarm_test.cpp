// The shipped packs in use: checks of one measurement against another must not raise false alarms in steps, pauses and
// relaxation, nor in a charge that ends at a constant voltage.
#include <algorithm>
#include <string>

#include "config/pack_config.hpp"
#include "mmu/devices/random.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

constexpr const char* shipped[] = {"charger-48s", "demo-48s",      "fs-20s3p-84v", "i3-96s",          "lfp-96s",
                                   "lipo-6s-24v", "outlander-80s", "shell-eco-6s", "storage-16s-48v", "traction-16x12"};

CoreConfig config_of(const char* name) {
  auto read = load_pack_config(test::in_source(std::string("config/packs/") + name + ".json"));
  REQUIRE(read.has_value());
  return read->core;
}

/// No fault of the checks that compare, neither confirmed nor pending for some time.
bool is_quiet(const Core& core) {
  return !core.faults().state(FaultId::stuck_values).is_present() &&
         !core.faults().state(FaultId::stuck_values).is_warning &&
         core.faults().state(FaultId::current_contradicts_voltage).stage == FaultStage::good;
}

}  // namespace

TEST_CASE("steps, pauses and steady loads of every shipped pack are no contradiction", "[scenario][slow]") {
  for (const char* const name : shipped) {
    DYNAMIC_SECTION(name) {
      const CoreConfig config = config_of(name);
      test::SimRun run(config);
      run.apply("pack soc_permille 700");
      run.run_to(3);
      run.apply("vehicle on");
      run.run_to(9);
      REQUIRE(run.core().sequence().phase == Phase::closed);
      RandomSource random(7);
      const double full_A = config.current.discharge_continuous_mA * 0.9e-3;
      const double back_A = config.current.charge_continuous_mA * 0.5e-3;
      // For 400 s, or while the charge lasts.
      const double charge_As = static_cast<double>(config.cell.capacity_uAs) * 1e-6;
      const double until = 9 + std::min(400.0, 0.2 * charge_As / (0.35 * full_A));
      for (double at = 9; at < until;) {
        const double share = static_cast<double>(random.next() % 1'001) / 1e3;
        const bool is_back = random.next() % 4 == 0;
        run.apply("load current_A " + std::to_string(is_back ? -back_A * share : full_A * share));
        constexpr double pauses_s[] = {0.13, 0.4, 1.1, 3.3, 5.2, 9.0};
        at += pauses_s[random.next() % 6];
        run.run_to(at);
        REQUIRE(is_quiet(run.core()));
      }
      INFO("opened for " << row_of(run.core().last_opening().fault).name);
      CHECK(run.core().sequence().phase == Phase::closed);
    }
  }
}

TEST_CASE("cells that a charger holds at its voltage are not stuck", "[scenario]") {
  const CoreConfig config = config_of("lipo-6s-24v");
  test::SimRun run(config);
  run.apply("pack soc_permille 985");
  run.apply("charger current_A 3");
  run.apply("charger obeys nobody");  // its own voltage holds the cells
  run.run_to(3);
  run.apply("charger connected");
  run.run_to(9);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  for (int second = 9; second < 400; ++second) {
    run.run_to(second);
    REQUIRE(is_quiet(run.core()));
  }
}
