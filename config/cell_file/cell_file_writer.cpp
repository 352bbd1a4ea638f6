#include "config/cell_file/cell_file_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "config/cell_file/cell_dynamics_reader.hpp"
#include "config/cell_file/charge_plateau_reader.hpp"
#include "config/cell_file/derating_reader.hpp"
#include "config/fields/pack_fields.hpp"

namespace bmu {
namespace {

// --- numbers --------------------------------------------------------------------------------------------------------

struct UnitDigits {
  std::string_view key_ending;
  double steps_per_unit;  // resolution after rounding: 100 for two digits after the point
};
/// More digits than a measurement has, and few enough to keep a list readable.
constexpr std::array unit_digits{UnitDigits{"_mV", 100}, UnitDigits{"_mOhm", 1'000}, UnitDigits{"_s", 1'000},
                                 UnitDigits{"_C", 100}, UnitDigits{"activation_K", 1}};
constexpr double other_steps_per_unit = 100'000;

double steps_per_unit(const FieldInfo& info) {
  if (info.type == FieldType::integer) return 1;
  const auto* const found = std::find_if(unit_digits.begin(), unit_digits.end(), [&info](const UnitDigits& digits) {
    return info.key.ends_with(digits.key_ending);
  });
  return found == unit_digits.end() ? other_steps_per_unit : found->steps_per_unit;
}

/// The value in whole steps of the last digit.
double steps_of(double value, const FieldInfo& info) {
  return std::nearbyint(value * steps_per_unit(info)) + 0.0;  // a zero without a sign
}

// --- JSON -----------------------------------------------------------------------------------------------------------

std::string text_of(const std::string& text) {
  return JsonValue(text).dump(-1, ' ', false, JsonValue::error_handler_t::replace);
}

std::string member(std::string_view key, const std::string& value) {
  return '"' + std::string(key) + "\": " + value;
}

/// JSON list on one line.
std::string line_of(const std::vector<std::string>& parts) {
  std::string line = "[";
  for (const std::string& part : parts) line += (line.size() == 1 ? "" : ", ") + part;
  return line + "]";
}

/// JSON list or object with each part on a line, or on lines, of its own.
std::string block(char open, const std::vector<std::string>& parts, char close) {
  std::string text(1, open);
  for (const std::string& part : parts) {
    text += text.size() == 1 ? "\n  " : ",\n  ";
    for (const char c : part) text += c == '\n' ? std::string("\n  ") : std::string(1, c);
  }
  return text + "\n" + close;
}

// --- rows of keys ---------------------------------------------------------------------------------------------------

/// The fields of a cell are only numbers and texts.
template <class Target>
void write_fields(std::span<const Field<Target>> fields, const Target& target, std::vector<std::string>& members) {
  for (const Field<Target>& field : fields) {
    const FieldValue value = field.read(target);
    const double* number = std::get_if<double>(&value);
    members.push_back(member(
        field.info.key, number == nullptr ? text_of(std::get<std::string>(value))
                                          : number_text(steps_of(*number, field.info) / steps_per_unit(field.info))));
  }
}

std::string numbers_text(std::span<const double> numbers, double file_units, const ListInfo& info) {
  std::vector<std::string> parts;
  double before = 0.0;
  for (const double number : numbers) {
    double steps = steps_of(number * file_units, info.number);
    if (info.is_rising && !parts.empty()) steps = std::max(steps, before + 1);
    parts.push_back(number_text(steps / steps_per_unit(info.number)));
    before = steps;
  }
  return line_of(parts);
}

template <class Target>
void write_lists(std::span<const ListField<Target>> fields, const Target& target, std::vector<std::string>& members) {
  for (const ListField<Target>& field : fields) {
    const auto text = [&field, &target](std::size_t list) {
      return numbers_text(field.read(target, list), field.file_units, field.info);
    };
    std::vector<std::string> lists;
    for (std::size_t list = 0; list < field.info.list_count; ++list) lists.push_back(text(list));
    members.push_back(member(field.info.number.key, lists.empty() ? text(0) : block('[', lists, ']')));
  }
}

std::string ocv_text(const CellModel& cell) {
  std::vector<std::string> pairs;
  for (const OcvPoint& point : cell.ocv) {
    pairs.push_back(line_of({std::to_string(point.soc_permille), number_text(point.ocv_uV / 1'000.0)}));
  }
  return block('[', pairs, ']');
}

/// Empty without any table.
std::vector<std::string> derating_members(const DeratingTables& derating) {
  std::vector<std::string> members;
  for (const DeratingField& field : derating_fields) {
    const DeratingTable& table = derating.*field.table;
    if (!table.is_given()) continue;
    std::vector<std::string> pairs;
    for (const DeratingPoint& point : table.points) {
      pairs.push_back(line_of({std::to_string(point.at), std::to_string(point.share_permille)}));
    }
    members.push_back(member(field.key, line_of(pairs)));
  }
  return members;
}

std::string dynamics_text(const CellDynamics& cell) {
  std::vector<std::string> members;
  write_fields(dynamics_fields(), cell, members);
  write_lists(dynamics_lists(), cell, members);
  std::vector<std::string> rows;
  for (const CellDynamics::Row& row : cell.rows) {
    std::vector<std::string> row_members;
    write_fields(dynamics_row_fields(), row, row_members);
    write_lists(dynamics_row_lists(), row, row_members);
    rows.push_back(block('{', row_members, '}'));
  }
  members.push_back(member("rows", block('[', rows, ']')));
  return block('{', members, '}');
}

}  // namespace

std::string charge_plateau_text(const ChargePlateauModel& model) {
  std::vector<std::string> members;
  write_fields(charge_plateau_fields(), model, members);
  return member("charge_plateau", block('{', members, '}'));
}

std::string cell_file_text(const CellFile& cell) {
  std::vector<std::string> members;
  write_fields(cell_name_fields(), cell, members);
  write_fields(cell_model_fields(), cell.model, members);
  members.push_back(member("ocv", ocv_text(cell.model)));
  const std::vector<std::string> derating = derating_members(cell.derating);
  if (!derating.empty()) members.push_back(member("derating", block('{', derating, '}')));
  if (cell.charge_plateau) members.push_back(charge_plateau_text(*cell.charge_plateau));
  if (cell.dynamics) members.push_back(member("dynamics", dynamics_text(*cell.dynamics)));
  return block('{', members, '}') + "\n";
}

}  // namespace bmu
