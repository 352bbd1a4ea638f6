#include "daemon/core/stuck_watch.hpp"

#include <cstdlib>

namespace bmu {

namespace {

constexpr double shows_at_least_uV = 5'000.0;
/// Samples further apart than this do not prove what was between them.
constexpr Duration sample_gap_max = 1s;

}  // namespace

void StuckWatch::init(const CellModel& cell) {
  const double resistance_mOhm = cell.series_resistance_Ohm * 1e3;
  moved_min_mA_ = resistance_mOhm > 0.0 ? std::llround(shows_at_least_uV / resistance_mOhm) : 0;
  cells_ = {};
}

void StuckWatch::take(Cell& cell, const Measured<std::int32_t>& voltage_uV, std::int32_t current_mA) const {
  if (voltage_uV.taken_at == cell.taken_at) return;
  if (!voltage_uV.is_valid() || cell.taken_at == TimePoint{} || voltage_uV.value != cell.voltage_uV) {
    cell = {.voltage_uV = voltage_uV.value, .current_mA = current_mA, .taken_at = voltage_uV.taken_at};
    return;
  }
  const Duration since = voltage_uV.taken_at - cell.taken_at;
  const bool has_moved = std::llabs(std::int64_t{current_mA} - cell.current_mA) >= moved_min_mA_;
  if (has_moved && since <= sample_gap_max) cell.stuck_for += since;
  cell.taken_at = voltage_uV.taken_at;
}

void StuckWatch::update(const ModuleTable& modules, const Measured<std::int32_t>& current_mA) {
  if (moved_min_mA_ == 0 || !current_mA.is_valid()) return;
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleRecord& module = modules.modules()[index];
    for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
      take(cells_[index][cell], module.cell_voltage_uV[cell], current_mA.value);
    }
  }
}

Reading StuckWatch::longest_ms(const ModuleTable& modules) const {
  Reading longest{.is_known = true};
  std::uint16_t before = 0;
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleConfig& module = modules.modules()[index].config;
    for (std::uint8_t cell = 0; cell < module.cell_count; ++cell) {
      const Cell& one = cells_[index][cell];
      if (to_ms(one.stuck_for) <= longest.value) continue;
      longest.value = to_ms(one.stuck_for);
      longest.taken_at = one.taken_at;
      longest.element = {.module_node = module.node,
                         .number = static_cast<std::uint8_t>(cell + 1),
                         .pack_number = static_cast<std::uint16_t>(before + cell + 1)};
    }
    before = static_cast<std::uint16_t>(before + module.cell_count);
  }
  return longest;
}

}  // namespace bmu
