#include "mmu/scenario.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "mmu/scenario_text.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

using scenario_text::has_word;
using scenario_text::listed;
using scenario_text::number_text;

// --- words of a line ------------------------------------------------------------------------------------------------

namespace {

constexpr double time_max_s = 1e6;
constexpr std::size_t found_length_max = 40;

struct Word {
  std::string_view text;
  std::uint32_t column = 1;
};

/// The words of one line, without its comment; past the end comes an empty word at the end of the line.
class Words {
 public:
  explicit Words(std::string_view line) {
    line = line.substr(0, line.find('#'));
    std::size_t at = 0;
    while (true) {
      at = std::min(line.find_first_not_of(blanks, at), line.size());
      if (at == line.size()) break;
      const std::size_t end = std::min(line.find_first_of(blanks, at), line.size());
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
  /// Everything from here on, as it stands in the line.
  [[nodiscard]] std::string_view rest() const {
    if (at_end()) return {};
    const std::string_view& last = words_.back().text;
    const char* const first = words_[next_].text.data();
    return {first, static_cast<std::size_t>(last.data() + last.size() - first)};
  }

 private:
  static constexpr std::string_view blanks = " \t\r";
  std::vector<Word> words_;
  std::size_t next_ = 0;
  std::uint32_t end_column_ = 1;
};

using Problem = std::optional<ScenarioProblem>;

std::string shown(std::string_view text) {
  if (text.empty()) return "the end of the line";
  std::string clean = "'";
  for (const char one : text.substr(0, found_length_max)) clean += one >= ' ' && one <= '~' ? one : '?';
  return clean + (text.size() > found_length_max ? "...'" : "'");
}

ScenarioProblem problem_at(const Word& word, std::string wanted) {
  return {.line = 0, .column = word.column, .found = shown(word.text), .wanted = std::move(wanted)};
}

std::optional<double> number_of(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc{} && end == text.data() + text.size();
  return is_whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<std::uint8_t> count_of(std::string_view text, unsigned max) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc{} && end == text.data() + text.size();
  return is_whole && value >= 1 && value <= max ? std::optional(static_cast<std::uint8_t>(value)) : std::nullopt;
}

std::optional<std::uint8_t> index_of(std::span<const std::string_view> words, std::string_view word) {
  const auto place = std::find(words.begin(), words.end(), word);
  if (place == words.end()) return std::nullopt;
  return static_cast<std::uint8_t>(place - words.begin());
}

Duration duration_of(double seconds) {
  return std::chrono::round<Duration>(std::chrono::duration<double>(seconds));
}

// --- the parts of an event ------------------------------------------------------------------------------------------

Problem parse_node_and_index(const Word& word, unsigned index_max, std::string_view example, ScenarioPlace& place) {
  const std::size_t dot = word.text.find('.');
  const auto node = count_of(word.text.substr(0, dot), internal_bus::node_count_max);
  const auto index = dot == std::string_view::npos ? std::nullopt : count_of(word.text.substr(dot + 1), index_max);
  if (!node || !index) {
    return problem_at(
        word, "a node 1 to 63, a dot and 1 to " + std::to_string(index_max) + ", as in " + std::string(example));
  }
  place = {*node, static_cast<std::uint8_t>(*index - 1)};
  return std::nullopt;
}

Problem parse_address(const TargetSpec& target, Words& words, ScenarioPlace& place) {
  if (target.address == Address::none) return std::nullopt;
  const Word word = words.take();
  switch (target.address) {
    case Address::none: break;
    case Address::node: {
      const auto node = count_of(word.text, internal_bus::node_count_max);
      if (!node) return problem_at(word, "a node 1 to 63");
      place.node = *node;
      break;
    }
    case Address::node_cell: return parse_node_and_index(word, internal_bus::cells_per_module_max, "cell 2.7", place);
    case Address::node_slot:
      return parse_node_and_index(word, internal_bus::cell_temperatures_per_module_max, "thermistor 2.4", place);
    case Address::word: {
      const auto index = index_of(target.words, word.text);
      if (!index) return problem_at(word, "one of " + listed(target.words));
      place.index = *index;
      break;
    }
  }
  return std::nullopt;
}

bool exists_for(const PropertySpec& property, const TargetSpec& target, const ScenarioPlace& place) {
  if (property.target != target.kind) return false;
  return property.only_for.empty() || has_word(property.only_for, target.words[place.index]);
}

Problem parse_property(const TargetSpec& target, Words& words, ScenarioEvent& event) {
  const Word word = words.take();
  std::string possible;
  for (const PropertySpec& row : property_table()) {
    if (!exists_for(row, target, event.place)) continue;
    if (row.name == word.text) {
      event.property = row.property;
      return std::nullopt;
    }
    possible += (possible.empty() ? "" : ", ") + std::string(row.name);
  }
  return problem_at(word, "a property of " + std::string(target.name) + ": " + possible);
}

Problem check_range(const PropertySpec& property, const Word& word, double value) {
  if (value >= property.min && value <= property.max) return std::nullopt;
  return problem_at(word, number_text(property.min) + " to " + number_text(property.max));
}

Problem parse_ramp(const PropertySpec& property, const Word& word, std::size_t dots, Words& words,
                   ScenarioValue& value) {
  const Word from{word.text.substr(0, dots), word.column};
  const Word to{word.text.substr(dots + 2), word.column + static_cast<std::uint32_t>(dots) + 2};
  const auto start = from.text.empty() ? std::optional(0.0) : number_of(from.text);
  const auto end = number_of(to.text);
  if (!start || !end) return problem_at(word, "a ramp: FROM..TO over SECONDS, or ..TO over SECONDS");
  if (!from.text.empty()) {
    if (Problem problem = check_range(property, from, *start)) return problem;
  }
  if (Problem problem = check_range(property, to, *end)) return problem;
  const Word over = words.take();
  if (over.text != "over") return problem_at(over, "over SECONDS, after a ramp");
  const Word seconds = words.take();
  const auto length_s = number_of(seconds.text);
  if (!length_s || *length_s <= 0.0 || *length_s > time_max_s) return problem_at(seconds, "seconds, more than 0");
  const auto kind = from.text.empty() ? ScenarioValue::Kind::ramp_from_present : ScenarioValue::Kind::ramp;
  value = {.kind = kind, .number = *end, .from = *start, .over = duration_of(*length_s)};
  return std::nullopt;
}

Problem parse_number(const PropertySpec& property, Words& words, ScenarioValue& value) {
  const Word word = words.take();
  const bool may_be_auto = property.kind == ValueKind::number_or_auto;
  if (may_be_auto && word.text == "auto") {
    value = {.kind = ScenarioValue::Kind::automatic};
    return std::nullopt;
  }
  if (const std::size_t dots = word.text.find(".."); dots != std::string_view::npos) {
    return parse_ramp(property, word, dots, words, value);
  }
  const auto number = number_of(word.text);
  if (!number) {
    return problem_at(word, std::string(may_be_auto ? "a number or auto, " : "a number, ") + number_text(property.min) +
                                " to " + number_text(property.max));
  }
  value = {.kind = ScenarioValue::Kind::number, .number = *number};
  return check_range(property, word, *number);
}

Problem parse_value(const PropertySpec& property, Words& words, ScenarioValue& value) {
  if (property.kind == ValueKind::none) return std::nullopt;
  if (property.kind != ValueKind::word) return parse_number(property, words, value);
  const Word word = words.take();
  const auto index = index_of(property.words, word.text);
  if (!index) return problem_at(word, "one of " + listed(property.words));
  value = {.kind = ScenarioValue::Kind::word, .word = *index};
  return std::nullopt;
}

Problem parse_target(Words& words, const TargetSpec*& found) {
  const Word word = words.take();
  std::string possible;
  for (const TargetSpec& target : target_table()) {
    if (target.name == word.text) {
      found = &target;
      return std::nullopt;
    }
    possible += (possible.empty() ? "" : ", ") + std::string(target.name);
  }
  return problem_at(word, "a target: " + possible);
}

/// Target to the end of the line.
Problem parse_event_words(Words& words, ScenarioEvent& event) {
  event.text = words.rest();
  event.target_column = words.peek().column;
  const TargetSpec* target = nullptr;
  if (Problem problem = parse_target(words, target)) return problem;
  if (Problem problem = parse_address(*target, words, event.place)) return problem;
  if (Problem problem = parse_property(*target, words, event)) return problem;
  if (Problem problem = parse_value(spec_of(event.property), words, event.value)) return problem;
  if (!words.at_end()) return problem_at(words.peek(), "nothing more on this line");
  return std::nullopt;
}

Problem parse_line(Words& words, ScenarioEvent& event) {
  const Word word = words.take();
  const auto seconds = number_of(word.text);
  if (!seconds || *seconds < 0.0 || *seconds > time_max_s) {
    return problem_at(word, "a time in seconds, 0 to " + number_text(time_max_s));
  }
  event.at = duration_of(*seconds);
  return parse_event_words(words, event);
}

}  // namespace

Result<Scenario, ScenarioProblems> parse_scenario(std::string_view text) {
  Scenario scenario;
  ScenarioProblems problems;
  std::uint32_t line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    Words words(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.at_end()) continue;
    ScenarioEvent event;
    event.line = line_number;
    if (Problem problem = parse_line(words, event)) {
      problem->line = line_number;
      problems.push_back(std::move(*problem));
    } else {
      scenario.events.push_back(std::move(event));
    }
  }
  if (!problems.empty()) return failure(std::move(problems));
  std::stable_sort(scenario.events.begin(), scenario.events.end(),
                   [](const ScenarioEvent& one, const ScenarioEvent& other) { return one.at < other.at; });
  return scenario;
}

Result<ScenarioEvent, ScenarioProblem> parse_event(std::string_view text) {
  Words words(text);
  ScenarioEvent event;
  event.line = 1;
  if (Problem problem = parse_event_words(words, event)) {
    problem->line = 1;
    return failure(std::move(*problem));
  }
  return event;
}

std::string to_text(const ScenarioProblem& problem, std::string_view file_name) {
  return std::string(file_name) + ":" + std::to_string(problem.line) + ":" + std::to_string(problem.column) +
         ": found " + problem.found + ", wanted " + problem.wanted;
}

}  // namespace bmu
