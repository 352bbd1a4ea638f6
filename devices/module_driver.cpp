#include "devices/module_driver.hpp"

#include <algorithm>

namespace bmu {

namespace {

bool is_out(const SignalValue& value) {
  return value.validity == Validity::out_of_range;
}

template <class Values>
std::size_t count_out(const Values& values, std::size_t most) {
  const auto count = std::min(values.size(), most);
  return static_cast<std::size_t>(
      std::count_if(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count), is_out));
}

}  // namespace

std::size_t values_out_of_range(const ModuleReport& report, std::size_t cell_count, std::size_t temperature_count) {
  const std::size_t cells_before = std::min<std::size_t>(report.first_cell, cell_count);
  std::size_t count = count_out(report.cell_voltage_uV, cell_count - cells_before) +
                      count_out(report.cell_temperature_dC, temperature_count);
  if (report.board_temperature_dC && is_out(*report.board_temperature_dC)) ++count;
  if (is_out(report.stack_voltage_mV)) ++count;
  return count;
}

}  // namespace bmu
