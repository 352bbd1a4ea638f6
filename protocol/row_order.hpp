// Check that a table that is indexed by an enumeration is in the order of that enumeration.
#pragma once

#include <cstddef>

namespace bmu {

/// `id`: the member that identifies a row.
template <class Table, class Row, class Id>
[[nodiscard]] consteval bool rows_are_in_order(const Table& table, Id Row::*id) {
  std::size_t number = 0;
  for (const Row& row : table) {
    if (static_cast<std::size_t>(row.*id) != number++) return false;
  }
  return true;
}

}  // namespace bmu
