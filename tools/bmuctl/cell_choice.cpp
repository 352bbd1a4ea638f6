#include "tools/bmuctl/cell_choice.hpp"

#include <algorithm>

#include "protocol/number_text.hpp"

namespace bmu {

namespace {

/// The whole text as a number from 1.
std::optional<std::int64_t> number_from(std::string_view text) {
  const auto number = number_of_text<std::int64_t>(text);
  return number && *number >= 1 ? number : std::nullopt;
}

std::optional<CellWord> word_from(std::string_view text) {
  if (text == "all") return CellWord{};
  const std::size_t point = text.find('.');
  if (point == std::string_view::npos) {
    const auto number = number_from(text);
    return number ? std::optional(CellWord{.number = number, .module = {}, .place = {}, .text = {}}) : std::nullopt;
  }
  const std::string_view behind = text.substr(point + 1);
  const CellWord word{
      .number = {}, .module = number_from(text.substr(0, point)), .place = number_from(behind), .text = {}};
  return word.module && (word.place || behind == "*") ? std::optional(word) : std::nullopt;
}

}  // namespace

bool CellWord::is_meant(const HistoryPlace& cell) const {
  return number.value_or(cell.number) == cell.number && module.value_or(cell.module) == cell.module &&
         place.value_or(cell.place) == cell.place;
}

std::optional<CellChoice> cell_choice_from(std::string_view text) {
  CellChoice choice;
  while (true) {
    const std::size_t comma = text.find(',');
    const auto word = word_from(text.substr(0, comma));
    if (!word) return std::nullopt;
    choice.push_back(*word);
    choice.back().text = text.substr(0, comma);
    if (comma == std::string_view::npos) return choice;
    text.remove_prefix(comma + 1);
  }
}

std::string meant_by_none(const CellChoice& choice, const std::vector<HistoryPlace>& cells) {
  for (const CellWord& word : choice) {
    const bool is_some =
        std::any_of(cells.begin(), cells.end(), [&](const HistoryPlace& cell) { return word.is_meant(cell); });
    if (!is_some) return word.text;
  }
  return "";
}

std::vector<HistoryPlace> chosen(const CellChoice& choice, const std::vector<HistoryPlace>& cells) {
  std::vector<HistoryPlace> places;
  for (const HistoryPlace& cell : cells) {
    if (std::any_of(choice.begin(), choice.end(), [&](const CellWord& word) { return word.is_meant(cell); })) {
      places.push_back(cell);
    }
  }
  return places;
}

}  // namespace bmu
