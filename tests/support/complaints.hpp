// Faults and warnings of a pack, for tests in which there must be none.
#pragma once

#include <string>

#include "daemon/core/core.hpp"

namespace bmu::test {

/// Faults that are present, and all warnings but those of a peak: that 50 A flow, and that most of the peak is used up.
inline std::string complaints(const Core& core) {
  std::string names;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = core.faults().state(row.id);
    const bool is_warning =
        state.is_warning && row.id != FaultId::discharge_overload && row.id != FaultId::discharge_overcurrent;
    if (state.is_present() || is_warning) names += std::string(row.name) + " ";
  }
  return names;
}

}  // namespace bmu::test
