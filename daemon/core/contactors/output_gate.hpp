// Output gate: every frame that is sent passes it and can be refused. It passes only messages that this node sends, in
// their right form; never a contactor command that closes more than the decision of this tick allows, a charger command
// that requests more, an inverter message that permits more current or requests a charge that is not permitted, a
// command that stops or changes the current sensor while it is needed, or a module command that bleeds cells which this
// tick did not decide to bleed.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/types/observation.hpp"
#include "devices/charger.hpp"
#include "devices/inverter.hpp"
#include "devices/module_driver.hpp"
#include "devices/sensor_set_up.hpp"
#include "protocol/frame.hpp"
#include "protocol/tables/vehicle_dialects.hpp"

namespace bmu {

enum class GateVerdict : std::uint8_t {
  pass,
  not_ours,       // no such message on this bus, or not one of the master's
  malformed,      // wrong length, checksum or complement
  not_permitted,  // a command or limit that goes beyond the decision
};

[[nodiscard]] std::string_view to_text(GateVerdict verdict);

struct GateRules {
  std::uint16_t vehicle_base_id = vehicle_bus::default_base_id;
  VehicleDialect dialect = VehicleDialect::iha;
  std::optional<std::uint16_t> reply_id{};    // of answers to data requests, if enabled
  std::uint16_t cell_voltages_id = 0;         // of the cyclic cell data; 0: none is sent
  std::uint16_t cell_temperatures_id = 0;     // likewise
  const SensorSetUpDriver* sensor = nullptr;  // sensor with settings that may be read; null: none
  bool may_configure_sensor = false;  // stop it and change its settings; reading and starting is always permitted
  bool may_store_in_sensor = false;
  std::uint32_t second_sensor_command_id = 0;  // for reading the settings of a second sensor; 0: none
  const ChargerDriver* charger = nullptr;      // protocol of the chargers; null: none is commanded
  MasterAddress master_address = MasterAddress::f4;
  bool may_charge = false;                     // and is to, by this tick's decision
  bool may_request_mains = false;              // from a charging post
  std::int32_t charge_current_mA = 0;          // maximum request to all units together
  std::span<const std::int32_t> ordered_mA{};  // last request to each unit; as many as there are units
  std::int32_t charge_voltage_mV = 0;
  const InverterDriver* inverter = nullptr;  // protocol of the inverter; null: none is addressed
  std::int32_t inverter_charge_mA = 0;       // maximum limit that may be sent
  std::int32_t inverter_discharge_mA = 0;    // likewise
  std::int32_t inverter_charge_voltage_mV = 0;
  std::int32_t inverter_discharge_voltage_mV = 0;  // minimum
  bool is_soc_known = false;                       // without it no charge is requested from the inverter
  const ModuleDriver* modules = nullptr;           // protocol of modules of another maker; null: bmud's own
  ModuleOptions module_options;
  std::uint32_t module_round = 0;                // of the polls in progress
  std::optional<std::int32_t> bleed_above_uV{};  // to be sent by this tick's decision
  bool may_stay_closed = false;                  // this tick's permission
  ContactorOutputs decided;                      // this tick's outputs
};

[[nodiscard]] GateVerdict judge_output(Port port, const CanFrame& frame, const GateRules& rules);

/// The CONTACTOR_COMMAND frame for these outputs.
[[nodiscard]] CanFrame contactor_command_frame(const ContactorOutputs& outputs, std::uint8_t counter);
[[nodiscard]] ContactorOutputs outputs_of(const CanFrame& contactor_command);

}  // namespace bmu
