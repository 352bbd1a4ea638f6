// Answers about cells, banks, batteries and the pack.
#include <algorithm>
#include <array>

#include "daemon/core/vehicle/cell_question.hpp"

namespace bmu {

namespace {

std::int64_t rounded(double value) {
  return std::llround(value);
}

unsigned loads_on(const Question& question) {
  unsigned count = 0;
  for_each_cell(question, [&](const ModuleRecord& module, std::size_t cell, std::size_t) {
    count += module.balancing_cells >> cell & 1U;
  });
  return count;
}

RequestData cell_status(const Question& question) {
  const Extremes voltage = voltages_uV(question);
  const Extremes temperature = temperatures_dC(question);
  const unsigned load = loads_on(question);
  const ModuleRecord& module = module_of(question, question.scope.first_module);
  const bool is_there = module.status.is_usable(question.view.now, question.view.config->ages.module_status);
  unsigned status = 0;
  status |= voltage.is_known() ? 1U << 0U : 0U;
  status |= temperature.is_known() ? 1U << 1U : 0U;
  status |= resistances_Ohm(question).is_known() ? 1U << 2U : 0U;
  status |= load << 3U;
  status |= is_there && !voltage.is_known() ? 1U << 4U : 0U;
  status |= is_there && temperature.has_gap ? 1U << 5U : 0U;
  RequestData data;
  data.push_back(byte_of(status));
  data.push_back(byte_of(load));
  return data;
}

/// Of boards with their load off, and of all: here the same.
RequestData average_temperature(const Question& question) {
  RequestData data;
  const Extremes temperature = temperatures_dC(question);
  if (!temperature.is_known()) return data;
  const std::uint8_t average = temperature_byte(rounded(temperature.average()));
  data.push_back(average);
  data.push_back(0);
  data.push_back(average);
  return data;
}

RequestData average_resistance(const Question& question) {
  RequestData data;
  const Extremes resistance = resistances_Ohm(question);
  if (resistance.is_known()) data.push_back(resistance_byte(resistance.average()));
  return data;
}

/// Numbers and counts of cells and banks. If one does not fit, neither it nor those beside it are sent: it would be
/// another cell's.
template <std::size_t Count>
RequestData numbers(const std::size_t (&all)[Count]) {
  constexpr std::size_t number_max = 254;
  RequestData data;
  if (std::any_of(std::begin(all), std::end(all), [](std::size_t one) { return one > number_max; })) return data;
  for (const std::size_t one : all) data.push_back(static_cast<std::uint8_t>(one));
  return data;
}

RequestData extent(const Question& question) {
  const RequestScope& scope = question.scope;
  return numbers({scope.first_cell + 1, scope.cells, scope.first_module, scope.modules});
}

struct Missing {
  std::size_t count = 0;
  std::size_t first = 0;
};

/// Cells without a usable voltage, by their numbers from 1.
Missing missing_cells(const Question& question) {
  Missing missing;
  for_each_cell(question, [&](const ModuleRecord& module, std::size_t cell, std::size_t number) {
    const Duration age_max = question.view.config->ages.cell_voltage;
    if (module.cell_voltage_uV[cell].is_usable(question.view.now, age_max)) return;
    if (missing.count++ == 0) missing.first = number + 1;
  });
  return missing;
}

bool talks(const ModuleRecord& module, const CellRequestView& view) {
  return module.status.is_usable(view.now, view.config->ages.module_status);
}

RequestData bank_status(const Question& question) {
  constexpr std::uint8_t not_yet = 0x00;
  constexpr std::uint8_t no_communication = 0xFF;
  constexpr std::uint8_t wrong_number = 0x80;
  const ModuleRecord& module = module_of(question, question.scope.first_module);
  const std::size_t missing_count = missing_cells(question).count;
  const std::uint8_t mark = missing_count != 0 ? wrong_number : 0;
  const auto found = static_cast<std::uint8_t>(mark | (question.scope.cells - missing_count));
  RequestData data;
  const std::uint8_t silence = module.last_answer_at == TimePoint{} ? not_yet : no_communication;
  data.push_back(talks(module, question.view) ? found : silence);
  data.push_back(byte_of(loads_on(question)));
  return data;
}

RequestData pack_status(const Question& question) {
  RequestData data;
  data.push_back(missing_cells(question).count > 0 ? 1 : 0);
  data.push_back(byte_of(loads_on(question)));
  return data;
}

RequestData missing(const Question& question) {
  Missing banks;
  for (std::size_t index = 0; index < question.scope.modules; ++index) {
    const std::size_t number = question.scope.first_module + index;
    if (talks(module_of(question, number), question.view)) continue;
    if (banks.count++ == 0) banks.first = number;
  }
  const Missing cells = missing_cells(question);
  return numbers({cells.count, cells.first, banks.count, banks.first});
}

/// A value and the number of the cell that has it.
RequestData numbered(bool is_known, std::uint8_t value, std::size_t number) {
  RequestData data;
  if (!is_known || numbers({number}).empty()) return data;
  data.push_back(value);
  data.push_back(static_cast<std::uint8_t>(number));
  return data;
}

RequestData voltage_min(const Question& question) {
  const Extremes all = voltages_uV(question);
  return numbered(all.is_known(), voltage_byte(rounded(all.min)), all.min_number);
}
RequestData voltage_max(const Question& question) {
  const Extremes all = voltages_uV(question);
  return numbered(all.is_known(), voltage_byte(rounded(all.max)), all.max_number);
}
RequestData voltage_average(const Question& question) {
  RequestData data;
  const Extremes voltage = voltages_uV(question);
  if (voltage.is_known()) data.push_back(voltage_byte(rounded(voltage.average())));
  return data;
}

RequestData voltage_of_cells(const Question& question) {
  RequestData data;
  const Extremes voltage = voltages_uV(question);
  if (voltage.is_known()) put_16(data, divide_to_nearest(rounded(voltage.sum), 100'000));
  return data;
}
/// The sensor's pack voltage; without one the sum of the cells.
RequestData voltage_of_pack(const Question& question) {
  const Measured<std::int32_t>& voltage = question.view.vehicle->pack->pack_voltage_mV;
  if (!voltage.is_valid()) return voltage_of_cells(question);
  RequestData data;
  put_16(data, divide_to_nearest(voltage.value, 100));
  return data;
}

/// Of boards with their load off, and of all: here the same.
RequestData numbered_twice(bool is_known, std::uint8_t value, std::size_t number) {
  RequestData data = numbered(is_known, value, number);
  if (data.empty()) return data;
  data.push_back(data[0]);
  data.push_back(data[1]);
  return data;
}
RequestData temperature_min(const Question& question) {
  const Extremes all = temperatures_dC(question);
  return numbered_twice(all.is_known(), temperature_byte(rounded(all.min)), all.min_number);
}
RequestData temperature_max(const Question& question) {
  const Extremes all = temperatures_dC(question);
  return numbered_twice(all.is_known(), temperature_byte(rounded(all.max)), all.max_number);
}

RequestData resistance_min(const Question& question) {
  const Extremes all = resistances_Ohm(question);
  return numbered(all.is_known(), resistance_byte(all.min), all.min_number);
}
RequestData resistance_max(const Question& question) {
  const Extremes all = resistances_Ohm(question);
  return numbered(all.is_known(), resistance_byte(all.max), all.max_number);
}

RequestData resistance_sum(const Question& question) {
  RequestData data;
  const Extremes resistance = resistances_Ohm(question);
  if (resistance.is_known()) put_16(data, rounded(resistance.sum * 1e4));
  return data;
}

/// The same requests about a bank (20h on), a battery (30h on) and the pack (40h on).
struct ExtentRow {
  std::uint8_t offset;
  RequestData (*of_bank)(const Question& question);
  RequestData (*of_pack)(const Question& question);
};
constexpr std::array extent_rows{
    ExtentRow{0x0, extent, extent},
    ExtentRow{0x1, bank_status, pack_status},
    ExtentRow{0x2, missing, missing},
    ExtentRow{0x3, voltage_min, voltage_min},
    ExtentRow{0x4, voltage_average, voltage_average},
    ExtentRow{0x5, voltage_max, voltage_max},
    ExtentRow{0x6, voltage_of_cells, voltage_of_pack},
    ExtentRow{0x7, temperature_min, temperature_min},
    ExtentRow{0x8, average_temperature, average_temperature},
    ExtentRow{0x9, temperature_max, temperature_max},
    ExtentRow{0xA, resistance_min, resistance_min},
    ExtentRow{0xB, average_resistance, average_resistance},
    ExtentRow{0xC, resistance_max, resistance_max},
    ExtentRow{0xD, resistance_sum, resistance_sum},
};

constexpr std::array cell_rows{
    PidRow{0x11, About::cell, cell_status},
    PidRow{0x14, About::cell, voltage_average},
    PidRow{0x18, About::cell, average_temperature},
    PidRow{0x1B, About::cell, average_resistance},
};

constexpr auto rows = [] {
  std::array<PidRow, cell_rows.size() + 3 * extent_rows.size()> all{};
  auto* next = std::copy(cell_rows.begin(), cell_rows.end(), all.begin());
  for (const ExtentRow& row : extent_rows) {
    *next++ = {static_cast<std::uint8_t>(0x20 + row.offset), About::bank, row.of_bank};
    *next++ = {static_cast<std::uint8_t>(0x30 + row.offset), About::battery, row.of_pack};
    *next++ = {static_cast<std::uint8_t>(0x40 + row.offset), About::pack, row.of_pack};
  }
  return all;
}();

}  // namespace

std::span<const PidRow> cell_answers() {
  return rows;
}

}  // namespace bmu
