#include "daemon/shell/can/buses.hpp"

#include <algorithm>
#include <utility>

#include "daemon/core/vehicle/report_vehicle.hpp"
#include "daemon/core/vehicle/swapped_buses.hpp"
#include "devices/device_list.hpp"

namespace bmu {

namespace {

Result<std::unique_ptr<BusPort>, OsError> open_port(const std::string& name, ReceiveIds ids) {
  return open_bus(name, {.receive_ids = std::move(ids.standard),
                         .receive_extended_ids = std::move(ids.extended),
                         .receive_own = true,
                         .receive_errors = true,
                         .must_exist = false});
}

/// Identifiers of all messages that the device sends and receives.
std::vector<std::uint32_t> device_receive_ids(std::string_view name, bool is_extended) {
  std::vector<std::uint32_t> ids;
  for (const MessageSpec* message : find_device(name)->catalogue->messages()) {
    if (message->is_extended == is_extended) ids.push_back(message->base_id);
  }
  return ids;
}

std::vector<std::uint32_t> every_node_of(const Catalogue& catalogue) {
  std::vector<std::uint32_t> ids;
  for (const MessageSpec* message : catalogue.messages()) {
    for (std::uint32_t node = message->node_min; node <= message->node_max; ++node) ids.push_back(message->id_of(node));
  }
  return ids;
}

}  // namespace

bool Buses::is_shared(Port port) const {
  return std::any_of(all_ports.begin(), all_ports.end(),
                     [&](Port other) { return other != port && is_there(other) && &serving(other) == &serving(port); });
}

std::vector<std::uint32_t> internal_receive_ids(const CoreConfig& config) {
  if (are_modules_ours(config)) return every_node_of(internal_bus::catalogue);
  std::vector<std::uint32_t> ids = every_node_of(internal_bus::catalogue_without_modules);
  const std::vector<std::uint32_t> of_modules = every_node_of(*config.foreign.driver->catalogue);
  ids.insert(ids.end(), of_modules.begin(), of_modules.end());
  return ids;
}

std::vector<std::uint32_t> vehicle_receive_ids(const CoreConfig& config) {
  const VehicleConfig& vehicle = config.vehicle;
  std::vector<std::uint32_t> ids;
  for (std::uint32_t index = 0; index < vehicle_message_count; ++index) ids.push_back(vehicle.base_id + index);
  if (vehicle.request_id != 0) {
    ids.push_back(vehicle.request_id);
    ids.push_back(reply_id_of(vehicle));
  }
  for (const std::uint16_t id : {vehicle.cell_voltages_id, vehicle.cell_temperatures_id}) {
    if (id != 0) ids.push_back(id);
  }
  for (std::uint32_t id = 0; id < Catalogue::id_count; ++id) {
    if (misplaced_row(config, id) != nullptr) ids.push_back(id);
  }
  return ids;
}

std::vector<std::uint32_t> second_pack_receive_ids(const CoreConfig& config) {
  std::vector<std::uint32_t> ids;
  if (config.second_pack.base_id == 0) return ids;
  for (std::uint32_t index = 0; index < vehicle_message_count; ++index) {
    ids.push_back(config.second_pack.base_id + index);
  }
  return ids;
}

std::vector<std::uint32_t> charger_receive_ids(const CoreConfig& config, bool is_extended) {
  if (config.charger.driver == nullptr) return {};
  return device_receive_ids(config.charger.driver->name, is_extended);
}

std::vector<std::uint32_t> inverter_receive_ids(const CoreConfig& config) {
  if (config.inverter.driver == nullptr) return {};
  return device_receive_ids(config.inverter.driver->name, false);
}

namespace {

ReceiveIds own_receive_ids(Port port, const CoreConfig& config) {
  switch (port) {
    case Port::internal: return {.standard = internal_receive_ids(config)};
    case Port::vehicle: return {.standard = vehicle_receive_ids(config)};
    case Port::charger:
      return {.standard = charger_receive_ids(config, false), .extended = charger_receive_ids(config, true)};
    case Port::second_pack: return {.standard = second_pack_receive_ids(config)};
    case Port::inverter: break;
  }
  return {.standard = inverter_receive_ids(config)};
}

}  // namespace

std::vector<std::uint32_t> sensor_receive_ids(Port port, const CoreConfig& config) {
  std::vector<std::uint32_t> ids;
  const auto add = [&ids](const auto* driver) {
    if (driver == nullptr) return;
    for (const MessageSpec* message : find_device(driver->name)->catalogue->messages()) ids.push_back(message->base_id);
  };
  if (port == Port::internal) add(config.sensor.set_up);
  if (port == Port::internal && config.sensor.second_command_id != 0) {
    ids.push_back(config.sensor.second_command_id);
    ids.push_back(config.sensor.second_response_id);
  }
  if (port == config.sensor.bus) add(config.sensor.first);
  if (port == config.sensor.bus) add(config.sensor.second);
  if (port == config.insulation.bus) add(config.insulation.driver);
  return ids;
}

ReceiveIds receive_ids(Port port, const CoreConfig& config) {
  ReceiveIds ids = own_receive_ids(port, config);
  const std::vector<std::uint32_t> of_sensors = sensor_receive_ids(port, config);
  ids.standard.insert(ids.standard.end(), of_sensors.begin(), of_sensors.end());
  return ids;
}

Result<Buses, OsError> open_buses(const BusNames& names, const CoreConfig& config) {
  std::array<ReceiveIds, port_count> ids;
  Buses buses;
  const ServedBy serving = served_by(names);
  for (const Port port : all_ports) {
    const ReceiveIds more = receive_ids(port, config);
    if (more.empty()) continue;
    const auto index = static_cast<std::size_t>(port);
    buses.served_by.at(index) = serving.at(index);
    ReceiveIds& all = ids.at(static_cast<std::size_t>(serving.at(index)));
    all.standard.insert(all.standard.end(), more.standard.begin(), more.standard.end());
    all.extended.insert(all.extended.end(), more.extended.begin(), more.extended.end());
  }
  for (const Port port : all_ports) {
    const auto index = static_cast<std::size_t>(port);
    if (ids.at(index).empty()) continue;
    auto opened = open_port(names.name(port), std::move(ids.at(index)));
    if (!opened) return failure(opened.error());
    buses.ports.at(index) = std::move(*opened);
  }
  return buses;
}

}  // namespace bmu
