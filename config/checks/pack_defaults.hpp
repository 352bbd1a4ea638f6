// What a pack file leaves out and no constant can say: limits that follow from the cell or from the limits beside them.
// docs/configuration.md says of each what it follows from.
#pragma once

#include "config/types/pack.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Fills in what was not given. The configuration must be valid.
void complete_defaults(CoreConfig& config);

/// The same of the paces of polling, which follow from the bit rate of the internal bus, too.
void complete_paces(PackConfig& pack);

}  // namespace bmu
