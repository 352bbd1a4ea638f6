// Events of the script language: target, place, property, value.
#include "daemon/core/types/core_config.hpp"
#include "mmu/scenario/scenario_words.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::scenario_text {

// --- numbers and places ---------------------------------------------------------------------------------------------

namespace {

bool is_within(double value, const NumberRange& range) {
  return value >= range.from && value <= range.to;
}

Problem parse_node_and_index(const Word& word, unsigned index_max, std::string_view example, ScenarioPlace& place) {
  const std::size_t dot = word.text.find('.');
  const auto node = count_of(word.text.substr(0, dot), internal_bus::node_count_max);
  const auto index = dot == std::string_view::npos ? std::nullopt : count_of(word.text.substr(dot + 1), index_max);
  if (!node || !index) {
    return problem_at(
        word, "a node 1 to 63, a dot and 1 to " + std::to_string(index_max) + ", as in " + std::string(example));
  }
  place = {static_cast<std::uint8_t>(*node), static_cast<std::uint8_t>(*index - 1)};
  return std::nullopt;
}

}  // namespace

Problem parse_range(const Word& word, const NumberRange& allowed, NumberRange& range) {
  const std::size_t dots = word.text.find("..");
  const std::string form = "A..B, both " + number_text(allowed.from) + " to " + number_text(allowed.to);
  if (dots == std::string_view::npos) return problem_at(word, form);
  const auto from = number_of(word.text.substr(0, dots));
  const auto to = number_of(word.text.substr(dots + 2));
  if (!from || !to || !is_within(*from, allowed) || !is_within(*to, allowed)) return problem_at(word, form);
  if (*to < *from) return problem_at(word, "A..B, the second not below the first");
  range = {*from, *to};
  return std::nullopt;
}

Problem parse_seconds(Words& words, Duration& length) {
  const Word word = words.take();
  const auto seconds = number_of(word.text);
  const bool is_in_range = seconds && *seconds > 0.0 && *seconds <= time_max_s;
  if (!is_in_range || duration_of(*seconds) == Duration::zero()) return problem_at(word, "seconds, more than 0");
  length = duration_of(*seconds);
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
      place.node = static_cast<std::uint8_t>(*node);
      break;
    }
    case Address::node_cell: return parse_node_and_index(word, internal_bus::cells_per_module_max, "cell 2.7", place);
    case Address::node_slot: {
      const bool is_on_board = target.kind == TargetKind::board_thermistor;
      const std::size_t sensors = is_on_board ? internal_bus::board_temperatures_per_module : cell_sensors_max;
      return parse_node_and_index(word, static_cast<unsigned>(sensors), "thermistor 2.4", place);
    }
    case Address::word: {
      const auto index = index_of(target.words, word.text);
      if (!index) return problem_at(word, "one of " + listed(target.words));
      place.index = *index;
      break;
    }
  }
  return std::nullopt;
}

// --- the parts of an event ------------------------------------------------------------------------------------------

namespace {

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
  Duration length{};
  if (Problem problem = parse_seconds(words, length)) return problem;
  const auto kind = from.text.empty() ? ScenarioValue::Kind::ramp_from_present : ScenarioValue::Kind::ramp;
  value = {.kind = kind, .number = *end, .from = *start, .over = length};
  return std::nullopt;
}

/// "a whole number or auto, 0 to 15".
std::string wanted_number(const PropertySpec& property) {
  return std::string(is_count(property.kind) ? "a whole number" : "a number") +
         (may_be_auto(property.kind) ? " or auto, " : ", ") + number_text(property.min) + " to " +
         number_text(property.max);
}

Problem parse_random_number(const PropertySpec& property, Words& words, ScenarioValue& value) {
  NumberRange range;
  const Word word = words.take();
  if (Problem problem = parse_range(word, {property.min, property.max}, range)) return problem;
  if (is_count(property.kind) && !(is_whole(range.from) && is_whole(range.to))) {
    return problem_at(word, "A..B, both whole numbers");
  }
  value = {.kind = ScenarioValue::Kind::number, .is_random = true, .number = range.to, .from = range.from};
  return std::nullopt;
}

Problem parse_number(const PropertySpec& property, Words& words, ScenarioValue& value) {
  const Word word = words.take();
  if (may_be_auto(property.kind) && word.text == "auto") {
    value = {.kind = ScenarioValue::Kind::automatic};
    return std::nullopt;
  }
  const std::size_t dots = word.text.find("..");
  if (dots != std::string_view::npos && !is_count(property.kind)) {
    return parse_ramp(property, word, dots, words, value);
  }
  if (word.text == "random") return parse_random_number(property, words, value);
  const auto number = number_of(word.text);
  if (!number || (is_count(property.kind) && !is_whole(*number))) return problem_at(word, wanted_number(property));
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

bool has_properties(const TargetSpec& target) {
  return std::any_of(property_table().begin(), property_table().end(),
                     [&target](const PropertySpec& row) { return row.target == target.kind; });
}

Problem parse_target(Words& words, const MasterVocabulary& master, const TargetSpec*& found) {
  const Word word = words.take();
  std::string possible;
  for (const TargetSpec& target : target_table()) {
    if (!has_properties(target)) continue;
    const bool is_absent = target.kind == TargetKind::master && master.phases.empty();
    if (is_absent && target.name == word.text) {
      return problem_at(word, "an event of the emulated pack: here is no master that could be told");
    }
    if (is_absent) continue;
    if (target.name == word.text) {
      found = &target;
      return std::nullopt;
    }
    possible += (possible.empty() ? "" : ", ") + std::string(target.name);
  }
  return problem_at(word, "a target: " + possible);
}

}  // namespace

Problem parse_event_words(Words& words, const MasterVocabulary& master, ScenarioEvent& event) {
  const Word first = words.peek();
  const TargetSpec* target = nullptr;
  if (Problem problem = parse_target(words, master, target)) return problem;
  if (Problem problem = parse_address(*target, words, event.place)) return problem;
  if (Problem problem = parse_property(*target, words, event)) return problem;
  if (Problem problem = parse_value(spec_of(event.property), words, event.value)) return problem;
  event.text = words.since(first);
  return std::nullopt;
}

}  // namespace bmu::scenario_text
