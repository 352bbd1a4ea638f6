// The worked frames of docs/bus-protocol.md with their meaning: decoded, encoded, sent through the DBC and the dump. A
// signal that is not listed is 0, "no" or "none".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/tables/vehicle_bus_elithion.hpp"

namespace bmu::test {

struct WorkedFrame {
  const MessageSpec* message;
  std::uint8_t node;
  std::uint8_t counter;  // of rows that have one
  std::vector<std::uint8_t> bytes;
  std::vector<std::pair<std::string_view, SignalValue>> meaning;

  [[nodiscard]] CanFrame frame() const {
    CanFrame result = make_frame(*message, node);
    result.length = static_cast<std::uint8_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), result.data.begin());
    return result;
  }
  [[nodiscard]] SignalValue value_of(const SignalSpec& signal) const {
    if (signal.name == "counter") return known(counter);
    for (const auto& [name, value] : meaning) {
      if (name == signal.name) return value;
    }
    return known(0);
  }
  [[nodiscard]] bool has(const SignalSpec& signal) const {
    return is_selected(signal, value_of(message->signals.front()).value);
  }
};

[[nodiscard]] inline SignalValue letters(std::string_view eight) {
  std::uint64_t word = 0;
  for (const char letter : eight) word = (word << 8) | static_cast<std::uint8_t>(letter);
  return known(static_cast<std::int64_t>(word));
}

