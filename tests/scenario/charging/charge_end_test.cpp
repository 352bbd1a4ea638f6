// The demonstration pack is charged to its end by the emulated charger, which receives its limit once a second in whole
// amperes: the final voltage of the cells, and whether the charger settles.
#include <algorithm>
#include <cmath>
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

struct ChargeEnd {
  std::int32_t highest_uV = 0;
  double last_A = 0.0;
  double rises_A = 0.0;  // sum of all rises of the charger's current after its first fall
  bool stayed_closed = true;
};

/// Runs the charge from its start at 10 s.
ChargeEnd charge(test::SimRun& run, double until_s) {
  ChargeEnd end;
  double before_A = 0.0;
  bool has_fallen = false;
  for (double at_s = 10.0; at_s < until_s; at_s += 0.1) {
    run.run_to(at_s);
    const double now_A = run.simulator().plant().charger_A();
    end.highest_uV = std::max(end.highest_uV, run.core().pack().cell_voltage_uV.max);
    end.stayed_closed = end.stayed_closed && run.core().sequence().phase == Phase::closed;
    has_fallen = has_fallen || now_A < before_A - 0.5;
    if (has_fallen) end.rises_A += std::max(now_A - before_A, 0.0);
    before_A = now_A;
  }
  end.last_A = before_A;
  return end;
}

}  // namespace

TEST_CASE("a charge ends below the opening voltage, and the charger comes to rest",
          "[scenario][charger][slow][BMU_13]") {
  const auto pack = load_pack_config(test::in_source("config/packs/demo-48s.json"));
  REQUIRE(pack.has_value());
  const int temperature_dC = GENERATE(250, 120);
  CAPTURE(temperature_dC);
  test::SimRun run(pack->core);
  run.run_to(0.1);
  run.apply("pack soc_permille 980");
  run.apply("pack temperature_dC " + std::to_string(temperature_dC));
  run.run_to(2.5);
  run.apply("charger connected");
  run.run_to(9.0);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  run.apply("charger current_A 20");
  const ChargeEnd end = charge(run, 900.0);
  CAPTURE(end.highest_uV, end.last_A, end.rises_A);
  CHECK(end.stayed_closed);
  CHECK(end.highest_uV > 4'190'000);
  CHECK(end.highest_uV < 4'226'000);  // held at 4.2225 V, opened at 4.2300 V
  CHECK(end.last_A < 3.0);
  CHECK(end.rises_A < 3.0);
}
