// A module table that is filled frame by frame, at times that a test sets and without a core.
#pragma once

#include <initializer_list>
#include <vector>

#include "daemon/core/measurement/module_table.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::test {

class ModuleFeed {
 public:
  explicit ModuleFeed(const CoreConfig& config) : config_(config) { table_.init(config_); }

  [[nodiscard]] const ModuleTable& modules() const { return table_; }
  [[nodiscard]] const CoreConfig& config() const { return config_; }
  [[nodiscard]] TimePoint now() const { return now_; }
  void pass(Duration duration) { now_ += duration; }

  /// Starts a poll cycle of all modules now.
  void poll() { table_.begin_cycle(now_, {}); }
  /// Feeds the first temperature sensors of a module, the others not fitted, in TEMP_1; then TEMP_2 with those of the
  /// board.
  void temperatures(std::uint8_t node, std::initializer_list<SignalValue> values_dC) {
    using namespace internal_bus;
    CanFrame first = make_frame(temp_1, node);
    CanFrame second = make_frame(temp_2, node);
    const std::vector<SignalValue> values(values_dC);
    for (std::size_t slot = 0; slot < 4; ++slot) {
      const SignalValue value = slot < values.size() ? values[slot] : not_known(Validity::not_fitted);
      if (slot < 3) encode_signal(temp_1.signals[slot], value, first.data);
      if (slot == 3) encode_signal(temp_2.signals[0], value, second.data);
    }
    for (std::size_t slot = 1; slot <= 4; ++slot) encode_signal(temp_2.signals[slot], board_dC, second.data);
    table_.observe(temp_1, node, first, now_);
    table_.observe(temp_2, node, second, now_);
  }
  /// STATUS, all cells and the module voltage, as answers to the last POLL.
  void cells(std::uint8_t node, const std::vector<SignalValue>& cells_uV, SignalValue module_mV,
             std::uint16_t open_wires = 0) {
    using namespace internal_bus;
    status(node, {});
    for (std::size_t block = 0; block * cells_per_frame < cells_uV.size(); ++block) {
      CanFrame frame = make_frame(*cells_rows[block], node);
      for (std::size_t slot = 0; slot < cells_per_frame; ++slot) {
        const std::size_t cell = block * cells_per_frame + slot;
        const SignalValue value = cell < cells_uV.size() ? cells_uV[cell] : not_known(Validity::not_fitted);
        encode_signal(cells_rows[block]->signals[slot], value, frame.data);
      }
      table_.observe(*cells_rows[block], node, frame, now_);
    }
    CanFrame stack = make_frame(module, node);
    encode_signal(module.signals[0], module_mV, stack.data);
    write<module, "open_wire_cells">(stack, open_wires);
    table_.observe(module, node, stack, now_);
  }
  /// STATUS only, with the module's own report.
  void status(std::uint8_t node, const ModuleStatus& said) {
    using namespace internal_bus;
    CanFrame frame = make_frame(internal_bus::status, node);
    write<internal_bus::status, "mode">(frame, static_cast<std::int64_t>(Mode::normal));
    write<internal_bus::status, "cell_count">(
        frame, said.cell_count != 0 ? said.cell_count : table_.find(node)->config.cell_count);
    write<internal_bus::status, "board_too_hot">(frame, said.board_too_hot ? 1 : 0);
    write<internal_bus::status, "external_supply_low">(frame, said.external_supply_low ? 1 : 0);
    write<internal_bus::status, "temperature_sensor_fault">(frame, said.temperature_sensor_fault ? 1 : 0);
    write<internal_bus::status, "front_end_crc_errors">(frame, said.front_end_crc_errors ? 1 : 0);
    write<internal_bus::status, "open_cell_wire">(frame, said.open_cell_wire ? 1 : 0);
    write<internal_bus::status, "self_test_failed">(frame, said.self_test_failed ? 1 : 0);
    write<internal_bus::status, "undervoltage_cells">(frame, said.undervoltage_cells);
    write<internal_bus::status, "overvoltage_cells">(frame, said.overvoltage_cells);
    write<internal_bus::status, "cell_voltage_age_ms">(frame, known(0));
    table_.observe(internal_bus::status, node, frame, now_);
  }
  void identity(std::uint8_t node, const ModuleIdentity& who) {
    using namespace internal_bus;
    CanFrame frame = make_frame(ident, node);
    write<ident, "protocol_version">(frame, who.protocol_version);
    write<ident, "cell_count">(frame, who.cell_count);
    write<ident, "temperature_sensor_count">(frame, who.temperature_sensor_count);
    write<ident, "serial_number">(frame, who.serial_number);
    table_.observe(ident, node, frame, now_);
  }

  SignalValue board_dC = known(300);

 private:
  CoreConfig config_;
  ModuleTable table_;
  TimePoint now_{100s};
};

}  // namespace bmu::test
