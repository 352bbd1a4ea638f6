// The whole pack at the instant a fault is believed: what is kept with the fault, over restarts too.
//
// Made once for a confirmation, of what is known then; what is not known has no value. No allocation; a few hundred
// bytes are copied.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/vehicle/vehicle_state.hpp"

namespace bmu {

/// The pack at one instant; what was not known then has no value.
struct FreezeFrame {
  std::int64_t unix_time_ms = 0;
  std::int64_t value = 0;      // what the fault's row read
  std::int64_t threshold = 0;  // and what it was held against
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
  std::optional<std::int32_t> link_time_constant_ms;  // of the link of an open pack that falls
  std::optional<std::int32_t> current_mA;
  std::optional<std::int32_t> current_2_mA;  // of the second sensor
  std::optional<std::int32_t> soc_permille;
  std::optional<std::int32_t> insulation_Ohm;
  std::int32_t discharge_limit_mA = 0;
  std::int32_t charge_limit_mA = 0;
  std::optional<std::int32_t> discharge_overload_permille;  // used of the peak
  std::optional<std::int32_t> charge_overload_permille;
  std::optional<ContactorOutputs> outputs;  // commanded, before this fault had a say
  std::optional<PduState> inputs;           // auxiliary contacts, inputs, insulation monitor, throttle

  friend bool operator==(const FreezeFrame&, const FreezeFrame&) = default;
};

/// What is known and decided at that instant.
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
