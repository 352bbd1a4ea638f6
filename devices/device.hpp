// A third-party device with its own protocol: a charger, an inverter, a sensor, the modules of a car.
//
// Everything about one third-party protocol is in one folder here, with the name of the device: its rows
// (NAME/NAME.hpp), its driver (charger.hpp, inverter.hpp, current_sensor.hpp, sensor_set_up.hpp,
// insulation_monitor.hpp, module_driver.hpp) and frames with their meaning (NAME/worked_frames.log,
// worked_frames.expected). A folder that has NAME/NAME.hpp, with `device` in the namespace bmu::NAME, is in the list of
// devices (device_list.hpp) without any registration.
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

/// Display name: "charger", "current sensor".
[[nodiscard]] std::string_view to_text(DeviceKind kind);

struct Device {
  std::string_view name;   // that of its folder
  std::string_view title;  // manufacturer and type
  DeviceKind kind = DeviceKind::charger;
  const Catalogue* catalogue = nullptr;
  const Catalogue* little_endian = nullptr;      // for a device that can be configured for this byte order; or null
  std::span<const std::uint32_t> bit_rates{};    // bit/s it supports, the usual one first
  std::string_view meaning;                      // description in one line
  const ChargerDriver* charger = nullptr;        // driver of a charger
  const InverterDriver* inverter = nullptr;      // driver that sends the battery's data to an inverter
  const CurrentSensorDriver* current = nullptr;  // driver of a current sensor with frames of its own
  const SensorSetUpDriver* set_up = nullptr;     // driver that reads and writes a sensor's settings
  const InsulationDriver* insulation = nullptr;  // driver of an insulation monitor
  const ModuleDriver* modules = nullptr;         // driver that polls modules
};

inline constexpr std::uint32_t bit_rate_125k = 125'000;
inline constexpr std::uint32_t bit_rate_250k = 250'000;
inline constexpr std::uint32_t bit_rate_500k = 500'000;
inline constexpr std::uint32_t bit_rate_1000k = 1'000'000;

inline constexpr std::uint32_t only_500k[] = {bit_rate_500k};
inline constexpr std::uint32_t any_bit_rate[] = {bit_rate_500k, bit_rate_250k, bit_rate_125k, bit_rate_1000k};

}  // namespace bmu
