// The rules by name, and the values that the core publishes: see oracle.hpp.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/core/contactors/contactor_ledger.hpp"
#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/estimation/health/pack_totals.hpp"
#include "protocol/time.hpp"

namespace bmu::test {

enum class Rule : std::uint8_t {
  permission,
  fresh,
  edge,
  pause,
  healthy,
  precharge,
  counter,
  wakes,
  gate,
  soc,
  totals,
  published,
  reason,
  in_time,
  contacts,
  asks,
  stops,
  allows,
  withdraws,
  silence,
  recovery,
};
[[nodiscard]] std::string_view to_text(Rule rule);

/// The values that the core publishes, as on the status socket.
struct View {
  bool may_stay_closed = false;
  bool may_charge = false;
  bool may_discharge = false;
  std::int32_t charge_mA = 0;     // the pack's limit, the lesser of momentary and continuous
  std::int32_t discharge_mA = 0;  // likewise
  ContactorOutputs outputs;
  std::optional<std::int32_t> soc_permille;
  std::optional<PackTotals> totals;
  ContactorLedgerEntries wear{};
  std::uint64_t gate_refusals = 0;
  bool is_resting = false;
  bool is_port_up = false;  // of the internal bus: otherwise nothing is sent, and the counter goes on
};

using Blame = std::function<void(Rule, TimePoint, const std::string&)>;

}  // namespace bmu::test
