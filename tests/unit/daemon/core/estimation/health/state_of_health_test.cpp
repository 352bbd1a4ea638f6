// SOH of a cell by capacity and by resistance.
#include "daemon/core/estimation/health/state_of_health.hpp"

#include <limits>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("health by capacity is what it holds of what it was rated for", "[unit][estimators][FS_5][BMU_7]") {
  const HealthFigure figure = health_by_capacity(7'200.0 * 0.8765, 72.0, 7'200.0);
  CHECK(figure.is_known);
  CHECK(figure.permille == 877);
  CHECK(figure.sigma_permille == 10);
  CHECK(health_by_capacity(7'560.0, 0.0, 7'200.0).permille == 1'050);
  CHECK(health_by_capacity(1.0, 0.0, 7'200.0).permille == 0);
  CHECK(health_by_capacity(7'200.0, 8'000.0, 7'200.0).sigma_permille == 1'000);
}

TEST_CASE("a capacity that is none has no health", "[unit][estimators][FS_5]") {
  for (const double wrong : {0.0, -1.0, not_measured, infinite}) {
    CAPTURE(wrong);
    CHECK_FALSE(health_by_capacity(wrong, 1.0, 7'200.0).is_known);
    CHECK_FALSE(health_by_capacity(7'200.0, 1.0, wrong).is_known);
  }
  CHECK_FALSE(health_by_capacity(7'200.0, -1.0, 7'200.0).is_known);
  CHECK_FALSE(health_by_capacity(7'200.0, not_measured, 7'200.0).is_known);
  CHECK(health_by_capacity(7'200.0, infinite, 7'200.0).sigma_permille == 1'000);
  CHECK(health_by_capacity(10'800.0, 1.0, 7'200.0).is_known);
  CHECK_FALSE(health_by_capacity(10'801.0, 1.0, 7'200.0).is_known);
  CHECK(health_by_capacity(not_measured, 1.0, 7'200.0).permille == 0);
}

TEST_CASE("health by resistance is what is left of the way to the end of life", "[unit][estimators][FS_5]") {
  const HealthFigure figure = health_by_resistance(0.4, 0.05);
  CHECK(figure.is_known);
  CHECK(figure.permille == 600);
  CHECK(figure.sigma_permille == 50);
  CHECK(health_by_resistance(0.0, 0.0).permille == 1'000);
  CHECK(health_by_resistance(-0.2, 0.0).permille == 1'000);  // not better than new
  CHECK(health_by_resistance(1.0, 0.0).permille == 0);
  CHECK(health_by_resistance(1.7, 0.0).permille == 0);
  const HealthFigure slow = health_by_resistance(0.4, 0.05, 1.5);
  CHECK(slow.permille == 200);
  CHECK(slow.sigma_permille == 100);
}

TEST_CASE("a resistance that is none has no health", "[unit][estimators][FS_5]") {
  for (const double wrong : {not_measured, infinite, -1.01}) {
    CAPTURE(wrong);
    CHECK_FALSE(health_by_resistance(wrong, 0.1).is_known);
  }
  CHECK(health_by_resistance(-1.0, 0.1).is_known);
  for (const double wrong : {1.0, 0.5, not_measured, infinite}) {
    CHECK_FALSE(health_by_resistance(0.1, 0.1, wrong).is_known);
  }
  CHECK(health_by_resistance(0.1, 0.1, 1.01).is_known);
  CHECK_FALSE(health_by_resistance(0.1, -0.1).is_known);
  CHECK_FALSE(health_by_resistance(0.1, not_measured).is_known);
}
