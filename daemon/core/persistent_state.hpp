// All that outlives a process. A copy of it goes to the shell whenever `generation` has changed.
#pragma once

#include <cstdint>

#include "daemon/core/contactor_ledger.hpp"
#include "daemon/core/fault_history.hpp"

namespace bmu {

struct PersistentState {
  FaultRecords faults{};
  ContactorLedgerEntries contactors{};

  friend bool operator==(const PersistentState&, const PersistentState&) = default;
};

}  // namespace bmu
