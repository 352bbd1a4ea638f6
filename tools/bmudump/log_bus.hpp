// Names of the buses in logs that are not shown, for advice that can be typed unchanged.
#pragma once

#include <string>
#include <vector>

#include "devices/device.hpp"

namespace bmu::dump {

/// The first bus in these logs with an identifier of the device, else the first bus at all. Empty if the beginning of
/// each log has no frame. Standard input ("-") is not read, because its data could not be read again.
[[nodiscard]] std::string bus_of_logs(const std::vector<std::string>& files, const Device& device);

}  // namespace bmu::dump
