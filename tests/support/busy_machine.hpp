// What a real daemon says of the machine it runs on, and not of its pack: a test machine is shared, and with sanitizers
// slow. Tests that want to know of the pack's faults, and of no other, look past it.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/sanitized.hpp"

namespace bmu::test {

/// Whether a fault of this name may be there with the machine alone as its cause: decisions came late or not at
/// all for some time, frames were not read in time, or a sanitizer keeps memory.
[[nodiscard]] inline bool may_be_of_the_machine(const std::string& fault_name) {
  return fault_name == "tick_overrun" || fault_name == "control_loop_gap" || fault_name == "frames_lost" ||
         (is_sanitized && fault_name == "memory_low");
}

/// `faults`, an array of names or of objects with a "name", as the status socket tells them, without those.
[[nodiscard]] inline nlohmann::json of_the_pack(const nlohmann::json& faults) {
  nlohmann::json kept = nlohmann::json::array();
  for (const nlohmann::json& fault : faults) {
    const auto name = (fault.is_object() ? fault.at("name") : fault).get<std::string>();
    if (!may_be_of_the_machine(name)) kept.push_back(fault);
  }
  return kept;
}

}  // namespace bmu::test
