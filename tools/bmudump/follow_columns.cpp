#include "tools/bmudump/follow_columns.hpp"

#include <algorithm>

namespace bmu::dump {
namespace {

constexpr int space = 1;
constexpr int space_before_values = 2;  // between numbers and values, as between values
constexpr int values_width_min = 46;    // "cell_voltage_1 3.6512 V  _2 3.6498  _3 3.6530"
constexpr int bus_width_min = 6;
constexpr int name_width_min = 8;

struct Number {
  int FollowColumns::*width;
  int needs;
};
/// In the order of priority: the last ones are removed first.
constexpr Number numbers[] = {
    {&FollowColumns::rate, 8}, {&FollowColumns::age, 8}, {&FollowColumns::gap, 8}, {&FollowColumns::frames, 10}};

}  // namespace

FollowColumns fit_columns(const ColumnNeeds& needs, int width) {
  FollowColumns fit;
  if (needs.bus > 0) fit.bus = std::min(needs.bus, std::max(width / 8, bus_width_min)) + space;
  fit.id = needs.id + space;
  fit.name = std::min(needs.name, std::max(width * 7 / 20, name_width_min)) + space;
  const int wanted = std::max(width / 2, values_width_min);
  int left = width - fit.bus - fit.id - fit.name;
  for (const Number& number : numbers) {
    if (left - number.needs - space_before_values < wanted) break;
    fit.*number.width = number.needs;
    left -= number.needs;
  }
  fit.values_space = fit.rate > 0 ? space_before_values : 0;
  fit.values = std::max(left - fit.values_space, 0);
  return fit;
}

}  // namespace bmu::dump
