// Histories for tests: rows with numbers that identify the row, and files full of them.
#pragma once

#include <string>
#include <vector>

#include "daemon/history/history_file.hpp"
#include "daemon/history/history_reader.hpp"
#include "daemon/history/history_row.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {

/// 2026-03-01 12:00 UTC.
inline constexpr std::int64_t history_begin_ms = 1'772'366'400'000;
inline constexpr std::int64_t minute_ms = 60'000;

/// `modules` of 12 cells and 4 sensors.
[[nodiscard]] inline HistoryLife life_of(std::size_t modules, std::string token = "one") {
  HistoryLife life{.token = std::move(token), .version = "0.1.0", .pack_name = "test pack", .config = "00c0ffee"};
  for (std::size_t index = 0; index < modules; ++index) {
    life.layout.modules.push_back(
        {.node = static_cast<std::int64_t>(index + 1), .cells = 12, .cell_sensors = 4, .board_sensors = 4});
  }
  return life;
}

/// Row of the `minute`-th minute of its session, from 1: `minute` minutes after history_begin_ms.
[[nodiscard]] inline HistoryRow history_row(std::int64_t minute, const HistoryLife& life) {
  HistoryRow row;
  row.unix_time_ms = history_begin_ms + minute * minute_ms;
  row.span_ms = minute_ms;
  row.uptime_ms = minute * minute_ms;
  row.current_average_mA = 1'000 + minute;
  row.current_min_mA = -minute;
  row.current_max_mA = 20'000 + minute;
  row.current_samples = 6'000;
  row.pack_voltage_average_mV = 350'000;
  row.pack_voltage_samples = 600;
  row.soc_permille = minute % 1'001;
  row.discharge_limit_mA = 80'000;
  row.discharge_limit_cause = "continuous";
  row.charge_limit_cause = "not connected";
  row.phase = "closed";
  row.closed_ms = minute_ms;
  row.mode = "driving";
  row.energy_out_mWh = 5'833;
  row.modules_answering_min = static_cast<std::int64_t>(life.layout.modules.size());
  row.energy_left_mWh = 4'200'000 - minute;
  row.energy_left_sigma_mWh = 90'000;
  row.discharge_power_W = 28'000;
  row.charge_power_W = 7'000;
  row.discharge_power_cause = "continuous";
  row.charge_power_cause = "not connected";
  if (minute % 10 == 0) row.warnings = "cell_undervoltage,disk_low";
  for (std::size_t cell = 0; cell < life.layout.cell_count(); ++cell) {
    const std::int64_t voltage_uV = 3'300'000 + minute % 1'000 * 100 + static_cast<std::int64_t>(cell) * 1'000;
    row.cells.push_back({.voltage_average_uV = voltage_uV,
                         .voltage_min_uV = voltage_uV - 2'000,
                         .voltage_max_uV = voltage_uV + 2'000,
                         .voltage_samples = 600,
                         .soc_permille = minute % 1'001,
                         .health_by_capacity_permille = 987,
                         .health_by_resistance_permille = std::nullopt,
                         .bled_permille = static_cast<std::int64_t>(cell)});
  }
  for (std::size_t sensor = 0; sensor < life.layout.sensor_count(); ++sensor) {
    row.sensors.push_back({.temperature_average_dC = 250 - static_cast<std::int64_t>(sensor) * 20,
                           .temperature_min_dC = -100,
                           .temperature_max_dC = 300,
                           .temperature_samples = 599});
  }
  return row;
}

[[nodiscard]] inline HistoryEvent history_event(std::int64_t number) {
  return {.number = number,
          .unix_time_ms = history_begin_ms + number * minute_ms,
          .uptime_ms = number * minute_ms,
          .severity = "warning",
          .name = "fault_warned",
          .fault = "disk_low",
          .text = "disk space low"};
}

/// Writes minutes `first` to `last`, each with an event.
inline void write_minutes(HistoryFile& file, const HistoryLife& life, std::int64_t first, std::int64_t last) {
  std::vector<HistoryRow> rows;
  std::vector<HistoryEvent> events;
  for (std::int64_t minute = first; minute <= last; ++minute) {
    rows.push_back(history_row(minute, life));
    events.push_back(history_event(minute));
  }
  const auto written = file.write(rows, events);
  INFO((written ? "" : written.error().what));
  REQUIRE(written);
}

struct ReadHistory {
  std::vector<HistoryRow> rows;
  std::vector<HistoryEvent> events;
  std::vector<std::string> problems;

  [[nodiscard]] std::vector<std::int64_t> minutes() const {
    std::vector<std::int64_t> all;
    for (const HistoryRow& row : rows) all.push_back(row.uptime_ms.value_or(-1) / minute_ms);
    return all;
  }
};

[[nodiscard]] inline ReadHistory read_all(HistoryReader& reader, const HistorySpan& span = {}) {
  ReadHistory all;
  reader.for_each_row(span, [&](const HistoryRow& row) {
    all.rows.push_back(row);
    return true;
  });
  reader.for_each_event(span, [&](const HistoryEvent& event) {
    all.events.push_back(event);
    return true;
  });
  all.problems = reader.problems();
  return all;
}

[[nodiscard]] inline ReadHistory read_all(const std::string& path) {
  auto reader = HistoryReader::open(path);
  INFO((reader ? "" : reader.error()));
  REQUIRE(reader);
  return read_all(*reader);
}

/// first, first + 1, ... last.
[[nodiscard]] inline std::vector<std::int64_t> count(std::int64_t first, std::int64_t last) {
  std::vector<std::int64_t> all;
  for (std::int64_t number = first; number <= last; ++number) all.push_back(number);
  return all;
}

}  // namespace bmu::test
