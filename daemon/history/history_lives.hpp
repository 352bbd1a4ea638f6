// Sessions of the daemon and their layouts, as far as they are readable in a database.
//
// The position of each cell is stored twice, as text (`layout`) and row by row (`place`); if one is damaged the other
// is used. A row gives the number of its cells and sensors: if both are damaged, a known layout with the same numbers
// is used, and otherwise they are numbered as those of one module, number 0. problems() reports this.
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

/// Properties of a session, derived from its rows.
struct LifeOfRows {
  std::size_t cells = 0;
  std::size_t sensors = 0;
  std::map<std::int64_t, std::size_t> spans_s;  // number of rows of each length
};

class HistoryLives {
 public:
  /// Takes some milliseconds.
  void read(const Database& database);
  /// Adds sessions that are only found page by page to those that are known. Missing ones are not detected: `complete`
  /// has to follow.
  void read(StrayRows& rows);
  /// False: rows may belong to sessions that are unknown or incomplete; `complete` derives those from the rows.
  [[nodiscard]] bool are_whole() const { return problems_.empty(); }
  void complete(const std::map<std::int64_t, LifeOfRows>& of_rows);

  /// In ascending order of their id.
  [[nodiscard]] const std::vector<HistoryLife>& all() const { return lives_; }
  /// Null: unknown.
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

  std::map<std::int64_t, HistoryLayout> layouts_;  // by id
  std::vector<HistoryLife> lives_;
  std::vector<std::string> problems_;
};

}  // namespace bmu
