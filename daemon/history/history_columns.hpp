// Columns of the history's tables as rows: a name, which is the member's, and the location of the value. The statements
// that create, fill and read the tables, the checksum of a row, and the CSV and JSON output of `bmuctl history` are
// derived from them.
//
// Each version of the schema has the columns of those before it, and appends its own: `row_columns_of` has those of one
// version, and a step in history_schema.cpp creates them. Rows that were written before have no values in them.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "daemon/history/history_row.hpp"

namespace bmu {

/// Exactly one of the two members is given.
template <class Row>
struct HistoryColumn {
  std::string_view name;
  HistoryNumber Row::*number = nullptr;
  std::string Row::*text = nullptr;
};

/// Columns of all versions, the first version's first; without `sequence`, the arrays and the checksum.
[[nodiscard]] std::span<const HistoryColumn<HistoryRow>> row_columns();
/// Columns that this version of the schema has added, from 1 to history_version.
[[nodiscard]] std::span<const HistoryColumn<HistoryRow>> row_columns_of(std::int64_t version);
/// Number of columns of the table of minutes: `sequence`, both arrays and the checksum included.
[[nodiscard]] std::size_t minute_columns(std::int64_t version);
[[nodiscard]] std::span<const HistoryColumn<HistoryEvent>> event_columns();

struct HistoryCellColumn {
  std::string_view name;
  HistoryNumber (*read)(const HistoryCell&);
};
[[nodiscard]] std::span<const HistoryCellColumn> cell_columns();

struct HistorySensorColumn {
  std::string_view name;
  HistoryNumber (*read)(const HistorySensor&);
};
[[nodiscard]] std::span<const HistorySensorColumn> sensor_columns();

}  // namespace bmu
