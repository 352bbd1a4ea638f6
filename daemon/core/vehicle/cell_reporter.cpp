#include "daemon/core/vehicle/cell_reporter.hpp"

#include "devices/cell_data/cell_data.hpp"

namespace bmu {

namespace {

using cell_data::values_per_frame;

std::size_t blocks_for(std::size_t count, std::uint16_t id) {
  return id == 0 ? 0 : (count + values_per_frame - 1) / values_per_frame;
}

std::size_t sensor_count(const CoreConfig& config) {
  std::size_t count = 0;
  for (const ModuleConfig& module : config.modules) count += module.temperature_sensor_count;
  return count;
}

SignalValue value_of(const Measured<std::int32_t>& measured, TimePoint now, Duration age_max) {
  return measured.is_usable(now, age_max) ? known(measured.value) : not_known();
}

/// Value of cell or sensor `number` through the pack, from 0; unknown if it does not exist.
SignalValue voltage_uV(std::size_t number, const ModuleTable& modules, TimePoint now, const AgeConfig& ages) {
  for (const ModuleRecord& module : modules.modules()) {
    const std::size_t count = module.config.cell_count;
    if (number < count) return value_of(module.cell_voltage_uV[number], now, ages.cell_voltage);
    number -= count;
  }
  return not_known();
}
SignalValue temperature_dC(std::size_t number, const ModuleTable& modules, TimePoint now, const AgeConfig& ages) {
  for (const ModuleRecord& module : modules.modules()) {
    const std::size_t count = module.config.temperature_sensor_count;
    if (number < count) return value_of(module.cell_temperature_dC[number], now, ages.temperature);
    number -= count;
  }
  return not_known();
}

/// Properties in which the two kinds differ.
struct BlockKind {
  const MessageSpec& message;
  std::uint16_t id;
  std::size_t blocks;
  SignalValue (*value)(std::size_t number, const ModuleTable& modules, TimePoint now, const AgeConfig& ages);
};

CanFrame block_frame(std::size_t block, const BlockKind& kind, const ModuleTable& modules, TimePoint now,
                     const AgeConfig& ages) {
  CanFrame frame = make_frame(kind.message);
  frame.id = kind.id;
  frame.data[0] = static_cast<std::uint8_t>(block);
  frame.data[1] = static_cast<std::uint8_t>(kind.blocks - 1);
  for (std::size_t slot = 0; slot < values_per_frame; ++slot) {
    encode_signal(kind.message.signals[cell_data::first_value + slot],
                  kind.value(block * values_per_frame + slot, modules, now, ages), frame.data);
  }
  return frame;
}

}  // namespace

CellDataBlocks cell_data_blocks(const CoreConfig& config) {
  return {.voltages = blocks_for(cell_count(config), config.vehicle.cell_voltages_id),
          .temperatures = blocks_for(sensor_count(config), config.vehicle.cell_temperatures_id)};
}

CanFrame cell_data_frame(std::size_t index, const ModuleTable& modules, TimePoint now, const CoreConfig& config) {
  const CellDataBlocks blocks = cell_data_blocks(config);
  BMU_ASSERT(index < blocks.count());
  const VehicleConfig& vehicle = config.vehicle;
  if (index < blocks.voltages) {
    return block_frame(index, {cell_data::voltages, vehicle.cell_voltages_id, blocks.voltages, voltage_uV}, modules,
                       now, config.ages);
  }
  return block_frame(index - blocks.voltages,
                     {cell_data::temperatures, vehicle.cell_temperatures_id, blocks.temperatures, temperature_dC},
                     modules, now, config.ages);
}

void CellReporter::init(const CoreConfig& config, TimePoint started_at) {
  blocks_ = cell_data_blocks(config);
  period_ = config.vehicle.cell_data_period;
  round_at_ = started_at + period_;
  index_ = 0;
}

std::optional<CanFrame> CellReporter::step(TimePoint now, const ModuleTable& modules, const CoreConfig& config) {
  if (!is_due(now)) return std::nullopt;
  if (now - next_at() > period_) {
    round_at_ = now;
    index_ = 0;
  }
  const CanFrame frame = cell_data_frame(index_, modules, now, config);
  if (++index_ == blocks_.count()) {
    index_ = 0;
    round_at_ += period_;
  }
  return frame;
}

}  // namespace bmu
