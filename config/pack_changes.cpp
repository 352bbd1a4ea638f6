#include "config/pack_changes.hpp"

#include <algorithm>
#include <set>

#include "config/json/json_reader.hpp"

namespace bmu {
namespace {

class Comparison {
 public:
  explicit Comparison(std::vector<PackChange>& changes) : changes_(changes) {}

  /// Null: the value is missing.
  void compare(const JsonValue* before, const JsonValue* now, const Place& place) {
    if (before != nullptr && now != nullptr && before->is_object() && now->is_object()) {
      return compare_objects(*before, *now, place);
    }
    if (before != nullptr && now != nullptr && before->is_array() && now->is_array()) {
      return compare_lists(*before, *now, place);
    }
    if (before != nullptr && now != nullptr && *before == *now) return;
    changes_.push_back({.file = place.file, .path = place.path, .before = text_of(before), .now = text_of(now)});
  }

 private:
  static std::string text_of(const JsonValue* value) { return value == nullptr ? "" : shown(*value); }
  static const JsonValue* find(const JsonValue& object, const std::string& key) {
    const auto found = object.find(key);
    return found == object.end() ? nullptr : &*found;
  }

  void compare_objects(const JsonValue& before, const JsonValue& now, const Place& place) {
    std::set<std::string> keys;
    for (const JsonValue* object : {&before, &now}) {
      for (const auto& [key, value] : object->items()) keys.insert(key);
    }
    for (const std::string& key : keys) compare(find(before, key), find(now, key), place.at(key));
  }

  void compare_lists(const JsonValue& before, const JsonValue& now, const Place& place) {
    for (std::size_t index = 0; index < std::max(before.size(), now.size()); ++index) {
      compare(index < before.size() ? &before[index] : nullptr, index < now.size() ? &now[index] : nullptr,
              place.at(index));
    }
  }

  std::vector<PackChange>& changes_;
};

void compare_texts(const std::string& before, const std::string& now, const std::string& file,
                   std::vector<PackChange>& changes) {
  ProblemList none;  // both were read without errors before
  const auto tree_before = parse_json(before, file, none);
  const auto tree_now = parse_json(now, file, none);
  if (tree_before && tree_now) Comparison(changes).compare(&*tree_before, &*tree_now, {.file = file, .path = ""});
}

}  // namespace

std::string to_text(const PackChange& change) {
  const auto or_none = [](const std::string& text) { return text.empty() ? "absent" : text; };
  return change.file + ": " + change.path + ": " + or_none(change.before) + " -> " + or_none(change.now);
}

std::vector<PackChange> pack_changes(const PackSources& before, const PackSources& now) {
  std::vector<PackChange> changes;
  compare_texts(before.pack_text, now.pack_text, now.pack_name, changes);
  // A change between a cell in a file of its own and one in the pack file is a change of the key "cell" already.
  if (!before.cell_name.empty() && !now.cell_name.empty()) {
    compare_texts(before.cell_text, now.cell_text, now.cell_name, changes);
  }
  return changes;
}

}  // namespace bmu
