// Defaults of missing keys that are not constants: limits that follow from the cell or from other limits.
// docs/configuration.md gives the source of each.
#pragma once

#include "config/types/pack.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Fills in missing values. Precondition: the configuration is valid.
void complete_defaults(CoreConfig& config);

/// Likewise for the poll periods, which also follow from the bit rate of the internal bus.
void complete_paces(PackConfig& pack);

}  // namespace bmu
