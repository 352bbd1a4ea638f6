// Values of one row, from a statement or from a page that is read by itself (stray_rows.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/history/database.hpp"

namespace bmu {

class RowValues {
 public:
  RowValues() = default;
  RowValues(const RowValues&) = delete;
  RowValues& operator=(const RowValues&) = delete;
  virtual ~RowValues() = default;
  /// None if it is not an integer.
  [[nodiscard]] virtual std::optional<std::int64_t> number(int column) const = 0;
  /// None if it is neither text nor bytes. Valid as long as this object.
  [[nodiscard]] virtual std::optional<std::string_view> text(int column) const = 0;
};

/// Values of the current row of a statement.
class StatementRow : public RowValues {
 public:
  explicit StatementRow(const Statement& statement) : statement_(statement) {}
  [[nodiscard]] std::optional<std::int64_t> number(int column) const override { return statement_.number(column); }
  [[nodiscard]] std::optional<std::string_view> text(int column) const override { return statement_.text(column); }

 private:
  const Statement& statement_;
};

}  // namespace bmu
