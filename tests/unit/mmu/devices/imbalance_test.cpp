// Counting of cells above the lowest of their module.
#include "mmu/devices/imbalance.hpp"

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

constexpr std::int32_t lowest_uV = 3'600'000;

/// Reading with equal cells, except the second.
CellReading second_above(std::int32_t by_uV) {
  CellReading reading;
  reading.cell_voltage_uV.fill(lowest_uV);
  reading.cell_voltage_uV[1] += by_uV;
  reading.measured = first_cells(mmu_cells_max);
  return reading;
}

ImbalanceWatch watch_at_rest() {
  ImbalanceWatch watch;
  watch.check(second_above(0));  // a switch may have been on in the first window
  return watch;
}

void check_times(ImbalanceWatch& watch, const CellReading& reading, int times) {
  for (int time = 0; time < times; ++time) watch.check(reading);
}

TEST_CASE("more than 5 mV above the lowest in more than 50 checks in a row", "[unit][mmu][MMU_IMB]") {
  ImbalanceWatch watch = watch_at_rest();
  check_times(watch, second_above(5'001), 50);
  CHECK(watch.cells() == 0);
  CHECK_FALSE(watch.is_decided());
  check_times(watch, second_above(5'001), 1);
  CHECK(watch.cells() == cell_bit(1));
  CHECK(watch.is_decided());

  SECTION("and no longer when it is not") {
    check_times(watch, second_above(5'000), 1);
    CHECK(watch.cells() == 0);
  }
  SECTION("a hundred more change nothing") {
    check_times(watch, second_above(5'001), 300);
    CHECK(watch.cells() == cell_bit(1));
  }
}

TEST_CASE("5 mV are none, and one good check begins anew", "[unit][mmu][MMU_IMB]") {
  ImbalanceWatch watch = watch_at_rest();
  check_times(watch, second_above(5'000), 100);
  CHECK(watch.cells() == 0);
  check_times(watch, second_above(5'001), 50);
  check_times(watch, second_above(5'000), 1);
  check_times(watch, second_above(5'001), 50);
  CHECK(watch.cells() == 0);
}

TEST_CASE("nothing is counted in a window that saw a switch on", "[unit][mmu][MMU_IMB]") {
  ImbalanceWatch watch = watch_at_rest();
  check_times(watch, second_above(9'000), 51);
  REQUIRE(watch.cells() == cell_bit(1));
  watch.note_switches(true);
  CHECK(watch.cells() == 0);
  CHECK_FALSE(watch.is_decided());
  watch.note_switches(false);
  check_times(watch, second_above(9'000), 51);  // in a part of the first one a switch was on
  CHECK(watch.cells() == 0);
  check_times(watch, second_above(9'000), 1);
  CHECK(watch.cells() == cell_bit(1));
}

TEST_CASE("cells without a voltage take no part and keep their count", "[unit][mmu][MMU_IMB]") {
  ImbalanceWatch watch = watch_at_rest();
  CellReading reading = second_above(9'000);
  reading.cell_voltage_uV[6] = 0;
  reading.measured = static_cast<CellMask>(reading.measured & ~cell_bit(6));
  check_times(watch, reading, 50);
  reading.measured = static_cast<CellMask>(reading.measured & ~cell_bit(1));
  check_times(watch, reading, 5);
  CHECK(watch.cells() == 0);
  check_times(watch, second_above(9'000), 1);
  CHECK(watch.cells() == cell_bit(1));
}

TEST_CASE("a look that brings nothing ends as well", "[unit][mmu][MMU_IMB]") {
  ImbalanceWatch watch = watch_at_rest();
  check_times(watch, CellReading{}, 51);
  CHECK(watch.is_decided());
  CHECK(watch.cells() == 0);
}

}  // namespace
}  // namespace bmu
