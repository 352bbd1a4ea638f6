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
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace bmu {

/// The values of one row, wherever they come from.
class RowValues {
 public:
  RowValues() = default;
  RowValues(const RowValues&) = delete;
  RowValues& operator=(const RowValues&) = delete;
  virtual ~RowValues() = default;
  /// None if it is not an integer.
  [[nodiscard]] virtual std::optional<std::int64_t> number(int column) const = 0;
  /// None if it is neither text nor bytes. Holds as long as this.
  [[nodiscard]] virtual std::optional<std::string_view> text(int column) const = 0;
};

class StrayRows {
 public:
  /// Of nothing that can be read there are none.
  explicit StrayRows(const std::string& path);

  /// All with so many columns from one rowid to another, rising, until `take` returns false. Column 0 is the rowid.
  /// There may be several with the same.
  void for_each(std::size_t columns, std::int64_t first, std::int64_t last,
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
  std::size_t page_bytes_ = 0;
  std::size_t usable_bytes_ = 0;
  std::uint32_t pages_ = 0;
  std::multimap<std::int64_t, Place> rows_;
};

}  // namespace bmu