inline std::vector<WorkedFrame> internal_worked_frames() {
  using namespace internal_bus;
  const SignalValue left = not_known(Validity::unchanged);
  return {
      {&poll,
       0,
       42,
       {0x00, 0x8F, 0x00, 0x00, 0x00, 0x00, 0x2A, 0x1F},
       {{"sync", known(1)},
        {"want_status", known(1)},
        {"want_cells", known(1)},
        {"want_temp", known(1)},
        {"want_module", known(1)}}},
      {&status,
       3,
       42,
       {0x5C, 0x00, 0x00, 0x00, 0x10, 0x0C, 0x2A, 0xA1},
       {{"mode", known(1)},
        {"balancing", known(1)},
        {"cell_count", known(12)},
        {"overvoltage_cells", known(1 << 4)},
        {"cell_voltage_age_ms", known(12)}}},
      {&cells_1,
       3,
       42,
       {0x8E, 0xA0, 0x8E, 0x92, 0x8E, 0xB2, 0x2A, 0xB2},
       {{"cell_voltage_1_uV", known(3'651'200)},
        {"cell_voltage_2_uV", known(3'649'800)},
        {"cell_voltage_3_uV", known(3'653'000)}}},
      {&cells_2,
       3,
       42,
       {0x8E, 0xA0, 0xFF, 0xFF, 0x8E, 0x94, 0x2A, 0x66},
       {{"cell_voltage_4_uV", known(3'651'200)},
        {"cell_voltage_5_uV", not_known(Validity::not_fitted)},
        {"cell_voltage_6_uV", known(3'650'000)}}},
      {&temp_1,
       3,
       42,
       {0x00, 0xFB, 0xFF, 0xCB, 0x80, 0x01, 0x2A, 0xC7},
       {{"cell_temperature_1_dC", known(251)},
        {"cell_temperature_2_dC", known(-53)},
        {"cell_temperature_3_dC", not_known(Validity::open_circuit)}}},
      {&temp_2,
       3,
       42,
       {0x00, 0xFD, 0x1F, 0x21, 0x1E, 0x80, 0x2A, 0xD4},
       {{"cell_temperature_4_dC", known(253)},
        {"board_temperature_1_dC", known(310)},
        {"board_temperature_2_dC", known(330)},
        {"board_temperature_3_dC", known(300)},
        {"board_temperature_4_dC", not_known(Validity::not_fitted)}}},
      {&internal_bus::module,
       3,
       42,
       {0x55, 0x92, 0x01, 0x00, 0x00, 0x01, 0x2A, 0xE3},
       {{"module_voltage_mV", known(43'812)},
        {"balancing_cells", known(1 << 4)},
        {"balancing_time_left_s", known(60)}}},
      {&ident,
       3,
       42,
       {0x01, 0xC4, 0x00, 0x12, 0xD6, 0x87, 0x2A, 0x8D},
       {{"protocol_version", known(1)},
        {"cell_count", known(12)},
        {"temperature_sensor_count", known(4)},
        {"serial_number", known(1'234'567)}}},
      {&command,
       3,
       17,
       {0x03, 0xFF, 0xF5, 0xFF, 0xFF, 0xF0, 0x11, 0x76},
       {{"operation", known(3)},
        {"balancing_time_1_s", left},
        {"balancing_time_2_s", left},
        {"balancing_time_3_s", left},
        {"balancing_time_4_s", left},
        {"balancing_time_5_s", known(120)},
        {"balancing_time_6_s", left},
        {"balancing_time_7_s", left},
        {"balancing_time_8_s", left},
        {"balancing_time_9_s", left},
        {"balancing_time_10_s", left},
        {"balancing_time_11_s", left},
        {"balancing_time_12_s", left}}},
      {&response, 3, 17, {0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x11, 0x07}, {{"operation", known(3)}}},
      {&command,
       3,
       18,
       {0x02, 0x75, 0x30, 0xA4, 0x10, 0x00, 0x12, 0x98},
       {{"operation", known(2)},
        {"undervoltage_limit_uV", known(3'000'000)},
        {"overvoltage_limit_uV", known(4'200'000)}}},
      {&contactor_command,
       0,
       5,
       {0x06, 0xF9, 0x00, 0x00, 0x00, 0x00, 0x05, 0x75},
       {{"main_negative", known(1)}, {"precharge", known(1)}, {"complement", known(0xF9)}}},
      {&pdu_temperature,
       0,
       5,
       {0xFF, 0xCB, 0x00, 0x00, 0x00, 0x00, 0x05, 0xBC},
       {{"intake_air_temperature_dC", known(-53)}}},
      {&pdu_status,
       0,
       5,
       {0x06, 0x3D, 0x04, 0xB0, 0x01, 0xFF, 0x05, 0x2E},
       {{"main_negative_closed", known(1)},
        {"precharge_closed", known(1)},
        {"vehicle_on", known(1)},
        {"estop_1_released", known(1)},
        {"estop_2_released", known(1)},
        {"interlock_closed", known(1)},
        {"insulation_monitor_ok", known(1)},
        {"insulation_resistance_Ohm", known(1'200'000)},
        {"insulation_monitor_state", known(1)},
        {"throttle_permille", not_known()}}},
  };
}

inline std::vector<WorkedFrame> vehicle_worked_frames() {
  using namespace vehicle_bus;
  return {
      {&pack_name, 0, 0, {0x49, 0x48, 0x41, 0x20, 0x42, 0x4D, 0x53, 0x31}, {{"name", letters("IHA BMS1")}}},
      {&pack_version, 0, 0, {0x53, 0x57, 0x3A, 0x20, 0x31, 0x2E, 0x30, 0x32}, {{"version", letters("SW: 1.02")}}},
      {&pack_status,
       0,
       0,
       {0x02, 0x0E, 0x8D, 0x04, 0x00, 0x00},
       {{"state", known(2)}, {"uptime_s", known(3725)}, {"discharging", known(1)}}},
      {&pack_status,
       0,
       0,
       {0x01, 0x00, 0x3C, 0x02, 0x01, 0x03},
       {{"state", known(1)},
        {"uptime_s", known(60)},
        {"charging", known(1)},
        {"dtc_1", known(1)},
        {"dtc_2", known(3)}}},
      {&pack_voltage,
       0,
       0,
       {0x01, 0x3C, 0x20, 0x07, 0x22, 0x17},
       {{"pack_voltage_mV", known(316'000)},
        {"cell_voltage_min_uV", known(3'200'000)},
        {"cell_voltage_min_cell", known(7)},
        {"cell_voltage_max_uV", known(3'400'000)},
        {"cell_voltage_max_cell", known(23)}}},
      {&pack_current,
       0,
       0,
       {0x00, 0x55, 0x00, 0x28, 0x00, 0xC8},
       {{"pack_current_mA", known(85'000)},
        {"charge_limit_mA", known(40'000)},
        {"discharge_limit_mA", known(200'000)}}},
      {&pack_current,
       0,
       0,
       {0xFF, 0xE0, 0x00, 0x28, 0x00, 0xC8},
       {{"pack_current_mA", known(-32'000)},
        {"charge_limit_mA", known(40'000)},
        {"discharge_limit_mA", known(200'000)}}},
      {&pack_energy,
       0,
       0,
       {0x00, 0x12, 0xD6, 0x87, 0x00, 0x12, 0x4F, 0x80},
       {{"energy_in_mWh", known(1'234'567'000)}, {"energy_out_mWh", known(1'200'000'000)}}},
      {&pack_charge,
       0,
       0,
       {0x48, 0x00, 0x1C, 0x00, 0x64, 0xFF, 0x62},
       {{"soc_permille", known(720)},
        {"depth_of_discharge_uAs", known(28 * uAs_per_Ah)},
        {"capacity_uAs", known(100 * uAs_per_Ah)},
        {"soc_2_permille", not_known()},
        {"soh_permille", known(980)}}},
      {&pack_temperature,
       0,
       0,
       {0x15, 0xFB, 0x12, 0x03, 0x19, 0x29},
       {{"cell_temperature_average_dC", known(210)},
        {"air_temperature_dC", known(-50)},
        {"cell_temperature_min_dC", known(180)},
        {"cell_temperature_min_sensor", known(3)},
        {"cell_temperature_max_dC", known(250)},
        {"cell_temperature_max_sensor", known(41)}}},
      {&pack_temperature,
       0,
       0,
       {0x80, 0x80, 0x80, 0xFF, 0x80, 0xFF},
       {{"cell_temperature_average_dC", not_known()},
        {"air_temperature_dC", not_known()},
        {"cell_temperature_min_dC", not_known()},
        {"cell_temperature_min_sensor", not_known()},
        {"cell_temperature_max_dC", not_known()},
        {"cell_temperature_max_sensor", not_known()}}},
      {&pack_resistance,
       0,
       0,
       {0x00, 0x60, 0x08, 0x0C, 0x0E, 0x58},
       {{"pack_resistance_uOhm", known(96'000)},
        {"cell_resistance_min_uOhm", known(800)},
        {"cell_resistance_min_cell", known(12)},
        {"cell_resistance_max_uOhm", known(1'400)},
        {"cell_resistance_max_cell", known(88)}}},
  };
}

/// Of the dialect `elithion`, where it differs.
inline std::vector<WorkedFrame> elithion_worked_frames() {
  using namespace vehicle_bus_elithion;
  return {
      {&vehicle_bus::pack_name,
       0,
       0,
       {0x45, 0x6C, 0x69, 0x74, 0x68, 0x69, 0x6F, 0x6E},
       {{"name", letters("Elithion")}}},
      {&pack_status,
       0,
       0,
       {0x0A, 0x0E, 0x8D, 0x0A, 0x00, 0x00, 0x01},
       {{"k1_on", known(1)},
        {"k3_on", known(1)},
        {"uptime_s", known(3725)},
        {"load_power", known(1)},
        {"wired_request", known(1)},
        {"warning_bits", known(0x01)}}},
      {&pack_status,
       0,
       0,
       {0x11, 0xFF, 0xFF, 0xA5, 0x13, 0x81, 0x80},
       {{"fault", known(1)},
        {"relay_fault", known(1)},
        {"uptime_s", known(65'535)},
        {"source_power", known(1)},
        {"interlock_tripped", known(1)},
        {"charging_blocked", known(1)},
        {"fan_on", known(1)},
        {"stored_fault", known(19)},
        {"fault_bits", known(0x81)},
        {"warning_bits", known(0x80)}}},
      {&pack_energy,
       0,
       0,
       {0x00, 0x12, 0xD6, 0x87, 0xFF, 0xFF, 0xFF, 0xFF},
       {{"energy_in_counts", known(1'234'567)}, {"energy_out_counts", not_known()}}},
      {&pack_charge,
       0,
       0,
       {0x48, 0x00, 0x1C, 0x00, 0x64, 0x00, 0x62},
       {{"soc_permille", known(720)},
        {"depth_of_discharge_uAs", known(28 * uAs_per_Ah)},
        {"capacity_uAs", known(100 * uAs_per_Ah)},
        {"soh_permille", known(980)}}},
      {&pack_temperature,
       0,
       0,
       {0x15, 0x00, 0x12, 0x03, 0x19, 0x29},
       {{"cell_temperature_average_dC", known(210)},
        {"cell_temperature_min_dC", known(180)},
        {"cell_temperature_min_sensor", known(3)},
        {"cell_temperature_max_dC", known(250)},
        {"cell_temperature_max_sensor", known(41)}}},
  };
}

/// Same numbers from every standard library, unlike its distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint32_t next() {
    state_ = state_ * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
    return static_cast<std::uint32_t>(state_ >> 32);
  }
  std::uint32_t below(std::uint32_t bound) { return next() % bound; }
  /// Within low..high, both included; the range must be narrower than 2^62.
  std::int64_t between(std::int64_t low, std::int64_t high) {
    const std::uint64_t high_half = next();  // on its own: operands of | may be evaluated in either order
    const std::uint64_t wide = (high_half << 32) | next();
    return low + static_cast<std::int64_t>(wide % static_cast<std::uint64_t>(high - low + 1));
  }

 private:
  std::uint64_t state_;
};

}  // namespace bmu::test
