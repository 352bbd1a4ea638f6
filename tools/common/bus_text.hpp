// What to tell somebody whose bus cannot be opened.
#pragma once

#include <cerrno>
#include <string>

#include "daemon/shell/system/os_error.hpp"

namespace bmu {

/// The system's reason; for an interface that is not there, also how to make or find one.
[[nodiscard]] inline std::string open_failure_text(const std::string& bus, const OsError& error) {
  if (error.code != ENODEV) return to_text(error);
  if (!bus.starts_with("vcan")) return "there is no interface " + bus + "; `ip -br link` lists those there are";
  return "there is no interface " + bus + "; make it with: sudo modprobe vcan && sudo ip link add " + bus +
         " type vcan && sudo ip link set " + bus + " up";
}

}  // namespace bmu
