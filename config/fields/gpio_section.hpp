// The section "gpio": lines by name, and checks of their combination.
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// Leaves pack.gpio empty if the file has no such section.
void read_gpio(const JsonValue& root, const Place& root_place, PackConfig& pack, ProblemList& problems);

}  // namespace bmu
