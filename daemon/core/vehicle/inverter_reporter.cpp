#include "daemon/core/vehicle/inverter_reporter.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "daemon/core/estimation/pack_health.hpp"

namespace bmu {

namespace {

/// Alarm of each fault in the protocols of inverters; faults without a row are `general`.
struct AlarmRow {
  FaultId fault;
  BatteryAlarm alarm;
};
constexpr AlarmRow alarm_rows[] = {
    {FaultId::cell_overvoltage, BatteryAlarm::high_voltage},
    {FaultId::cell_undervoltage, BatteryAlarm::low_voltage},
    {FaultId::cell_deep_discharge, BatteryAlarm::low_voltage},
    {FaultId::module_reports_undervoltage, BatteryAlarm::low_voltage},
    {FaultId::cell_overtemperature, BatteryAlarm::hot},
    {FaultId::board_overtemperature, BatteryAlarm::hot},
    {FaultId::temperature_rise, BatteryAlarm::hot},
    {FaultId::cell_undertemperature, BatteryAlarm::cold},
    {FaultId::board_undertemperature, BatteryAlarm::cold},
    {FaultId::charge_overtemperature, BatteryAlarm::hot_to_charge},
    {FaultId::charge_undertemperature, BatteryAlarm::cold_to_charge},
    {FaultId::discharge_overcurrent, BatteryAlarm::high_current},
    {FaultId::discharge_overload, BatteryAlarm::high_current},
    {FaultId::discharge_not_allowed, BatteryAlarm::high_current},
    {FaultId::charge_overcurrent, BatteryAlarm::high_charge_current},
    {FaultId::charge_overload, BatteryAlarm::high_charge_current},
    {FaultId::charge_not_allowed, BatteryAlarm::high_charge_current},
    {FaultId::contactor_feedback, BatteryAlarm::contactor},
    {FaultId::contactor_welded, BatteryAlarm::contactor},
    {FaultId::link_not_following, BatteryAlarm::contactor},
    {FaultId::link_not_discharging, BatteryAlarm::contactor},
    {FaultId::precharge_failed, BatteryAlarm::contactor},
    {FaultId::precharge_overcurrent, BatteryAlarm::short_circuit},
    {FaultId::cell_imbalance, BatteryAlarm::imbalance},
    {FaultId::module_lost, BatteryAlarm::communication},
    {FaultId::cell_not_measured, BatteryAlarm::internal},
    {FaultId::temperature_not_measured, BatteryAlarm::internal},
    {FaultId::open_wire, BatteryAlarm::internal},
    {FaultId::module_reports_fault, BatteryAlarm::internal},
    {FaultId::current_sensor_lost, BatteryAlarm::communication},
    {FaultId::voltage_sensor_lost, BatteryAlarm::communication},
    {FaultId::pdu_lost, BatteryAlarm::communication},
    {FaultId::internal_bus_down, BatteryAlarm::communication},
};

BatteryAlarm alarm_of(FaultId fault) {
  const auto* const found = std::find_if(std::begin(alarm_rows), std::end(alarm_rows),
                                         [fault](const AlarmRow& row) { return row.fault == fault; });
  return found == std::end(alarm_rows) ? BatteryAlarm::general : found->alarm;
}

/// Assumed limits of an inverter after a frame was not sent: unknown, so more than any limit.
constexpr InverterLimits anything{.charge_mA = INT32_MAX, .discharge_mA = INT32_MAX};

InverterLimits most_of(const InverterLimits& one, const InverterLimits& other) {
  return {.charge_mA = std::max(one.charge_mA, other.charge_mA),
          .discharge_mA = std::max(one.discharge_mA, other.discharge_mA)};
}

/// The smaller of the two; a maximum of 0 does not limit.
std::int32_t bounded(std::int32_t limit_mA, std::int32_t most_mA) {
  return most_mA == 0 ? limit_mA : std::min(limit_mA, most_mA);
}

SignalValue value_of(const Measured<std::int32_t>& measured) {
  return measured.is_valid() ? known(measured.value) : not_known();
}
SignalValue if_given(const std::optional<std::int32_t>& value) {
  return value ? known(*value) : not_known();
}
SignalValue if_complete(const Spread& spread, std::int32_t value) {
  return spread.is_complete() ? known(value) : not_known();
}

SignalValue soh_permille(const PackEstimate* estimate, const InverterConfig& config) {
  const HealthFigure health = estimate != nullptr ? pack_health(*estimate).by_capacity : HealthFigure{};
  if (health.is_known) return known(health.permille);
  return config.soh_assumed_permille > 0 ? known(config.soh_assumed_permille) : not_known();
}

}  // namespace

InverterLimits inverter_limits(const InverterView& view, const InverterConfig& config) {
  const bool is_seen = view.pack->is_complete() && view.pack->current_mA.is_valid();
  if (!is_seen || view.is_held_back) return {};
  const auto least = [](const CurrentLimit& now, const CurrentLimit& for_long) {
    return std::max(std::min(now.limit_mA, for_long.limit_mA), 0);
  };
  const CurrentLimits& limits = *view.limits;
  InverterLimits told;
  if (view.may_charge) told.charge_mA = bounded(least(limits.charge, limits.charge_continuous), config.charge_max_mA);
  if (view.may_discharge) {
    told.discharge_mA = bounded(least(limits.discharge, limits.discharge_continuous), config.discharge_max_mA);
  }
  return told;
}

BatteryAlarms battery_alarms(const InverterView& view) {
  constexpr StricterReactions none;
  const StricterReactions& stricter = view.stricter != nullptr ? *view.stricter : none;
  BatteryAlarms told;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = view.faults->state(row.id);
    const std::uint16_t bit = bit_of(alarm_of(row.id));
    const bool stops = view.is_closed ? opens_for(row, state, view.wish, stricter)
                                      : keeps_open_for(row, state, view.wish, view.is_plugged_in, stricter);
    if (stops) told.alarms |= bit;
    if (!stops && (state.is_present() || state.is_warning)) told.warnings |= bit;
  }
  return told;
}

