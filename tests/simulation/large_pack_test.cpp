// The largest pack there can be: 63 modules of 12 cells, 756 in series, on a bus of 1 Mbit/s with exact lengths.
#include "config/checks/bus_budget.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {
namespace {

/// Of a chemistry with 2.4 V per cell: 1.8 kV in all, which the voltage sensor can still measure.
CoreConfig largest_pack() {
  CoreConfig config = pack_of(modules_max);
  config.cell.ocv.clear();
  config.cell.ocv.push_back({0, 2'000'000});
  config.cell.ocv.push_back({500, 2'350'000});
  config.cell.ocv.push_back({1000, 2'600'000});
  config.cell.voltage_max_uV = 2'640'000;
  config.limits.cell_undervoltage = {.warn = 1'900'000, .open = 1'800'000, .hysteresis = 50'000};
  config.limits.cell_overvoltage = {.warn = 2'580'000, .open = 2'640'000, .hysteresis = 20'000};
  config.limits.pack_voltage_mismatch = {.warn = 20'000, .open = 40'000, .hysteresis = 5'000, .confirm = 300ms};
  config.ages.cell_voltage = 280ms;  // two periods, and a cycle of 80 ms at worst
  return config;
}

const WiredPack& driving_pack() {
  static const WiredPack pack = [] {
    WiredPack fresh(largest_pack(), {}, {.bits_per_s = 1'000'000, .stuffing = Stuffing::exact});
    fresh.run(3s);
    REQUIRE(fresh.close());
    fresh.apply("load current_A 40");
    fresh.run(2s);
    return fresh;
  }();
  return pack;
}

/// From the event to the command on the bus that opens everything.
Duration opens_after(std::string_view event) {
  WiredPack pack = driving_pack();
  const TimePoint began_at = pack.now();
  pack.apply(event);
  REQUIRE(pack.run_until([](const WiredPack& one) { return !one.commanded().any_contactor(); }, 3s));
  return pack.now() - began_at;
}

}  // namespace

TEST_CASE("756 cells close, and drive", "[simulation][scale][BMS_F.2]") {
  const WiredPack& pack = driving_pack();
  CHECK(pack.phase() == Phase::closed);
  CHECK(pack.core().pack().cell_voltage_uV.min > 2'000'000);
  const Duration before = pack.bus().busy(pack.now());
  WiredPack later = pack;
  later.run(2s);
  CHECK(later.phase() == Phase::closed);
  const std::int64_t load_permille = (later.bus().busy(later.now()) - before) * 1'000 / 2s;
  CHECK(load_permille > 500);
  CHECK(load_permille <= bus_load_permille(later.config(), later.config().poll.period, 1'000));
  for (const Station station : {Station::master, Station::module_first, Station::pdu}) {
    CHECK(later.bus().counters(station) == ErrorCounters{});
  }
}

TEST_CASE("756 cells: a lost module opens within 300 ms", "[simulation][scale][F21]") {
  CHECK(opens_after("module $N silent") <= 300ms);
  CHECK(opens_after("module 1 silent") <= 300ms);
}

TEST_CASE("756 cells: a cell beyond its limit opens within 450 ms", "[simulation][scale][BMS_F.1]") {
  CHECK(opens_after("cell $C voltage_mV 2700") <= 450ms);
  CHECK(opens_after("cell 1.1 voltage_mV 1700") <= 450ms);
}

}  // namespace bmu::test
