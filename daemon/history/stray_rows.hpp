// Salvage of rows from a damaged SQLite file, page by page: a page with rows is read by itself, whether the pages that
// lead to it are intact or not (sqlite.org/fileformat2.html). A row that is found may be an older state, or forged: the
// caller has to verify it by its own checksum.
//
// Only the file itself is read, not a log beside it. Cost: the file is read once, 16 bytes a row stay in memory.
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
  /// An unreadable file has no rows. The header of the file is not used, nor its page size: it may be the damaged part.
  /// `page_bytes` is a power of 2 from 512 on.
  StrayRows(const std::string& path, std::size_t page_bytes);

  /// Permitted number of columns of a row: one that was written before a column was added has fewer.
  struct Columns {
    std::size_t min = 0;
    std::size_t max = 0;
  };

  /// Calls `take` for all rows with such a number of columns and with rowids from `first` to `last`, ascending, until
  /// it returns false. Column 0 is the rowid; columns that a row lacks are empty. Several rows may have the same rowid.
  void for_each(const Columns& columns, std::int64_t first, std::int64_t last,
                const std::function<bool(const RowValues& row, std::int64_t rowid)>& take);

 private:
  struct Place {
    std::uint32_t page = 0;  // from 1
    std::uint32_t at = 0;    // offset of the cell in it
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
