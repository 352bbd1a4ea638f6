#include "daemon/core/vehicle/report_vehicle.hpp"

#include <cmath>

#include "daemon/core/estimation/pack_health.hpp"
#include "protocol/tables/vehicle_dialects.hpp"

namespace bmu {

namespace {

using namespace vehicle_bus;

/// Below this a current is "neither charging nor discharging".
constexpr std::int32_t flowing_current_mA = 200;

SignalValue value_of(const Measured<std::int32_t>& measured) {
  return measured.is_valid() ? known(measured.value) : not_known();
}
template <class Number>
SignalValue if_known(const std::optional<Number>& value) {
  return value ? known(*value) : not_known();
}
SignalValue if_complete(const Spread& spread, std::int32_t value) {
  return spread.is_complete() ? known(value) : not_known();
}
/// Number of a cell or sensor, from 1. One that does not fit is unknown, not the nearest: it would point to the wrong
/// cell.
SignalValue number_if(bool is_known, std::size_t number) {
  constexpr std::size_t number_max = 254;
  return is_known && number <= number_max ? known(static_cast<std::int64_t>(number)) : not_known();
}
SignalValue number_of(const Spread& spread, const Element& element) {
  return number_if(spread.is_complete(), element.pack_number);
}

void write_text(CanFrame& frame, const std::array<char, 8>& text) {
  for (std::size_t index = 0; index < text.size(); ++index) frame.data[index] = static_cast<std::uint8_t>(text[index]);
}

CanFrame name_frame(const VehicleView&, const VehicleConfig& config) {
  CanFrame frame = make_frame(pack_name);
  write_text(frame, config.name);
  return frame;
}

CanFrame version_frame(const VehicleView&, const VehicleConfig& config) {
  CanFrame frame = make_frame(pack_version);
  write_text(frame, config.version);
  return frame;
}

std::int64_t uptime_s(const VehicleView& view) {
  return std::chrono::duration_cast<std::chrono::seconds>(view.uptime).count() % 65536;
}

CanFrame iha_status_frame(const VehicleView& view, const VehicleConfig&) {
  const Measured<std::int32_t>& current = view.pack->current_mA;
  CanFrame frame = make_frame(pack_status);
  write<pack_status, "state">(frame, vehicle_state(VehicleDialect::iha, view.mode));
  write<pack_status, "uptime_s">(frame, uptime_s(view));
  write<pack_status, "discharging">(frame, current.is_valid() && current.value >= flowing_current_mA);
  write<pack_status, "charging">(frame, current.is_valid() && current.value <= -flowing_current_mA);
  write<pack_status, "dtc_1">(frame, view.codes.first);
  write<pack_status, "dtc_2">(frame, view.codes.second);
  return frame;
}

CanFrame original_status_frame(const VehicleView& view, const VehicleConfig&) {
  using vehicle_bus_original::pack_status;
  CanFrame frame = make_frame(pack_status);
  write<pack_status, "state">(frame, vehicle_state(VehicleDialect::original, view.mode));
  write<pack_status, "uptime_s">(frame, uptime_s(view));
  write<pack_status, "dtc_1">(frame, view.codes.first);
  write<pack_status, "dtc_2">(frame, view.codes.second);
  return frame;
}

/// State, flags and faults are bits made by other functions: each is written as a byte.
CanFrame elithion_status_frame(const VehicleView& view, const VehicleConfig&) {
  using vehicle_bus_elithion::pack_status;
  CanFrame frame = make_frame(pack_status);
  frame.data[0] = vehicle_state(VehicleDialect::elithion, view.mode);
  write<pack_status, "uptime_s">(frame, uptime_s(view));
  frame.data[3] = elithion_flags(view);
  write<pack_status, "stored_fault">(frame, view.faults.stored_code);
  write<pack_status, "fault_bits">(frame, view.faults.level_faults);
  write<pack_status, "warning_bits">(frame, view.faults.warnings);
  return frame;
}

CanFrame voltage_frame(const VehicleView& view, const VehicleConfig&) {
  const Spread& cells = view.pack->cell_voltage_uV;
  CanFrame frame = make_frame(pack_voltage);
  write<pack_voltage, "pack_voltage_mV">(frame, value_of(view.pack->pack_voltage_mV));
  write<pack_voltage, "cell_voltage_min_uV">(frame, if_complete(cells, cells.min));
  write<pack_voltage, "cell_voltage_min_cell">(frame, number_of(cells, cells.min_at));
  write<pack_voltage, "cell_voltage_max_uV">(frame, if_complete(cells, cells.max));
  write<pack_voltage, "cell_voltage_max_cell">(frame, number_of(cells, cells.max_at));
  return frame;
}

CanFrame current_frame(const VehicleView& view, const VehicleConfig& config) {
  SignalValue current_mA = value_of(view.pack->current_mA);
  if (config.is_charge_positive) current_mA.value = -current_mA.value;
  CanFrame frame = make_frame(pack_current);
  write<pack_current, "pack_current_mA">(frame, current_mA);
  write<pack_current, "charge_limit_mA">(frame, view.limits->charge.limit_mA);
  write<pack_current, "discharge_limit_mA">(frame, view.limits->discharge.limit_mA);
  return frame;
}

/// Since manufacture, by the message's definition: since the daemon first ran with this pack, if persistent state is
/// kept.
CanFrame energy_frame(const VehicleView& view, const VehicleConfig&) {
  CanFrame frame = make_frame(pack_energy);
  write<pack_energy, "energy_in_mWh">(frame, view.totals ? known(view.totals->energy_in_mWh) : not_known());
  write<pack_energy, "energy_out_mWh">(frame, view.totals ? known(view.totals->energy_out_mWh) : not_known());
  return frame;
}

/// The counts are Wh, or kWh: receivers differ, and the pack file selects it.
CanFrame elithion_energy_frame(const VehicleView& view, const VehicleConfig& config) {
  using vehicle_bus_elithion::pack_energy;
  const std::int64_t count_mWh = config.is_energy_in_kWh ? 1'000'000 : 1'000;
  const auto counts = [&](std::int64_t PackTotals::*energy_mWh) {
    return view.totals ? known(divide_to_nearest((*view.totals).*energy_mWh, count_mWh)) : not_known();
  };
  CanFrame frame = make_frame(pack_energy);
  write<pack_energy, "energy_in_counts">(frame, counts(&PackTotals::energy_in_mWh));
  write<pack_energy, "energy_out_counts">(frame, counts(&PackTotals::energy_out_mWh));
  return frame;
}

CanFrame charge_frame(const VehicleView& view, const VehicleConfig&) {
  CanFrame frame = make_frame(pack_charge);
  write<pack_charge, "soc_permille">(frame, if_known(view.soc_permille));
  write<pack_charge, "depth_of_discharge_uAs">(frame, if_known(view.depth_of_discharge_uAs));
  write<pack_charge, "capacity_uAs">(frame, view.capacity_uAs);
  write<pack_charge, "soc_2_permille">(frame, if_known(view.soc_2_permille));
  const HealthFigure health = view.estimate != nullptr ? pack_health(*view.estimate).by_capacity : HealthFigure{};
  write<pack_charge, "soh_permille">(frame, health.is_known ? known(health.permille) : not_known());
  return frame;
}

/// As in the other dialects, except that there is no second pack: its byte is 0.
CanFrame elithion_charge_frame(const VehicleView& view, const VehicleConfig& config) {
  CanFrame frame = charge_frame(view, config);
  frame.data[5] = 0;
  return frame;
}

CanFrame temperature_frame(const VehicleView& view, const VehicleConfig&) {
  const Spread& cells = view.pack->cell_temperature_dC;
  CanFrame frame = make_frame(pack_temperature);
  write<pack_temperature, "cell_temperature_average_dC">(frame, if_complete(cells, cells.average));
  write<pack_temperature, "air_temperature_dC">(frame, value_of(view.intake_air_dC));
  write<pack_temperature, "cell_temperature_min_dC">(frame, if_complete(cells, cells.min));
  write<pack_temperature, "cell_temperature_min_sensor">(frame, number_of(cells, cells.min_at));
  write<pack_temperature, "cell_temperature_max_dC">(frame, if_complete(cells, cells.max));
  write<pack_temperature, "cell_temperature_max_sensor">(frame, number_of(cells, cells.max_at));
  return frame;
}

/// As in the other dialects, except that the byte of the air is unused.
CanFrame elithion_temperature_frame(const VehicleView& view, const VehicleConfig& config) {
  CanFrame frame = temperature_frame(view, config);
  frame.data[1] = 0;
  return frame;
}

SignalValue resistance_of(bool is_known, double resistance_Ohm) {
  return is_known ? known(std::llround(resistance_Ohm * 1e6)) : not_known();
}

/// The message defines the scales of the signals: a cell of less than 100 uOhm is sent as 0 or 100.
CanFrame resistance_frame(const VehicleView& view, const VehicleConfig&) {
  const PackHealth health = view.estimate != nullptr ? pack_health(*view.estimate) : PackHealth{};
  const bool is_known = health.resistance.is_known;
  CanFrame frame = make_frame(vehicle_bus::pack_resistance);
  write<vehicle_bus::pack_resistance, "pack_resistance_uOhm">(
      frame, resistance_of(is_known, health.resistance.resistance_Ohm));
  write<vehicle_bus::pack_resistance, "cell_resistance_min_uOhm">(
      frame, resistance_of(is_known, health.cell_resistance_min_Ohm));
  write<vehicle_bus::pack_resistance, "cell_resistance_min_cell">(
      frame, number_if(is_known, health.cell_resistance_min_cell + 1));
  write<vehicle_bus::pack_resistance, "cell_resistance_max_uOhm">(
      frame, resistance_of(is_known, health.cell_resistance_max_Ohm));
  write<vehicle_bus::pack_resistance, "cell_resistance_max_cell">(
      frame, number_if(is_known, health.resistance.worst_cell + 1));
  return frame;
}

using MakeFrame = CanFrame (*)(const VehicleView&, const VehicleConfig&);
using Makers = std::array<MakeFrame, vehicle_message_count>;

/// In the order of VehicleDialect.
constexpr std::array<Makers, vehicle_dialect_count> makers{{
    {name_frame, version_frame, iha_status_frame, voltage_frame, current_frame, energy_frame, charge_frame,
     temperature_frame, resistance_frame},
    {name_frame, version_frame, original_status_frame, voltage_frame, current_frame, energy_frame, charge_frame,
     temperature_frame, resistance_frame},
    {name_frame, version_frame, elithion_status_frame, voltage_frame, current_frame, elithion_energy_frame,
     elithion_charge_frame, elithion_temperature_frame, resistance_frame},
}};

constexpr std::uint8_t bit_if(bool is_set, unsigned number) {
  return static_cast<std::uint8_t>(is_set ? 1U << number : 0U);
}

}  // namespace

std::uint8_t vehicle_state(VehicleDialect dialect, const ModeInputs& mode) {
  switch (dialect) {
    case VehicleDialect::iha: break;
    case VehicleDialect::original: return original_state(pack_mode(mode), mode);
    case VehicleDialect::elithion: return elithion_state(mode);
  }
  return iha_state(pack_mode(mode));
}

std::uint8_t elithion_flags(const VehicleView& view) {
  unsigned flags = bit_if(view.mode.charger_connected, 0);
  flags |= bit_if(view.mode.vehicle_on, 1);
  flags |= bit_if(view.interlock_tripped, 2);
  flags |= bit_if(view.close_requested, 3);
  flags |= bit_if(view.limits->charge.limit_mA == 0, 5);
  flags |= bit_if(view.limits->discharge.limit_mA == 0, 6);
  flags |= bit_if(view.mode.outputs.fan, 7);
  return static_cast<std::uint8_t>(flags);
}

CanFrame vehicle_frame(std::size_t index, const VehicleView& view, const VehicleConfig& config) {
  BMU_ASSERT(index < vehicle_message_count);
  CanFrame frame = makers[static_cast<std::size_t>(config.dialect)][index](view, config);
  frame.id = frame.id - default_base_id + config.base_id;
  return frame;
}

std::optional<CanFrame> VehicleReporter::step(TimePoint now, const VehicleView& view, const VehicleConfig& config) {
  if (!is_due(now)) return std::nullopt;
  const CanFrame frame = vehicle_frame(index_, view, config);
  const bool is_last = index_ + 1 == vehicle_message_count;
  next_at_ += is_last ? period - spacing * (static_cast<int>(vehicle_message_count) - 1) : spacing;
  if (next_at_ + period <= now) next_at_ = now + spacing;  // after a gap; no burst to catch up
  index_ = is_last ? 0 : index_ + 1;
  return frame;
}

}  // namespace bmu
