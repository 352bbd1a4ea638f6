#include "daemon/history/history_schema.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "daemon/history/history_columns.hpp"
#include "daemon/history/row_blob.hpp"

namespace bmu {

namespace {

template <class Row>
std::string definitions(std::span<const HistoryColumn<Row>> columns) {
  std::string text;
  for (const HistoryColumn<Row>& column : columns) {
    text += ",\n  " + std::string(column.name) + (column.number != nullptr ? " INTEGER" : " TEXT NOT NULL");
  }
  return text;
}

template <class Row>
std::string names(std::span<const HistoryColumn<Row>> columns) {
  std::string text;
  for (const HistoryColumn<Row>& column : columns) text += ", " + std::string(column.name);
  return text;
}

std::string insert_sql(const std::string& table, const std::string& all_names, std::size_t count) {
  std::string marks = "?";
  for (std::size_t index = 1; index < count; ++index) marks += ", ?";
  return "INSERT INTO " + table + " (" + all_names + ") VALUES (" + marks + ")";
}

// --- version 1 ---

/// The n-th 16 bit number of the hexadecimal text `h`, NULL for FFFFh: SQL has no other way to read from a blob.
std::string number_in_h(std::size_t index) {
  std::string sum;
  constexpr std::array weights{"4096", "256", "16", "1"};
  for (std::size_t digit = 0; digit < weights.size(); ++digit) {
    sum += (digit == 0 ? "" : " + ") + std::string(weights.at(digit)) + " * (instr('0123456789ABCDEF', substr(h, " +
           std::to_string(index * weights.size() + digit + 1) + ", 1)) - 1)";
  }
  return "nullif(" + sum + ", 65535)";
}

struct ViewColumn {
  std::string name;
  std::string scale;  // text after the number
};

/// View with a row for each element of a minute's array, with its position in the pack.
std::string view_sql(const std::string& name, const std::string& blob, const std::string& kinds,
                     std::size_t record_bytes, const std::vector<ViewColumn>& columns) {
  std::string text = "CREATE VIEW " + name + " AS\nSELECT sequence, life, unix_time_ms, kind, number, module, place";
  for (std::size_t index = 0; index < columns.size(); ++index) {
    text += ",\n  " + number_in_h(index) + columns[index].scale + " AS " + columns[index].name;
  }
  const std::string bytes = std::to_string(record_bytes);
  return text + "\nFROM (SELECT m.sequence, m.life, m.unix_time_ms, p.kind, p.number, p.module, p.place,\n" +
         "        hex(substr(m." + blob + ", (p.number - 1) * " + bytes + " + 1, " + bytes + ")) AS h\n" +
         "      FROM minute m JOIN life l ON l.id = m.life JOIN place p ON p.layout = l.layout\n" +
         "      WHERE p.kind IN (" + kinds + "));\n";
}

std::string version_1() {
  const std::string voltage = " * " + std::to_string(cell_voltage_step_uV);
  const std::string temperature = " - " + std::to_string(temperature_offset_dC);
  // Both settings within the transaction that creates the tables: a reader meanwhile finds an empty file or a history.
  return "PRAGMA auto_vacuum = INCREMENTAL;\n"
         "PRAGMA application_id = " +
         std::to_string(history_application_id) +
         ";\n"
         "CREATE TABLE layout (id INTEGER PRIMARY KEY, modules TEXT NOT NULL);\n"
         "CREATE TABLE place (layout INTEGER, kind TEXT, number INTEGER, module INTEGER, place INTEGER,\n"
         "  PRIMARY KEY (layout, kind, number)) WITHOUT ROWID;\n"
         "CREATE TABLE life (id INTEGER PRIMARY KEY, token TEXT NOT NULL, version TEXT NOT NULL,\n"
         "  pack_name TEXT NOT NULL, config TEXT NOT NULL, period_s INTEGER, layout INTEGER);\n"
         "CREATE TABLE minute (sequence INTEGER PRIMARY KEY" +
         definitions(row_columns_of(1)) +
         ",\n  cells BLOB, sensors BLOB, checksum INTEGER);\n"
         "CREATE INDEX minute_by_time ON minute (unix_time_ms);\n"
         "CREATE TABLE event (sequence INTEGER PRIMARY KEY" +
         definitions(event_columns()) + ",\n  checksum INTEGER);\n" +
         view_sql("cell_minute", "cells", "'cell'", cell_bytes,
                  {{"voltage_average_uV", voltage},
                   {"voltage_min_uV", voltage},
                   {"voltage_max_uV", voltage},
                   {"voltage_samples", ""},
                   {"soc_permille", ""},
                   {"health_by_capacity_permille", ""},
                   {"health_by_resistance_permille", ""},
                   {"bled_permille", ""}}) +
         view_sql("sensor_minute", "sensors", "'sensor', 'board'", sensor_bytes,
                  {{"temperature_average_dC", temperature},
                   {"temperature_min_dC", temperature},
                   {"temperature_max_dC", temperature},
                   {"temperature_samples", ""}});
}

// --- version 2 ---

/// Existing rows have no values in the new columns, and are not changed.
std::string version_2() {
  std::string text;
  for (const HistoryColumn<HistoryRow>& column : row_columns_of(2)) {
    text += "ALTER TABLE minute ADD COLUMN " + std::string(column.name) +
            (column.number != nullptr ? " INTEGER" : " TEXT NOT NULL DEFAULT ''") + ";\n";
  }
  return text;
}

constexpr std::array step_table{SchemaStep{.version = 1, .sql = version_1}, SchemaStep{.version = 2, .sql = version_2}};
static_assert(step_table.back().version == history_version);

DatabaseResult<void> take(const Database& database, const SchemaStep& step) {
  // Not IMMEDIATE: that creates the first page, after which the setting of auto_vacuum has no effect.
  const std::string text =
      "BEGIN;\n" + step.sql() + ";PRAGMA user_version = " + std::to_string(step.version) + ";\nCOMMIT;";
  auto taken = database.run(text);
  if (!taken && database.is_in_transaction()) static_cast<void>(database.run("ROLLBACK"));
  return taken;
}

/// One text for each object of the schema.
DatabaseResult<std::vector<std::string>> things_in(const Database& database) {
  auto statement = database.prepare("SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE sql IS NOT NULL");
  if (!statement) return failure(statement.error());
  std::vector<std::string> things;
  while (true) {
    const auto has_row = statement->step();
    if (!has_row) return failure(has_row.error());
    if (!*has_row) return things;
    std::string thing;
    for (int column = 0; column < 4; ++column) thing += std::string(statement->text(column).value_or("?")) + "\n";
    things.push_back(std::move(thing));
  }
}

/// All columns of the table, in its order.
std::string minute_names(std::int64_t version) {
  std::string text = "sequence" + names(row_columns_of(1)) + ", cells, sensors, checksum";
  for (std::int64_t added = 2; added <= version; ++added) text += names(row_columns_of(added));
  return text;
}

/// Comparison of a database with the result of the steps.
struct Comparison {
  bool has_all = false;
  bool has_more = false;
};

DatabaseResult<Comparison> compare(const Database& database, std::span<const SchemaStep> steps) {
  auto model = Database::open(":memory:", OpenAs::writer);
  if (!model) return failure(model.error());
  if (auto made = migrate(*model, steps); !made) return failure(made.error());
  const auto wanted = things_in(*model);
  if (!wanted) return failure(wanted.error());
  const auto found = things_in(database);
  if (!found) return failure(found.error());
  const bool has_all = std::all_of(wanted->begin(), wanted->end(), [&](const std::string& thing) {
    return std::find(found->begin(), found->end(), thing) != found->end();
  });
  return Comparison{.has_all = has_all, .has_more = found->size() > wanted->size()};
}

}  // namespace

std::span<const SchemaStep> history_steps(std::int64_t version) {
  return std::span(step_table).first(static_cast<std::size_t>(version));
}

DatabaseResult<void> migrate(const Database& database, std::span<const SchemaStep> steps) {
  const auto version = database.number("PRAGMA user_version");
  if (!version) return failure(version.error());
  for (const SchemaStep& step : steps) {
    if (step.version <= version->value_or(0)) continue;
    if (auto taken = take(database, step); !taken) return taken;
  }
  return {};
}

DatabaseResult<bool> has_schema(const Database& database, std::span<const SchemaStep> steps) {
  const auto compared = compare(database, steps);
  if (!compared) return failure(compared.error());
  return compared->has_all;
}

DatabaseResult<bool> is_schema(const Database& database, std::span<const SchemaStep> steps) {
  const auto compared = compare(database, steps);
  if (!compared) return failure(compared.error());
  return compared->has_all && !compared->has_more;
}

DatabaseResult<std::optional<std::int64_t>> version_by_tables(const Database& database) {
  for (std::int64_t version = history_version; version >= 1; --version) {
    const auto is_this = is_schema(database, history_steps(version));
    if (!is_this) return failure(is_this.error());
    if (*is_this) return std::optional(version);
  }
  return std::optional<std::int64_t>{};
}

std::string insert_minute_sql() {
  return insert_sql("minute", minute_names(history_version), minute_columns(history_version));
}

std::string select_minutes_sql(std::int64_t version) {
  std::string text = "SELECT " + minute_names(version);
  for (std::size_t missing = minute_columns(version); missing < minute_columns(history_version); ++missing) {
    text += ", NULL";
  }
  return text + " FROM minute";
}

std::string insert_event_sql() {
  return insert_sql("event", "sequence" + names(event_columns()) + ", checksum", event_columns().size() + 2);
}

std::string select_events_sql() {
  return "SELECT sequence" + names(event_columns()) + ", checksum FROM event";
}

}  // namespace bmu
