#include "config/cell_file/cell_dynamics_reader.hpp"

#include <array>
#include <string>
#include <vector>

#include "config/fields/pack_fields.hpp"

namespace bmu {
namespace {

using Row = CellDynamics::Row;

constexpr double error_max_mV = 1'000;
constexpr double resistance_max_mOhm = 100'000;
constexpr double time_min_s = 0.1;
constexpr double time_max_s = 100'000;

constexpr std::array dynamics_list_table{
    list<&CellDynamics::pair_time_constant_s>({.number = {.key = "pair_time_constants_s",
                                                          .min = time_min_s,
                                                          .max = time_max_s,
                                                          .meaning = "how fast each pair settles"},
                                               .one_for_each = "one for each pair",
                                               .is_rising = true}),
};

constexpr std::array dynamics_table{
    required(real<&CellDynamics::activation_K>(
        {.key = "activation_K",
         .min = 0,
         .max = 10'000,
         .meaning = "between the rows a temperature counts as exp(this * (1/T - 1/298.15 K)), and beyond them the "
                    "resistances grow and shrink so"})),
    required(real<&CellDynamics::hysteresis_charge, 1, 1'000>(
        {.key = "hysteresis_charge_permille",
         .min = 1,
         .max = 1'000,
         .meaning = "of the capacity: so much has to flow back for two thirds of the way between the curves"})),
    required(real<&CellDynamics::charge_efficiency>(
        {.key = "charge_efficiency", .min = 0.5, .max = 1, .meaning = "what of a charging current arrives as charge"})),
};

constexpr std::array row_table{
    required(real<&Row::temperature_C>({.key = "temperature_C",
                                        .min = -60,
                                        .max = 150,
                                        .meaning = "of the cell; each row is warmer than the one before"})),
    required(real<&Row::exchange_current_A>(
        {.key = "exchange_current_A",
         .min = 0.0001,
         .max = 1'000'000,
         .meaning = "well below it the charge transfer is a resistance, well above it takes hardly more voltage"})),
    required(real<&Row::slow_error_V, 1, 1'000>(
        {.key = "slow_error_mV",
         .min = 0.1,
         .max = error_max_mV,
         .meaning = "how far the model is off for minutes, one standard deviation"})),
    required(real<&Row::slow_error_time_s>(
        {.key = "slow_error_time_s", .min = time_min_s, .max = time_max_s, .meaning = "how long that lasts"})),
    required(real<&Row::fast_error_V, 1, 1'000>(
        {.key = "fast_error_mV",
         .min = 0,
         .max = error_max_mV,
         .meaning = "how far it is off for seconds, besides, one standard deviation"})),
    required(real<&Row::fast_error_time_s>(
        {.key = "fast_error_time_s", .min = time_min_s, .max = time_max_s, .meaning = "how long that lasts"})),
};

constexpr std::string_view at_20_permille = "one at every 20 permille of charge, from empty to full";
constexpr std::string_view at_50_permille = "one at every 50 permille of charge, from empty to full";
static_assert(CellDynamics::curve_points == 51 && CellDynamics::resistance_points == 21);

constexpr std::array row_list_table{
    list<&Row::ocv_V, 1'000>({.number = {.key = "ocv_mV",
                                         .min = ocv_min_mV,
                                         .max = ocv_max_mV,
                                         .meaning = "open-circuit voltage, the middle between after charging and after "
                                                    "discharging, at every 20 permille of charge from empty to full"},
                              .one_for_each = at_20_permille,
                              .is_rising = true}),
    list<&Row::hysteresis_V, 1'000>({.number = {.key = "hysteresis_mV",
                                                .min = 0,
                                                .max = 200,
                                                .meaning = "half of what lies between the two, at every 50 permille"},
                                     .one_for_each = at_50_permille}),
    list<&Row::series_Ohm, 1'000>({.number = {.key = "series_mOhm",
                                              .min = 0.001,
                                              .max = resistance_max_mOhm,
                                              .meaning = "what a current step shows at once, at every 50 permille"},
                                   .one_for_each = at_50_permille}),
    list<&Row::kinetic_Ohm, 1'000>(
        {.number = {.key = "kinetic_mOhm",
                    .min = 0,
                    .max = resistance_max_mOhm,
                    .meaning = "the charge transfer at a small current, at every 50 permille"},
         .one_for_each = at_50_permille}),
    list<&Row::pair_Ohm, 1'000>(
        {.number = {.key = "pair_mOhm",
                    .min = 0,
                    .max = resistance_max_mOhm,
                    .meaning = "what it shows later: a list for each pair, at every 50 permille"},
         .one_for_each = "one for each pair"}),
};

