// The lives of the daemon and their layouts, as far as a database still says them.
//
// Which cell sits where stands in a database twice, as text (`layout`) and row by row (`place`); where the one is
// damaged the other tells. A row brings the number of its cells and sensors: where both are damaged, a layout that is
// known and has as many is taken, and else they are counted through as of one module, number 0. What was done so is
// told.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/history/database.hpp"
#include "daemon/history/history_row.hpp"
#include "daemon/history/row_values.hpp"
#include "daemon/history/stray_rows.hpp"

namespace bmu {

/// What the rows of a life say of it.
struct LifeOfRows {
  std::size_t cells = 0;
  std::size_t sensors = 0;
  std::map<std::int64_t, std::size_t> spans_s;  // how long how many of them were
};

class HistoryLives {
 public:
  /// Some milliseconds.
  void read(const Database& database);
  /// Those to which nothing leads any more beside those that are known. What is missing is not noticed: `complete` has
  /// to follow.
  void read(StrayRows& rows);
  /// False: rows may be of lives that are not known, or not whole; `complete` with what the rows say helps.
  [[nodiscard]] bool are_whole() const { return problems_.empty(); }
  void complete(const std::map<std::int64_t, LifeOfRows>& of_rows);

  /// Rising by their id.
  [[nodiscard]] const std::vector<HistoryLife>& all() const { return lives_; }
  /// Null: not known.
  [[nodiscard]] const HistoryLife* find(const HistoryNumber& id) const;
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

 private:
  template <class Take>
  void read_rows(const Database& database, const char* statement_text, const std::string& table, Take take);
  void read_layouts(const Database& database);
  void read_places(const Database& database);
  void read_table(const Database& database);
  void take_layout(const RowValues& row);
  void take_life(std::int64_t id, const RowValues& row);
  void fill(HistoryLife& life, const LifeOfRows& rows);
  void problem(const std::string& text) {
    if (std::find(problems_.begin(), problems_.end(), text) == problems_.end()) problems_.push_back(text);
  }

  std::map<std::int64_t, HistoryLayout> layouts_;  // by their id
  std::vector<HistoryLife> lives_;
  std::vector<std::string> problems_;
};

}  // namespace bmu
