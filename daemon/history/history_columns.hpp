// The columns of the history's tables as rows: a name, which is the member's, and where the value is. From them come
// the statements that make, fill and read the tables, the checksum of a row, and what `bmuctl history` writes as CSV
// and JSON.
//
// Each version of the schema has the columns of those before it, and adds its own behind them: `row_columns_of` has
// those of one version, and a step in history_schema.cpp makes them. Rows that were written before have none in them.
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

/// Without `sequence`, the arrays and the checksum; of all versions, the first version's first.
[[nodiscard]] std::span<const HistoryColumn<HistoryRow>> row_columns();
/// Those that this version of the schema has added, from 1 to history_version.
[[nodiscard]] std::span<const HistoryColumn<HistoryRow>> row_columns_of(std::int64_t version);
/// How many columns the table of minutes has: `sequence`, both arrays and the checksum included.
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
