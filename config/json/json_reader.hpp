// Parser of JSON text into a tree, with additions that a configuration needs: comments are skipped, a duplicate key is
// an error (the second would silently win), nesting is limited, and every problem has its location.
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

/// Location in a file: the file, and a JSON pointer.
struct Place {
  std::string file;
  std::string path;

  [[nodiscard]] Place at(std::string_view key) const;
  [[nodiscard]] Place at(std::size_t index) const;
};

/// List of problems. A check of two values first tests both with `is_good`: one mistake is one problem.
class ProblemList {
 public:
  void add(const Place& place, std::string found, std::string wanted);
  /// Adds a problem of a text that is not JSON.
  void add(const Place& file, TextPosition at, std::string found, std::string wanted);

  [[nodiscard]] bool empty() const { return problems_.empty(); }
  /// Whether there is no problem at this location or at one that contains it.
  [[nodiscard]] bool is_good(const Place& place) const;
  /// Likewise, and no problem within it.
  [[nodiscard]] bool is_good_throughout(const Place& place) const;
  [[nodiscard]] ConfigProblems take() { return std::move(problems_); }

 private:
  ConfigProblems problems_;
};

/// The whole text as a tree; none, and a problem with line and column, if it is not JSON.
[[nodiscard]] std::optional<JsonValue> parse_json(std::string_view text, const std::string& file,
                                                  ProblemList& problems);

/// A value for display in a message: JSON, on one line, shortened in the middle.
[[nodiscard]] std::string shown(const JsonValue& value);
/// A text in quotes, by the same rules.
[[nodiscard]] std::string in_quotes(std::string_view text);

/// Whether the value is an object; otherwise adds a problem.
[[nodiscard]] bool is_object(const JsonValue& value, const Place& place, ProblemList& problems);

/// Adds a problem for every key of the object that is not one of `known_keys`, with a hint to the nearest.
void check_keys(const JsonValue& object, const Place& place, const std::vector<std::string_view>& known_keys,
                ProblemList& problems);

/// The value of a key. Null if there is none, which is a problem if it is required.
[[nodiscard]] const JsonValue* find_value(const JsonValue& object, const Place& place, std::string_view key,
                                          bool is_required, ProblemList& problems);
/// The object of an optional key. Null if it is missing, and with a problem if it is not an object.
[[nodiscard]] const JsonValue* find_section(const JsonValue& object, const Place& place, std::string_view key,
                                            ProblemList& problems);

}  // namespace bmu
