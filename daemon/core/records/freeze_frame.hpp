// State of the whole pack at the instant a fault is confirmed; kept with the fault, also over restarts.
//
// Made once per confirmation, from the values known then; an unknown one has no value. No allocation; a few hundred
// bytes are copied.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/vehicle/vehicle_state.hpp"

namespace bmu {

/// State of the pack at one instant; a quantity that was unknown then has no value.
struct FreezeFrame {
  std::int64_t unix_time_ms = 0;
  std::int64_t value = 0;      // reading of the fault's row
  std::int64_t threshold = 0;  // threshold that it was compared with
  Element element;
  Phase phase = Phase::open;
  std::optional<PackMode> mode;
  std::optional<std::int32_t> cell_voltage_min_uV;
  std::optional<std::int32_t> cell_voltage_max_uV;
  std::optional<std::int32_t> cell_voltage_average_uV;
  Element cell_voltage_min_at;
  Element cell_voltage_max_at;
  std::optional<std::int32_t> cell_voltage_sum_mV;
  std::optional<std::int32_t> module_voltage_sum_mV;
  std::optional<std::int32_t> cell_temperature_min_dC;
  std::optional<std::int32_t> cell_temperature_max_dC;
  std::optional<std::int32_t> cell_temperature_average_dC;
  Element cell_temperature_min_at;
  Element cell_temperature_max_at;
  std::optional<std::int32_t> board_temperature_min_dC;
  std::optional<std::int32_t> board_temperature_max_dC;
  Element board_temperature_min_at;
  Element board_temperature_max_at;
  std::optional<std::int32_t> pack_voltage_mV;
  std::optional<std::int32_t> link_voltage_mV;
  std::optional<std::int32_t> link_time_constant_ms;  // of the discharging DC link of an open pack
  std::optional<std::int32_t> current_mA;
  std::optional<std::int32_t> current_2_mA;  // of the second sensor
  std::optional<std::int32_t> soc_permille;
  std::optional<std::int32_t> insulation_Ohm;
  std::int32_t discharge_limit_mA = 0;
  std::int32_t charge_limit_mA = 0;
  std::optional<std::int32_t> discharge_overload_permille;  // share of the peak that is used
  std::optional<std::int32_t> charge_overload_permille;
  std::optional<ContactorOutputs> outputs;  // commanded before the reaction to this fault
  std::optional<PduState> inputs;           // auxiliary contacts, inputs, insulation monitor, throttle

  friend bool operator==(const FreezeFrame&, const FreezeFrame&) = default;
};

/// Known values and decisions at that instant.
struct FreezeSources {
  TimePoint now{};
  std::int64_t unix_time_ms{};
  const CoreConfig& config;
  const FaultState& fault;
  const PackState& pack;
  const SensorTable& sensors;
  const CurrentLimits& limits;
  std::optional<std::int32_t> soc_permille;
  const OverloadCounter& overload;
  ContactorOutputs outputs;
  Phase phase = Phase::open;
  PackMode mode = PackMode::open;
  std::optional<Duration> link_time_constant{};
};

[[nodiscard]] FreezeFrame freeze(const FreezeSources& from);

}  // namespace bmu
