// SOC methods of one cell in parallel: fed with the same samples, and compared.
#include "daemon/core/estimation/soc/cell_estimate.hpp"

#include <memory>

#include "daemon/core/estimation/soc/cells_of_model.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/plain_cell.hpp"

using namespace bmu;
using test::plain_cell;
using test::plain_ends;
using test::plain_sample;

namespace {

constexpr CurrentSensorError sensor{.gain = 0.01, .offset_A = 0.001, .unknown_current_A = 1.0};

}  // namespace

TEST_CASE("before it has begun a cell is not known and takes nothing in", "[unit][estimators]") {
  CellEstimate cell;
  CHECK_FALSE(cell.is_begun());
  CHECK_FALSE(cell.update(plain_sample(4.0, -0.01, 30.0), plain_ends).has_value());
  for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
    CHECK_FALSE(cell.estimate(method).is_known);
  }
  CHECK(cell.disagreement() == 0.0);
}

TEST_CASE("all methods are fed, and each says its own", "[unit][estimators]") {
  const CellDynamics model = plain_cell();
  CellEstimate cell;
  cell.begin(model, sensor, {.soc = 0.5, .sigma = 0.1}, 25.0);
  REQUIRE(cell.is_begun());
  // Half an hour of 0.1 A takes 5 %; the voltage corresponds to 60 % all the time.
  for (int minute = 0; minute < 30; ++minute)
    CHECK_FALSE(cell.update(plain_sample(3.595, 0.1, 60.0), plain_ends).has_value());
  CHECK(cell.estimate(SocMethod::coulomb).soc == Approx(0.45).margin(0.001));
  CHECK(cell.estimate(SocMethod::mixed).soc == Approx(0.45).margin(0.001));
  CHECK(cell.estimate(SocMethod::ekf).soc > 0.55);
  cell.forget();
  CHECK_FALSE(cell.is_begun());
  CHECK_FALSE(cell.estimate(SocMethod::coulomb).is_known);
}

TEST_CASE("the end of a charge sets all of them", "[unit][estimators]") {
  const CellDynamics model = plain_cell();
  CellEstimate cell;
  cell.begin(model, sensor, {.soc = 0.8, .sigma = 0.1}, 25.0);
  CHECK(cell.update(plain_sample(4.0, -0.02, 20.0), plain_ends).has_value());
  CHECK(cell.estimate(SocMethod::coulomb).soc == 1.0);
  CHECK(cell.estimate(SocMethod::mixed).soc == 1.0);
  CHECK(cell.estimate(SocMethod::ekf).soc == Approx(1.0).margin(0.01));
  for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
    CHECK(cell.estimate(method).sigma < 0.02);
  }
}

TEST_CASE("methods contradict each other when they are further apart than twice what both may be wrong by",
          "[unit][estimators]") {
  const CellDynamics model = plain_cell();
  CellEstimate cell;
  cell.begin(model, sensor, {.soc = 0.5, .sigma = 0.02}, 25.0);
  CHECK(cell.disagreement() < 0.1);
  // The voltage stays at 60 %, the counters at a half.
  for (int second = 0; second < 3'000; ++second)
    CHECK_FALSE(cell.update(plain_sample(3.6, 0.0), plain_ends).has_value());
  const SocEstimate filter = cell.estimate(SocMethod::ekf);
  const SocEstimate counter = cell.estimate(SocMethod::coulomb);
  CHECK(cell.disagreement() == Approx((filter.soc - counter.soc) / (2.0 * std::hypot(filter.sigma, counter.sigma))));
  CHECK(cell.disagreement() > 1.0);
}

using Cells = CellsOfModel<CellDynamics, CellEstimate>;

TEST_CASE("a copy of the cells looks at its own tables", "[unit][estimators]") {
  auto cells = std::make_unique<Cells>();
  cells->init(plain_cell());
  (*cells)[3].begin(cells->model(), sensor, {.soc = 0.5, .sigma = 0.1}, 25.0);
  const auto copy = std::make_unique<Cells>(*cells);
  auto assigned = std::make_unique<Cells>();
  *assigned = *cells;
  cells.reset();
  for (Cells* one : {copy.get(), assigned.get()}) {
    for (int minute = 0; minute < 30; ++minute) {
      CHECK_FALSE((*one)[3].update(plain_sample(3.45, 0.1, 60.0), plain_ends).has_value());
    }
    CHECK((*one)[3].estimate(SocMethod::coulomb).soc == Approx(0.45).margin(0.001));
    CHECK((*one)[3].estimate(SocMethod::mixed).soc == Approx(0.45).margin(0.001));
    CHECK((*one)[3].estimate(SocMethod::ekf).soc == Approx(0.45).margin(0.02));
    CHECK_FALSE((*one)[2].is_begun());
    one->init(plain_cell());
    CHECK_FALSE((*one)[3].is_begun());
  }
}
