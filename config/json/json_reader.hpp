// JSON text to a tree, with what a configuration needs beyond the language: comments are skipped, a key given twice is
// an error (the second would silently win), nesting is bounded, and every finding says where it was.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/json/problem.hpp"

namespace bmu {

using JsonValue = nlohmann::json;

/// Where in which file: a JSON pointer and the file it is in.
struct Place {
  std::string file;
  std::string path;

  [[nodiscard]] Place at(std::string_view key) const;
  [[nodiscard]] Place at(std::size_t index) const;
};

/// Collects what is wrong. A check of two values asks `is_good` for both first: one mistake is one problem.
class ProblemList {
 public:
  void add(const Place& place, std::string found, std::string wanted);
  /// Of a text that is no JSON.
  void add(const Place& file, TextPosition at, std::string found, std::string wanted);

  [[nodiscard]] bool empty() const { return problems_.empty(); }
  /// Nothing was found wrong at this place or at one that contains it.
  [[nodiscard]] bool is_good(const Place& place) const;
  /// The same, and nothing was found wrong within it.
  [[nodiscard]] bool is_good_throughout(const Place& place) const;
  [[nodiscard]] ConfigProblems take() { return std::move(problems_); }

 private:
  ConfigProblems problems_;
};

/// The whole text as a tree; nothing, and a problem with line and column, where it is not JSON.
[[nodiscard]] std::optional<JsonValue> parse_json(std::string_view text, const std::string& file,
                                                  ProblemList& problems);

/// A value as a person should see it in a message: JSON, on one line, shortened in the middle.
[[nodiscard]] std::string shown(const JsonValue& value);
/// A text in quotes, by the same rules.
[[nodiscard]] std::string in_quotes(std::string_view text);

/// True if it is one; else a problem with what it should have been.
[[nodiscard]] bool is_object(const JsonValue& value, const Place& place, ProblemList& problems);

/// A problem for every key of the object that is none of these, with a hint to the nearest.
void check_keys(const JsonValue& object, const Place& place, const std::vector<std::string_view>& known_keys,
                ProblemList& problems);

/// The value of a key. Null if there is none, which is a problem if it is required.
[[nodiscard]] const JsonValue* find_value(const JsonValue& object, const Place& place, std::string_view key,
                                          bool is_required, ProblemList& problems);
/// The object of a key that need not be there. Null if it is not there, and with a problem if it is no object.
[[nodiscard]] const JsonValue* find_section(const JsonValue& object, const Place& place, std::string_view key,
                                            ProblemList& problems);

}  // namespace bmu
