// A minute contains only values that were measured in it.
#include "daemon/history/minute_averager.hpp"

#include <memory>
#include <vector>

#include "daemon/history/history_row.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu {

namespace {

using test::CoreBench;
using test::small_pack;

constexpr std::int64_t noon_ms = 1'772'366'400'000;  // a full minute

struct AveragedPack {
  explicit AveragedPack(const CoreConfig& config = small_pack()) : bench(config), averager(bench.core(), 60s) {
    bench.each_ms = [this] {
      if (averager.update(bench.now())) minutes.push_back(averager.minute());
    };
  }
  void tell_clock(std::int64_t unix_time_ms) { bench.observe(WallClockSeen{.unix_time_ms = unix_time_ms}); }
  /// Runs to the end of the next minute.
  const Minute& next() {
    const std::size_t count = minutes.size();
    REQUIRE(bench.run_until([&] { return minutes.size() > count; }, 91s));
    return minutes.back();
  }

  CoreBench bench;
  MinuteAverager averager;
  std::vector<Minute> minutes;
};

}  // namespace

TEST_CASE("a minute has the mean, the lowest and the highest of what was measured in it", "[unit][history][BMS_F.5]") {
  AveragedPack pack;
  static_cast<void>(pack.next());  // the modules must be found first
  pack.bench.current_mA = 10'000;
  pack.bench.modules[0].cell_voltage_uV[2] = known(3'700'000);
  pack.bench.run(15s);
  pack.bench.current_mA = -2'000;
  pack.bench.modules[0].cell_voltage_uV[2] = known(3'600'000);
  pack.bench.modules[1].cell_temperature_dC[1] = known(350);
  const Minute& minute = pack.next();
  CHECK(minute.span >= 60s);
  CHECK(minute.span < 60s + 20ms);
  CHECK(minute.current_mA.average == Approx(1'000).margin(20));
  CHECK(minute.current_mA.min == -2'000);
  CHECK(minute.current_mA.max == 10'000);
  CHECK(minute.current_mA.samples > 1'000);
  const SampledValue& voltage_uV = minute.cells[2].voltage_uV;
  CHECK(voltage_uV.average == Approx(3'625'000).margin(400));
  CHECK(voltage_uV.min == 3'600'000);
  CHECK(voltage_uV.max == 3'700'000);
  CHECK(voltage_uV.samples == Approx(600).margin(2));
  CHECK(minute.cells[3].voltage_uV == SampledValue{3'700'000, 3'700'000, 3'700'000, voltage_uV.samples});
  // Two cell sensors and four board positions of module 1, then the second sensor of module 2.
  CHECK(minute.temperature_dC[7].average == Approx(325).margin(1));
  CHECK(minute.temperature_dC[7].min == 250);
  CHECK(minute.temperature_dC[7].max == 350);
  CHECK(minute.cell_count == 8);
  CHECK(minute.sensor_count == 12);
}

TEST_CASE("what was missing or absurd has no part in a minute, and is never zero", "[unit][history][BMS_F.5]") {
  AveragedPack pack;
  static_cast<void>(pack.next());
  pack.bench.modules[0].cell_voltage_uV[1] = SignalValue{0, Validity::not_fitted};
  pack.bench.run(20s);
  pack.bench.modules[1].talks = false;
  pack.bench.sensor_talks = false;
  const Minute& half = pack.next();
  CHECK(half.cells[4].voltage_uV.average == 3'700'000);
  CHECK(half.cells[4].voltage_uV.min == 3'700'000);
  CHECK(half.cells[4].voltage_uV.samples == Approx(200).margin(3));
  CHECK(half.modules_answering_min == 1);
  CHECK(half.uncounted > 35s);

  const Minute& none = pack.next();
  CHECK(none.cells[4].voltage_uV.samples == 0);
  CHECK(none.current_mA.samples == 0);
  const HistoryRow row = row_of(none, layout_of(pack.bench.core().config()));
  CHECK(none.cells[1].voltage_uV.samples == 0);
  CHECK_FALSE(row.cells[4].voltage_average_uV.has_value());
  CHECK_FALSE(row.cells[4].voltage_min_uV.has_value());
  CHECK(row.cells[4].voltage_samples == 0);
  CHECK_FALSE(row.current_average_mA.has_value());
  CHECK_FALSE(row.cells[1].voltage_average_uV.has_value());
  CHECK(row.cells[0].voltage_average_uV == 3'700'000);
  CHECK(row.cell_voltage_min_uV == 3'700'000);
  CHECK(row.cells_measured == 3);
}

TEST_CASE("minutes end with those of the wall clock, and a jump of it makes none shorter than half",
          "[unit][history][BMS_F.5]") {
  AveragedPack pack;
  pack.bench.run(1s);
  pack.tell_clock(noon_ms + 21'000);
  const Minute first = pack.next();  // started before the clock was known
  CHECK(first.span == 60s);
  CHECK(first.unix_time_ms == Approx(noon_ms + 20'000).margin(10));
  const Minute second = pack.next();
  CHECK((second.unix_time_ms + to_ms(second.span)) % 60'000 == Approx(0).margin(20));
  CHECK(pack.next().span == 60s);
  CHECK(pack.minutes.back().unix_time_ms % 60'000 == Approx(0).margin(20));

  std::uint64_t seed = 1;
  for (int jump = 0; jump < 20; ++jump) {
    seed = seed * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
    pack.tell_clock(noon_ms + static_cast<std::int64_t>(seed >> 40U) * 1'000);
    const Duration before = pack.minutes.back().uptime;
    const Minute& minute = pack.next();
    CHECK(minute.span >= 30s);
    CHECK(minute.span <= 90s + 20ms);
    CHECK(minute.uptime == before + minute.span);
  }
}

TEST_CASE("without a clock minutes are as long, and have no time", "[unit][history][BMS_F.5]") {
  AveragedPack pack;
  CHECK(pack.next().unix_time_ms == 0);
  CHECK(pack.next().span == 60s);
  CHECK_FALSE(row_of(pack.minutes.back(), layout_of(small_pack())).unix_time_ms.has_value());
}

TEST_CASE("a minute knows what was wrong in it and how long the pack was closed", "[unit][history][BMS_F.5]") {
  CoreConfig config = small_pack();
  config.limits.stuck_values = never_above;  // the voltages are constant under the current
  AveragedPack pack(config);
  REQUIRE(pack.bench.close());
  pack.bench.current_mA = 36'000;
  const Minute& closed = pack.next();
  CHECK(closed.closed > 55s);
  INFO(row_of(closed, layout_of(small_pack())).faults);
  CHECK(closed.faults_present.none());
  CHECK(closed.phase == Phase::closed);
  CHECK(closed.charge_out_uAs == Approx(36e6 * 60).epsilon(0.05));  // nearly a minute of it
  CHECK(closed.energy_out_mWh > 0);
  CHECK(closed.limits.discharge.limit_mA > 0);

  pack.bench.modules[0].cell_voltage_uV[0] = known(4'300'000);
  pack.bench.run(5s);
  pack.bench.modules[0].cell_voltage_uV[0] = known(3'700'000);
  const Minute& faulty = pack.next();
  CHECK(faulty.faults_present.test(static_cast<std::size_t>(FaultId::cell_overvoltage)));
  CHECK(faulty.closed < 10s);
  const HistoryRow row = row_of(faulty, layout_of(small_pack()));
  CHECK(row.faults.find("cell_overvoltage") != std::string::npos);
  CHECK(row.phase == "open");
}

TEST_CASE("the minute under way is not lost at the end", "[unit][history][BMS_F.5]") {
  AveragedPack pack;
  static_cast<void>(pack.next());
  pack.bench.run(12s);
  REQUIRE(pack.averager.finish(pack.bench.now()));
  CHECK(to_ms(pack.averager.minute().span) == Approx(12'000).margin(10));
  CHECK(pack.averager.minute().cells[0].voltage_uV.samples == Approx(120).margin(2));
  CHECK_FALSE(pack.averager.finish(pack.bench.now()));
}

TEST_CASE("looking at the core and handing a minute over takes no memory", "[unit][history]") {
  AveragedPack pack;
  static_cast<void>(pack.next());
  const TimePoint now = pack.bench.now();
  const std::uint64_t before = test::allocation_count();
  bool is_over = false;
  for (int tick = 1; tick < 7'000; ++tick) is_over = pack.averager.update(now + tick * tick_period) || is_over;
  CHECK(test::allocation_count() == before);
  CHECK(is_over);
}

}  // namespace bmu
