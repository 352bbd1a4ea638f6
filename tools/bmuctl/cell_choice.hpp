// Selection of the cells to show, as words of a command line.
//
//   all      19 (no. 19 of the pack)      1.3 (cell 3 of module 1)      2.* (all of module 2)      1.3,2.*,19
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/history/history_row.hpp"

namespace bmu {

inline constexpr const char* cell_choice_form = "all, or numbers like 19, 1.3 or 2.* with commas between";

/// One word of a selection: a missing number matches any.
struct CellWord {
  std::optional<std::int64_t> number;
  std::optional<std::int64_t> module;
  std::optional<std::int64_t> place;
  std::string text = "all";

  [[nodiscard]] bool is_meant(const HistoryPlace& cell) const;
};
using CellChoice = std::vector<CellWord>;

/// None if the text is not valid.
[[nodiscard]] std::optional<CellChoice> cell_choice_from(std::string_view text);
/// The first word that matches none of the cells; "" if each matches some.
[[nodiscard]] std::string meant_by_none(const CellChoice& choice, const std::vector<HistoryPlace>& cells);
/// The cells that at least one word matches, in their order.
[[nodiscard]] std::vector<HistoryPlace> chosen(const CellChoice& choice, const std::vector<HistoryPlace>& cells);

}  // namespace bmu
