// Rows of a damaged SQLite file, found page by page: a page that holds rows is read by itself, whether what leads to it
// is still there or not (sqlite.org/fileformat2.html). What is found may be an older state of a row, or made up:
// whoever takes it checks it by a checksum of its own.
//
// Only the file itself is looked at, not a log beside it. Cost: the file is read once, 16 bytes a row stay in memory.
#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <map>
#include <string>

#include "daemon/history/row_values.hpp"

namespace bmu {

class StrayRows {
 public:
  /// Of nothing that can be read there are none. What the file says of itself is not asked, the page size neither: it
  /// stands at the beginning, and may be what is damaged. `page_bytes` is a power of 2 from 512 on.
  StrayRows(const std::string& path, std::size_t page_bytes);

  /// How many columns a row may have: one that was written before a column was added has fewer.
  struct Columns {
    std::size_t min = 0;
    std::size_t max = 0;
  };

  /// All with so many columns from one rowid to another, rising, until `take` returns false. Column 0 is the rowid;
  /// columns that a row does not have are none. There may be several with the same rowid.
  void for_each(const Columns& columns, std::int64_t first, std::int64_t last,
                const std::function<bool(const RowValues& row, std::int64_t rowid)>& take);

 private:
  struct Place {
    std::uint32_t page = 0;  // from 1
    std::uint32_t at = 0;    // of the cell in it
  };
  [[nodiscard]] bool read_page(std::uint32_t page, std::string& to);
  void look_at(std::uint32_t page, const std::string& bytes);
  [[nodiscard]] std::string record_at(const Place& place);

  std::ifstream file_;
  std::size_t page_bytes_;
  std::uint32_t pages_ = 0;
  std::multimap<std::int64_t, Place> rows_;
};

}  // namespace bmu
