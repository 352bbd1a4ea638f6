// Tables of a history, in versions: PRAGMA user_version gives that of a file, and steps migrate from each to the next.
// Rationale for the tables: docs/decisions/0014-history.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "daemon/history/database.hpp"

namespace bmu {

/// "bmud": distinguishes files of bmud from those of other programs (PRAGMA application_id).
inline constexpr std::int64_t history_application_id = 0x62'6D'75'64;
inline constexpr std::int64_t history_version = 2;
/// Page size of each history, whatever the header of a damaged one states.
inline constexpr std::size_t history_page_bytes = 8'192;
/// No history has as many rows, and no time is as many milliseconds: a larger number is invalid.
inline constexpr std::int64_t history_number_max = std::int64_t{1} << 52;

/// Migrates to `version` from the one before.
struct SchemaStep {
  std::int64_t version = 0;
  std::string (*sql)() = nullptr;
};
/// Steps up to `version`, the first one from an empty file.
[[nodiscard]] std::span<const SchemaStep> history_steps(std::int64_t version = history_version);

/// Executes the steps beyond the version of the database, each completely or not at all.
[[nodiscard]] DatabaseResult<void> migrate(const Database& database, std::span<const SchemaStep> steps);

/// Whether all that the steps create is in the database, word for word. More may be.
[[nodiscard]] DatabaseResult<bool> has_schema(const Database& database, std::span<const SchemaStep> steps);
/// The same, and nothing else is in it: then the steps have created it, whatever its version number.
[[nodiscard]] DatabaseResult<bool> is_schema(const Database& database, std::span<const SchemaStep> steps);

/// The version with exactly the tables that are in the database, whatever its version number; none if there is none.
[[nodiscard]] DatabaseResult<std::optional<std::int64_t>> version_by_tables(const Database& database);

/// "INSERT INTO minute (...) VALUES (...)": sequence, the columns of the first version in the order of
/// history_columns.hpp, for a minute `cells` and `sensors`, `checksum`, and the columns of the later versions. The
/// SELECT has the same order, which is that of the table. `version`: of the database; columns that it lacks are NULL.
[[nodiscard]] std::string insert_minute_sql();
[[nodiscard]] std::string select_minutes_sql(std::int64_t version = history_version);
[[nodiscard]] std::string insert_event_sql();
[[nodiscard]] std::string select_events_sql();

}  // namespace bmu
