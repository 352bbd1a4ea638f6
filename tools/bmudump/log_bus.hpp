// The names of buses in logs that are not shown, for advice that can be typed as it stands.
#pragma once

#include <string>
#include <vector>

#include "devices/device.hpp"

namespace bmu::dump {

/// Of these logs the first bus with an identifier of the device, else the first bus there is. Empty if the beginning of
/// none of them has a frame. Standard input ("-") is not read: what is read of it is gone.
[[nodiscard]] std::string bus_of_logs(const std::vector<std::string>& files, const Device& device);

}  // namespace bmu::dump
