// Upper bound of the polarisation, compared with the RC elements themselves for arbitrary currents.
#include "daemon/core/balancing/polarisation.hpp"

#include "mmu/devices/random.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

CellModel two_pairs() {
  CellModel cell;
  cell.rc_resistance_Ohm = 0.001;
  cell.rc_time_constant_s = 30.0;
  cell.slow_rc_resistance_Ohm = 0.002;
  cell.slow_rc_time_constant_s = 600.0;
  return cell;
}

Measured<std::int32_t> measured(std::int32_t current_mA, TimePoint at) {
  return {current_mA, at, Validity::valid};
}

}  // namespace

TEST_CASE("what follows a current late rises at once and falls as slowly as its pair", "[unit][estimators]") {
  PolarisationBound bound;
  bound.init(two_pairs(), 50'000);
  TimePoint now{10s};
  bound.update(now, measured(-10'000, now));
  CHECK(bound.most_uV() == Approx(30'000.0));
  now += 600s;
  bound.update(now, measured(0, now));
  CHECK(bound.most_uV() == Approx(20'000.0 * std::exp(-1.0) + 10'000.0 * std::exp(-20.0)));
}

TEST_CASE("a current that is not known any more counts as the largest", "[unit][estimators]") {
  PolarisationBound bound;
  bound.init(two_pairs(), 50'000);
  bound.update(TimePoint{8s}, {});  // before the first sensor value
  CHECK(bound.most_uV() == 0.0);
  bound.update(TimePoint{9s}, measured(0, TimePoint{9s}));
  CHECK(bound.most_uV() == 0.0);
  bound.update(TimePoint{10s}, {});
  CHECK(bound.most_uV() == Approx(150'000.0));
}

TEST_CASE("no current brings a pair beyond its bound", "[unit][estimators]") {
  const CellModel cell = two_pairs();
  PolarisationBound bound;
  bound.init(cell, 50'000);
  RandomSource random(17);
  TimePoint now{10s};
  double fast_uV = 0.0;
  double slow_uV = 0.0;
  std::int32_t current_mA = 0;
  for (int count = 0; count < 50'000; ++count) {
    now += 100ms;
    if (random.next() % 100 == 0) current_mA = random.within(50'000);
    bound.update(now, measured(current_mA, now));
    fast_uV += (cell.rc_resistance_Ohm * current_mA * 1e3 - fast_uV) * 0.1 / cell.rc_time_constant_s;
    slow_uV += (cell.slow_rc_resistance_Ohm * current_mA * 1e3 - slow_uV) * 0.1 / cell.slow_rc_time_constant_s;
    REQUIRE(std::abs(fast_uV + slow_uV) <= bound.most_uV() + 1.0);
  }
}
