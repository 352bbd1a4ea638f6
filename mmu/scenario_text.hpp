// Words shared by the scenario parser's messages and the generated documentation. Internal to the two.
#pragma once

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

[[nodiscard]] inline std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

}  // namespace bmu::scenario_text
