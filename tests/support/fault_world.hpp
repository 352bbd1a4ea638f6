// Inputs of the rows of the fault table, set by a test: a small healthy pack in which a test changes one thing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "daemon/core/faults/fault_table.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu::test {

inline constexpr TimePoint start{100s};

/// Two modules of 4 cells and 2 sensors, a sensor and a PDU: all have just reported that they are healthy.
class FaultWorld {
 public:
  explicit FaultWorld(const CoreConfig& given = small_pack()) : config(given) {
    modules_.init(config);
    modules_.begin_cycle(start, {});
    answer(1);
    answer(2);
    watchers.switches.init(config);
    watchers.switches.update(modules_);
    sensors.current_mA = sensors.pack_voltage_mV = sensors.link_voltage_mV = {0, start, Validity::valid};
    sensors.pdu = {.value = {.estop_1_released = true,
                             .estop_2_released = true,
                             .interlock_closed = true,
                             .insulation_monitor_ok = true},
                   .taken_at = start,
                   .validity = Validity::valid};
  }

  CoreConfig config;
  SensorTable sensors;
  PackState pack;
  Watchers watchers;
  Reading soc_disagreement_permille{.is_known = true, .taken_at = start};
  Reading cell_misfit_permille{.is_known = true, .taken_at = start};
  CoreFlags flags{.internal_bus_up = true};
  bool has_started = true;
  TimePoint now = start;

  [[nodiscard]] Reading read(FaultId id) const {
    return row_of(id).read({.now = now,
                            .config = &config,
                            .pack = &pack,
                            .modules = &modules_,
                            .sensors = &sensors,
                            .watchers = &watchers,
                            .soc_disagreement_permille = soc_disagreement_permille,
                            .cell_misfit_permille = cell_misfit_permille,
                            .flags = flags,
                            .has_started = has_started});
  }
  [[nodiscard]] bool is_true(FaultId id) const {
    const Reading reading = read(id);
    REQUIRE(reading.is_known);
    return reading.value == 1;
  }
  [[nodiscard]] ModuleTable& modules() { return modules_; }

  /// All messages of a module, at `now`.
  void answer(std::uint8_t node) {
    say_status(node, [](CanFrame&) {});
    say_cells(node, 4);
    say_temperatures(node, 2);
    say_module(node, 0);
    say_identity(node, 1, 4, 2);
  }
  template <class Change>
  void say_status(std::uint8_t node, Change change) {
    CanFrame frame = make_frame(internal_bus::status, node);
    write<internal_bus::status, "mode">(frame, static_cast<std::int64_t>(internal_bus::Mode::normal));
    write<internal_bus::status, "cell_count">(frame, 4);
    write<internal_bus::status, "cell_voltage_age_ms">(frame, 0);
    change(frame);
    modules_.observe(internal_bus::status, node, frame, now);
  }
  void say_cells(std::uint8_t node, std::size_t count) {
    tell(internal_bus::cells_1, node, count, 3, 3'700'000);
    tell(internal_bus::cells_2, node, count > 3 ? count - 3 : 0, 3, 3'700'000);
  }
  void say_temperatures(std::uint8_t node, std::size_t count, std::int64_t temperature_dC = 250) {
    tell(internal_bus::temp_1, node, count, 3, temperature_dC);
  }
  /// TEMP_2 of a module without a fourth cell sensor: board sensors 1 to 4.
  void say_boards(std::uint8_t node, const std::array<SignalValue, 4>& boards_dC) {
    CanFrame frame = make_frame(internal_bus::temp_2, node);
    encode_signal(internal_bus::temp_2.signals[0], not_known(Validity::not_fitted), frame.data);
    for (std::size_t slot = 0; slot < boards_dC.size(); ++slot) {
      encode_signal(internal_bus::temp_2.signals[1 + slot], boards_dC[slot], frame.data);
    }
    modules_.observe(internal_bus::temp_2, node, frame, now);
  }
  /// The first temperature of a module; the second stays at 25.0 degC.
  void say_first_temperature(std::uint8_t node, SignalValue temperature_dC) {
    CanFrame frame = make_frame(internal_bus::temp_1, node);
    encode_signal(internal_bus::temp_1.signals[0], temperature_dC, frame.data);
    encode_signal(internal_bus::temp_1.signals[1], known(250), frame.data);
    encode_signal(internal_bus::temp_1.signals[2], not_known(Validity::not_fitted), frame.data);
    modules_.observe(internal_bus::temp_1, node, frame, now);
  }
  void say_module(std::uint8_t node, std::int64_t open_wire_cells) {
    CanFrame frame = make_frame(internal_bus::module, node);
    write<internal_bus::module, "open_wire_cells">(frame, open_wire_cells);
    modules_.observe(internal_bus::module, node, frame, now);
  }
  void say_identity(std::uint8_t node, std::int64_t protocol_version, std::int64_t cells, std::int64_t temperatures) {
    CanFrame frame = make_frame(internal_bus::ident, node);
    write<internal_bus::ident, "protocol_version">(frame, protocol_version);
    write<internal_bus::ident, "cell_count">(frame, cells);
    write<internal_bus::ident, "temperature_sensor_count">(frame, temperatures);
    modules_.observe(internal_bus::ident, node, frame, now);
  }
  /// Starts a new poll cycle, `later` after the present time.
  void poll_after(Duration later) {
    now += later;
    modules_.begin_cycle(now, {});
  }

  /// Voltages in uV of the first three or six cells of a module.
  void tell_cells(std::uint8_t node, const std::vector<std::int64_t>& voltages_uV) {
    const std::array rows{&internal_bus::cells_1, &internal_bus::cells_2};
    for (std::size_t block = 0; block * 3 < voltages_uV.size(); ++block) {
      CanFrame frame = make_frame(*rows[block], node);
      for (std::size_t slot = 0; slot < 3; ++slot) {
        const std::size_t cell = block * 3 + slot;
        const SignalValue value =
            cell < voltages_uV.size() ? known(voltages_uV[cell]) : not_known(Validity::not_fitted);
        encode_signal(rows[block]->signals[slot], value, frame.data);
      }
      modules_.observe(*rows[block], node, frame, now);
    }
  }

 private:
  /// Feeds a frame with `value` in its first `count` signals and "not fitted" in the others.
  void tell(const MessageSpec& message, std::uint8_t node, std::size_t count, std::size_t room, std::int64_t value) {
    CanFrame frame = make_frame(message, node);
    for (std::size_t slot = 0; slot < room; ++slot) {
      encode_signal(message.signals[slot], slot < count ? known(value) : not_known(Validity::not_fitted), frame.data);
    }
    modules_.observe(message, node, frame, now);
  }

  ModuleTable modules_;
};

}  // namespace bmu::test
