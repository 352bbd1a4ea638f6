// Model values that many cells share are computed once, without any effect on the results.
#include "daemon/core/estimation/soc/model_memo.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "daemon/core/estimation/soc/cell_estimate.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using bmu::test::Chance;

TEST_CASE("a memo asks once for what is equal, and always for what is no number", "[unit][estimators]") {
  Memo<double, int> memo;
  int asked = 0;
  const auto ask = [&](double with) { return memo.of(with, [&] { return ++asked; }); };
  CHECK(ask(1.0) == 1);
  CHECK(ask(1.0) == 1);
  CHECK(ask(std::nextafter(1.0, 2.0)) == 2);
  CHECK(ask(1.0) == 3);
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  CHECK(ask(no_number) == 4);
  CHECK(ask(no_number) == 5);
}

namespace {

constexpr std::size_t cells = 3;

struct Cells {
  std::array<CellEstimate, cells> shared;
  std::array<CellEstimate, cells> alone;
};

CellSample sample_of(Chance& chance, double passed_s, double temperature_C) {
  const double current_A = chance.between(-30.0, 30.0);
  return {.passed_s = passed_s,
          .mean_current_A = chance.one_in(20) ? not_measured : current_A,
          .current_A = current_A,
          .voltage_V = chance.one_in(10) ? not_measured : chance.between(3.0, 4.2),
          .temperature_C = chance.one_in(10) ? not_measured : temperature_C};
}

void check_same(const CellEstimate& one, const CellEstimate& other) {
  for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
    REQUIRE(one.estimate(method).soc == other.estimate(method).soc);
    REQUIRE(one.estimate(method).sigma == other.estimate(method).sigma);
  }
  REQUIRE(one.filter().misfit() == other.filter().misfit());
}

void live(std::uint64_t seed) {
  const CellDynamics model = test::sloped_cell();
  const ChargeEndConfig ends = charge_ends_of(model);
  Chance chance(seed);
  ModelMemo memo;
  Cells all;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const SocBegin begin{.soc = chance.even(), .sigma = chance.between(0.01, 0.3), .is_rested = chance.one_in(2)};
    all.shared[cell].begin(model, {}, begin, 25.0);
    all.alone[cell].begin(model, {}, begin, 25.0);
  }
  double temperature_C = 25.0;
  for (int step = 0; step < 400; ++step) {
    const double passed_s = chance.one_in(3) ? 0.1 : chance.between(0.001, 20.0);
    for (std::size_t cell = 0; cell < cells; ++cell) {
      if (chance.one_in(2)) temperature_C = chance.between(-30.0, 60.0);
      const CellSample sample = sample_of(chance, passed_s, temperature_C);
      const bool has_ended = all.shared[cell].update(sample, ends, memo).has_value();
      REQUIRE(has_ended == all.alone[cell].update(sample, ends).has_value());
      check_same(all.shared[cell], all.alone[cell]);
    }
  }
}

}  // namespace

TEST_CASE("cells that share a memo are estimated as cells that do not, to the last bit", "[unit][estimators]") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    live(seed);
  }
}
