// The one door everything sent passes, and which can say no: only messages that are ours to send, in their right form,
// and never a contactor command that closes more than the decision of this tick allows, nor a charger's that asks for
// more, nor a word to the inverter that lets more flow or asks for a charge where none may be, nor one that stops or
// changes the current sensor while it is needed, nor one to modules that bleeds what this tick did not decide to bleed.
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
  not_ours,       // no such message, or not one of the master's, on this bus
  malformed,      // wrong length, checksum or complement
  not_permitted,  // a word to contactors, charger or inverter that goes beyond what was decided
};

[[nodiscard]] std::string_view to_text(GateVerdict verdict);

struct GateRules {
  std::uint16_t vehicle_base_id = vehicle_bus::default_base_id;
  VehicleDialect dialect = VehicleDialect::iha;
  std::optional<std::uint16_t> reply_id{};    // of answers to requests for data, if they are given
  std::uint16_t cell_voltages_id = 0;         // of the cyclic cell data; 0: none is sent
  std::uint16_t cell_temperatures_id = 0;     // likewise
  const SensorSetUpDriver* sensor = nullptr;  // whose settings may be asked; null: nobody's
  bool may_configure_sensor = false;          // stopped and given others; what is read and started may always be
  bool may_store_in_sensor = false;
  std::uint32_t second_sensor_command_id = 0;  // where a second one may be asked for its settings; 0: nowhere
  const ChargerDriver* charger = nullptr;      // what chargers speak; null: none is told anything
  MasterAddress master_address = MasterAddress::f4;
  bool may_charge = false;                     // and is to, by this tick's decision
  bool may_request_mains = false;              // from a charging post
  std::int32_t charge_current_mA = 0;          // the most that all units together may be asked for
  std::span<const std::int32_t> ordered_mA{};  // what each unit was asked for last: as many as there are
  std::int32_t charge_voltage_mV = 0;
  const InverterDriver* inverter = nullptr;  // what the inverter speaks; null: none is told anything
  std::int32_t inverter_charge_mA = 0;       // the most it may be allowed
  std::int32_t inverter_discharge_mA = 0;    // likewise
  std::int32_t inverter_charge_voltage_mV = 0;
  std::int32_t inverter_discharge_voltage_mV = 0;  // no further down
  bool is_soc_known = false;                       // without it no inverter is asked for a charge
  const ModuleDriver* modules = nullptr;           // what foreign modules speak; null: they are ours
  ModuleOptions module_options;
  std::uint32_t module_round = 0;                // of the questions that are being asked
  std::optional<std::int32_t> bleed_above_uV{};  // what they are to be told by this tick's decision
  bool may_stay_closed = false;                  // this tick's permission
  ContactorOutputs decided;                      // this tick's outputs
};

[[nodiscard]] GateVerdict judge_output(Port port, const CanFrame& frame, const GateRules& rules);

/// The CONTACTOR_COMMAND that says this.
[[nodiscard]] CanFrame contactor_command_frame(const ContactorOutputs& outputs, std::uint8_t counter);
[[nodiscard]] ContactorOutputs outputs_of(const CanFrame& contactor_command);

}  // namespace bmu
