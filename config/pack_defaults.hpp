// What a pack file leaves out and no constant can say: limits that follow from the cell or from the limits beside them.
// docs/configuration.md says of each what it follows from.
#pragma once

#include "daemon/core/core_config.hpp"

namespace bmu {

/// Fills in what was not given. The configuration must be valid.
void complete_defaults(CoreConfig& config);

}  // namespace bmu
