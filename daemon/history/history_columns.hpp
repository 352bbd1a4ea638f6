// The columns of the history's tables as rows: a name, which is the member's, and where the value is. From them come
// the statements that make, fill and read the tables, the checksum of a row, and what `bmuctl history` writes as CSV
// and JSON.
//
// The schema's first version is made of all of them. A later one adds rows here and a step in history_schema.cpp.
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

/// Without `sequence`, the arrays and the checksum.
[[nodiscard]] std::span<const HistoryColumn<HistoryRow>> row_columns();
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
