// Published state of charge: it follows the current and never steps.
#include "daemon/core/estimation/soc/published_soc.hpp"

#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Published SOC after its start phase.
PublishedSoc settled(double soc) {
  PublishedSoc told;
  told.begin(soc);
  for (int second = 0; second < 301; ++second) told.update(1.0, 0.0, soc);
  return told;
}

}  // namespace

TEST_CASE("what is told follows the current at once", "[unit][estimators]") {
  PublishedSoc told = settled(0.5);
  CHECK(told.soc() == 0.5);
  told.update(1.0, 0.01, 0.49);
  CHECK(told.soc() == Approx(0.49));
  told.update(1.0, -0.03, 0.52);
  CHECK(told.soc() == Approx(0.52));
}

TEST_CASE("what is told goes to the estimate by 0.02 % a second, either way, and stops there", "[unit][estimators]") {
  PublishedSoc told = settled(0.5);
  told.update(1.0, 0.0, 0.9);
  CHECK(told.soc() == Approx(0.5002));
  told.update(0.1, 0.0, 0.1);
  CHECK(told.soc() == Approx(0.50018));
  for (int second = 0; second < 499; ++second) told.update(1.0, 0.0, 0.6);
  CHECK(told.soc() == Approx(0.50018 + 499.0 * 0.0002));
  for (int second = 0; second < 2; ++second) told.update(1.0, 0.0, 0.6);
  CHECK(told.soc() == 0.6);
}

TEST_CASE("both at once: what flowed, and the way to the estimate", "[unit][estimators]") {
  PublishedSoc told = settled(0.5);
  for (int second = 0; second < 100; ++second) told.update(1.0, 0.001, 0.0);
  CHECK(told.soc() == Approx(0.5 - 100.0 * 0.0012));
}

TEST_CASE("a young one may go 2 % a second for 300 s", "[unit][estimators]") {
  PublishedSoc told;
  told.begin(0.2);
  told.update(1.0, 0.0, 0.9);
  CHECK(told.soc() == Approx(0.22));
  told.update(298.5, 0.0, 0.22);
  told.update(0.5, 0.0, 0.9);
  CHECK(told.soc() == Approx(0.23));
  told.update(0.5, 0.0, 0.9);
  CHECK(told.soc() == Approx(0.2301));
  told.begin(0.4);  // starts its start phase again
  told.update(1.0, 0.0, 0.9);
  CHECK(told.soc() == Approx(0.42));
}

TEST_CASE("what is told lies between empty and full", "[unit][estimators]") {
  PublishedSoc told = settled(0.01);
  told.update(1.0, 0.5, 0.0);
  CHECK(told.soc() == 0.0);
  told.update(1.0, -3.0, 1.0);
  CHECK(told.soc() == 1.0);
}

TEST_CASE("an estimate that is none does not move what is told", "[unit][estimators]") {
  for (const double bad : {unknown, infinite, -infinite}) {
    CAPTURE(bad);
    PublishedSoc told = settled(0.5);
    told.update(1.0, 0.01, bad);
    CHECK(told.soc() == Approx(0.49));
    told.update(1.0, bad, 0.49);
    CHECK(told.soc() == Approx(0.49));
    told.update(1.0, 0.0, 0.9);
    CHECK(told.soc() == Approx(0.4902));
  }
}

TEST_CASE("no passing of time makes what is told step", "[unit][estimators]") {
  for (const double passed_s : {0.0, -1.0, -1e9, -infinite, infinite, unknown}) {
    CAPTURE(passed_s);
    PublishedSoc told = settled(0.5);
    told.update(passed_s, 0.0, 0.9);
    CHECK(told.soc() == 0.5);
    told.update(1.0, 0.0, 0.9);  // its age is unchanged
    CHECK(told.soc() == Approx(0.5002));
  }
}

TEST_CASE("whatever the estimates do, what is told moves by its rate and what flowed", "[unit][estimators]") {
  constexpr std::uint64_t seed = 20;
  CAPTURE(seed);
  test::Chance chance(seed);
  PublishedSoc told = settled(0.5);
  double before = told.soc();
  for (int turn = 0; turn < 20'000; ++turn) {
    const double passed_s = chance.between(0.05, 2.0);
    const double flowed = chance.between(-0.001, 0.001);
    const double estimate = chance.one_in(50.0) ? unknown : chance.between(-0.5, 1.5);
    told.update(passed_s, flowed, estimate);
    REQUIRE(std::abs(told.soc() - before) <= 0.0002 * passed_s + std::abs(flowed) + 1e-12);
    REQUIRE((told.soc() >= 0.0 && told.soc() <= 1.0));
    before = told.soc();
  }
}
