// Cost of the history: for the loop, for the writer, and on the disk. Run on a disk of the target's type: set TMPDIR to
// a folder there.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "daemon/history/history_file.hpp"
#include "daemon/history/history_reader.hpp"
#include "daemon/history/minute_averager.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {

namespace {

constexpr std::int64_t minutes_per_day = 1'440;
constexpr std::int64_t begin_unix_ms = 1'772'366'400'000;

HistoryLife life_of(std::size_t modules) {
  HistoryLife life{.token = "bench", .version = "0", .pack_name = "bench", .config = "0"};
  life.layout = layout_of(test::pack_of(modules));
  return life;
}

/// Sets every value, with others each minute.
HistoryRow row_of_minute(std::int64_t number, const HistoryLayout& layout) {
  static auto minute = std::make_unique<Minute>();
  minute->unix_time_ms = begin_unix_ms + number * 60'000;
  minute->span = 60s;
  minute->uptime = number * 60s;
  minute->cell_count = layout.cell_count();
  minute->sensor_count = layout.sensor_count();
  const auto step = static_cast<std::int32_t>(number % 9'000);
  for (std::size_t cell = 0; cell < minute->cell_count; ++cell) {
    const std::int32_t voltage_uV = 3'000'000 + step * 100 + static_cast<std::int32_t>(cell) * 300;
    minute->cells[cell] = {.voltage_uV = {voltage_uV, voltage_uV - 20'000, voltage_uV + 15'000, 600},
                           .soc_permille = step / 9,
                           .health_by_capacity_permille = 987,
                           .health_by_resistance_permille = 876,
                           .bled_permille = 12};
  }
  for (std::size_t sensor = 0; sensor < minute->sensor_count; ++sensor) {
    minute->temperature_dC[sensor] = {250, 240, 260, 600};
  }
  minute->current_mA = {12'345, -54'321, 98'765, 6'000};
  minute->pack_voltage_mV = minute->link_voltage_mV = {350'123, 340'123, 360'123, 600};
  minute->soc_permille = minute->soc_sigma_permille = 500;
  minute->health_by_capacity_permille = minute->health_by_resistance_permille = 900;
  minute->pack_resistance_uOhm = 123'456;
  minute->totals = PackTotals{123'456'789'012, 123'456'789'012, 1'234'567'890, 1'234'567'890};
  minute->charge_out_uAs = minute->charge_in_uAs = 12'345'678;
  minute->energy_out_mWh = minute->energy_in_mWh = 12'345;
  if (number % 60 == 0) minute->warnings_present.set(static_cast<std::size_t>(FaultId::cell_imbalance));
  return row_of(*minute, layout);
}

/// The read of the core in a tick, by modules of 12 cells; the loop's only part besides handing over.
void history_look(benchmark::State& state) {
  test::CoreBench bench(test::pack_of(static_cast<std::size_t>(state.range(0))));
  bench.run(3s);
  MinuteAverager averager(bench.core(), 60s);
  TimePoint at = bench.now();
  for (auto _ : state) {
    at += 1us;  // the minute does not end, and no value becomes stale
    benchmark::DoNotOptimize(averager.update(at));
  }
}
BENCHMARK(history_look)->Arg(8)->Arg(16)->Arg(63)->Unit(benchmark::kNanosecond);

/// The end of a minute, with the row made from it.
void history_minute_end(benchmark::State& state) {
  test::CoreBench bench(test::pack_of(static_cast<std::size_t>(state.range(0))));
  bench.run(3s);
  MinuteAverager averager(bench.core(), 60s);
  TimePoint at = bench.now();
  for (auto _ : state) {
    at += 1us;
    static_cast<void>(averager.update(at));
    at += 1us;
    benchmark::DoNotOptimize(averager.finish(at));
  }
}
BENCHMARK(history_minute_end)->Arg(8)->Arg(16)->Arg(63)->Unit(benchmark::kMicrosecond);

/// A row as written by the writer thread: one transaction with its sync, and removal of excess rows.
void history_insert(benchmark::State& state) {
  const TemporaryFolder folder;
  const HistoryLife life = life_of(static_cast<std::size_t>(state.range(0)));
  HistoryFile file({.path = folder / "history.sqlite"}, life);
  std::int64_t number = 0;
  for (auto _ : state) {
    const HistoryRow row = row_of_minute(++number, life.layout);
    if (!file.write({&row, 1}, {}) || !file.trim()) return state.SkipWithError("not written");
  }
}
BENCHMARK(history_insert)->Arg(8)->Arg(63)->Unit(benchmark::kMicrosecond);

/// Days in a database, and their size on the disk. By modules of 12 cells, and days.
void history_size(benchmark::State& state) {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  const HistoryLife life = life_of(static_cast<std::size_t>(state.range(0)));
  const std::int64_t days = state.range(1);
  for (auto _ : state) {
    std::filesystem::remove(path);
    HistoryFile file({.path = path}, life);
    std::vector<HistoryRow> rows;
    for (std::int64_t number = 1; number <= days * minutes_per_day; ++number) {
      rows.push_back(row_of_minute(number, life.layout));
      if (number % minutes_per_day != 0) continue;
      if (!file.write(rows, {})) return state.SkipWithError("not written");
      rows.clear();
    }
  }
  const double bytes = static_cast<double>(std::filesystem::file_size(path));
  state.counters["MB"] = bytes / 1e6;
  state.counters["MB_per_day"] = bytes / 1e6 / static_cast<double>(days);
  state.counters["bytes_per_row"] = bytes / static_cast<double>(days * minutes_per_day);
}
BENCHMARK(history_size)->Args({8, 1})->Args({8, 30})->Args({63, 1})->Iterations(1)->Unit(benchmark::kMillisecond);

/// Reads, checks and parses all rows of a day of 96 cells.
void history_read_day(benchmark::State& state) {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  const HistoryLife life = life_of(8);
  std::vector<HistoryRow> rows;
  for (std::int64_t number = 1; number <= minutes_per_day; ++number) rows.push_back(row_of_minute(number, life.layout));
  {
    HistoryFile file({.path = path}, life);
    if (!file.write(rows, {})) return state.SkipWithError("not written");
  }
  for (auto _ : state) {
    auto reader = HistoryReader::open(path);
    if (!reader) return state.SkipWithError("not read");
    std::int64_t count = 0;
    reader->for_each_row({}, [&](const HistoryRow&) { return ++count > 0; });
    if (count != minutes_per_day) return state.SkipWithError("rows are missing");
  }
}
BENCHMARK(history_read_day)->Unit(benchmark::kMillisecond);

}  // namespace

}  // namespace bmu
