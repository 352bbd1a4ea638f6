#include "daemon/core/vehicle/vehicle_state.hpp"

#include <algorithm>
#include <array>

#include "protocol/row_order.hpp"

namespace bmu {

std::string_view to_text(PackMode mode) {
  switch (mode) {
    case PackMode::fault: return "fault";
    case PackMode::resting: return "resting";
    case PackMode::open: return "open";
    case PackMode::closing: return "closing";
    case PackMode::driving: return "driving";
    case PackMode::charging: return "charging";
    case PackMode::charge_only: return "charge only";
    case PackMode::opening: return "opening";
    case PackMode::closed: return "closed";
  }
  return "?";
}

PackMode pack_mode(const ModeInputs& in) {
  switch (in.phase) {
    case Phase::open:
      if (in.rest == RestPhase::resting) return PackMode::resting;
      return in.fault_opens ? PackMode::fault : PackMode::open;
    case Phase::main_negative:
    case Phase::precharge:
    case Phase::main_positive: return PackMode::closing;
    case Phase::ramp_down:
    case Phase::breaking: return PackMode::opening;
    case Phase::closed: break;
  }
  if (in.charger_connected) return in.may_discharge ? PackMode::charging : PackMode::charge_only;
  if (in.fault_opens) return PackMode::fault;
  return in.vehicle_on ? PackMode::driving : PackMode::closed;
}

namespace {

enum class Iha : std::uint8_t { fault, charger_closed, on_closed, off_closed, off_open };

struct StateRow {
  PackMode mode;
  Iha iha;
};

// In the order of PackMode. A pack asleep after an undervoltage has a fault; a closing pack is not closed yet.
constexpr std::array<StateRow, pack_mode_count> states{{
    {PackMode::fault, Iha::fault},
    {PackMode::resting, Iha::fault},
    {PackMode::open, Iha::off_open},
    {PackMode::closing, Iha::off_open},
    {PackMode::driving, Iha::on_closed},
    {PackMode::charging, Iha::charger_closed},
    {PackMode::charge_only, Iha::charger_closed},
    {PackMode::opening, Iha::off_closed},
    {PackMode::closed, Iha::off_closed},
}};

static_assert(rows_are_in_order(states, &StateRow::mode));

// States of the dialect `original`.
constexpr std::uint8_t unplugged_off = 0;
constexpr std::uint8_t unplugged_off_charging = 1;
constexpr std::uint8_t unplugged_relays_off = 2;
constexpr std::uint8_t unplugged_charge_depleting = 4;
constexpr std::uint8_t plugged_idle = 8;
constexpr std::uint8_t plugged_getting_ready = 9;
constexpr std::uint8_t plugged_charging = 10;
constexpr std::uint8_t plugged_discharging = 12;

std::uint8_t plugged_state(PackMode mode, std::int32_t current_mA) {
  const bool is_closed = mode == PackMode::charging || mode == PackMode::charge_only;
  if (mode == PackMode::closing) return plugged_getting_ready;
  if (!is_closed) return plugged_idle;
  return current_mA > small_current_mA ? plugged_discharging : plugged_charging;
}

constexpr std::uint8_t bit(unsigned number) {
  return static_cast<std::uint8_t>(1U << number);
}

/// The warning bits have an order of their own.
struct WarningRow {
  FaultId fault;
  unsigned bit;
};
constexpr WarningRow warning_rows[] = {
    {FaultId::cell_undervoltage, 0},      {FaultId::cell_overvoltage, 1},        {FaultId::charge_overcurrent, 2},
    {FaultId::charge_overload, 2},        {FaultId::discharge_overcurrent, 3},   {FaultId::discharge_overload, 3},
    {FaultId::cell_undertemperature, 4},  {FaultId::charge_undertemperature, 4}, {FaultId::cell_overtemperature, 5},
    {FaultId::charge_overtemperature, 5}, {FaultId::pack_resistance, 6},         {FaultId::insulation_low, 7},
    {FaultId::insulation_low_driving, 7},
};

constexpr std::array closing_tests{
    FaultId::precharge_failed, FaultId::precharge_too_fast, FaultId::precharge_overcurrent, FaultId::contactor_feedback,
    FaultId::contactor_welded, FaultId::link_not_following, FaultId::link_not_discharging};

}  // namespace

std::uint8_t iha_state(PackMode mode) {
  return static_cast<std::uint8_t>(states[static_cast<std::size_t>(mode)].iha);
}

std::uint8_t original_state(PackMode mode, const ModeInputs& in) {
  if (in.charger_connected) return plugged_state(mode, in.current_mA);
  const bool is_closed = in.phase == Phase::closed || in.phase == Phase::ramp_down || in.phase == Phase::breaking;
  if (in.vehicle_on) return is_closed ? unplugged_charge_depleting : unplugged_relays_off;
  return is_closed && in.current_mA < -small_current_mA ? unplugged_off_charging : unplugged_off;
}

std::uint8_t elithion_state(const ModeInputs& in) {
  std::uint8_t state = 0;
  if (in.has_fault) state |= bit(0);
  if (in.outputs.main_positive) state |= bit(1);
  if (in.outputs.precharge) state |= bit(2);
  if (in.outputs.main_negative) state |= bit(3);
  if (in.has_relay_fault) state |= bit(4);
  return state;
}

bool has_relay_fault(const FaultMemory& faults) {
  return std::any_of(closing_tests.begin(), closing_tests.end(),
                     [&faults](FaultId id) { return faults.state(id).is_present(); });
}

ElithionFaults elithion_faults(const FaultMemory& faults) {
  constexpr std::uint8_t level_codes = 8;
  ElithionFaults result;
  TimePoint latest{};
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = faults.state(row.id);
    if (!state.is_present() || row.lithiumate_code == 0) continue;
    const bool is_there = state.stage == FaultStage::active;
    if (is_there && row.lithiumate_code <= level_codes) result.level_faults |= bit(row.lithiumate_code - 1U);
    if (result.stored_code != 0 && state.confirmed_at < latest) continue;
    latest = state.confirmed_at;
    result.stored_code = row.lithiumate_code;
  }
  for (const WarningRow& row : warning_rows) {
    const FaultState& state = faults.state(row.fault);
    if (state.is_warning || state.stage == FaultStage::active) result.warnings |= bit(row.bit);
  }
  return result;
}

TroubleCodes trouble_codes(const FaultMemory& faults) {
  TroubleCodes codes;
  for (const FaultRow& row : fault_table()) {
    if (row.dtc == 0 || !faults.state(row.id).is_present()) continue;
    (codes.first == 0 ? codes.first : codes.second) = row.dtc;
  }
  return codes;
}

}  // namespace bmu
