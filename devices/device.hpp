// A device that speaks a language of its own: a charger, an inverter, a sensor, the modules of a car.
//
// Everything one foreign protocol is lies in one folder here, named as the device is: its rows (NAME/NAME.hpp), how it
// is driven or read (charger.hpp, inverter.hpp, current_sensor.hpp, sensor_set_up.hpp, insulation_monitor.hpp,
// module_driver.hpp) and frames with their meaning (NAME/worked_frames.log, worked_frames.expected). A folder that has
// NAME/NAME.hpp, and in it `device` in the namespace bmu::NAME, is in the list of devices (device_list.hpp): nothing
// else is to be told of it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "devices/charger.hpp"
#include "devices/current_sensor.hpp"
#include "devices/insulation_monitor.hpp"
#include "devices/inverter.hpp"
#include "devices/module_driver.hpp"
#include "devices/sensor_set_up.hpp"
#include "protocol/message.hpp"

namespace bmu {

enum class DeviceKind : std::uint8_t {
  charger,
  inverter,
  current_sensor,
  insulation_monitor,
  modules,
  cell_requests,
  cell_data,
};

/// As a person reads it: "charger", "current sensor".
[[nodiscard]] std::string_view to_text(DeviceKind kind);

struct Device {
  std::string_view name;   // as its folder
  std::string_view title;  // maker and type
  DeviceKind kind = DeviceKind::charger;
  const Catalogue* catalogue = nullptr;
  const Catalogue* little_endian = nullptr;      // of one that may be configured for this byte order; or null
  std::span<const std::uint32_t> bit_rates{};    // bit/s it may have, the usual one first
  std::string_view meaning;                      // a line of what it is
  const ChargerDriver* charger = nullptr;        // how a charger is driven
  const InverterDriver* inverter = nullptr;      // how an inverter is told of its battery
  const CurrentSensorDriver* current = nullptr;  // how a current is read that has frames of its own
  const SensorSetUpDriver* set_up = nullptr;     // how a sensor's settings are read and given
  const InsulationDriver* insulation = nullptr;  // how an insulation monitor is read
  const ModuleDriver* modules = nullptr;         // how modules are asked
};

inline constexpr std::uint32_t bit_rate_125k = 125'000;
inline constexpr std::uint32_t bit_rate_250k = 250'000;
inline constexpr std::uint32_t bit_rate_500k = 500'000;
inline constexpr std::uint32_t bit_rate_1000k = 1'000'000;

inline constexpr std::uint32_t only_500k[] = {bit_rate_500k};
inline constexpr std::uint32_t any_bit_rate[] = {bit_rate_500k, bit_rate_250k, bit_rate_125k, bit_rate_1000k};

}  // namespace bmu
