// Balancing without a bus, in steps of a second: measurement, plan and commands of the master, balancing of the
// modules, and cells that are charged, discharged and bled. Days of a large pack take seconds of test time. No
// contactors, no faults: the test sets the balancing blockers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "daemon/core/balancing/balancing_control.hpp"
#include "daemon/core/estimation/cell_charge.hpp"
#include "mmu/devices/balancing.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::test {

class BalancingBench {
 public:
  explicit BalancingBench(const CoreConfig& given) : config(given) {
    modules_.init(config);
    switches_.init(config);
    control_.init(config);
    book_.init(config);
    steps_.init(config);
    for (std::size_t index = 0; index < config.modules.size(); ++index) {
      units_.emplace_back(now_);
      serial_numbers.push_back(1'001 + static_cast<std::uint32_t>(index));
    }
    soc.assign(cell_count(config), 0.5);
    capacity_share.assign(soc.size(), 1.0);
    bled_uAs.assign(soc.size(), 0.0);
    resistance_Ohm.assign(soc.size(), config.cell.series_resistance_Ohm);
    bled_J.assign(soc.size(), 0.0);
    error_uV.assign(soc.size(), 0.0);
    hysteresis_V.assign(soc.size(), 0.0);
    hysteresis.assign(soc.size(), 0.0);
    lost_permille_per_month.assign(soc.size(), 0.0);
  }

  const CoreConfig config;
  std::vector<double> soc;             // of each cell, true value
  std::vector<double> capacity_share;  // of each cell, of the file's capacity
  std::vector<double> resistance_Ohm;  // of each cell
  std::vector<double> bled_uAs;        // of each cell, true value
  std::vector<double> bled_J;
  std::vector<double> error_uV;  // of the voltage that a module reports: measurement error, and any that a test sets
  std::vector<double> hysteresis_V;             // of each cell, maximum
  std::vector<double> hysteresis;               // of each cell, present share of that maximum, from -1 to 1
  std::vector<double> lost_permille_per_month;  // self-discharge
  std::vector<std::uint32_t> serial_numbers;    // of the modules
  std::int64_t unix_time_ms = 1'700'000'000'000;
  double wire_Ohm = 0.0;   // lowers the measured voltage of a bleeding cell, per ampere of its bleed current
  double current_A = 0.0;  // out of the pack
  double sensor_gain = 1.0;
  double sensor_offset_A = 0.0;
  bool is_open = false;
  BalancingBlockers blockers = 0;
  std::function<std::uint16_t(std::size_t module, std::uint16_t switches)> told_switches;  // reported as on
  std::function<bool(std::size_t module)> answers;  // whether it responds to a COMMAND; empty: all do
  bool keeps_minutes = false;  // modules start only when a number changes, and keep it after its time has expired
  internal_bus::Mode mode = internal_bus::Mode::normal;  // reported by all modules
  bool is_on_module_supply = false;
  internal_bus::CommandResult result = internal_bus::CommandResult::done;

  void run(Duration duration) {
    for (const TimePoint end = now_ + duration; now_ < end;) step();
  }
  /// Returns false if that took longer than `at_most`.
  [[nodiscard]] bool run_until(const std::function<bool()>& condition, Duration at_most) {
    for (const TimePoint end = now_ + at_most; now_ < end && !condition();) step();
    return condition();
  }

  /// Ends the session and starts the next after `dead_for`, with the records of the charge book as its only knowledge.
  /// Modules stop bleeding.
  void restart(const CellChargeRecords& kept, Duration dead_for) {
    now_ += dead_for;
    unix_time_ms += to_ms(dead_for);
    leak(to_s(dead_for));
    modules_ = {};
    modules_.init(config);
    switches_ = {};
    switches_.init(config);
    control_ = {};
    control_.init(config);
    book_.init(config);
    book_.restore(kept);
    steps_ = {};
    steps_.init(config);
    charge_ = {};
    for (Balancing& unit : units_) unit.stop();
  }
  [[nodiscard]] CellChargeRecords record() const {
    CellChargeRecords records;
    static_cast<void>(book_.record(records));
    return records;
  }

  [[nodiscard]] TimePoint now() const { return now_; }
  [[nodiscard]] const BalancingControl& control() const { return control_; }
  [[nodiscard]] const BalancingSwitches& switches() const { return switches_; }
  [[nodiscard]] const CellChargeBook& book() const { return book_; }
  [[nodiscard]] const std::vector<BalancingOrder>& orders() const { return orders_; }
  [[nodiscard]] const std::vector<BalancingStep>& steps() const { return remarkable_; }
  /// Switches that the module itself has on.
  [[nodiscard]] std::uint16_t really_on(std::size_t module) const { return units_[module].switches(); }
  /// True charge from the present SOC of the cell to full.
  [[nodiscard]] double missing_uAs(std::size_t cell) const {
    return (1.0 - soc[cell]) * capacity_share[cell] * static_cast<double>(config.cell.capacity_uAs);
  }
  [[nodiscard]] double soc_spread() const {
    const auto [low, high] = std::minmax_element(soc.begin(), soc.end());
    return *high - *low;
  }
  [[nodiscard]] double rested_spread_mV() const {
    double low = 1e9;
    double high = 0.0;
    for (const double one : soc) {
      low = std::min(low, ocv_uV(config.cell, one * 1e3) * 1e-3);
      high = std::max(high, ocv_uV(config.cell, one * 1e3) * 1e-3);
    }
    return high - low;
  }

 private:
  static constexpr double step_s = 1.0;

  void step() {
    now_ += 1s;
    unix_time_ms += unix_time_ms == 0 ? 0 : 1'000;
    for (Balancing& unit : units_) unit.update(now_, false);
    live();
    tell();
    switches_.update(modules_);
    const PackState pack = summary();
    book_.update({.now = now_,
                  .unix_time_ms = unix_time_ms,
                  .is_open = is_open,
                  .is_bleeding = switches_.is_any_on() || switches_.is_any_told(),
                  .modules = &modules_,
                  .pack = &pack,
                  .charge = &charge_,
                  .bled_uAs = switches_.bled_uAs()});
    const BalancingStep step = control_.step(
        {.now = now_, .modules = &modules_, .pack = &pack, .steps = &steps_, .charges = &book_, .blockers = blockers},
        switches_);
    if (step.has_begun || step.was_stopped || step.unanswered_node != 0) remarkable_.push_back(step);
    for (const BalancingOrder& order : step.orders) obey(order);
  }

  void live() {
    const double capacity_As = static_cast<double>(config.cell.capacity_uAs) * 1e-6;
    charge_.flowed_uAs += std::llround(told_current_A() * step_s * 1e6);
    leak(step_s);
    std::size_t number = 0;
    for (std::size_t index = 0; index < units_.size(); ++index) {
      for (std::size_t cell = 0; cell < config.modules[index].cell_count; ++cell, ++number) {
        const bool is_on = (units_[index].switches() >> cell & 1U) != 0;
        const double bleed_A = is_on ? voltage_V(number) / config.balancing.bleed_resistance_Ohm : 0.0;
        const double share = (current_A + bleed_A) * step_s / (capacity_As * capacity_share[number]);
        soc[number] -= share;
        drag(number, share);
        bled_uAs[number] += bleed_A * step_s * 1e6;
        bled_J[number] += bleed_A * voltage_V(number) * step_s;
      }
    }
  }
  [[nodiscard]] double told_current_A() const { return current_A * sensor_gain + sensor_offset_A; }
  /// The hysteresis law of the cell model, with the share of its capacity that has left the cell.
  void drag(std::size_t number, double share) {
    if (share == 0.0 || hysteresis_V[number] == 0.0) return;
    const double end = share > 0.0 ? -1.0 : 1.0;
    const double part = std::exp(-std::fabs(share) * 1e3 / config.cell.hysteresis_charge_permille);
    hysteresis[number] = end + (hysteresis[number] - end) * part;
  }
  void leak(double seconds) {
    constexpr double seconds_per_month = 30.0 * 86'400.0;
    for (std::size_t cell = 0; cell < soc.size(); ++cell) {
      soc[cell] -= lost_permille_per_month[cell] / 1e3 * seconds / seconds_per_month;
    }
  }
  [[nodiscard]] double voltage_V(std::size_t number) const {
    return ocv_uV(config.cell, soc[number] * 1e3) * 1e-6 + hysteresis[number] * hysteresis_V[number] -
           current_A * resistance_Ohm[number];
  }

  void tell() {
    using namespace internal_bus;
    modules_.begin_cycle(now_, {.temperatures = false});
    std::size_t number = 0;
    for (std::size_t index = 0; index < units_.size(); ++index) {
      const ModuleConfig& module_config = config.modules[index];
      CanFrame said = make_frame(status, module_config.node);
      write<status, "mode">(said, static_cast<std::int64_t>(mode));
      write<status, "supply">(said, is_on_module_supply ? 1 : 0);
      write<status, "cell_count">(said, module_config.cell_count);
      write<status, "cell_voltage_age_ms">(said, 0);
      modules_.observe(status, module_config.node, said, now_);
      CanFrame identity = make_frame(ident, module_config.node);
      write<ident, "protocol_version">(identity, protocol_version);
      write<ident, "cell_count">(identity, module_config.cell_count);
      write<ident, "temperature_sensor_count">(identity, module_config.temperature_sensor_count);
      write<ident, "serial_number">(identity, serial_numbers[index]);
      modules_.observe(ident, module_config.node, identity, now_);
      const std::uint16_t on = units_[index].switches();
      for (std::size_t block = 0; block * cells_per_frame < module_config.cell_count; ++block) {
        CanFrame frame = make_frame(*cells_rows[block], module_config.node);
        for (std::size_t slot = 0; slot < cells_per_frame; ++slot) {
          const std::size_t cell = block * cells_per_frame + slot;
          const bool is_there = cell < module_config.cell_count;
          const double wire_V = (on >> cell & 1U) != 0
                                    ? wire_Ohm * voltage_V(number + cell) / config.balancing.bleed_resistance_Ohm
                                    : 0.0;
          encode_signal(cells_rows[block]->signals[slot],
                        is_there
                            ? known(std::llround((voltage_V(number + cell) - wire_V) * 1e6 + error_uV[number + cell]))
                            : not_known(Validity::not_fitted),
                        frame.data);
        }
        modules_.observe(*cells_rows[block], module_config.node, frame, now_);
      }
      CanFrame stack = make_frame(module, module_config.node);
      write<module, "module_voltage_mV">(stack, 40'000);
      write<module, "balancing_cells">(stack, told_switches ? told_switches(index, on) : on);
      modules_.observe(module, module_config.node, stack, now_);
      number += module_config.cell_count;
    }
  }

  [[nodiscard]] PackState summary() const {
    PackState pack;
    pack.cell_voltage_uV.count = pack.cell_voltage_uV.expected = static_cast<std::uint16_t>(soc.size());
    pack.current_mA = {static_cast<std::int32_t>(std::lround(told_current_A() * 1e3)), now_, Validity::valid};
    return pack;
  }

  /// Minutes that change something for a module; Balancing::keep_minutes for those that do not.
  [[nodiscard]] BalancingMinutes heard(std::size_t module, const BalancingMinutes& minutes) {
    if (!keeps_minutes) return minutes;
    kept_minutes_.resize(units_.size());
    BalancingMinutes changed = minutes;
    for (std::size_t cell = 0; cell < minutes.size(); ++cell) {
      if (kept_minutes_[module][cell] == minutes[cell]) changed[cell] = Balancing::keep_minutes;
    }
    kept_minutes_[module] = minutes;
    return changed;
  }

  void obey(const BalancingOrder& order) {
    orders_.push_back(order);
    for (std::size_t index = 0; index < units_.size(); ++index) {
      if (order.module_index != BalancingOrder::to_all && order.module_index != index) continue;
      if (answers && !answers(index)) continue;
      if (order.is_stop) {
        units_[index].stop();
        continue;
      }
      if (result == internal_bus::CommandResult::done) units_[index].command(heard(index, order.minutes));
      CanFrame response = make_frame(internal_bus::response, config.modules[index].node);
      write<internal_bus::response, "operation">(response, static_cast<std::int64_t>(internal_bus::Operation::balance));
      write<internal_bus::response, "result">(response, static_cast<std::int64_t>(result));
      (void)control_.observe_response(index, response, now_, switches_);
    }
  }

  TimePoint now_{1'000s};
  ModuleTable modules_;
  BalancingSwitches switches_;
  BalancingControl control_;
  CellChargeBook book_;
  StepResponse steps_;
  ChargeState charge_;
  std::vector<Balancing> units_;
  std::vector<BalancingMinutes> kept_minutes_;
  std::vector<BalancingOrder> orders_;
  std::vector<BalancingStep> remarkable_;
};

}  // namespace bmu::test
