// Answers about the system: charge, limits, faults, inputs and outputs, currents.
#include <array>

#include "daemon/core/estimation/pack_health.hpp"
#include "daemon/core/vehicle/cell_question.hpp"

namespace bmu {

namespace {

RequestData one_byte(std::optional<std::int64_t> value) {
  RequestData data;
  if (value) data.push_back(byte_of(*value));
  return data;
}

RequestData state_of_charge(const Question& question) {
  const auto& soc = question.view.vehicle->soc_permille;
  return one_byte(soc ? std::optional(divide_to_nearest(*soc, 10)) : std::nullopt);
}
RequestData capacity(const Question& question) {
  RequestData data;
  put_16(data, divide_to_nearest(question.view.vehicle->capacity_uAs, uAs_per_Ah));
  return data;
}
RequestData depth_of_discharge(const Question& question) {
  RequestData data;
  const auto& depth_uAs = question.view.vehicle->depth_of_discharge_uAs;
  if (depth_uAs) put_16(data, divide_to_nearest(*depth_uAs, uAs_per_Ah));
  return data;
}

std::optional<std::int64_t> current_mA(const Question& question) {
  const Measured<std::int32_t>& current = question.view.vehicle->pack->current_mA;
  return current.is_valid() ? std::optional<std::int64_t>(current.value) : std::nullopt;
}
std::int64_t with_sign_as_told(const Question& question, std::int64_t value) {
  return question.view.config->vehicle.is_charge_positive ? -value : value;
}

RequestData power(const Question& question) {
  constexpr std::int64_t power_step_uW = 100'000'000;
  RequestData data;
  const std::optional<std::int64_t> current = current_mA(question);
  const Measured<std::int32_t>& voltage = question.view.vehicle->pack->pack_voltage_mV;
  if (!current || !voltage.is_valid()) return data;
  put_signed_16(data, with_sign_as_told(question, divide_to_nearest(*current * voltage.value, power_step_uW)));
  return data;
}

RequestData energy(const Question& question, std::int64_t PackTotals::*energy_mWh) {
  constexpr std::int64_t energy_step_mWh = 1'000'000;
  RequestData data;
  const auto& totals = question.view.vehicle->totals;
  if (totals) put_24(data, divide_to_nearest((*totals).*energy_mWh, energy_step_mWh));
  return data;
}
RequestData energy_in(const Question& question) {
  return energy(question, &PackTotals::energy_in_mWh);
}
RequestData energy_out(const Question& question) {
  return energy(question, &PackTotals::energy_out_mWh);
}

RequestData state_of_health(const Question& question) {
  const HealthFigure health = pack_health(*question.view.vehicle->estimate).by_capacity;
  return one_byte(health.is_known ? std::optional(divide_to_nearest(health.permille, 10)) : std::nullopt);
}

/// Starts of the daemon with this pack.
RequestData power_cycles(const Question& question) {
  RequestData data;
  const auto& starts = question.view.vehicle->starts;
  if (starts) put_16(data, *starts);
  return data;
}

RequestData uptime(const Question& question) {
  RequestData data;
  put_24(data, std::chrono::duration_cast<std::chrono::seconds>(question.view.vehicle->uptime).count());
  return data;
}

RequestData faults(const Question& question) {
  const ElithionFaults& faults = question.view.vehicle->faults;
  RequestData data;
  data.push_back(faults.level_faults);
  data.push_back(faults.stored_code);
  data.push_back(faults.warnings);
  return data;
}

RequestData relays(const Question& question) {
  constexpr std::int64_t on = 0x11;
  return one_byte(question.view.vehicle->mode.phase == Phase::closed ? on : 0);
}

/// Cause of a reduced limit, as the Lithiumate numbers it; 0 if it has no number for it.
struct CauseRow {
  LimitCause cause;
  std::uint8_t charge;
  std::uint8_t discharge;
};
constexpr CauseRow cause_rows[] = {
    {LimitCause::cell_voltage_low, 3, 3},
    {LimitCause::voltage_would_fall, 3, 3},
    {LimitCause::empty, 3, 3},
    {LimitCause::cell_voltage_high, 4, 4},
    {LimitCause::voltage_would_rise, 4, 4},
    {LimitCause::full, 4, 4},
    {LimitCause::cell_hot, 5, 7},
    {LimitCause::too_hot_to_charge, 5, 7},
    {LimitCause::hot, 5, 7},
    {LimitCause::board_hot, 5, 7},
    {LimitCause::cell_cold, 6, 8},
    {LimitCause::too_cold_to_charge, 6, 8},
    {LimitCause::cold, 6, 8},
    {LimitCause::overload, 9, 10},
    {LimitCause::charged_too_much, 9, 10},
    {LimitCause::drawn_too_much, 9, 10},
};

RequestData share_of(const CurrentLimit& limit, std::int64_t most_mA, std::uint8_t CauseRow::*number) {
  constexpr std::int64_t whole = 0xFF;
  const auto* const row = std::find_if(std::begin(cause_rows), std::end(cause_rows),
                                       [&](const CauseRow& one) { return one.cause == limit.cause; });
  RequestData data;
  data.push_back(byte_of(most_mA > 0 ? limit.limit_mA * whole / most_mA : 0));
  data.push_back(row == std::end(cause_rows) ? std::uint8_t{0} : row->*number);
  return data;
}
RequestData charge_limit(const Question& question) {
  const CurrentLimitConfig most = carried(*question.view.config);
  return share_of(question.view.vehicle->limits->charge, std::max(most.charge_peak_mA, most.charge_continuous_mA),
                  &CauseRow::charge);
}
RequestData discharge_limit(const Question& question) {
  const CurrentLimitConfig most = carried(*question.view.config);
  return share_of(question.view.vehicle->limits->discharge,
                  std::max(most.discharge_peak_mA, most.discharge_continuous_mA), &CauseRow::discharge);
}

RequestData inputs(const Question& question) {
  return one_byte(elithion_flags(*question.view.vehicle));
}
/// Outputs of a Lithiumate: fault and three contactors. None is forced.
RequestData outputs(const Question& question) {
  constexpr std::uint8_t bits_alike = 0x0F;
  RequestData data;
  data.push_back(static_cast<std::uint8_t>(elithion_state(question.view.vehicle->mode) & bits_alike));
  data.push_back(0);
  return data;
}

constexpr std::int64_t current_step_mA = 100;

RequestData pack_current(const Question& question) {
  RequestData data;
  const std::optional<std::int64_t> current = current_mA(question);
  if (current) put_signed_16(data, with_sign_as_told(question, divide_to_nearest(*current, current_step_mA)));
  return data;
}
RequestData source_current(const Question& question) {
  RequestData data;
  const std::optional<std::int64_t> current = current_mA(question);
  if (current) put_signed_16(data, divide_to_nearest(std::max<std::int64_t>(-*current, 0), current_step_mA));
  return data;
}
RequestData load_current(const Question& question) {
  RequestData data;
  const std::optional<std::int64_t> current = current_mA(question);
  if (current) put_signed_16(data, divide_to_nearest(std::max<std::int64_t>(*current, 0), current_step_mA));
  return data;
}

/// The last four characters of the version in 621h: a Lithiumate's revision has four characters, too.
RequestData revision(const Question& question) {
  RequestData data;
  const auto& version = question.view.config->vehicle.version;
  for (std::size_t index = 4; index < version.size(); ++index) {
    data.push_back(static_cast<std::uint8_t>(version[index]));
  }
  return data;
}

constexpr std::array rows{
    PidRow{0x50, About::system, state_of_charge},
    PidRow{0x51, About::system, capacity},
    PidRow{0x52, About::system, depth_of_discharge},
    PidRow{0x53, About::system, power},
    PidRow{0x54, About::system, energy_in},
    PidRow{0x55, About::system, energy_out},
    PidRow{0x56, About::system, state_of_health},
    PidRow{0x60, About::system, power_cycles},
    PidRow{0x61, About::system, uptime},
    PidRow{0x62, About::system, faults},
    PidRow{0x63, About::system, relays},
    PidRow{0x64, About::system, charge_limit},
    PidRow{0x65, About::system, discharge_limit},
    PidRow{0x66, About::system, inputs},
    PidRow{0x67, About::system, outputs},
    PidRow{0x68, About::system, pack_current},
    PidRow{0x69, About::system, source_current},
    PidRow{0x6A, About::system, load_current},
    PidRow{0x6B, About::system, source_current},
    PidRow{0x6C, About::system, load_current},
    PidRow{0x70, About::system, revision},
};

}  // namespace

std::span<const PidRow> system_answers() {
  return rows;
}

}  // namespace bmu
