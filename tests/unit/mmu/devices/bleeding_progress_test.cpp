// Cells that bleeding does not discharge.
#include "mmu/devices/bleeding_progress.hpp"

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

constexpr CellMask second = cell_bit(1);

CellReading second_above(std::int32_t by_uV) {
  CellReading reading;
  reading.cell_voltage_uV.fill(3'600'000);
  reading.cell_voltage_uV[1] += by_uV;
  reading.measured = first_cells(mmu_cells_max);
  return reading;
}

int rounds_of_second(BleedingProgress& progress, std::int32_t surplus_uV, std::int32_t less_each_round_uV) {
  int rounds = 0;
  while (rounds < 1'000 && surplus_uV > 0 && progress.begin_round(second, second_above(surplus_uV)) != 0) {
    ++rounds;
    surplus_uV -= less_each_round_uV;
  }
  return rounds;
}

TEST_CASE("a cell that does not come down gets ten rounds", "[unit][mmu][MMU_AB]") {
  BleedingProgress progress;
  CHECK(rounds_of_second(progress, 20'000, 0) == 10);
  CHECK(progress.hopeless() == second);
  CHECK(progress.begin_round(second, second_above(1'000)) == 0);  // still given up
}

TEST_CASE("one that comes down a millivolt within ten rounds is bled to the end", "[unit][mmu][MMU_AB]") {
  BleedingProgress fast;
  CHECK(rounds_of_second(fast, 20'000, 2'000) == 10);
  CHECK(fast.hopeless() == 0);
  BleedingProgress slow;
  CHECK(rounds_of_second(slow, 20'000, 100) == 200);
  CHECK(slow.hopeless() == 0);
  BleedingProgress too_slow;
  CHECK(rounds_of_second(too_slow, 20'000, 99) == 10);
}

TEST_CASE("noise is no progress for long", "[unit][mmu][MMU_AB]") {
  BleedingProgress progress;
  int rounds = 0;
  while (rounds < 1'000 && progress.begin_round(second, second_above(20'000 + rounds % 7 * 500)) != 0) ++rounds;
  CHECK(rounds <= 20);
}

TEST_CASE("each cell has a count of its own", "[unit][mmu][MMU_AB]") {
  BleedingProgress progress;
  CellReading reading = second_above(20'000);
  reading.cell_voltage_uV[4] += 15'000;
  for (int round = 0; round < 10; ++round) {
    reading.cell_voltage_uV[4] -= 1'000;
    CHECK(progress.begin_round(second | cell_bit(4), reading) == (second | cell_bit(4)));
  }
  reading.cell_voltage_uV[4] -= 1'000;
  CHECK(progress.begin_round(second | cell_bit(4), reading) == cell_bit(4));
  CHECK(progress.hopeless() == second);
}

}  // namespace
}  // namespace bmu
