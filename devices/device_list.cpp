#include "devices/device_list.hpp"

#include <algorithm>

#include "devices/device_rows.hpp"

namespace bmu {
namespace {

[[nodiscard]] consteval bool are_sorted_and_whole() {
  const Device* before = nullptr;
  for (const Device* device : device_rows) {
    const bool is_behind = before == nullptr || before->name < device->name;
    if (!is_behind || device->catalogue == nullptr || !check_catalogue(*device->catalogue)) return false;
    if (device->little_endian != nullptr && !check_catalogue(*device->little_endian)) return false;
    if (device->title.empty() || device->meaning.empty() || device->bit_rates.empty()) return false;
    before = device;
  }
  return true;
}
static_assert(are_sorted_and_whole(), "each device has a name of its own and says all of itself");

}  // namespace

std::string_view to_text(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::charger: return "charger";
    case DeviceKind::inverter: return "inverter";
    case DeviceKind::current_sensor: return "current sensor";
    case DeviceKind::insulation_monitor: return "insulation monitor";
    case DeviceKind::modules: return "modules";
    case DeviceKind::cell_requests: return "cell requests";
    case DeviceKind::cell_data: return "cell data";
  }
  return "?";
}

std::span<const Device* const> all_devices() {
  return device_rows;
}

const Device* find_device(std::string_view name) {
  const auto found = std::find_if(std::begin(device_rows), std::end(device_rows),
                                  [name](const Device* device) { return device->name == name; });
  return found == std::end(device_rows) ? nullptr : *found;
}

}  // namespace bmu
