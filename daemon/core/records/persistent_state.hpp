// All that outlives a process. A copy of it goes to the shell whenever `generation` has changed.
#pragma once

#include <cstdint>

#include "daemon/core/contactors/contactor_ledger.hpp"
#include "daemon/core/contactors/precharge_guard.hpp"
#include "daemon/core/estimation/cell_charge_record.hpp"
#include "daemon/core/estimation/health/pack_totals.hpp"
#include "daemon/core/estimation/soc_record.hpp"
#include "daemon/core/modules/module_roster.hpp"
#include "daemon/core/records/fault_history.hpp"

namespace bmu {

/// So that a life that ends again and again closes no sooner, and heats no more, than one that goes on.
struct ClosingMemory {
  PrechargeMemory precharge{};
  std::int64_t lockout_ms = 0;  // a wait that is to begin anew at the start; 0: none

  friend bool operator==(const ClosingMemory&, const ClosingMemory&) = default;
};

struct PersistentState {
  FaultRecords faults{};
  ContactorLedgerEntries contactors{};
  ClosingMemory closing{};
  KnownModules modules{};  // who was seen on which node, where the pack file does not say it
  CellChargeRecords cell_charges{};
  SocRecords soc{};
  PackTotals totals{};
  std::uint32_t starts = 0;            // of the daemon, in which it has seen the whole pack
  std::uint32_t hours_since_full = 0;  // of the daemon's own time, for an inverter that is asked for a full charge

  friend bool operator==(const PersistentState&, const PersistentState&) = default;
};

}  // namespace bmu
