// Reader of a history, whether the daemon is writing it or not. Never changes it.
//
//   auto history = HistoryReader::open("/var/lib/bmud/history.sqlite");
//   if (!history) return complain(history.error());
//   history->for_each_row({.from_unix_ms = yesterday, .to_unix_ms = today}, [&](const HistoryRow& row) {
//     const HistoryLayout& layout = history->life_of(row)->layout;      // position of each cell
//     for (const HistoryPlace& place : layout.cells()) draw(place, row.cells[place.number - 1].voltage_average_uV);
//     return true;                                                      // false: stop
//   });
//   for (const std::string& problem : history->problems()) warn(problem);
//
// Rows are returned in the order in which they were written, which is that of time unless the clock was set. Content
// and units of a row: history_row.hpp. A file that is damaged, truncated or forged is read as far as it is valid: each
// row has a checksum, and rows with a wrong one are omitted and listed in problems(). If only the structures that lead
// to the rows (stray_rows.hpp) or the tables beside them (history_lives.hpp) are damaged no row is lost; nor if the
// beginning of the file is, without which SQLite opens nothing: a valid row on any of its pages identifies it as a
// history. While no process has the file open, reading requires neither disk space nor write permission.
//
// A history of an older schema is read as it is: columns that its rows lack are empty.
//
// A file that the daemon is just creating opens as a history without rows: an empty file, a database without tables,
// one that its creator holds locked, and the remains of a creator that was killed. From then until the end of its first
// period it has events alone; has_no_minute_yet() is true of both.
//
// Cost: some 10 us a row of 96 cells, plus the disk's part; one row is in memory at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/history/database.hpp"
#include "daemon/history/history_lives.hpp"
#include "daemon/history/history_row.hpp"
#include "daemon/history/history_schema.hpp"
#include "daemon/history/stray_rows.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Span of the wall clock, ms since 1970; `to` is exclusive. A bound that is not given does not limit; rows with an
/// unknown time belong only to a span without bounds.
struct HistorySpan {
  HistoryNumber from_unix_ms;
  HistoryNumber to_unix_ms;

  [[nodiscard]] bool has(const HistoryNumber& unix_time_ms) const;
};

/// Permitted ways to open a history. In the process that writes it, its file must not be opened and closed outside
/// SQLite: by POSIX that ends all locks of the process, including the writer's.
enum class HistoryAccess : std::uint8_t { in_any_way, beside_writer };

class HistoryReader {
 public:
  /// The error is a message for the user, and includes the path.
  [[nodiscard]] static Result<HistoryReader, std::string> open(const std::string& path,
                                                               HistoryAccess access = HistoryAccess::in_any_way);

  /// Calls `take` for all readable rows of each kind within the span, the oldest first, until it returns false.
  void for_each_row(const HistorySpan& span, const std::function<bool(const HistoryRow&)>& take);
  /// For reading in pieces: rows after that sequence number, whatever their time; -1 for all.
  void for_each_row_after(std::int64_t sequence, const std::function<bool(const HistoryRow&)>& take);
  void for_each_event(const HistorySpan& span, const std::function<bool(const HistoryEvent&)>& take);

  /// No minute was recorded when it was opened, and nothing is damaged; events may exist, and a minute may have been
  /// added since.
  [[nodiscard]] bool has_no_minute_yet() const { return has_no_minute_; }
  /// Length of a minute in s, in the newest session; the default if no session is known.
  [[nodiscard]] std::int64_t period_s() const;
  [[nodiscard]] const std::vector<HistoryLife>& lives() const { return lives_.all(); }
  /// Session of a row that was read: never null.
  [[nodiscard]] const HistoryLife* life_of(const HistoryRow& row) const { return lives_.find(row.life); }
  /// Span of the rows that have a time: from the start of the first one to just after the start of the last one.
  [[nodiscard]] HistorySpan covered();
  /// Parts that could not be read so far, a sentence each; consecutive rows share one.
  [[nodiscard]] std::vector<std::string> problems() const;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  /// Unreadable rows of a table, with the reason.
  struct Gap {
    std::string table;
    std::int64_t first = 0;
    std::int64_t last = 0;
    std::string reason;
  };
  struct Range {
    std::int64_t first = 0;
    std::int64_t last = 0;
  };
  struct Table {
    std::string name;
    std::string select;
    std::size_t columns = 0;                              // of a row of the newest version
    std::size_t columns_min = 0;                          // of the oldest
    bool (*is_whole)(const RowValues& values) = nullptr;  // whether its checksum is valid
  };
  using TakeValues = std::function<bool(const RowValues& values, std::int64_t sequence)>;
  struct Refusal {
    std::string why;
    bool may_be_damage = true;
  };

  explicit HistoryReader(std::string path) : path_(std::move(path)) {}
  HistoryReader(std::string path, Database database) : path_(std::move(path)), database_(std::move(database)) {}
  [[nodiscard]] static Result<HistoryReader, std::string> open_new(const std::string& path);
  [[nodiscard]] static Result<HistoryReader, std::string> open_as_it_can_be(const std::string& path,
                                                                            HistoryAccess access);
  [[nodiscard]] static Result<HistoryReader, std::string> open_without_company(const std::string& path,
                                                                               const DatabaseError& error);
  [[nodiscard]] static Result<HistoryReader, std::string> open_ruin(const std::string& path, HistoryAccess access,
                                                                    const DatabaseError& error);
  [[nodiscard]] static Result<HistoryReader, std::string> open_by_pages(const std::string& path, HistoryAccess access,
                                                                        const std::string& refusal);
  [[nodiscard]] Result<void, Refusal> check();
  [[nodiscard]] Result<void, Refusal> check_version();
  void find_version();
  [[nodiscard]] bool has_no_table_yet() const;
  [[nodiscard]] bool is_known_to_be_without(const Table& table) const;
  [[nodiscard]] bool has_whole_row();
  void read_lives();
  [[nodiscard]] Range range_of(const HistorySpan& span);
  [[nodiscard]] const Table& minutes() const;
  [[nodiscard]] static const Table& events();
  [[nodiscard]] Range range_of(const Table& table);
  [[nodiscard]] Range range_of_strays(const Table& table, const std::string& trouble);
  void read_rows(const HistorySpan& span, Range range, const std::function<bool(const HistoryRow&)>& take);
  [[nodiscard]] std::string misfit_of(const HistoryRow& row) const;
  void scan(const Table& table, Range range, const TakeValues& take);
  void scan_quietly(const Table& table, const TakeValues& take);
  [[nodiscard]] bool bridge(const Table& table, Range gap, const std::string& trouble, const TakeValues& take);
  [[nodiscard]] StrayRows& strays();
  void note(const std::string& problem) {
    if (std::find(notes_.begin(), notes_.end(), problem) == notes_.end()) notes_.push_back(problem);
  }
  void note_damaged_beginning() { note(path_ + " is damaged at its beginning: what of it can be read follows"); }
  void note_gap(const std::string& table, std::int64_t first, std::int64_t last, const std::string& reason);

  std::string path_;
  HistoryAccess access_ = HistoryAccess::in_any_way;
  std::optional<Database> database_;  // none: SQLite cannot open the file, its rows are found page by page
  bool is_ruin_ = false;              // damaged: nothing is looked up, everything is scanned
  bool is_new_ = false;               // neither minute nor event
  bool has_no_minute_ = false;
  std::int64_t version_ = history_version;  // of the tables
  HistoryLives lives_;
  std::unique_ptr<StrayRows> strays_;  // made when first needed; empty beside the writer
  std::vector<std::string> notes_;
  std::vector<Gap> gaps_;
};

}  // namespace bmu
