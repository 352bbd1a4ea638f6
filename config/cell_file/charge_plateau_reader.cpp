#include "config/cell_file/charge_plateau_reader.hpp"

#include <array>
#include <string>
#include <string_view>

namespace bmu {
namespace {

constexpr std::array charge_plateau_table{
    required(real<&ChargePlateauModel::plateau_weight, 1, 1'000>(
        {.key = "plateau_weight_permille",
         .min = 0,
         .max = 20'000,
         .meaning = "what the charge through the flattest 50 mV is multiplied with"})),
    required(real<&ChargePlateauModel::above_weight, 1, 1'000>(
        {.key = "above_weight_permille",
         .min = 0,
         .max = 5'000,
         .meaning = "and the charge from the end of the plateau until the cell is full; their sum is the capacity"})),
    required(real<&ChargePlateauModel::sigma_As, 3'600>(
        {.key = "sigma_Ah",
         .min = 0.0001,
         .max = 1'000,
         .meaning = "of a capacity from one charge, one standard deviation"})),
    required(real<&ChargePlateauModel::current_A>(
        {.key = "current_A",
         .min = 0.001,
         .max = 10'000,
         .meaning = "of the charges it was fitted to; other charges within a fifth of it are looked at"})),
    required(real<&ChargePlateauModel::full_voltage_V, 1, 1'000>(
        {.key = "full_voltage_mV", .min = 500, .max = 6'000, .meaning = "at which these were held until full"})),
    required(real<&ChargePlateauModel::end_current_A>(
        {.key = "end_current_A", .min = 0.0001, .max = 1'000, .meaning = "at which they counted as full"})),
    real<&ChargePlateauModel::temperature_min_C>(
        {.key = "temperature_min_C", .min = -40, .max = 100, .meaning = "a colder cell shows another curve"}),
    real<&ChargePlateauModel::temperature_max_C>(
        {.key = "temperature_max_C", .min = -40, .max = 100, .meaning = "and a hotter one"}),
};

/// Checks that the first value is less than the second.
void check_pair(std::string_view lower_key, double lower, std::string_view upper_key, double upper, const Place& place,
                ProblemList& problems) {
  if (!problems.is_good(place.at(lower_key)) || !problems.is_good(place.at(upper_key)) || lower < upper) return;
  problems.add(place.at(lower_key), number_text(lower),
               "less than " + std::string(upper_key) + ", " + number_text(upper));
}

}  // namespace

std::span<const Field<ChargePlateauModel>> charge_plateau_fields() {
  return charge_plateau_table;
}

ChargePlateauModel read_charge_plateau(const JsonValue& object, const Place& place, ProblemList& problems) {
  ChargePlateauModel model;
  if (!is_object(object, place, problems)) return model;
  check_keys(object, place, keys_of(charge_plateau_fields()), problems);
  read_fields(object, place, charge_plateau_fields(), model, problems);
  check_pair("end_current_A", model.end_current_A, "current_A", model.current_A, place, problems);
  check_pair("temperature_min_C", model.temperature_min_C, "temperature_max_C", model.temperature_max_C, place,
             problems);
  return model;
}

}  // namespace bmu
