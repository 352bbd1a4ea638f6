// Resistance by the 2013 method from single current steps.
#include "daemon/core/estimation/health/step_average.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

TEST_CASE("a resistance is the first step's, and then a quarter of each that follows", "[unit][estimators][BMS_F.6]") {
  StepAverage average;
  average.take(80'000, 40'000, 2'000);
  CHECK(average.resistance_uOhm == 2'000);
  average.take(-96'000, -40'000, 2'000);  // a step down counts equally
  CHECK(average.resistance_uOhm == 2'100);
  CHECK_FALSE(average.is_known());
  average.take(84'000, 40'000, 2'000);
  CHECK(average.is_known());
  CHECK(average.resistance_uOhm == 2'100);
  for (int step = 0; step < 300; ++step) average.take(84'000, 40'000, 2'000);
  CHECK(average.is_known());
}

TEST_CASE("steps that say nothing of a cell are passed over", "[unit][estimators][BMS_F.6]") {
  StepAverage average;
  average.take(0, 40'000, 2'000);
  average.take(-1'000, 40'000, 2'000);     // the voltage rose with the current
  average.take(1'600'040, 40'000, 2'000);  // 40.001 mOhm, for a cell of 2
  CHECK(average.steps == 0);
  average.take(1'600'000, 40'000, 2'000);
  CHECK(average.steps == 1);
  CHECK(average.resistance_uOhm == 40'000);
  average.take(40, 40'000, 2'000);  // 1 uOhm is still valid
  CHECK(average.steps == 2);
}
