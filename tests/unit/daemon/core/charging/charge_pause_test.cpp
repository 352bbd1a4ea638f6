// Short pause of a charge at a fixed state of charge.
#include "daemon/core/charging/charge_pause.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr std::int32_t charging_mA = -10'000;

/// 20 Ah: a current counts as a charge from 1 A.
CoreConfig pausing_at(std::int32_t soc_permille) {
  CoreConfig config;
  config.cell.capacity_uAs = 20 * uAs_per_Ah;
  config.soc.resistance_pause_permille = soc_permille;
  config.soc.resistance_pause = 5s;
  return config;
}

class Bench {
 public:
  explicit Bench(std::int32_t at_permille = 500) { pause_.init(pausing_at(at_permille)); }

  /// Runs for this time with ten updates a second; returns how long the charge was paused.
  Duration run(Duration duration, std::optional<std::int32_t> soc_permille, std::int32_t current_mA,
               bool is_closed = true) {
    Duration paused{};
    for (const TimePoint end = now_ + duration; now_ < end; now_ += 100ms) {
      pause_.update({.now = now_,
                     .is_closed = is_closed,
                     .soc_permille = soc_permille,
                     .current_mA = {current_mA, now_, Validity::valid},
                     .is_resistance_known = is_resistance_known});
      if (pause_.is_pausing()) paused += 100ms;
    }
    return paused;
  }
  bool is_resistance_known = true;
  [[nodiscard]] ChargePause& pause() { return pause_; }
  [[nodiscard]] TimePoint now() const { return now_; }

 private:
  ChargePause pause_;
  TimePoint now_{1h};
};

}  // namespace

TEST_CASE("a charge pauses once where the pack file says", "[unit][charge_pause][BMS_F.6]") {
  Bench bench;
  CHECK(bench.run(100s, 450, charging_mA) == 0s);
  CHECK(bench.run(100s, 499, charging_mA) == 0s);
  CHECK(bench.run(10s, 500, charging_mA) == 5s);
  CHECK(bench.run(200s, 510, charging_mA) == 0s);
  CHECK(bench.run(200s, 451, charging_mA) == 0s);
  CHECK(bench.run(200s, 500, charging_mA) == 0s);
  CHECK(bench.run(10s, 450, 10'000) == 0s);  // discharged, and charged again
  CHECK(bench.run(100s, 500, charging_mA) == 5s);
}

TEST_CASE("a pause repeats after 8 s of charging while a resistance is unknown", "[unit][charge_pause][RES_1]") {
  Bench bench;
  bench.is_resistance_known = false;
  CHECK(bench.run(100s, 450, charging_mA) == 0s);
  CHECK(bench.run(5s, 500, charging_mA) == 5s);
  CHECK(bench.run(7s, 500, charging_mA) == 0s);
  CHECK(bench.run(10s, 500, charging_mA) == 5s);
  SECTION("not once it is known") {
    bench.is_resistance_known = true;
    CHECK(bench.run(200s, 505, charging_mA) == 0s);
    bench.is_resistance_known = false;
    CHECK(bench.run(1s, 505, charging_mA) == 1s);
  }
  SECTION("thirty times") {
    CHECK(bench.run(1h, 549, charging_mA) == 28 * 5s);
  }
  SECTION("not far above the place") {
    CHECK(bench.run(200s, 550, charging_mA) == 0s);
    CHECK(bench.run(1s, 549, charging_mA) == 1s);
  }
  SECTION("thirty times again after the charge has been below") {
    CHECK(bench.run(1h, 549, charging_mA) == 28 * 5s);
    CHECK(bench.run(10s, 450, charging_mA) == 0s);
    CHECK(bench.run(1h, 500, charging_mA) == 30 * 5s);
  }
  SECTION("after a break not before it has charged for as long") {
    CHECK(bench.run(100s, 500, 0) == 0s);
    CHECK(bench.run(8s, 500, charging_mA) == 0s);
    CHECK(bench.run(1s, 500, charging_mA) == 1s);
  }
}

TEST_CASE("without a place in the pack file nothing pauses", "[unit][charge_pause]") {
  Bench bench(0);
  CHECK(bench.run(100s, 0, charging_mA) == 0s);
  CHECK(bench.run(100s, 500, charging_mA) == 0s);
}

TEST_CASE("only a charge that has lasted is paused", "[unit][charge_pause]") {
  Bench bench;
  CHECK(bench.run(10s, 400, charging_mA) == 0s);
  SECTION("a minute later, not sooner") {
    CHECK(bench.run(50s, 500, charging_mA) == 0s);
    CHECK(bench.run(10s, 500, charging_mA) == 5s);
  }
  SECTION("not a trickle") {
    CHECK(bench.run(200s, 500, -999) == 0s);
    CHECK(bench.run(100s, 500, -1'000) == 5s);
  }
  SECTION("not while it is open or discharged") {
    CHECK(bench.run(200s, 500, charging_mA, false) == 0s);
    CHECK(bench.run(200s, 500, 10'000) == 0s);
  }
  SECTION("an interruption begins the minute anew") {
    CHECK(bench.run(49s, 500, charging_mA) == 0s);
    CHECK(bench.run(1s, 500, 0) == 0s);
    CHECK(bench.run(60s, 500, charging_mA) == 0s);
    CHECK(bench.run(10s, 500, charging_mA) == 5s);
  }
}

TEST_CASE("a charge or a current that is not known pauses nothing", "[unit][charge_pause]") {
  Bench bench;
  CHECK(bench.run(100s, 400, charging_mA) == 0s);
  CHECK(bench.run(100s, std::nullopt, charging_mA) == 0s);
  bench.pause().update({.now = bench.now(), .is_closed = true, .soc_permille = 500});
  CHECK_FALSE(bench.pause().is_pausing());
}

TEST_CASE("a pack that opens ends the pause", "[unit][charge_pause]") {
  Bench bench;
  CHECK(bench.run(100s, 400, charging_mA) == 0s);
  CHECK(bench.run(1s, 500, charging_mA) == 1s);
  CHECK(bench.run(1s, 500, 0, false) == 0s);
  CHECK(bench.run(100s, 500, charging_mA) == 0s);
}

TEST_CASE("begun above the place it waits for the next time", "[unit][charge_pause]") {
  Bench bench;
  CHECK(bench.run(200s, 600, charging_mA) == 0s);
}
