// Text for a bus that cannot be opened.
#pragma once

#include <cerrno>
#include <string>

#include "daemon/shell/system/os_error.hpp"

namespace bmu {

/// The system's reason; for a missing interface also how to create or find one.
[[nodiscard]] inline std::string open_failure_text(const std::string& bus, const OsError& error) {
  if (error.code != ENODEV) return to_text(error);
  if (!bus.starts_with("vcan")) return "there is no interface " + bus + "; `ip -br link` lists those there are";
  return "there is no interface " + bus + "; make it with: sudo modprobe vcan && sudo ip link add " + bus +
         " type vcan && sudo ip link set " + bus + " up";
}

}  // namespace bmu
