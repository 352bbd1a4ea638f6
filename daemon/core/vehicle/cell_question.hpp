// Subject of a data request (cell_requests.hpp) and parts of its answer: the addressed modules and cells, their lowest
// and highest values, and the encodings of a Lithiumate.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "daemon/core/vehicle/cell_requests.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

/// Data bytes of an answer; empty: there is no answer.
using RequestData = FixedVector<std::uint8_t, 4>;

[[nodiscard]] constexpr std::uint8_t byte_of(std::int64_t value) {
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(value, 0, 0xFF));
}
/// 10 mV a count from 2.00 V.
[[nodiscard]] constexpr std::uint8_t voltage_byte(std::int64_t value_uV) {
  return byte_of(divide_to_nearest(value_uV - 2'000'000, 10'000));
}
/// Degrees Celsius above -128.
[[nodiscard]] constexpr std::uint8_t temperature_byte(std::int64_t value_dC) {
  return byte_of(divide_to_nearest(value_dC, 10) + 128);
}
/// 0.1 mOhm a count.
[[nodiscard]] inline std::uint8_t resistance_byte(double value_Ohm) {
  return byte_of(std::llround(value_Ohm * 1e4));
}

constexpr void put_16(RequestData& data, std::int64_t value) {
  const std::int64_t kept = std::clamp<std::int64_t>(value, 0, 0xFFFF);
  data.push_back(static_cast<std::uint8_t>(kept >> 8));
  data.push_back(static_cast<std::uint8_t>(kept & 0xFF));
}
constexpr void put_signed_16(RequestData& data, std::int64_t value) {
  const auto kept = static_cast<std::uint16_t>(std::clamp<std::int64_t>(value, INT16_MIN, INT16_MAX));
  put_16(data, kept);
}
constexpr void put_24(RequestData& data, std::int64_t value) {
  const std::int64_t kept = std::clamp<std::int64_t>(value, 0, 0xFF'FFFF);
  data.push_back(static_cast<std::uint8_t>(kept >> 16));
  put_16(data, kept & 0xFFFF);
}

/// Modules of a bank, the battery or the pack, or the module of a cell.
struct RequestScope {
  std::size_t first_module = 0;
  std::size_t modules = 0;
  std::size_t first_cell = 0;  // through the pack, from 0
  std::size_t cells = 0;
};

struct Question {
  const CellRequestView& view;
  RequestScope scope;
};

enum class About : std::uint8_t { cell, bank, battery, pack, system };

struct PidRow {
  std::uint8_t pid;
  About about;
  RequestData (*answer)(const Question& question);
};

/// Answers about cells, banks, batteries and the pack; about the system.
[[nodiscard]] std::span<const PidRow> cell_answers();
[[nodiscard]] std::span<const PidRow> system_answers();

/// The modules and cells addressed by `number`, b3 of the request. None: they do not exist.
[[nodiscard]] std::optional<RequestScope> scope_of(About about, std::uint8_t number, const CellRequestView& view);

[[nodiscard]] inline const ModuleRecord& module_of(const Question& question, std::size_t index) {
  return question.view.modules->modules()[index];
}

/// Calls take(module, index within it, number through the pack from 0) for each cell of the scope.
template <class Take>
void for_each_cell(const Question& question, Take take) {
  std::size_t number = 0;
  for (std::size_t index = 0; index < question.scope.first_module; ++index) {
    number += module_of(question, index).config.cell_count;
  }
  for (std::size_t index = 0; index < question.scope.modules; ++index) {
    const ModuleRecord& module = module_of(question, question.scope.first_module + index);
    for (std::size_t cell = 0; cell < module.config.cell_count; ++cell, ++number) {
      const std::size_t end = question.scope.first_cell + question.scope.cells;
      if (number >= question.scope.first_cell && number < end) take(module, cell, number);
    }
  }
}

/// Lowest, highest and average of all expected values; unknown while one is missing.
struct Extremes {
  double min = 0.0;
  double max = 0.0;
  double sum = 0.0;
  std::size_t min_number = 0;  // from 1
  std::size_t max_number = 0;
  std::size_t count = 0;
  bool has_gap = false;

  void add(std::optional<double> value, std::size_t number) {
    if (!value) {
      has_gap = true;
      return;
    }
    if (count == 0 || *value < min) {
      min = *value;
      min_number = number;
    }
    if (count == 0 || *value > max) {
      max = *value;
      max_number = number;
    }
    sum += *value;
    ++count;
  }
  [[nodiscard]] bool is_known() const { return count > 0 && !has_gap; }
  [[nodiscard]] double average() const { return sum / static_cast<double>(count); }
};

/// Each of these is unknown while a value is missing or stale.
[[nodiscard]] Extremes voltages_uV(const Question& question);
/// Of the sensors on the cells of these modules, numbered through the pack.
[[nodiscard]] Extremes temperatures_dC(const Question& question);
[[nodiscard]] Extremes resistances_Ohm(const Question& question);

}  // namespace bmu
