// All devices: one for each folder of devices/, sorted by name. The list is generated when the project is configured; a
// new folder is found by the next build.
#pragma once

#include <span>
#include <string_view>

#include "devices/device.hpp"

namespace bmu {

[[nodiscard]] std::span<const Device* const> all_devices();

/// The device with this name; null if there is none.
[[nodiscard]] const Device* find_device(std::string_view name);

}  // namespace bmu
