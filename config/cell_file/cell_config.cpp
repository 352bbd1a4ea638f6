#include "config/cell_file/cell_config.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "config/cell_file/cell_dynamics_reader.hpp"
#include "config/cell_file/charge_plateau_reader.hpp"
#include "config/cell_file/derating_reader.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/json/read_file.hpp"

namespace bmu {
namespace {

// --- the curve ------------------------------------------------------------------------------------------------------

/// The value in whole microvolts, or none. Half a microvolt is below any measurement; a double represents a decimal
/// fraction well enough.
std::optional<std::int32_t> whole_uV(double value_mV) {
  const double value_uV = value_mV * 1'000;
  const double whole = std::nearbyint(value_uV);
  if (std::abs(value_uV - whole) > 1e-3) return std::nullopt;
  return static_cast<std::int32_t>(whole);
}

std::optional<OcvPoint> read_ocv_point(const JsonValue& value, const Place& place, ProblemList& problems) {
  if (!value.is_array() || value.size() != 2) {
    problems.add(place, shown(value), "a pair, [soc_permille, ocv_mV]");
    return std::nullopt;
  }
  const FieldInfo soc{.key = "soc_permille", .min = 0, .max = 1'000};
  const FieldInfo ocv{.key = "ocv_mV", .min = ocv_min_mV, .max = ocv_max_mV, .type = FieldType::real};
  const auto soc_read = read_value(value[0], soc, place.at(0), problems);
  const auto ocv_read = read_value(value[1], ocv, place.at(1), problems);
  if (!soc_read || !ocv_read) return std::nullopt;
  const auto ocv_uV = whole_uV(std::get<double>(*ocv_read));
  if (!ocv_uV) {
    problems.add(place.at(1), shown(value[1]), "at most three digits behind the point: microvolts");
    return std::nullopt;
  }
  return OcvPoint{static_cast<std::int32_t>(std::get<double>(*soc_read)), *ocv_uV};
}

/// Checks that the point is above the previous one in both columns, and that the table begins at 0 and ends at 1000.
void check_ocv_point(const CellModel& cell, std::size_t index, std::size_t count, const JsonValue& value,
                     const Place& place, ProblemList& problems) {
  const OcvPoint& point = cell.ocv[index];
  const bool is_last = index + 1 == count;
  if (index == 0 && point.soc_permille != 0) problems.add(place.at(0), shown(value[0]), "0 in the first pair");
  if (is_last && point.soc_permille != 1'000) problems.add(place.at(0), shown(value[0]), "1000 in the last pair");
  if (index == 0) return;
  const OcvPoint& before = cell.ocv[index - 1];
  if (point.soc_permille <= before.soc_permille) {
    problems.add(place.at(0), shown(value[0]), "more than in the pair before, " + std::to_string(before.soc_permille));
  }
  if (point.ocv_uV <= before.ocv_uV) {
    problems.add(place.at(1), shown(value[1]),
                 "more than in the pair before, " + number_text(static_cast<double>(before.ocv_uV) / 1'000));
  }
}

void read_ocv(const JsonValue& object, const Place& cell_place, CellModel& cell, ProblemList& problems) {
  const JsonValue* table = find_value(object, cell_place, "ocv", true, problems);
  if (table == nullptr) return;
  const Place place = cell_place.at("ocv");
  if (!table->is_array() || table->size() < 2 || table->size() > ocv_points_max) {
    const std::string found = table->is_array() ? std::to_string(table->size()) + " pairs" : shown(*table);
    problems.add(place, found, "a list of 2 to 64 pairs, [soc_permille, ocv_mV]");
    return;
  }
  for (std::size_t index = 0; index < table->size(); ++index) {
    const auto point = read_ocv_point((*table)[index], place.at(index), problems);
    if (point) cell.ocv.push_back(*point);
  }
  if (cell.ocv.size() != table->size()) return;  // a missing point would cause errors in its neighbours
  for (std::size_t index = 0; index < table->size(); ++index) {
    check_ocv_point(cell, index, table->size(), (*table)[index], place.at(index), problems);
  }
}

// --- what must fit together -----------------------------------------------------------------------------------------

struct AbsolutePair {
  std::string_view lower_key;
  std::string_view upper_key;
  std::int32_t CellModel::*lower;
  std::int32_t CellModel::*upper;
  std::int32_t scale;
};
constexpr std::array absolute_pairs{
    AbsolutePair{"voltage_min_mV", "voltage_max_mV", &CellModel::voltage_min_uV, &CellModel::voltage_max_uV, 1'000},
    AbsolutePair{"temperature_min_dC", "temperature_max_dC", &CellModel::temperature_min_dC,
                 &CellModel::temperature_max_dC, 1},
};

void check_absolute_pair(const CellModel& cell, const AbsolutePair& pair, const Place& cell_place,
                         ProblemList& problems) {
  const Place place = cell_place.at(pair.lower_key);
  if (!problems.is_good(place) || !problems.is_good(cell_place.at(pair.upper_key))) return;
  const std::int32_t lower = cell.*pair.lower;
  const std::int32_t upper = cell.*pair.upper;
  if (lower < upper) return;
  problems.add(place, std::to_string(lower / pair.scale),
               "less than " + std::string(pair.upper_key) + ", " + std::to_string(upper / pair.scale));
}

/// Checks that the open-circuit voltages of an empty and of a full cell are within the manufacturer's limits.
void check_ocv_range(const CellModel& cell, const Place& cell_place, ProblemList& problems) {
  const Place place = cell_place.at("ocv");
  if (!problems.is_good_throughout(place)) return;
  if (!problems.is_good(cell_place.at("voltage_min_mV")) || !problems.is_good(cell_place.at("voltage_max_mV"))) return;
  const std::int32_t empty_uV = cell.ocv[0].ocv_uV;
  const std::int32_t full_uV = cell.ocv.back().ocv_uV;
  if (empty_uV >= cell.voltage_min_uV && full_uV <= cell.voltage_max_uV) return;
  problems.add(place, std::to_string(mV_from_uV(empty_uV)) + " to " + std::to_string(mV_from_uV(full_uV)) + " mV",
               "from voltage_min_mV, " + std::to_string(mV_from_uV(cell.voltage_min_uV)) + ", to voltage_max_mV, " +
                   std::to_string(mV_from_uV(cell.voltage_max_uV)));
}

/// Checks that the slow RC element is the slower one; otherwise both have been mixed up.
void check_rc_pairs(const CellModel& cell, const Place& cell_place, ProblemList& problems) {
  const Place place = cell_place.at("slow_rc_time_constant_s");
  if (!problems.is_good(place) || !problems.is_good(cell_place.at("rc_time_constant_s"))) return;
  if (cell.slow_rc_resistance_Ohm == 0.0 || cell.slow_rc_time_constant_s > cell.rc_time_constant_s) return;
  problems.add(place, number_text(cell.slow_rc_time_constant_s),
               "more than rc_time_constant_s, " + number_text(cell.rc_time_constant_s));
}

}  // namespace

void read_cell(const JsonValue& object, const Place& place, CellFile& cell, ProblemList& problems) {
  if (!is_object(object, place, problems)) return;
  std::vector<std::string_view> keys = keys_of(cell_name_fields());
  const auto model_keys = keys_of(cell_model_fields());
  keys.insert(keys.end(), model_keys.begin(), model_keys.end());
  keys.insert(keys.end(), {"ocv", "derating", "charge_plateau", "dynamics"});
  check_keys(object, place, keys, problems);
  read_fields(object, place, cell_name_fields(), cell, problems);
  read_fields(object, place, cell_model_fields(), cell.model, problems);
  read_ocv(object, place, cell.model, problems);
  const JsonValue* derating = find_value(object, place, "derating", false, problems);
  if (derating != nullptr) cell.derating = read_derating(*derating, place.at("derating"), problems);
  const JsonValue* plateau = find_value(object, place, "charge_plateau", false, problems);
  if (plateau != nullptr) cell.charge_plateau = read_charge_plateau(*plateau, place.at("charge_plateau"), problems);
  const JsonValue* dynamics = find_value(object, place, "dynamics", false, problems);
  if (dynamics != nullptr) cell.dynamics = read_dynamics(*dynamics, place.at("dynamics"), cell.model, problems);
}

void check_cell(const CellModel& cell, const Place& place, ProblemList& problems) {
  for (const AbsolutePair& pair : absolute_pairs) check_absolute_pair(cell, pair, place, problems);
  check_ocv_range(cell, place, problems);
  check_rc_pairs(cell, place, problems);
}

Result<CellFile, ConfigProblems> parse_cell_file(std::string_view text, std::string_view file_name) {
  ProblemList problems;
  const Place place{std::string(file_name), ""};
  CellFile cell;
  const auto tree = parse_json(text, place.file, problems);
  if (!tree) return failure(problems.take());
  read_cell(*tree, place, cell, problems);
  check_cell(cell.model, place, problems);
  if (!problems.empty()) return failure(problems.take());
  return cell;
}

Result<CellFile, ConfigProblems> load_cell_file(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (bytes) return parse_cell_file(*bytes, file.string());
  ProblemList problems;
  problems.add({file.string(), ""}, bytes.error(), wanted_file);
  return failure(problems.take());
}

}  // namespace bmu
