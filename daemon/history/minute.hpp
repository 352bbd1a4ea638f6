// One minute of a pack, as the loop's thread passes it on: mean, lowest and highest of the minute's own samples of
// every measured quantity, and their number; the state at its end; its throughput.
//
// A quantity that was not measured has no samples, and no substitute. All of it is of fixed size: filling and copying
// it allocates no memory. The length of a minute is configured (history/period_s), counted from the full minutes of the
// wall clock if that is known.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "daemon/core/core.hpp"

namespace bmu {

/// Board sensors have a position each, whether they are fitted or not: that is only determined during operation.
inline constexpr std::size_t sensors_per_module_max =
    internal_bus::cell_temperatures_per_module_max + internal_bus::board_temperatures_per_module;
inline constexpr std::size_t sensors_max = modules_max * sensors_per_module_max;

/// Without samples the numbers are meaningless.
struct SampledValue {
  std::int32_t average = 0;
  std::int32_t min = 0;
  std::int32_t max = 0;
  std::uint32_t samples = 0;

  friend bool operator==(const SampledValue&, const SampledValue&) = default;
};

struct CellMinute {
  SampledValue voltage_uV;
  std::optional<std::int32_t> soc_permille;  // at the end of the minute, by the selected method
  std::optional<std::int32_t> health_by_capacity_permille;
  std::optional<std::int32_t> health_by_resistance_permille;
  std::int32_t bled_permille = 0;  // share of the minute in which its bleed resistor was on
};

struct Minute {
  TimePoint began_at{};
  Duration span{};
  Duration uptime{};              // of the daemon, at its end
  std::int64_t unix_time_ms = 0;  // of its start; 0: the time was unknown

  // By number through the pack; the sensors module by module, those of the cells before those of the board.
  std::size_t cell_count = 0;
  std::size_t sensor_count = 0;
  std::array<CellMinute, cells_max> cells{};
  std::array<SampledValue, sensors_max> temperature_dC{};
  SampledValue current_mA;
  SampledValue pack_voltage_mV;
  SampledValue link_voltage_mV;

  // At its end.
  std::optional<std::int32_t> soc_permille;
  std::optional<std::int32_t> soc_sigma_permille;
  std::optional<std::int32_t> health_by_capacity_permille;
  std::optional<std::int32_t> health_by_resistance_permille;
  std::optional<std::int64_t> pack_resistance_uOhm;
  std::optional<std::int64_t> energy_left_mWh;
  std::optional<std::int64_t> energy_left_sigma_mWh;
  CurrentLimits limits;
  PowerLimits powers;
  Phase phase{};
  PackMode mode{};
  std::optional<PackTotals> totals;

  // Within it.
  Duration closed{};  // both main contactors commanded closed
  std::int64_t charge_out_uAs = 0;
  std::int64_t charge_in_uAs = 0;
  std::int64_t energy_out_mWh = 0;
  std::int64_t energy_in_mWh = 0;
  Duration uncounted{};                       // time without a usable current, which is not in the sums
  std::uint16_t modules_answering_min = 0;    // lowest number in the minute
  std::bitset<fault_count> faults_present;    // at any time of the minute, by FaultId
  std::bitset<fault_count> warnings_present;  //
};
static_assert(std::is_trivially_copyable_v<Minute>, "handed over between threads by copying");

}  // namespace bmu
