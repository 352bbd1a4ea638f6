// State that is kept over a restart. The shell receives a copy whenever `persistent_generation()` has changed.
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

/// Ensures that a daemon that restarts repeatedly closes no sooner, and heats the resistor no more, than one that keeps
/// running.
struct ClosingMemory {
  PrechargeMemory precharge{};
  std::int64_t lockout_ms = 0;  // lockout that starts from its beginning at the next start; 0: none

  friend bool operator==(const ClosingMemory&, const ClosingMemory&) = default;
};

struct PersistentState {
  FaultRecords faults{};
  ContactorLedgerEntries contactors{};
  ClosingMemory closing{};
  KnownModules modules{};  // serial number registered on each node, where the pack file does not give it
  CellChargeRecords cell_charges{};
  SocRecords soc{};
  PackTotals totals{};
  std::uint32_t starts = 0;            // of the daemon, in which it has received data of the whole pack
  std::uint32_t hours_since_full = 0;  // of daemon run time, for an inverter that requires a full charge

  friend bool operator==(const PersistentState&, const PersistentState&) = default;
};

}  // namespace bmu