void InverterReporter::init(const InverterConfig& config, TimePoint started_at) {
  config_ = config;
  next_at_ = full_at_ = started_at;
  hours_before_ = 0;
}

void InverterReporter::restore(std::uint32_t hours_since_full) {
  hours_before_ = std::min(hours_since_full, hours_max);
}

std::uint32_t InverterReporter::hours_since_full(TimePoint now) const {
  const auto hours = std::chrono::duration_cast<std::chrono::hours>(now - full_at_).count() + hours_before_;
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(hours, 0, hours_max));
}

void InverterReporter::follow(const InverterView& view) {
  if (!is_there()) return;
  limits_ = inverter_limits(view, config_);
  follow_requests(view);
  const auto has_fallen = [](std::int32_t from_mA, std::int32_t to_mA) {
    return to_mA + step_mA <= from_mA || (to_mA == 0 && from_mA > 0);
  };
  const bool is_late =
      has_fallen(told_.charge_mA, limits_.charge_mA) || has_fallen(told_.discharge_mA, limits_.discharge_mA);
  if (!is_late || view.now - round_at_ < config_.driver->period_min) return;
  index_ = 0;
  next_at_ = view.now;
}

void InverterReporter::follow_requests(const InverterView& view) {
  if (!view.soc_permille) {
    asks_for_charge_ = asks_for_full_charge_ = false;
    return;
  }
  const std::int32_t soc_permille = *view.soc_permille;
  const std::int32_t low_permille = config_.force_charge_permille;
  const bool is_low = soc_permille < low_permille;
  const bool is_still_low = asks_for_charge_ && soc_permille < low_permille + hysteresis_permille;
  asks_for_charge_ = limits_.charge_mA > 0 && (is_low || is_still_low);
  if (soc_permille >= full_permille) {
    full_at_ = view.now;
    hours_before_ = 0;
  }
  const Duration after = std::chrono::hours{24} * config_.full_charge_after_days;
  const Duration since = view.now - full_at_ + std::chrono::hours{hours_before_};
  asks_for_full_charge_ = limits_.charge_mA > 0 && after > Duration{} && since >= after;
}

BatteryReport InverterReporter::report(const InverterView& view) const {
  const PackState& pack = *view.pack;
  const BatteryAlarms alarms = battery_alarms(view);
  return {.charge_voltage_limit_mV = config_.charge_voltage_max_mV,
          .discharge_voltage_limit_mV = config_.discharge_voltage_min_mV,
          .charge_limit_mA = limits_.charge_mA,
          .discharge_limit_mA = limits_.discharge_mA,
          .may_charge = limits_.charge_mA > 0,
          .may_discharge = limits_.discharge_mA > 0,
          .asks_for_charge = asks_for_charge_,
          .asks_for_full_charge = asks_for_full_charge_,
          .soc_permille = if_given(view.soc_permille),
          .soh_permille = soh_permille(view.estimate, config_),
          .voltage_mV = value_of(pack.pack_voltage_mV),
          .current_mA = value_of(pack.current_mA),
          .temperature_dC = if_complete(pack.cell_temperature_dC, pack.cell_temperature_dC.average),
          .cell_voltage_min_uV = if_complete(pack.cell_voltage_uV, pack.cell_voltage_uV.min),
          .cell_voltage_max_uV = if_complete(pack.cell_voltage_uV, pack.cell_voltage_uV.max),
          .cell_temperature_min_dC = if_complete(pack.cell_temperature_dC, pack.cell_temperature_dC.min),
          .cell_temperature_max_dC = if_complete(pack.cell_temperature_dC, pack.cell_temperature_dC.max),
          .alarms = alarms.alarms,
          .warnings = alarms.warnings,
          .module_count = view.module_count,
          .capacity_uAs = view.capacity_uAs,
          .name = config_.maker};
}

/// The first frames of rounds are a period apart; after a gap the rounds start from now.
void InverterReporter::advance(TimePoint now) {
  index_ = static_cast<std::uint8_t>((index_ + 1) % config_.driver->frame_count);
  next_at_ = index_ != 0 ? now + spacing : std::max(round_at_ + config_.period, now + spacing);
}

std::optional<CanFrame> InverterReporter::step(const InverterView& view) {
  if (!is_there() || view.now < next_at_) return std::nullopt;
  const BatteryReport told = report(view);
  const InverterOptions options{
      .is_discharge_positive = config_.is_discharge_positive.value_or(config_.driver->is_discharge_positive),
      .has_short_frames = config_.has_short_frames};
  std::optional<CanFrame> frame;
  if (index_ == 0) {
    round_at_ = view.now;
    told_ = {};
  }
  // An omitted frame takes no time.
  do {
    // A limit may be higher by now than when the round started.
    if (index_ < config_.driver->urgent_count) told_ = most_of(told_, limits_);
    frame = config_.driver->frame(index_, told, options);
    advance(view.now);
  } while (!frame && index_ != 0);
  return frame;
}

void InverterReporter::note_failed(const CanFrame& frame) {
  if (!is_there()) return;
  BatteryReport ignored;
  const BatteryWord word = config_.driver->hear(frame, ignored);
  if (word == BatteryWord::limits || word == BatteryWord::requests) told_ = anything;
}

}  // namespace bmu
