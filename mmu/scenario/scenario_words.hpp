// Words of a script's line, and problems with a word. Internal to the parser's files.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mmu/scenario/scenario.hpp"
#include "mmu/scenario/scenario_text.hpp"
#include "protocol/number_text.hpp"

namespace bmu::scenario_text {

inline constexpr double time_max_s = 1e6;
inline constexpr std::size_t found_length_max = 40;

struct Word {
  std::string_view text;
  std::uint32_t column = 1;
};

/// The words of one line, without its comment; after the last one follows an empty word at the end of the line. Text in
/// quotes is one word, quotes included.
class Words {
 public:
  explicit Words(std::string_view line) {
    std::size_t at = 0;
    while (true) {
      at = std::min(line.find_first_not_of(blanks, at), line.size());
      if (at == line.size() || line[at] == '#') break;
      const std::size_t end = end_of_word(line, at);
      words_.push_back({line.substr(at, end - at), static_cast<std::uint32_t>(at + 1)});
      at = end;
    }
    end_column_ = words_.empty() ? 1 : words_.back().column + static_cast<std::uint32_t>(words_.back().text.size());
  }
  [[nodiscard]] bool at_end() const { return next_ == words_.size(); }
  [[nodiscard]] Word peek() const { return at_end() ? Word{{}, end_column_} : words_[next_]; }
  Word take() {
    const Word word = peek();
    if (!at_end()) ++next_;
    return word;
  }
  /// Text from the word `first` up to the next one, with one blank between two.
  [[nodiscard]] std::string since(const Word& first) const {
    std::string text;
    for (std::size_t index = 0; index < next_; ++index) {
      if (words_[index].column < first.column) continue;
      text += (text.empty() ? "" : " ") + std::string(words_[index].text);
    }
    return text;
  }

 private:
  static std::size_t end_of_word(std::string_view line, std::size_t at) {
    if (line[at] != '"') return std::min(line.find_first_of(word_ends, at), line.size());
    const std::size_t quote = line.find('"', at + 1);
    return quote == std::string_view::npos ? line.size() : quote + 1;
  }
  static constexpr std::string_view blanks = " \t\r";
  static constexpr std::string_view word_ends = " \t\r#";
  std::vector<Word> words_;
  std::size_t next_ = 0;
  std::uint32_t end_column_ = 1;
};

using Problem = std::optional<ScenarioProblem>;

inline std::string shown(std::string_view text) {
  if (text.empty()) return "the end of the line";
  std::string clean = "'";
  for (const char one : text.substr(0, found_length_max)) clean += one >= ' ' && one <= '~' ? one : '?';
  return clean + (text.size() > found_length_max ? "...'" : "'");
}

inline ScenarioProblem problem_at(const Word& word, std::string wanted) {
  return {.line = 0, .column = word.column, .found = shown(word.text), .wanted = std::move(wanted)};
}

inline std::optional<double> number_of(std::string_view text) {
  const auto value = number_of_text<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

[[nodiscard]] inline bool is_whole(double value) {
  return std::floor(value) == value;
}

inline std::optional<std::uint32_t> count_of(std::string_view text, std::uint32_t max) {
  const auto value = number_of_text<std::uint32_t>(text);
  return value && *value >= 1 && *value <= max ? value : std::nullopt;
}

inline std::optional<std::uint8_t> index_of(std::span<const std::string_view> words, std::string_view word) {
  const auto place = std::find(words.begin(), words.end(), word);
  if (place == words.end()) return std::nullopt;
  return static_cast<std::uint8_t>(place - words.begin());
}

inline Duration duration_of(double seconds) {
  return std::chrono::round<Duration>(std::chrono::duration<double>(seconds));
}

struct NumberRange {
  double from = 0.0;
  double to = 0.0;
};
/// "2700..3600" with both ends in `allowed`, the second not below the first.
[[nodiscard]] Problem parse_range(const Word& word, const NumberRange& allowed, NumberRange& range);

/// A length of time in seconds, more than 0.
[[nodiscard]] Problem parse_seconds(Words& words, Duration& length);

/// Reads the address of a target: its node, cell, sensor or word.
[[nodiscard]] Problem parse_address(const TargetSpec& target, Words& words, ScenarioPlace& place);

/// Reads an event from target to value; a line that ends before is a problem, the text after it is left to the caller.
[[nodiscard]] Problem parse_event_words(Words& words, const MasterVocabulary& master, ScenarioEvent& event);

/// Reads a condition from target or frame to comparison; likewise.
[[nodiscard]] Problem parse_condition_words(Words& words, const MasterVocabulary& master, ScenarioCondition& condition);

[[nodiscard]] inline Problem expect_end(const Words& words) {
  return words.at_end() ? std::nullopt : Problem(problem_at(words.peek(), "nothing more on this line"));
}

}  // namespace bmu::scenario_text
