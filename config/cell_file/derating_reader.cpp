#include "config/cell_file/derating_reader.hpp"

#include <optional>
#include <string>
#include <vector>

#include "config/fields/fields.hpp"

namespace bmu {
namespace {

constexpr std::int32_t all_permille = 1'000;

FieldInfo place_info(const DeratingField& field) {
  if (field.is_over_soc) return {.key = "soc_permille", .min = 0, .max = all_permille};
  return {.key = "temperature_dC", .min = -600, .max = 1'500};
}

std::optional<DeratingPoint> read_point(const JsonValue& value, const DeratingField& field, const Place& place,
                                        ProblemList& problems) {
  const FieldInfo at = place_info(field);
  if (!value.is_array() || value.size() != 2) {
    problems.add(place, shown(value), "a pair, [" + std::string(at.key) + ", share_permille]");
    return std::nullopt;
  }
  const FieldInfo share{.key = "share_permille", .min = 0, .max = all_permille};
  const auto at_read = read_value(value[0], at, place.at(0), problems);
  const auto share_read = read_value(value[1], share, place.at(1), problems);
  if (!at_read || !share_read) return std::nullopt;
  return DeratingPoint{static_cast<std::int32_t>(std::get<double>(*at_read)),
                       static_cast<std::int32_t>(std::get<double>(*share_read))};
}

/// A table under check, with its location and the list for its problems.
struct Look {
  const DeratingField& field;
  const DeratingTable& table;
  const Place& place;
  ProblemList& problems;

  void refuse(std::size_t point, std::size_t column, const std::string& wanted) const {
    const DeratingPoint& found = table.points[point];
    problems.add(place.at(point).at(column), std::to_string(column == 0 ? found.at : found.share_permille), wanted);
  }
  [[nodiscard]] std::int32_t share(std::size_t point) const { return table.points[point].share_permille; }
};

void check_places(const Look& look) {
  const std::size_t last = look.table.points.size() - 1;
  if (look.field.is_over_soc && look.table.points[0].at != 0) look.refuse(0, 0, "0 in the first pair");
  if (look.field.is_over_soc && look.table.points[last].at != all_permille) {
    look.refuse(last, 0, "1000 in the last pair");
  }
  for (std::size_t point = 1; point <= last; ++point) {
    const std::int32_t before = look.table.points[point - 1].at;
    if (look.table.points[point].at > before) continue;
    look.refuse(point, 0, "more than in the pair before, " + std::to_string(before));
  }
}

/// Checks that charging ends at some low temperature, because of lithium plating in the cold.
void check_cold_end(const Look& look) {
  if (look.field.is_over_soc || !look.field.is_charge || look.share(0) == 0) return;
  look.refuse(0, 1, "0 in the first pair: in the cold nothing is charged");
}

/// Checks that the coldest, the hottest, the fullest or the emptiest cell is the one with the smallest share.
void check_shares(const Look& look) {
  const bool may_rise_first = !look.field.is_over_soc || !look.field.is_charge;
  const bool may_fall_then = !look.field.is_over_soc || look.field.is_charge;
  bool has_fallen = !may_rise_first;
  for (std::size_t point = 1; point < look.table.points.size(); ++point) {
    const std::int32_t before = look.share(point - 1);
    const std::int32_t own = look.share(point);
    if (own < before && !may_fall_then) {
      look.refuse(point, 1, "at least as much as in the pair before, " + std::to_string(before));
    } else if (own > before && has_fallen) {
      look.refuse(point, 1,
                  "at most as much as in the pair before, " + std::to_string(before) +
                      (may_rise_first ? ", as it has fallen already" : ""));
    }
    has_fallen = has_fallen || own < before;
  }
}

void read_table(const JsonValue& list, const DeratingField& field, const Place& place, DeratingTable& table,
                ProblemList& problems) {
  if (!list.is_array() || list.size() < 2 || list.size() > DeratingTable::points_max) {
    const std::string found = list.is_array() ? std::to_string(list.size()) + " pairs" : shown(list);
    problems.add(place, found,
                 "a list of 2 to " + std::to_string(DeratingTable::points_max) + " pairs, [" +
                     std::string(place_info(field).key) + ", share_permille]");
    return;
  }
  for (std::size_t index = 0; index < list.size(); ++index) {
    const auto point = read_point(list[index], field, place.at(index), problems);
    if (point) table.points.push_back(*point);
  }
  if (table.points.size() != list.size()) return;  // a missing pair would cause errors in its neighbours
  const Look look{field, table, place, problems};
  check_places(look);
  check_cold_end(look);
  check_shares(look);
}

}  // namespace

DeratingTables read_derating(const JsonValue& object, const Place& place, ProblemList& problems) {
  DeratingTables tables;
  if (!is_object(object, place, problems)) return tables;
  std::vector<std::string_view> keys;
  for (const DeratingField& field : derating_fields) {
    keys.push_back(field.key);
    const JsonValue* list = find_value(object, place, field.key, false, problems);
    if (list != nullptr) read_table(*list, field, place.at(field.key), tables.*field.table, problems);
  }
  check_keys(object, place, keys, problems);
  return tables;
}

}  // namespace bmu
