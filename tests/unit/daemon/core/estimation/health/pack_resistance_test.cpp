// Resistance of a pack, and its worst cell.
#include "daemon/core/estimation/health/pack_resistance.hpp"

#include <array>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

ResistanceEstimate cell_of(double resistance_mOhm, double sigma_mOhm = 0.1) {
  return {true, resistance_mOhm * 1e-3, sigma_mOhm * 1e-3};
}

}  // namespace

TEST_CASE("a pack's resistance is its cells' together, and so is what it may be off by",
          "[unit][estimators][BMS_F.6]") {
  const std::array cells{cell_of(2.0), cell_of(2.5, 0.3), cell_of(1.5)};
  const PackResistance pack = pack_resistance(cells);
  CHECK(pack.is_known);
  CHECK(pack.resistance_Ohm == Approx(0.006));
  CHECK(pack.sigma_Ohm == Approx(0.0005));
  CHECK(pack.worst_cell == 1);
  CHECK(pack.worst_permille == 1250);
}

TEST_CASE("a cell of twice the average is told from one just above and just below it", "[unit][estimators][BMS_F.7]") {
  // Nine of 1 mOhm and one of x: 10 x / (9 + x) is 2 at 2.25.
  const auto worst_permille = [](double resistance_mOhm) {
    std::array<ResistanceEstimate, 10> cells{};
    cells.fill(cell_of(1.0));
    cells[7] = cell_of(resistance_mOhm);
    const PackResistance pack = pack_resistance(cells);
    CHECK(pack.worst_cell == 7);
    return pack.worst_permille;
  };
  CHECK(worst_permille(2.25) == 2000);
  CHECK(worst_permille(2.253) == 2002);
  CHECK(worst_permille(2.247) == 1998);
}

TEST_CASE("of equals the first is the worst", "[unit][estimators][BMS_F.7]") {
  const std::array cells{cell_of(1.0), cell_of(2.0), cell_of(2.0)};
  CHECK(pack_resistance(cells).worst_cell == 1);
}

TEST_CASE("before every cell is known nothing is known of the pack", "[unit][estimators][BMS_F.6]") {
  const std::array cells{cell_of(2.0), ResistanceEstimate{}, cell_of(9.0)};
  const PackResistance pack = pack_resistance(cells);
  CHECK_FALSE(pack.is_known);
  CHECK(pack.resistance_Ohm == 0.0);
  CHECK(pack.worst_permille == 0);
  CHECK_FALSE(pack_resistance({}).is_known);
}
