// What the history keeps, in the form that people and programs want it: a row a minute, an event as it happened, and
// the life of the daemon that they come from. Who reads a history (history_reader.hpp) gets these, and who writes one
// makes them from minutes.
//
// Members have the names of the database's columns, of the CSV's and of the JSON's keys, with their units; the columns
// are listed in history_columns.hpp. What was not known is not there. Times of the wall clock are ms since 1970, UTC.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/records/event.hpp"
#include "daemon/history/minute.hpp"

namespace bmu {

using HistoryNumber = std::optional<std::int64_t>;

/// Mean, lowest and highest of the minute's samples; none without samples. Voltages are kept to 0.1 mV.
struct HistoryCell {
  HistoryNumber voltage_average_uV;
  HistoryNumber voltage_min_uV;
  HistoryNumber voltage_max_uV;
  std::int64_t voltage_samples = 0;
  HistoryNumber soc_permille;
  HistoryNumber health_by_capacity_permille;
  HistoryNumber health_by_resistance_permille;
  std::int64_t bled_permille = 0;  // of the minute

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
  std::int64_t sequence = 0;   // counts the rows, whatever the clock does
  HistoryNumber life;          // HistoryLife::id
  HistoryNumber unix_time_ms;  // of the minute's beginning; not there: nobody had told the time
  HistoryNumber span_ms;       // how long it was, by a clock that never jumps
  HistoryNumber uptime_ms;     // of the daemon, at its end

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

  // Of all cells and sensors that were measured: the lowest of their lowest, the mean of their means, the highest.
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
  HistoryNumber charge_out_total_uAs;  // over all lives of the daemon
  HistoryNumber charge_in_total_uAs;
  HistoryNumber energy_out_total_mWh;
  HistoryNumber energy_in_total_mWh;

  // In the minute.
  HistoryNumber charge_out_uAs;
  HistoryNumber charge_in_uAs;
  HistoryNumber energy_out_mWh;
  HistoryNumber energy_in_mWh;
  HistoryNumber uncounted_ms;  // without a usable current: what flowed then is in none of the sums
  HistoryNumber closed_ms;     // both main contactors commanded closed
  HistoryNumber modules_answering_min;
  std::string faults;    // names with a comma between; "": none
  std::string warnings;  //

  // At the end of the minute; not there in rows of a schema before the second.
  HistoryNumber energy_left_mWh;        // at the load of then (estimation/energy_left.hpp)
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
  HistoryNumber number;        // in its life, from 1
  HistoryNumber unix_time_ms;  // not there: nobody had told the time
  HistoryNumber uptime_ms;
  std::string severity;  // "info", "warning", "error"
  std::string name;      // EventRow::name
  std::string fault;     // which one it is about; "": none
  std::string text;      // the line of the log

  friend bool operator==(const HistoryEvent&, const HistoryEvent&) = default;
};

/// What a module brings to the arrays of a row, in their order.
struct HistoryModule {
  std::int64_t node = 0;
  std::int64_t cells = 0;
  std::int64_t cell_sensors = 0;
  std::int64_t board_sensors = 0;  // places for them, fitted or not

  friend bool operator==(const HistoryModule&, const HistoryModule&) = default;
};

struct HistoryPlace {
  std::int64_t number = 0;  // through the pack, from 1: index in the row's array and one
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
/// None if it is no such text, or of more modules, cells or sensors than a pack can have.
[[nodiscard]] std::optional<HistoryLayout> layout_from_text(std::string_view text);

/// One run of the daemon.
struct HistoryLife {
  std::int64_t id = 0;    // in its database, in the order of the lives
  std::string token;      // unlike that of any other life
  std::string version;    // of the daemon
  std::string pack_name;  // of the pack file
  std::string config;     // hash of the pack file, as the log has it
  std::int64_t period_s = 60;
  HistoryLayout layout;
};

/// An event with what the core alone knows of its time. Handed over by copying.
struct TimedEvent {
  Event event;
  std::uint64_t number = 0;  // in this life, from 1
  std::int64_t unix_time_ms = 0;
  Duration uptime{};
};

/// `sequence` and `life` are for the database to say.
[[nodiscard]] HistoryRow row_of(const Minute& minute, const HistoryLayout& layout);
[[nodiscard]] HistoryEvent event_of(const TimedEvent& timed);

}  // namespace bmu
