// Records of the history in the form for users and programs: a row per minute, each event, and the session of the
// daemon that they are from. HistoryReader (history_reader.hpp) returns them, and the writer makes them from minutes.
//
// Members have the names of the database's columns, of the CSV's and of the JSON's keys, with their units; the columns
// are listed in history_columns.hpp. An unknown value is empty. Times of the wall clock are ms since 1970, UTC.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/records/event.hpp"
#include "daemon/history/minute.hpp"

namespace bmu {

using HistoryNumber = std::optional<std::int64_t>;

/// Mean, lowest and highest of the minute's samples; empty without samples. Voltages are stored in steps of 0.1 mV.
struct HistoryCell {
  HistoryNumber voltage_average_uV;
  HistoryNumber voltage_min_uV;
  HistoryNumber voltage_max_uV;
  std::int64_t voltage_samples = 0;
  HistoryNumber soc_permille;
  HistoryNumber health_by_capacity_permille;
  HistoryNumber health_by_resistance_permille;
  std::int64_t bled_permille = 0;  // share of the minute with the bleed resistor on

  friend bool operator==(const HistoryCell&, const HistoryCell&) = default;
};

struct HistorySensor {
  HistoryNumber temperature_average_dC;
  HistoryNumber temperature_min_dC;
  HistoryNumber temperature_max_dC;
  std::int64_t temperature_samples = 0;

  friend bool operator==(const HistorySensor&, const HistorySensor&) = default;
};

struct HistoryRow {
  std::int64_t sequence = 0;   // counts the rows, independent of the clock
  HistoryNumber life;          // HistoryLife::id
  HistoryNumber unix_time_ms;  // start of the minute; empty: the time was unknown
  HistoryNumber span_ms;       // length of the minute, by the monotonic clock
  HistoryNumber uptime_ms;     // of the daemon, at the end of the minute

  HistoryNumber current_average_mA;  // positive out of the pack
  HistoryNumber current_min_mA;
  HistoryNumber current_max_mA;
  HistoryNumber current_samples;
  HistoryNumber pack_voltage_average_mV;
  HistoryNumber pack_voltage_min_mV;
  HistoryNumber pack_voltage_max_mV;
  HistoryNumber pack_voltage_samples;
  HistoryNumber link_voltage_average_mV;
  HistoryNumber link_voltage_min_mV;
  HistoryNumber link_voltage_max_mV;
  HistoryNumber link_voltage_samples;

  // Of all measured cells and sensors: the lowest minimum, the mean of the means, the highest maximum.
  HistoryNumber cell_voltage_min_uV;
  HistoryNumber cell_voltage_average_uV;
  HistoryNumber cell_voltage_max_uV;
  HistoryNumber cells_measured;
  HistoryNumber cell_temperature_min_dC;
  HistoryNumber cell_temperature_average_dC;
  HistoryNumber cell_temperature_max_dC;
  HistoryNumber board_temperature_max_dC;

  // At the end of the minute.
  HistoryNumber soc_permille;
  HistoryNumber soc_sigma_permille;
  HistoryNumber health_by_capacity_permille;
  HistoryNumber health_by_resistance_permille;
  HistoryNumber pack_resistance_uOhm;
  HistoryNumber discharge_limit_mA;
  HistoryNumber charge_limit_mA;
  HistoryNumber discharge_continuous_limit_mA;
  HistoryNumber charge_continuous_limit_mA;
  std::string discharge_limit_cause;
  std::string charge_limit_cause;
  std::string discharge_continuous_limit_cause;
  std::string charge_continuous_limit_cause;
  std::string phase;
  std::string mode;
  HistoryNumber charge_out_total_uAs;  // over all sessions of the daemon
  HistoryNumber charge_in_total_uAs;
  HistoryNumber energy_out_total_mWh;
  HistoryNumber energy_in_total_mWh;

