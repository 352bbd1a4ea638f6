#include "config/checks/bus_guests.hpp"

#include <array>

#include "daemon/core/vehicle/cell_reporter.hpp"
#include "devices/cell_data/cell_data.hpp"
#include "devices/device_list.hpp"
#include "protocol/can_bits.hpp"
#include "protocol/tables/vehicle_dialects.hpp"

namespace bmu {
namespace {

using Guests = std::vector<GuestMessage>;

void add(const MessageSpec& message, std::uint32_t id, Duration period, Guests& guests) {
  if (period > Duration{}) guests.push_back({id, message.length, message.is_extended, period});
}

/// Adds the nine messages of a pack to its vehicle, of this pack or of the second one.
void add_reports(VehicleDialect dialect, std::uint32_t base_id, Guests& guests) {
  for (const MessageSpec* message : row_of(dialect).catalogue->messages()) {
    add(*message, message->base_id - vehicle_bus::default_base_id + base_id, message->period, guests);
  }
}

/// The frames of a round are spread evenly over its period.
void add_cell_data(const CoreConfig& core, Guests& guests) {
  const CellDataBlocks blocks = cell_data_blocks(core);
  const auto add_blocks = [&](const MessageSpec& message, std::uint32_t id, std::size_t count) {
    if (count > 0) add(message, id, core.vehicle.cell_data_period / static_cast<std::int64_t>(count), guests);
  };
  add_blocks(cell_data::voltages, core.vehicle.cell_voltages_id, blocks.voltages);
  add_blocks(cell_data::temperatures, core.vehicle.cell_temperatures_id, blocks.temperatures);
}

/// A protocol has rows for the maximum number of units.
void add_chargers(const ChargerConfig& charger, Guests& guests) {
  for (const MessageSpec* message : find_device(charger.driver->name)->catalogue->messages()) {
    const CanFrame frame = make_frame(*message);
    std::array<ChargerReport, charger_units_max> ignored{};
    const auto command = charger.driver->order_of(frame);
    const std::uint8_t unit = command ? command->unit : charger.driver->take(frame, ignored).unit;
    const bool is_of_other_master = command && command->order.master_address != charger.master_address;
    if (unit >= charger.unit_count || is_of_other_master) continue;
    add(*message, message->base_id, command ? charger.driver->command_period : message->period, guests);
  }
}

void add_inverter(const InverterConfig& inverter, Guests& guests) {
  for (const MessageSpec* message : find_device(inverter.driver->name)->catalogue->messages()) {
    add(*message, message->base_id, message->sender == Sender::bmu ? inverter.period : message->period, guests);
  }
}

/// Adds the messages of a sensor or monitor; those with a row on the internal bus are counted there.
template <class Driver>
void add_sensor(const Driver* driver, Guests& guests) {
  if (driver == nullptr) return;
  for (const MessageSpec* message : find_device(driver->name)->catalogue->messages()) {
    add(*message, message->base_id, message->period, guests);
  }
}

}  // namespace

std::vector<GuestMessage> guests_on(const CoreConfig& core, Port bus) {
  Guests guests;
  if (serves(core, bus, Port::vehicle)) {
    add_reports(core.vehicle.dialect, core.vehicle.base_id, guests);
    add_cell_data(core, guests);
  }
  if (serves(core, bus, Port::second_pack) && core.second_pack.base_id != 0) {
    add_reports(core.second_pack.dialect, core.second_pack.base_id, guests);
  }
  if (serves(core, bus, Port::charger) && core.charger.driver != nullptr) add_chargers(core.charger, guests);
  if (serves(core, bus, Port::inverter) && core.inverter.driver != nullptr) add_inverter(core.inverter, guests);
  if (serves(core, bus, core.sensor.bus)) {
    add_sensor(core.sensor.first, guests);
    add_sensor(core.sensor.second, guests);
  }
  if (serves(core, bus, core.insulation.bus)) add_sensor(core.insulation.driver, guests);
  return guests;
}

std::int64_t bits_of(const GuestMessage& message) {
  return bits_on_wire_max(message.length, message.is_extended);
}

bool goes_ahead(const GuestMessage& message, std::uint32_t of_id) {
  constexpr unsigned bits_behind = 18;  // of a 29-bit identifier; its first eleven are compared
  return (message.is_extended ? message.id >> bits_behind : message.id) < of_id;
}

}  // namespace bmu
