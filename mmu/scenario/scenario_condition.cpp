// Conditions of the script language: on the state of the world, and on frames.
#include "mmu/scenario/scenario_state.hpp"
#include "mmu/scenario/scenario_words.hpp"
#include "protocol/number_text.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace bmu {

namespace scenario_text {

namespace {

struct ComparisonRow {
  std::string_view sign;
  Comparison comparison;
};
constexpr ComparisonRow comparisons[] = {
    {"=", Comparison::equal},          {"!=", Comparison::not_equal}, {"<", Comparison::less},
    {"<=", Comparison::less_or_equal}, {">", Comparison::greater},    {">=", Comparison::greater_or_equal},
};

constexpr std::string_view not_known_word = "not_known";
constexpr std::uint32_t standard_id_max = 0x7FF;

Problem parse_comparison(Words& words, bool is_of_words, Comparison& comparison) {
  const Word word = words.take();
  std::string possible;
  for (const ComparisonRow& row : comparisons) {
    const bool is_possible =
        !is_of_words || row.comparison == Comparison::equal || row.comparison == Comparison::not_equal;
    if (!is_possible) continue;
    if (row.sign == word.text) {
      comparison = row.comparison;
      return std::nullopt;
    }
    possible += (possible.empty() ? "" : " ") + std::string(row.sign);
  }
  return problem_at(word, "a comparison: " + possible);
}

// --- states ---------------------------------------------------------------------------------------------------------

bool has_states(const TargetSpec& target) {
  return std::any_of(state_table().begin(), state_table().end(),
                     [&target](const StateSpec& row) { return row.target == target.kind; });
}

Problem parse_asked_target(const Word& word, const TargetSpec*& found) {
  std::string possible;
  for (const TargetSpec& target : target_table()) {
    if (!has_states(target)) continue;
    if (target.name == word.text) {
      found = &target;
      return std::nullopt;
    }
    possible += ", " + std::string(target.name);
  }
  return problem_at(word, "frame, or a target that can be asked: " + possible.substr(2));
}

Problem parse_state_name(const TargetSpec& target, Words& words, ScenarioCondition& condition) {
  const Word word = words.take();
  std::string possible;
  for (const StateSpec& row : state_table()) {
    if (row.target != target.kind) continue;
    if (row.name == word.text) {
      condition.state = &row;
      return std::nullopt;
    }
    possible += (possible.empty() ? "" : ", ") + std::string(row.name);
  }
  return problem_at(word, "a state of " + std::string(target.name) + ": " + possible);
}

Problem parse_wanted_number(Words& words, ScenarioCondition& condition) {
  const Word word = words.take();
  const auto number = number_of(word.text);
  if (!number) return problem_at(word, "a number");
  condition.wanted = *number;
  return std::nullopt;
}

Problem parse_wanted_word(Words& words, ScenarioCondition& condition) {
  const Word word = words.take();
  for (std::size_t index = 0; index < condition.words.size(); ++index) {
    if (!is_same_word(word.text, condition.words[index])) continue;
    condition.wanted = static_cast<double>(index);
    return std::nullopt;
  }
  return problem_at(word, "one of " + said(condition.words));
}

Problem parse_state(const Word& first, Words& words, const MasterVocabulary& master, ScenarioCondition& condition) {
  const TargetSpec* target = nullptr;
  if (Problem problem = parse_asked_target(first, target)) return problem;
  if (target->kind == TargetKind::master && master.phases.empty()) {
    return problem_at(first, "a state of the emulated pack: here is no master that could be asked");
  }
  if (Problem problem = parse_address(*target, words, condition.place)) return problem;
  if (Problem problem = parse_state_name(*target, words, condition)) return problem;
  const StateKind kind = condition.state->kind;
  if (kind == StateKind::flag) return std::nullopt;
  condition.words = words_of(kind, master);
  if (Problem problem = parse_comparison(words, !condition.words.empty(), condition.comparison)) return problem;
  return condition.words.empty() ? parse_wanted_number(words, condition) : parse_wanted_word(words, condition);
}

// --- frames ---------------------------------------------------------------------------------------------------------

constexpr const Catalogue* catalogues[] = {&internal_bus::catalogue, &vehicle_bus::catalogue};

const MessageSpec* find_message(std::string_view name) {
  for (const Catalogue* catalogue : catalogues) {
    for (const MessageSpec* message : catalogue->messages()) {
      if (message->name == name) return message;
    }
  }
  return nullptr;
}

std::string all_messages() {
  std::string names;
  for (const Catalogue* catalogue : catalogues) {
    for (const MessageSpec* message : catalogue->messages()) names += ", " + std::string(message->name);
  }
  return names.substr(2);
}

std::optional<std::uint32_t> identifier_of(std::string_view text) {
  if (!text.starts_with("0x")) return std::nullopt;
  const auto id = number_of_text<std::uint32_t>(text.substr(2), 16);
  return id && *id <= standard_id_max ? id : std::nullopt;
}

void take_identifier(std::uint32_t id, ScenarioCondition& condition) {
  condition.frame_id = id;
  condition.is_by_identifier = true;
  for (const Catalogue* catalogue : catalogues) {
    if (const MessageMatch match = catalogue->find(id); match.message != nullptr) condition.message = match.message;
  }
}

/// A number after a message that each node sends is its node; without one, any node matches.
Problem parse_frame_node(Words& words, ScenarioCondition& condition) {
  const MessageSpec& message = *condition.message;
  condition.frame_id = message.base_id + std::uint32_t{message.node_min};
  condition.is_any_node = message.has_node();
  const Word word = words.peek();
  const bool is_number = !word.text.empty() && word.text.front() >= '0' && word.text.front() <= '9';
  if (!message.has_node() || !is_number) return std::nullopt;
  const bool is_to_all = message.node_min == 0 && word.text == "0";
  const auto node = count_of(words.take().text, message.node_max);
  if (!node && !is_to_all) {
    return problem_at(word, "a node " + std::to_string(message.node_min) + " to " + std::to_string(message.node_max));
  }
  condition.frame_id = message.base_id + node.value_or(0U);
  condition.is_any_node = false;
  return std::nullopt;
}

Problem parse_which_frame(Words& words, ScenarioCondition& condition) {
  const Word word = words.take();
  if (const auto id = identifier_of(word.text)) {
    take_identifier(*id, condition);
    return std::nullopt;
  }
  condition.message = find_message(word.text);
  if (condition.message == nullptr) {
    return problem_at(word, "an identifier, 0x0 to 0x7ff, or a frame's name: " + all_messages());
  }
  return parse_frame_node(words, condition);
}

Problem parse_signal(const MessageSpec& message, Words& words, ScenarioCondition& condition) {
  const Word word = words.take();
  std::string possible;
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    const SignalSpec& signal = message.signals[index];
    if (signal.unit == Unit::text) continue;
    if (signal.name == word.text) {
      condition.signal = static_cast<std::uint8_t>(index);
      return std::nullopt;
    }
    possible += (possible.empty() ? "" : ", ") + std::string(signal.name);
  }
  return problem_at(word, "a signal of " + std::string(message.name) + ": " + possible);
}

Problem parse_signal_value(const SignalSpec& signal, Words& words, ScenarioCondition& condition) {
  const Word word = words.take();
  const bool is_equality = condition.comparison == Comparison::equal || condition.comparison == Comparison::not_equal;
  if (word.text == not_known_word && is_equality && !signal.special.empty()) {
    condition.wants_not_known = true;
    return std::nullopt;
  }
  std::string possible = "a number";
  for (const RawName& name : signal.names) {
    if (is_same_word(word.text, name.name)) {
      condition.wanted = static_cast<double>(name.raw * signal.scale);
      return std::nullopt;
    }
    possible += ", " + said({&name.name, 1});
  }
  if (!signal.special.empty() && is_equality) possible += ", " + std::string(not_known_word);
  const auto number = number_of(word.text);
  if (!number) return problem_at(word, possible);
  condition.wanted = *number;
  return std::nullopt;
}

bool is_end_of_condition(const Words& words) {
  return words.at_end() || words.peek().text == "within" || words.peek().text == "for";
}

Problem parse_frame(Words& words, ScenarioCondition& condition) {
  if (Problem problem = parse_which_frame(words, condition)) return problem;
  if (is_end_of_condition(words)) return std::nullopt;
  if (condition.message == nullptr)
    return problem_at(words.peek(), "no signal: this identifier is not in the protocol");
  if (Problem problem = parse_signal(*condition.message, words, condition)) return problem;
  if (Problem problem = parse_comparison(words, false, condition.comparison)) return problem;
  return parse_signal_value(condition.message->signals[*condition.signal], words, condition);
}

}  // namespace

Problem parse_condition_words(Words& words, const MasterVocabulary& master, ScenarioCondition& condition) {
  const Word first = words.take();
  Problem problem =
      first.text == "frame" ? parse_frame(words, condition) : parse_state(first, words, master, condition);
  if (!problem) condition.text = words.since(first);
  return problem;
}

}  // namespace scenario_text

bool holds(Comparison comparison, double found, double wanted) {
  switch (comparison) {
    case Comparison::none: return found != 0.0;
    case Comparison::equal: return found == wanted;
    case Comparison::not_equal: return found != wanted;
    case Comparison::less: return found < wanted;
    case Comparison::less_or_equal: return found <= wanted;
    case Comparison::greater: return found > wanted;
    case Comparison::greater_or_equal: return found >= wanted;
  }
  return false;
}

}  // namespace bmu
