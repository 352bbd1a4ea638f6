// Rows and events of a history as text: lines of CSV, lines of JSON, and tables. Names of columns and keys are those of
// the members (daemon/history/history_row.hpp), with their units; the `time` column is UTC.
//
// Texts of a database are untrusted: characters that could move a cursor are shown as "?".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/history/history_row.hpp"
#include "tools/common/page.hpp"

namespace bmu {

/// "cell_1.3_voltage_average_uV" and so on for each of `cells`; and for the sensors of their modules,
/// "sensor_1.2_temperature_average_dC", "board_1.1_...".
[[nodiscard]] std::string csv_head(const std::vector<HistoryPlace>& cells, const std::vector<HistoryPlace>& sensors);
/// `layout` is that of the row's session: a position that it does not have is empty.
[[nodiscard]] std::string csv_line(const HistoryRow& row, const HistoryLayout& layout,
                                   const std::vector<HistoryPlace>& cells, const std::vector<HistoryPlace>& sensors);
[[nodiscard]] std::string csv_event_head();
[[nodiscard]] std::string csv_line(const HistoryEvent& event);

/// With `cells` and `sensors` as lists of objects if they are not empty.
[[nodiscard]] std::string json_line(const HistoryRow& row, const std::vector<HistoryPlace>& cells,
                                    const std::vector<HistoryPlace>& sensors);
[[nodiscard]] std::string json_line(const HistoryEvent& event);

/// For a history without minutes: "recorded yet in PATH; the first minute comes after 30 to 90 s". Minutes end at full
/// minutes of the clock, and the first covers at least half of the period.
[[nodiscard]] std::string recorded_yet_text(const std::string& path, std::int64_t period_s);
/// The same as an object, instead of rows: "nothing_recorded_yet" (true), "path" and "period_s".
[[nodiscard]] std::string nothing_json_line(const std::string& path, std::int64_t period_s);

/// A table that grows row by row; each session of the daemon gets a heading. With `cells`, their average voltages
/// instead of the minimum and maximum.
class HistoryTable {
 public:
  explicit HistoryTable(std::vector<HistoryPlace> cells) : cells_(std::move(cells)) {}

  void add(const HistoryRow& row, const HistoryLife& life);
  void add(const HistoryEvent& event);
  [[nodiscard]] bool is_empty() const { return tables_.empty() && events_.empty(); }
  [[nodiscard]] Page page() const;

 private:
  struct OfLife {
    std::int64_t life = 0;
    std::string heading;
    std::vector<Line> rows;
  };
  [[nodiscard]] Line head() const;

  std::vector<HistoryPlace> cells_;
  std::vector<OfLife> tables_;
  std::vector<Line> events_;
};

}  // namespace bmu
