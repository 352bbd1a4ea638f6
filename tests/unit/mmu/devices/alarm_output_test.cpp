// Alarm output of a module: conditions that open it, conditions that do not, and how long it stays open.
#include "mmu/devices/alarm.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using test::MmuBench;

constexpr std::int32_t limit_dC = 600;
constexpr Duration fails_after = 3'200ms;  // 31 checks of 100 ms, and the first average

MmuBench settled(const MmuConfig& config = {.node = 3, .serial_number = 1, .alarm_temperature_dC = limit_dC}) {
  MmuBench bench(config);
  bench.settle();
  REQUIRE_FALSE(bench.mmu.is_alarm_given(bench.now));
  return bench;
}

TEST_CASE("the alarm output opens for an overcharged cell, until faults are cleared", "[unit][mmu][SEC_1]") {
  MmuBench bench = settled();
  bench.measured.cell_voltage_uV[7] = 4'300'000;
  bench.run(2'900ms);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
  bench.run(fails_after - 2'900ms);
  CHECK(bench.mmu.is_alarm_given(bench.now));
  bench.measured.cell_voltage_uV[7] = 3'700'000;
  bench.run(10s);
  CHECK(bench.mmu.is_alarm_given(bench.now));
  REQUIRE(bench.command(test::command_frame(3, bench.next_command(), {5})) == 0);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
  bench.run(10s);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
}

TEST_CASE("the alarm output leaves undervoltage out: an empty pack must be rechargeable", "[unit][mmu][SEC_1]") {
  MmuBench bench = settled();
  bench.measured.cell_voltage_uV.fill(2'000'000);
  bench.run(10s);
  const CanFrame status = bench.status();
  CHECK(read_raw<internal_bus::status, "undervoltage_cells">(status) == 0xFFF);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
}

TEST_CASE("the alarm output opens for a hot cell at any sensor, from three samples in a row on", "[unit][mmu][SEC_1]") {
  for (std::size_t sensor = 0; sensor < mmu_cell_temperatures; ++sensor) {
    MmuBench bench = settled();
    bench.measured.cell_temperature_dC[sensor] = known(limit_dC + 5);
    bench.run(900ms);
    CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
    bench.run(700ms);
    CHECK(bench.mmu.is_alarm_given(bench.now));
    bench.measured.cell_temperature_dC[sensor] = known(250);
    bench.run(5s);
    CHECK(bench.mmu.is_alarm_given(bench.now));
    REQUIRE(bench.command(test::command_frame(3, bench.next_command(), {5})) == 0);
    CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
    bench.run(5s);
    CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
  }
}

TEST_CASE("a cell is too hot from its limit on, in samples in a row", "[unit][mmu][SEC_1]") {
  using Sample = std::array<SignalValue, mmu_cell_temperatures>;
  const auto sample = [](std::int64_t temperature_dC) {
    Sample one;
    one.fill(not_known(Validity::not_fitted));
    one[1] = known(temperature_dC);
    return one;
  };
  CellHeatWatch watch;
  for (int repeat = 0; repeat < 10; ++repeat) watch.check(sample(limit_dC - 1), limit_dC);
  CHECK_FALSE(watch.has_failed());
  watch.check(sample(limit_dC), limit_dC);
  watch.check(sample(limit_dC), limit_dC);
  watch.check(sample(limit_dC - 1), limit_dC);
  watch.check(sample(limit_dC), limit_dC);
  watch.check(sample(limit_dC), limit_dC);
  CHECK_FALSE(watch.has_failed());
  Sample unreadable;
  unreadable.fill(not_known(Validity::open_circuit));
  watch.check(unreadable, limit_dC);  // keeps the count
  CHECK_FALSE(watch.has_failed());
  watch.check(sample(limit_dC), limit_dC);
  CHECK(watch.has_failed());
  watch.check(sample(0), limit_dC);
  CHECK(watch.has_failed());
  watch.clear();
  watch.check(sample(limit_dC), limit_dC);
  CHECK_FALSE(watch.has_failed());
}

TEST_CASE("the alarm output opens for thermal shutdown of the front end, not for its low supply",
          "[unit][mmu][SEC_1]") {
  MmuBench bench = settled();
  bench.measured.supply_low = true;
  bench.run(1s);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
  bench.measured.thermal_shutdown = true;
  bench.run(11ms);
  CHECK(bench.mmu.is_alarm_given(bench.now));
}

TEST_CASE("the alarm output opens for a front end that is not received", "[unit][mmu][SEC_1]") {
  MmuBench bench = settled();
  bench.measured.front_end_crc_ok = false;
  bench.run(200ms);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
  bench.run(100ms);
  CHECK(bench.mmu.is_alarm_given(bench.now));
  bench.measured.front_end_crc_ok = true;
  bench.run(300ms);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
}

TEST_CASE("a module that measures nothing has its alarm output open: asleep or without power", "[unit][mmu][SEC_1]") {
  MmuBench bench = settled();
  REQUIRE(bench.command(test::command_frame(3, bench.next_command(), {1, 3})) == 0);
  bench.run(1s);
  REQUIRE(bench.mmu.is_asleep());
  CHECK(bench.mmu.is_alarm_given(bench.now));
  bench.mmu.observe(test::poll_frame(0, 0, 200), bench.now);
  bench.run(500ms);
  CHECK_FALSE(bench.mmu.is_alarm_given(bench.now));
  bench.measured.external_supply_mV = bench.measured.module_mV = 0;
  bench.run(1s);
  REQUIRE(bench.mmu.mode() == UnitMode::unpowered);
  CHECK(bench.mmu.is_alarm_given(bench.now));
}

}  // namespace
}  // namespace bmu
