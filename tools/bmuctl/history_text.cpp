#include "tools/bmuctl/history_text.hpp"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "daemon/history/history_columns.hpp"
#include "tools/bmuctl/reply.hpp"
#include "tools/bmuctl/time_words.hpp"

namespace bmu {

namespace {

using Json = nlohmann::ordered_json;

std::string name_of(const HistoryPlace& place) {
  return std::to_string(place.module) + "." + std::to_string(place.place);
}
std::string sensor_name(const HistoryPlace& place) {
  return (place.is_board ? "board_" : "sensor_") + name_of(place);
}

std::string utc_text(const HistoryNumber& unix_ms) {
  return unix_ms ? utc_time_text(*unix_ms) : "";
}
std::string local_text(const HistoryNumber& unix_ms) {
  return unix_ms ? local_time_text(*unix_ms) : "time unknown";
}

/// Replaces what a terminal would execute: the control characters, and those of the upper half, C2h 80h to C2h 9Fh.
std::string harmless(std::string_view text) {
  std::string shown;
  for (const char one : text) {
    const auto byte = static_cast<unsigned char>(one);
    const bool is_upper_control = byte >= 0x80 && byte < 0xA0 && shown.ends_with('\xC2');
    if (is_upper_control) shown.pop_back();
    shown += byte < ' ' || byte == 0x7F || is_upper_control ? '?' : one;
  }
  return shown;
}

// --- CSV ---

std::string field(const HistoryNumber& number) {
  return number ? std::to_string(*number) : "";
}
std::string field(std::string_view text) {
  std::string plain = harmless(text);
  if (plain.find_first_of(",\"") == std::string::npos) return plain;
  std::string quoted = "\"";
  for (const char one : plain) quoted += one == '"' ? std::string("\"\"") : std::string(1, one);
  return quoted + "\"";
}

template <class Row>
std::string names(std::span<const HistoryColumn<Row>> columns) {
  std::string line = "time,sequence";
  for (const HistoryColumn<Row>& column : columns) line += "," + std::string(column.name);
  return line;
}

template <class Row>
std::string values(std::span<const HistoryColumn<Row>> columns, const Row& row) {
  std::string line = utc_text(row.unix_time_ms) + "," + std::to_string(row.sequence);
  for (const HistoryColumn<Row>& column : columns) {
    line += "," + (column.number != nullptr ? field(row.*column.number) : field(row.*column.text));
  }
  return line;
}

/// The same position in another layout's list; null if it is not there.
const HistoryPlace* find(const HistoryPlace& wanted, const std::vector<HistoryPlace>& in) {
  const auto found = std::find_if(in.begin(), in.end(), [&](const HistoryPlace& place) {
    return place.module == wanted.module && place.place == wanted.place && place.is_board == wanted.is_board;
  });
  return found == in.end() ? nullptr : &*found;
}

template <class Element, class Column>
std::string elements(const std::vector<Element>& all, const std::vector<HistoryPlace>& layout,
                     const std::vector<HistoryPlace>& wanted, std::span<const Column> columns) {
  std::string line;
  for (const HistoryPlace& one : wanted) {
    const HistoryPlace* const place = find(one, layout);
    for (const Column& column : columns) {
      line += ",";
      if (place != nullptr) line += field(column.read(all.at(static_cast<std::size_t>(place->number - 1))));
    }
  }
  return line;
}

// --- JSON ---

Json json_of(const HistoryNumber& number) {
  return number ? Json(*number) : Json(nullptr);
}

/// "a,b" as a list.
Json list_of(std::string_view names) {
  Json list = Json::array();
  while (!names.empty()) {
    const std::size_t comma = names.find(',');
    list.push_back(std::string(names.substr(0, comma)));
    names.remove_prefix(comma == std::string_view::npos ? names.size() : comma + 1);
  }
  return list;
}

template <class Row>
Json object_of(std::span<const HistoryColumn<Row>> columns, const Row& row) {
  Json json{{"time", row.unix_time_ms ? Json(utc_text(row.unix_time_ms)) : Json(nullptr)}, {"sequence", row.sequence}};
  for (const HistoryColumn<Row>& column : columns) {
    Json& value = json[std::string(column.name)];
    if (column.number != nullptr) {
      value = json_of(row.*column.number);
    } else if (column.name == "faults" || column.name == "warnings") {
      value = list_of(row.*column.text);
    } else {
      value = row.*column.text;
    }
  }
  return json;
}

template <class Element, class Column>
Json list_of(const std::vector<Element>& all, const std::vector<HistoryPlace>& wanted,
             std::span<const Column> columns) {
  Json list = Json::array();
  for (const HistoryPlace& place : wanted) {
    Json json{{"module", place.module}, {"place", place.place}, {"number", place.number}};
    if (place.is_board) json["is_board"] = true;
    for (const Column& column : columns) {
      json[std::string(column.name)] = json_of(column.read(all.at(static_cast<std::size_t>(place.number - 1))));
    }
    list.push_back(std::move(json));
  }
  return list;
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

// --- tables ---

Span dim(std::string text) {
  return {std::move(text), Style::dim};
}
/// A value that rounds to zero has no sign.
Span shown(const HistoryNumber& value, Unit unit, int decimals) {
  const std::string text = shown_short(value, unit, decimals);
  const bool is_nothing = text.starts_with('-') && text.find_first_of("123456789") == std::string::npos && value;
  return {is_nothing ? text.substr(1) : text};
}

Span state_of(const HistoryRow& row) {
  return {harmless(row.mode), row.mode == "fault" ? Style::bad : Style::normal};
}

Span trouble_of(const HistoryRow& row) {
  if (!row.faults.empty()) return {harmless(row.faults), Style::bad};
  return {harmless(row.warnings), Style::warning};
}

Style style_of_severity(std::string_view severity) {
  if (severity == "error") return Style::bad;
  return severity == "warning" ? Style::warning : Style::normal;
}

}  // namespace

std::string csv_head(const std::vector<HistoryPlace>& cells, const std::vector<HistoryPlace>& sensors) {
  std::string line = names(row_columns());
  for (const HistoryPlace& cell : cells) {
    for (const HistoryCellColumn& column : cell_columns()) {
      line += ",cell_" + name_of(cell) + "_" + std::string(column.name);
    }
  }
  for (const HistoryPlace& sensor : sensors) {
    for (const HistorySensorColumn& column : sensor_columns()) {
      line += "," + sensor_name(sensor) + "_" + std::string(column.name);
    }
  }
  return line + "\n";
}

std::string csv_line(const HistoryRow& row, const HistoryLayout& layout, const std::vector<HistoryPlace>& cells,
                     const std::vector<HistoryPlace>& sensors) {
  std::string line = values(row_columns(), row);
  if (!cells.empty()) line += elements(row.cells, layout.cells(), cells, cell_columns());
  if (!sensors.empty()) line += elements(row.sensors, layout.sensors(), sensors, sensor_columns());
  return line + "\n";
}

std::string csv_event_head() {
  return names(event_columns()) + "\n";
}

std::string csv_line(const HistoryEvent& event) {
  return values(event_columns(), event) + "\n";
}

std::string json_line(const HistoryRow& row, const std::vector<HistoryPlace>& cells,
                      const std::vector<HistoryPlace>& sensors) {
  Json json = object_of(row_columns(), row);
  if (!cells.empty()) json["cells"] = list_of(row.cells, cells, cell_columns());
  if (!sensors.empty()) json["sensors"] = list_of(row.sensors, sensors, sensor_columns());
  return line_of(json);
}

std::string json_line(const HistoryEvent& event) {
  return line_of(object_of(event_columns(), event));
}

std::string recorded_yet_text(const std::string& path, std::int64_t period_s) {
  const auto halves = [](std::int64_t count) { return std::to_string(count / 2) + (count % 2 == 0 ? "" : ".5"); };
  return "recorded yet in " + path + "; the first minute comes after " + halves(period_s) + " to " +
         halves(3 * period_s) + " s";
}

std::string nothing_json_line(const std::string& path, std::int64_t period_s) {
  return line_of({{"nothing_recorded_yet", true}, {"path", path}, {"period_s", period_s}});
}

Line HistoryTable::head() const {
  Line line{dim("Time"), dim("SOC %")};
  if (cells_.empty()) {
    for (const char* name : {"lowest V", "average V", "highest V"}) line.push_back(dim(name));
  }
  for (const HistoryPlace& cell : cells_) line.push_back(dim(name_of(cell) + " V"));
  for (const char* name : {"current A", "from", "to", "cells C", "to", "state", "faults and warnings"}) {
    line.push_back(dim(name));
  }
  return line;
}

void HistoryTable::add(const HistoryRow& row, const HistoryLife& life) {
  if (tables_.empty() || tables_.back().life != life.id) {
    tables_.push_back({.life = life.id,
                       .heading = "Session " + std::to_string(life.id) + ": " +
                                  (life.pack_name.empty() ? "pack unknown" : harmless(life.pack_name)) + ", " +
                                  std::to_string(life.layout.cell_count()) + " cells, bmud " + harmless(life.version),
                       .rows = {head()}});
  }
  constexpr int volt_decimals = 4;
  constexpr int decimals = 1;
  Line line{{local_text(row.unix_time_ms)}, shown(row.soc_permille, Unit::permille, decimals)};
  if (cells_.empty()) {
    for (const auto& value : {row.cell_voltage_min_uV, row.cell_voltage_average_uV, row.cell_voltage_max_uV}) {
      line.push_back(shown(value, Unit::uV, volt_decimals));
    }
  }
  const std::vector<HistoryPlace> places = life.layout.cells();
  for (const HistoryPlace& cell : cells_) {
    const HistoryPlace* const place = find(cell, places);
    const HistoryNumber none;
    line.push_back(
        shown(place == nullptr ? none : row.cells.at(static_cast<std::size_t>(place->number - 1)).voltage_average_uV,
              Unit::uV, volt_decimals));
  }
  for (const auto& value : {row.current_average_mA, row.current_min_mA, row.current_max_mA}) {
    line.push_back(shown(value, Unit::mA, decimals));
  }
  line.push_back(shown(row.cell_temperature_min_dC, Unit::dC, decimals));
  line.push_back(shown(row.cell_temperature_max_dC, Unit::dC, decimals));
  line.push_back(state_of(row));
  line.push_back(trouble_of(row));
  tables_.back().rows.push_back(std::move(line));
}

void HistoryTable::add(const HistoryEvent& event) {
  events_.push_back({{local_text(event.unix_time_ms)},
                     {harmless(event.severity), style_of_severity(event.severity)},
                     {harmless(event.text)}});
}

Page HistoryTable::page() const {
  Page page;
  for (const OfLife& table : tables_) {
    page.add({dim(table.heading)});
    // All numbers are right-aligned; time, state and faults are not.
    std::vector<std::size_t> right;
    for (std::size_t column = 1; column + 2 < table.rows.front().size(); ++column) right.push_back(column);
    page.add_table(table.rows, right);
  }
  if (!events_.empty()) page.add_table(events_, {});
  return page;
}

}  // namespace bmu