template <class Target>
void read_object(const JsonValue& object, const Place& place, std::span<const Field<Target>> fields,
                 std::span<const ListField<Target>> lists, std::string_view other_key, Target& target,
                 ProblemList& problems) {
  std::vector<std::string_view> keys = keys_of(fields);
  const auto list_keys = keys_of(lists);
  keys.insert(keys.end(), list_keys.begin(), list_keys.end());
  if (!other_key.empty()) keys.push_back(other_key);
  check_keys(object, place, keys, problems);
  read_fields(object, place, fields, target, problems);
  read_lists(object, place, lists, target, problems);
}

/// Checks that each row is warmer than the previous one.
void check_rising(const CellDynamics& cell, const Place& place, ProblemList& problems) {
  for (std::size_t index = 1; index < cell.rows.size(); ++index) {
    const Place key = place.at(index).at("temperature_C");
    const double before_C = cell.rows[index - 1].temperature_C;
    const double own_C = cell.rows[index].temperature_C;
    const bool are_good = problems.is_good(key) && problems.is_good(place.at(index - 1).at("temperature_C"));
    if (!are_good || own_C > before_C) continue;
    problems.add(key, number_text(own_C), "more than in the row before, " + number_text(before_C));
  }
}

void read_rows(const JsonValue& object, const Place& object_place, CellDynamics& cell, ProblemList& problems) {
  const JsonValue* rows = find_value(object, object_place, "rows", true, problems);
  if (rows == nullptr) return;
  const Place place = object_place.at("rows");
  if (!rows->is_array() || rows->empty() || rows->size() > CellDynamics::temperatures_max) {
    const std::string found = rows->is_array() ? std::to_string(rows->size()) + " rows" : shown(*rows);
    problems.add(
        place, found,
        "a list of 1 to " + std::to_string(CellDynamics::temperatures_max) + " rows, one for each temperature");
    return;
  }
  for (std::size_t index = 0; index < rows->size(); ++index) {
    const JsonValue& value = (*rows)[index];
    cell.rows.push_back({});
    if (!is_object(value, place.at(index), problems)) continue;
    read_object(value, place.at(index), dynamics_row_fields(), dynamics_row_lists(), "", cell.rows.back(), problems);
  }
  check_rising(cell, place, problems);
}

}  // namespace

std::span<const Field<CellDynamics>> dynamics_fields() {
  return dynamics_table;
}
std::span<const ListField<CellDynamics>> dynamics_lists() {
  return dynamics_list_table;
}
std::span<const Field<CellDynamics::Row>> dynamics_row_fields() {
  return row_table;
}
std::span<const ListField<CellDynamics::Row>> dynamics_row_lists() {
  return row_list_table;
}

CellDynamics read_dynamics(const JsonValue& object, const Place& place, const CellModel& model, ProblemList& problems) {
  CellDynamics cell;
  cell.capacity_As = static_cast<double>(model.capacity_uAs) * 1e-6;
  cell.self_discharge_per_month = model.self_discharge_permille_per_month / 1'000.0;
  if (!is_object(object, place, problems)) return cell;
  read_object(object, place, dynamics_fields(), dynamics_lists(), "rows", cell, problems);
  read_rows(object, place, cell, problems);
  return cell;
}

}  // namespace bmu
