// Loads that rise and fall over seconds, without a step, with the packs as shipped: whether the current sensor agrees
// with the cells.
#include <array>
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

CoreConfig pack_file(const std::string& name) {
  auto pack = load_pack_config(test::in_source("config/packs/" + name));
  REQUIRE(pack.has_value());
  return pack->core;
}

bool is_named(const Core& core) {
  return core.faults().state(FaultId::current_contradicts_voltage).is_present();
}

/// Changes the load linearly, until the fault is present at the latest.
void swell(WiredPack& pack, double from_A, double to_A, Duration span) {
  constexpr Duration step = 50ms;
  for (Duration at = step; at <= span && !is_named(pack.core()); at += step) {
    const double share = static_cast<double>(at.count()) / static_cast<double>(span.count());
    pack.apply("load current_A " + std::to_string(from_A + (to_A - from_A) * share));
    pack.run(step);
  }
}

constexpr std::array packs{"i3-96s.json", "outlander-80s.json", "lfp-96s.json", "demo-48s.json", "traction-16x12.json"};

/// Half of the continuous discharge current: no other limit is near.
double load_A(const CoreConfig& config) {
  return config.current.discharge_continuous_mA / 2e3;
}

}  // namespace

TEST_CASE("a sensor the wrong way round, or at zero for ever, is named while the load swells",
          "[scenario][estimators][F18][F12]") {
  for (const std::string name : packs) {
    for (const std::string fault : {"sensor current inverted on", "sensor current stuck on"}) {
      CAPTURE(name, fault);
      const CoreConfig config = pack_file(name);
      WiredPack pack(config);
      pack.apply("pack soc_permille 600");
      REQUIRE(pack.close());
      pack.run(8s);
      pack.apply(fault);
      const TimePoint began_at = pack.now();
      swell(pack, 0.0, load_A(config), 10s);
      CHECK(is_named(pack.core()));
      CHECK(pack.now() - began_at < 8s);
      pack.run(500ms);
      CHECK(pack.phase() == Phase::open);
    }
  }
}

/// 5 A above the calm phase, which extends into the load by up to 2 A; as stated in docs/commissioning.md.
constexpr double shown_from_A = 7.0;
constexpr std::array all_packs{"demo-48s.json",      "charger-48s.json",    "lipo-6s-24v.json",     "shell-eco-6s.json",
                               "outlander-80s.json", "traction-16x12.json", "storage-16s-48v.json", "i3-96s.json",
                               "lfp-96s.json",       "fs-20s3p-84v.json"};

TEST_CASE("a sensor the wrong way round is named by a load that swells in 5 s to 7 A, and not to 4",
          "[scenario][estimators][F18]") {
  for (const std::string name : all_packs) {
    for (const double to_A : {4.0, shown_from_A}) {
      CAPTURE(name, to_A);
      WiredPack pack(pack_file(name));
      pack.apply("pack soc_permille 600");
      REQUIRE(pack.close());
      pack.run(8s);
      pack.apply("sensor current inverted on");
      swell(pack, 0.0, to_A, 5s);
      pack.run(3s);
      CHECK(is_named(pack.core()) == (to_A == shown_from_A));
    }
  }
}

TEST_CASE("a sensor that is right stays unsuspected while loads swell and ebb", "[scenario][estimators][slow]") {
  for (const std::string name : packs) {
    CAPTURE(name);
    const CoreConfig config = pack_file(name);
    WiredPack pack(config);
    pack.apply("pack soc_permille 600");
    REQUIRE(pack.close());
    const double high_A = load_A(config);
    pack.run(8s);
    swell(pack, 0.0, high_A, 10s);
    pack.run(8s);
    swell(pack, high_A, 0.0, 10s);
    pack.run(7s);
    swell(pack, 0.0, -high_A / 8.0, 10s);
    pack.run(7s);
    swell(pack, -high_A / 8.0, high_A, 3s);
    swell(pack, high_A, 0.0, 20s);
    pack.run(20s);
    CHECK_FALSE(is_named(pack.core()));
    CHECK(pack.core().faults().state(FaultId::current_contradicts_voltage).count == 0);
    CHECK(pack.phase() == Phase::closed);
  }
}

TEST_CASE("a charger that comes up slowly shows a sensor the wrong way round", "[scenario][estimators][charger][F18]") {
  for (const bool is_reversed : {false, true}) {
    CAPTURE(is_reversed);
    test::SimRun run(pack_file("charger-48s.json"));
    run.apply("pack soc_permille 500");
    if (is_reversed) run.apply("sensor current inverted on");
    run.run_to(10.0);
    run.apply("charger current_A 25");
    run.apply("charger connected");
    run.run_to(70.0);
    CHECK(is_named(run.core()) == is_reversed);
    CHECK(run.core().sequence().phase == (is_reversed ? Phase::open : Phase::closed));
  }
}
