#include "config/fields/list_fields.hpp"

#include <string>

namespace bmu {
namespace {

/// Checks that the value is a list of `count` elements; `what`: their name in messages, "numbers".
bool has_count(const JsonValue& value, std::size_t count, const std::string& what, std::string_view one_for_each,
               const Place& place, ProblemList& problems) {
  if (value.is_array() && value.size() == count) return true;
  const std::string each = one_for_each.empty() ? "" : ", " + std::string(one_for_each);
  if (value.is_array()) {
    problems.add(place, std::to_string(value.size()) + " " + what, std::to_string(count) + each);
  } else {
    problems.add(place, shown(value), "a list of " + std::to_string(count) + " " + what + each);
  }
  return false;
}

bool is_rising(const JsonValue& value, const Place& place, std::span<const double> numbers, ProblemList& problems) {
  bool is_good = true;
  for (std::size_t index = 1; index < numbers.size(); ++index) {
    if (numbers[index] > numbers[index - 1]) continue;
    problems.add(place.at(index), shown(value[index]),
                 "more than the number before, " + number_text(numbers[index - 1]));
    is_good = false;
  }
  return is_good;
}

}  // namespace

bool read_numbers(const JsonValue& value, const ListInfo& info, const Place& place, std::span<double> numbers,
                  ProblemList& problems) {
  // In a list of lists, `one_for_each` refers to the lists, not to the numbers in them.
  const std::string_view one_for_each = info.list_count == 0 ? info.one_for_each : "";
  if (!has_count(value, numbers.size(), "numbers", one_for_each, place, problems)) return false;
  bool is_good = true;
  for (std::size_t index = 0; index < numbers.size(); ++index) {
    const auto read = read_value(value[index], info.number, place.at(index), problems);
    if (read) numbers[index] = std::get<double>(*read);
    is_good = is_good && read.has_value();
  }
  if (!is_good || !info.is_rising) return is_good;  // a wrong number would cause errors in its neighbours
  return is_rising(value, place, numbers, problems);
}

bool has_lists(const JsonValue& value, const ListInfo& info, const Place& place, ProblemList& problems) {
  return has_count(value, info.list_count, "lists", info.one_for_each, place, problems);
}

}  // namespace bmu