  // In the minute.
  HistoryNumber charge_out_uAs;
  HistoryNumber charge_in_uAs;
  HistoryNumber energy_out_mWh;
  HistoryNumber energy_in_mWh;
  HistoryNumber uncounted_ms;  // time without a usable current, which is in none of the sums
  HistoryNumber closed_ms;     // both main contactors commanded closed
  HistoryNumber modules_answering_min;
  std::string faults;    // names separated by commas; "": none
  std::string warnings;  //

  // At the end of the minute; empty in rows of schema version 1.
  HistoryNumber energy_left_mWh;        // at the load at that time (estimation/energy_left.hpp)
  HistoryNumber energy_left_sigma_mWh;  // one standard deviation
  HistoryNumber discharge_power_W;      // permissible: power_limits.hpp
  HistoryNumber charge_power_W;
  HistoryNumber discharge_continuous_power_W;
  HistoryNumber charge_continuous_power_W;
  std::string discharge_power_cause;
  std::string charge_power_cause;
  std::string discharge_continuous_power_cause;
  std::string charge_continuous_power_cause;

  std::vector<HistoryCell> cells;      // by number through the pack
  std::vector<HistorySensor> sensors;  // by HistoryLayout

  friend bool operator==(const HistoryRow&, const HistoryRow&) = default;
};

struct HistoryEvent {
  std::int64_t sequence = 0;
  HistoryNumber life;
  HistoryNumber number;        // in its session, from 1
  HistoryNumber unix_time_ms;  // empty: the time was unknown
  HistoryNumber uptime_ms;
  std::string severity;  // "info", "warning", "error"
  std::string name;      // EventRow::name
  std::string fault;     // the fault that it refers to; "": none
  std::string text;      // the line of the log

  friend bool operator==(const HistoryEvent&, const HistoryEvent&) = default;
};

/// Contribution of a module to the arrays of a row, in their order.
struct HistoryModule {
  std::int64_t node = 0;
  std::int64_t cells = 0;
  std::int64_t cell_sensors = 0;
  std::int64_t board_sensors = 0;  // positions for them, fitted or not

  friend bool operator==(const HistoryModule&, const HistoryModule&) = default;
};

struct HistoryPlace {
  std::int64_t number = 0;  // through the pack, from 1: index in the row's array plus one
  std::int64_t module = 0;  // node
  std::int64_t place = 0;   // within the module, from 1; of a board sensor among those of the board
  bool is_board = false;
};

struct HistoryLayout {
  std::vector<HistoryModule> modules;

  [[nodiscard]] std::size_t cell_count() const;
  [[nodiscard]] std::size_t sensor_count() const;
  [[nodiscard]] std::vector<HistoryPlace> cells() const;
  [[nodiscard]] std::vector<HistoryPlace> sensors() const;

  friend bool operator==(const HistoryLayout&, const HistoryLayout&) = default;
};
[[nodiscard]] HistoryLayout layout_of(const CoreConfig& config);
/// "1:12+4+4 2:12+4+4": node, cells, sensors of cells and of the board.
[[nodiscard]] std::string to_text(const HistoryLayout& layout);
/// None if the text is invalid, or has more modules, cells or sensors than a pack can have.
[[nodiscard]] std::optional<HistoryLayout> layout_from_text(std::string_view text);

/// One session of the daemon.
struct HistoryLife {
  std::int64_t id = 0;    // in its database, in the order of the sessions
  std::string token;      // unique among all sessions
  std::string version;    // of the daemon
  std::string pack_name;  // of the pack file
  std::string config;     // hash of the pack file, as in the log
  std::int64_t period_s = 60;
  HistoryLayout layout;
};

/// An event with the times that only the core knows. Passed on by copying.
struct TimedEvent {
  Event event;
  std::uint64_t number = 0;  // in this session, from 1
  std::int64_t unix_time_ms = 0;
  Duration uptime{};
};

/// `sequence` and the session are filled in by the database.
[[nodiscard]] HistoryRow row_of(const Minute& minute, const HistoryLayout& layout);
[[nodiscard]] HistoryEvent event_of(const TimedEvent& timed);

}  // namespace bmu
