#include "daemon/shell/buses.hpp"

#include <utility>

#include "daemon/core/report_vehicle.hpp"

namespace bmu {

namespace {

Result<std::unique_ptr<BusPort>, OsError> open_port(const std::string& name, std::vector<std::uint32_t> ids) {
  return open_bus(name,
                  {.receive_ids = std::move(ids), .receive_own = true, .receive_errors = true, .must_exist = false});
}

}  // namespace

std::vector<std::uint32_t> internal_receive_ids() {
  std::vector<std::uint32_t> ids;
  for (const MessageSpec* message : internal_bus::catalogue.messages()) {
    for (std::uint32_t node = message->node_min; node <= message->node_max; ++node)
      ids.push_back(message->base_id + node);
  }
  return ids;
}

std::vector<std::uint32_t> vehicle_receive_ids(const CoreConfig& config) {
  std::vector<std::uint32_t> ids;
  for (std::uint32_t index = 0; index < vehicle_message_count; ++index) ids.push_back(config.vehicle.base_id + index);
  return ids;
}

Result<Buses, OsError> open_buses(const BusNames& names, const CoreConfig& config) {
  std::vector<std::uint32_t> internal_ids = internal_receive_ids();
  std::vector<std::uint32_t> vehicle_ids = vehicle_receive_ids(config);
  const bool is_shared = names.internal == names.vehicle;
  if (is_shared) internal_ids.insert(internal_ids.end(), vehicle_ids.begin(), vehicle_ids.end());

  Buses buses;
  auto internal = open_port(names.internal, std::move(internal_ids));
  if (!internal) return failure(internal.error());
  buses.internal = std::move(*internal);
  if (is_shared) return buses;

  auto vehicle = open_port(names.vehicle, std::move(vehicle_ids));
  if (!vehicle) return failure(vehicle.error());
  buses.vehicle = std::move(*vehicle);
  return buses;
}

}  // namespace bmu
