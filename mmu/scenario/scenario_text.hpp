// Text functions shared by the scenario parser, the player and the generated documentation. Internal to these.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <string>
#include <string_view>

namespace bmu::scenario_text {

[[nodiscard]] inline std::string listed(std::span<const std::string_view> words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

/// Whether a word of a script is this name; blanks of the name are underscores in the script.
[[nodiscard]] inline bool is_same_word(std::string_view word, std::string_view name) {
  return std::equal(word.begin(), word.end(), name.begin(), name.end(),
                    [](char one, char other) { return one == (other == ' ' ? '_' : other); });
}

/// Names as they are written in a script, separated by commas.
[[nodiscard]] inline std::string said(std::span<const std::string_view> names) {
  std::string text = listed(names);
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool is_between_names = at > 0 && text[at - 1] == ',';
    if (text[at] == ' ' && !is_between_names) text[at] = '_';
  }
  return text;
}

/// Whether a list of words separated by spaces has this whole word: "current" is not in "current_2".
[[nodiscard]] inline bool has_word(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (list.substr(0, end) == word) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

[[nodiscard]] inline std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

}  // namespace bmu::scenario_text
