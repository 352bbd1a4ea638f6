#include "daemon/core/vehicle/cell_question.hpp"

namespace bmu {

namespace {

/// The number of a bank has four bits.
constexpr std::size_t banks_max = 16;

RequestScope whole_pack(const CellRequestView& view) {
  return {.modules = view.modules->modules().size(), .cells = cell_count(*view.config)};
}

std::optional<RequestScope> bank(const CellRequestView& view, std::size_t number) {
  if (number >= banks_max || number >= view.modules->modules().size()) return std::nullopt;
  RequestScope scope{.first_module = number, .modules = 1};
  for (std::size_t index = 0; index < number; ++index) {
    scope.first_cell += view.modules->modules()[index].config.cell_count;
  }
  scope.cells = view.modules->modules()[number].config.cell_count;
  return scope;
}

std::optional<RequestScope> one_cell(const CellRequestView& view, std::size_t number) {
  if (number == 0) return std::nullopt;
  RequestScope scope{.cells = 1};
  std::size_t first = 0;
  for (const ModuleRecord& module : view.modules->modules()) {
    if (number - 1 < first + module.config.cell_count) {
      scope.modules = 1;
      scope.first_cell = number - 1;
      return scope;
    }
    first += module.config.cell_count;
    ++scope.first_module;
  }
  return std::nullopt;
}

std::optional<double> usable(const Measured<std::int32_t>& value, TimePoint now, Duration age_max) {
  return value.is_usable(now, age_max) ? std::optional<double>(value.value) : std::nullopt;
}

}  // namespace

std::optional<RequestScope> scope_of(About about, std::uint8_t number, const CellRequestView& view) {
  if (about == About::cell) return one_cell(view, number);
  if (about == About::bank) return bank(view, number);
  return number == 0 ? std::optional(whole_pack(view)) : std::nullopt;
}

Extremes voltages_uV(const Question& question) {
  Extremes extremes;
  for_each_cell(question, [&](const ModuleRecord& module, std::size_t cell, std::size_t number) {
    extremes.add(usable(module.cell_voltage_uV[cell], question.view.now, question.view.config->ages.cell_voltage),
                 number + 1);
  });
  return extremes;
}

Extremes temperatures_dC(const Question& question) {
  Extremes extremes;
  std::size_t number = 0;
  for (std::size_t index = 0; index < question.scope.first_module + question.scope.modules; ++index) {
    const ModuleRecord& module = module_of(question, index);
    for (std::size_t sensor = 0; sensor < module.config.temperature_sensor_count; ++sensor) {
      ++number;
      if (index < question.scope.first_module) continue;
      extremes.add(
          usable(module.cell_temperature_dC[sensor], question.view.now, question.view.config->ages.temperature),
          number);
    }
  }
  return extremes;
}

Extremes resistances_Ohm(const Question& question) {
  Extremes extremes;
  const PackEstimate* const estimate = question.view.vehicle->estimate;
  for_each_cell(question, [&](const ModuleRecord&, std::size_t, std::size_t number) {
    const ResistanceEstimate cell = estimate->cell_resistance(number);
    extremes.add(cell.is_known ? std::optional(cell.resistance_Ohm) : std::nullopt, number + 1);
  });
  return extremes;
}

}  // namespace bmu
