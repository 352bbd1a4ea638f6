#include "daemon/history/stray_rows.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace bmu {

namespace {

constexpr unsigned char leaf_of_table = 0x0D;
constexpr std::size_t leaf_header_bytes = 8;
constexpr std::uint64_t record_bytes_max = 1 << 20;  // as in database.cpp

std::uint64_t big_endian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = at; i < at + count && i < bytes.size(); ++i) {
    value = value << 8U | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

/// Varint: seven bits a byte, the high ones first, all eight of the ninth; none if it is incomplete.
std::optional<std::uint64_t> take_varint(std::string_view& bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(bytes.size(), 9); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[i]);
    value = i == 8 ? value << 8U | byte : value << 7U | (byte & 0x7FU);
    if (i == 8 || byte < 0x80) {
      bytes.remove_prefix(i + 1);
      return value;
    }
  }
  return std::nullopt;
}

struct Column {
  std::uint64_t type = 0;
  std::size_t at = 0;
};

/// Size of a value of this serial type, in bytes.
std::size_t size_of(std::uint64_t type) {
  constexpr std::size_t sizes[] = {0, 1, 2, 3, 4, 6, 8, 8, 0, 0, 0, 0};
  return type < 12 ? sizes[type] : static_cast<std::size_t>((type - 12) / 2);
}

std::int64_t signed_of(std::string_view bytes, const Column& column) {
  const std::size_t count = size_of(column.type);
  const std::uint64_t value = big_endian(bytes, column.at, count);
  const auto shift = static_cast<unsigned>(64 - 8 * count);
  return static_cast<std::int64_t>(value << shift) >> shift;
}

/// A parsed record.
class Record : public RowValues {
 public:
  Record(std::string bytes, std::int64_t rowid) : bytes_(std::move(bytes)), rowid_(rowid) {
    std::string_view rest = bytes_;
    const auto head_bytes = static_cast<std::size_t>(take_varint(rest).value_or(0));
    const std::size_t own_bytes = bytes_.size() - rest.size();
    if (head_bytes < own_bytes || head_bytes > bytes_.size()) return;
    std::string_view head = rest.substr(0, head_bytes - own_bytes);
    std::size_t at = head_bytes;
    while (!head.empty()) {
      const auto type = take_varint(head);
      if (!type || *type / 2 > record_bytes_max || at + size_of(*type) > bytes_.size()) {
        columns_.clear();
        return;
      }
      columns_.push_back({.type = *type, .at = at});
      at += size_of(*type);
    }
  }

  [[nodiscard]] std::size_t columns() const { return columns_.size(); }
  [[nodiscard]] std::optional<std::int64_t> number(int column) const override {
    if (column == 0) return rowid_;
    const Column found = column_at(column);
    if (found.type == 8 || found.type == 9) return static_cast<std::int64_t>(found.type - 8);
    if (found.type == 0 || found.type > 6) return std::nullopt;
    return signed_of(bytes_, found);
  }
  [[nodiscard]] std::optional<std::string_view> text(int column) const override {
    const Column found = column_at(column);
    if (found.type < 12) return std::nullopt;
    return std::string_view(bytes_).substr(found.at, size_of(found.type));
  }

 private:
  /// A missing column is NULL, type 0.
  [[nodiscard]] Column column_at(int column) const {
    const auto index = static_cast<std::size_t>(column);
    return index < columns_.size() ? columns_[index] : Column{};
  }

  std::string bytes_;
  std::int64_t rowid_;
  std::vector<Column> columns_;
};

}  // namespace

StrayRows::StrayRows(const std::string& path, std::size_t page_bytes)
    : file_(path, std::ios::binary), page_bytes_(page_bytes) {
  std::string bytes;
  // Page 1 has the schema, and no rows of the tables.
  for (pages_ = 2; read_page(pages_, bytes); ++pages_) look_at(pages_, bytes);
}

bool StrayRows::read_page(std::uint32_t page, std::string& to) {
  to.resize(page_bytes_);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(page_bytes_) * (page - 1));
  return static_cast<bool>(file_.read(to.data(), static_cast<std::streamsize>(page_bytes_)));
}

void StrayRows::look_at(std::uint32_t page, const std::string& bytes) {
  if (static_cast<unsigned char>(bytes[0]) != leaf_of_table) return;
  const std::uint64_t cells = std::min<std::uint64_t>(big_endian(bytes, 3, 2), (page_bytes_ - leaf_header_bytes) / 2);
  for (std::size_t i = 0; i < cells; ++i) {
    const std::size_t at = static_cast<std::size_t>(big_endian(bytes, leaf_header_bytes + 2 * i, 2));
    if (at < leaf_header_bytes || at >= page_bytes_) continue;
    std::string_view cell = std::string_view(bytes).substr(at);
    const auto size = take_varint(cell);
    const auto rowid = take_varint(cell);
    if (!size || !rowid || *size > record_bytes_max) continue;
    rows_.emplace(static_cast<std::int64_t>(*rowid), Place{.page = page, .at = static_cast<std::uint32_t>(at)});
  }
}

/// The record with its parts on other pages; "" if it is incomplete.
std::string StrayRows::record_at(const Place& place) {
  std::string bytes;
  if (!read_page(place.page, bytes)) return "";
  std::string_view cell = std::string_view(bytes).substr(place.at, page_bytes_ - place.at);
  const auto size = static_cast<std::size_t>(take_varint(cell).value_or(0));
  if (!take_varint(cell)) return "";
  const std::size_t local_max = page_bytes_ - 35;
  const std::size_t local_min = (page_bytes_ - 12) * 32 / 255 - 23;
  const std::size_t left_over = local_min + (size - std::min(size, local_min)) % (page_bytes_ - 4);
  const std::size_t local = size <= local_max ? size : left_over <= local_max ? left_over : local_min;
  if (cell.size() < local) return "";
  std::string record(cell.substr(0, local));
  std::uint64_t next = size == local ? 0 : big_endian(cell, local, 4);
  while (record.size() < size) {
    if (next < 2 || next > pages_ || !read_page(static_cast<std::uint32_t>(next), bytes)) return "";
    record += std::string_view(bytes).substr(4, std::min(size - record.size(), page_bytes_ - 4));
    next = big_endian(bytes, 0, 4);
  }
  return record;
}

void StrayRows::for_each(const Columns& columns, std::int64_t first, std::int64_t last,
                         const std::function<bool(const RowValues& row, std::int64_t rowid)>& take) {
  for (auto at = rows_.lower_bound(first); at != rows_.end() && at->first <= last; ++at) {
    const Record record(record_at(at->second), at->first);
    const bool fits = record.columns() >= columns.min && record.columns() <= columns.max;
    if (fits && !take(record, at->first)) return;
  }
}

}  // namespace bmu
