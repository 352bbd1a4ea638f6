#include "config/json/json_reader.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "protocol/assert.hpp"

namespace bmu {
namespace {

constexpr std::size_t depth_max = 16;
constexpr std::size_t shown_length_max = 120;

/// Keeps head and tail, so that a message has a limited length whatever the file contains.
std::string shortened(std::string text) {
  constexpr std::size_t half = shown_length_max / 2;
  if (text.size() <= shown_length_max) return text;
  return text.substr(0, half) + " ... " + text.substr(text.size() - half);
}

/// Bytes that a terminal could interpret become '?'.
std::string plain(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
         c == '+' || c == '-';
}

/// Builds the tree as the parser reports its parts. The interface, and so the signatures, are the library's.
class TreeBuilder final : public nlohmann::json_sax<JsonValue> {
 public:
  TreeBuilder(std::string_view text, std::string file, ProblemList& problems)
      : text_(text), file_(std::move(file)), problems_(problems) {}

  [[nodiscard]] JsonValue take() { return std::move(root_); }

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(number_integer_t value) override { return put(value); }
  bool number_unsigned(number_unsigned_t value) override { return put(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return put(value); }
  bool string(string_t& value) override { return put(std::move(value)); }
  bool binary(binary_t& /*value*/) override { return false; }  // does not exist in text
  bool start_object(std::size_t /*size*/) override { return open(JsonValue::object()); }
  bool start_array(std::size_t /*size*/) override { return open(JsonValue::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Level& level = levels_.back();
    level.key = name;
    if (level.value->contains(name)) problems_.add(here(), "this key for a second time", "each key once");
    return true;
  }

  bool parse_error(std::size_t position, const std::string& /*last_token*/,
                   const nlohmann::detail::exception& error) override {
    const TextPosition at = position_of(token_start(position, error.what()));
    problems_.add({file_, ""}, at, "a " + reason(error.what()), "JSON, comments allowed");
    return false;
  }

 private:
  struct Level {
    JsonValue* value = nullptr;  // stable: a parent's container does not grow while its child is open
    std::string key;             // last key read, if an object
  };

  bool put(JsonValue value) {
    slot(std::move(value));
    return true;
  }

  bool open(JsonValue empty) {
    if (levels_.size() == depth_max) {
      problems_.add(here(), "another level of nesting", "at most " + std::to_string(depth_max) + " levels");
      return false;
    }
    levels_.push_back({slot(std::move(empty)), {}});
    return true;
  }

  bool close() {
    levels_.pop_back();
    return true;
  }

  static JsonValue& next_in(const Level& level) {
    return level.value->is_object() ? (*level.value)[level.key] : level.value->emplace_back();
  }

  JsonValue* slot(JsonValue value) {
    JsonValue& place = levels_.empty() ? root_ : next_in(levels_.back());
    place = std::move(value);
    return &place;
  }

  /// Location of the key or element that is being read.
  [[nodiscard]] Place here() const {
    Place place{file_, ""};
    for (const Level& level : levels_) {
      const bool is_innermost = &level == &levels_.back();
      if (level.value->is_object()) {
        place = place.at(level.key);
      } else {
        place = place.at(is_innermost ? level.value->size() : level.value->size() - 1);
      }
    }
    return place;
  }

  /// Start of the word or text in which the parser stopped; `position` is the number of bytes it had read by then.
  [[nodiscard]] std::size_t token_start(std::size_t position, std::string_view what) const {
    const std::size_t last = position > 0 ? position - 1 : 0;
    if (last > 0 && last < text_.size() && text_[last] == '"' && what.find("unexpected string") != what.npos) {
      const std::size_t quote = text_.rfind('"', last - 1);
      return quote == std::string_view::npos ? last : quote;
    }
    std::size_t start = last;
    while (start > 0 && start < text_.size() && is_word(text_[start]) && is_word(text_[start - 1])) --start;
    return start;
  }

  [[nodiscard]] TextPosition position_of(std::size_t offset) const {
    const std::string_view before = text_.substr(0, offset);
    const std::size_t line_start = before.rfind('\n');
    const std::size_t line_offset = line_start == std::string_view::npos ? 0 : line_start + 1;
    return {.line = 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n')),
            .column = 1 + before.size() - line_offset};
  }

  /// The library's message without its exception number and its own count of columns.
  [[nodiscard]] static std::string reason(std::string_view what) {
    constexpr std::array<std::string_view, 2> openings{"] ", ": "};
    const bool has_position = what.find("parse error at") != std::string_view::npos;
    const std::string_view opening = openings.at(has_position ? 1 : 0);
    const std::size_t start = what.find(opening);
    if (start != std::string_view::npos) what.remove_prefix(start + opening.size());
    return shortened(plain(std::string(what)));
  }

  std::string_view text_;
  std::string file_;
  ProblemList& problems_;
  JsonValue root_;
  std::vector<Level> levels_;
};

constexpr std::size_t hinted_length_max = 64;

/// Levenshtein distance: number of characters to insert, remove or change. One row of the table is kept.
std::size_t edit_distance(std::string_view one, std::string_view other) {
  std::array<std::size_t, hinted_length_max + 1> row{};
  BMU_ASSERT(other.size() < row.size());
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < one.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < other.size(); ++j) {
      const std::size_t changed = diagonal + (one[i] == other[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row[other.size()];
}

/// Hint for a message: the probable key, or "one of" all keys.
std::string known_key_hint(std::string_view key, const std::vector<std::string_view>& known_keys) {
  if (!known_keys.empty() && key.size() <= hinted_length_max) {
    const auto nearer = [key](std::string_view a, std::string_view b) {
      return edit_distance(key, a) < edit_distance(key, b);
    };
    const std::string_view nearest = *std::min_element(known_keys.begin(), known_keys.end(), nearer);
    const bool is_near = edit_distance(key, nearest) <= std::max<std::size_t>(2, nearest.size() / 3);
    if (is_near) return "a known key; did you mean \"" + std::string(nearest) + "\"?";
  }
  std::string text = "one of";
  for (const std::string_view known : known_keys) text += (text == "one of" ? " " : ", ") + std::string(known);
  return text;
}

bool is_same_or_within(std::string_view path, std::string_view outer) {
  const bool begins_alike = path.substr(0, outer.size()) == outer;
  return begins_alike && (path.size() == outer.size() || path[outer.size()] == '/');
}

}  // namespace

Place Place::at(std::string_view key) const {
  std::string token;
  for (const char c : shortened(std::string(key))) {
    if (c == '~') {
      token += "~0";
    } else if (c == '/') {
      token += "~1";
    } else {
      token += c;
    }
  }
  return {file, path + "/" + plain(token)};
}

Place Place::at(std::size_t index) const {
  return {file, path + "/" + std::to_string(index)};
}

void ProblemList::add(const Place& place, std::string found, std::string wanted) {
  problems_.push_back({place.file, place.path, std::move(found), std::move(wanted)});
}

void ProblemList::add(const Place& file, TextPosition at, std::string found, std::string wanted) {
  problems_.push_back({file.file, file.path, std::move(found), std::move(wanted), at});
}

bool ProblemList::is_good(const Place& place) const {
  return std::none_of(problems_.begin(), problems_.end(), [&place](const ConfigProblem& problem) {
    return problem.file == place.file && is_same_or_within(place.path, problem.path);
  });
}

bool ProblemList::is_good_throughout(const Place& place) const {
  return is_good(place) && std::none_of(problems_.begin(), problems_.end(), [&place](const ConfigProblem& problem) {
           return problem.file == place.file && is_same_or_within(problem.path, place.path);
         });
}

std::optional<JsonValue> parse_json(std::string_view text, const std::string& file, ProblemList& problems) {
  TreeBuilder builder(text, file, problems);
  const bool is_json = JsonValue::sax_parse(text, &builder, nlohmann::detail::input_format_t::json, true, true);
  if (!is_json) return std::nullopt;
  return builder.take();
}

std::string shown(const JsonValue& value) {
  // Escaped to ASCII, so that shortening never cuts a character in two.
  return shortened(value.dump(-1, ' ', true, JsonValue::error_handler_t::replace));
}

std::string in_quotes(std::string_view text) {
  return shown(JsonValue(std::string(text)));
}

bool is_object(const JsonValue& value, const Place& place, ProblemList& problems) {
  if (!value.is_object()) problems.add(place, shown(value), "an object, { ... }");
  return value.is_object();
}

void check_keys(const JsonValue& object, const Place& place, const std::vector<std::string_view>& known_keys,
                ProblemList& problems) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known_keys.begin(), known_keys.end(), key) != known_keys.end()) continue;
    problems.add(place.at(key), "an unknown key", known_key_hint(key, known_keys));
  }
}

const JsonValue* find_value(const JsonValue& object, const Place& place, std::string_view key, bool is_required,
                            ProblemList& problems) {
  const auto found = object.find(std::string(key));
  if (found != object.end()) return &*found;
  if (is_required) problems.add(place.at(key), "nothing", "this required key");
  return nullptr;
}

const JsonValue* find_section(const JsonValue& object, const Place& place, std::string_view key,
                              ProblemList& problems) {
  const JsonValue* section = find_value(object, place, key, false, problems);
  return section != nullptr && is_object(*section, place.at(key), problems) ? section : nullptr;
}

std::string to_text(const ConfigProblem& problem) {
  std::string where = problem.file;
  if (problem.at) where += ":" + std::to_string(problem.at->line) + ":" + std::to_string(problem.at->column);
  if (!problem.path.empty()) where += ": " + problem.path;
  const std::string found = problem.found == "nothing" ? "missing" : "found " + problem.found;
  return where + ": " + found + ", expected " + problem.wanted;
}

}  // namespace bmu
