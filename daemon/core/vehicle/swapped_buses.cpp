#include "daemon/core/vehicle/swapped_buses.hpp"

#include <algorithm>
#include <array>

#include "daemon/core/vehicle/report_vehicle.hpp"
#include "protocol/receive_check.hpp"

namespace bmu {

namespace {

bool has_other_use(const CoreConfig& config, std::uint32_t id) {
  const VehicleConfig& vehicle = config.vehicle;
  const std::array ids{std::uint32_t{vehicle.request_id}, std::uint32_t{reply_id_of(vehicle)},
                       std::uint32_t{vehicle.cell_voltages_id}, std::uint32_t{vehicle.cell_temperatures_id}};
  const bool is_report = id - vehicle.base_id < vehicle_message_count;
  const bool is_second_pack =
      config.second_pack.base_id != 0 && id - config.second_pack.base_id < vehicle_message_count;
  return is_report || is_second_pack || std::find(ids.begin(), ids.end(), id) != ids.end();
}

bool is_ident_of_pack(const CoreConfig& config, std::uint32_t id) {
  const bool has_inverter = config.inverter.driver != nullptr && serves(config, Port::vehicle, Port::inverter);
  return are_modules_ours(config) && !has_inverter &&
         std::any_of(config.modules.begin(), config.modules.end(),
                     [id](const ModuleConfig& module) { return internal_bus::ident.id_of(module.node) == id; });
}

const MessageSpec* result_row(const CoreConfig& config, std::uint32_t id) {
  const bool is_used = config.sensor.bus == Port::internal && config.sensor.first == nullptr;
  if (config.contactors.has_pdu || !is_used) return nullptr;
  for (const MessageSpec* row : {&internal_bus::sensor_current, &internal_bus::sensor_u1, &internal_bus::sensor_u2}) {
    if (row->base_id == id) return row;
  }
  return nullptr;
}

}  // namespace

const MessageSpec* misplaced_row(const CoreConfig& config, std::uint32_t id) {
  if (has_other_use(config, id)) return nullptr;
  if (config.contactors.has_pdu && id == internal_bus::pdu_status.base_id) return &internal_bus::pdu_status;
  return is_ident_of_pack(config, id) ? &internal_bus::ident : result_row(config, id);
}

bool is_misplaced(const CoreConfig& config, const CanFrame& frame) {
  if (form_fault(frame)) return false;
  const MessageSpec* const row = misplaced_row(config, frame.id);
  if (row == nullptr || content_fault(*row, frame)) return false;
  return row != &internal_bus::ident || counter_of(*row, frame) == 0;
}

}  // namespace bmu
