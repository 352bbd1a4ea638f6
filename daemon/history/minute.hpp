// One minute of a pack, as the loop's thread hands it over: of every quantity that is measured the mean, the lowest and
// the highest of the minute's own samples, and how many there were; what is known at its end; what flowed in it.
//
// What was not measured has no samples, and nothing stands for it. All of it is of fixed size: filling it and copying
// it takes no memory. A minute is what the configuration says (history/period_s), counted from the full minutes of the
// wall clock where that is known.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "daemon/core/core.hpp"

namespace bmu {

/// Board sensors have a place each, whether they are fitted or not: which are is learned on the way.
inline constexpr std::size_t sensors_per_module_max =
    internal_bus::cell_temperatures_per_module_max + internal_bus::board_temperatures_per_module;
inline constexpr std::size_t sensors_max = modules_max * sensors_per_module_max;

/// Unless there are samples the numbers mean nothing.
struct SampledValue {
  std::int32_t average = 0;
  std::int32_t min = 0;
  std::int32_t max = 0;
  std::uint32_t samples = 0;

  friend bool operator==(const SampledValue&, const SampledValue&) = default;
};

struct CellMinute {
  SampledValue voltage_uV;
  std::optional<std::int32_t> soc_permille;  // at the end of the minute, as the chosen method has it
  std::optional<std::int32_t> health_by_capacity_permille;
  std::optional<std::int32_t> health_by_resistance_permille;
  std::int32_t bled_permille = 0;  // of the minute, in which its resistor was on
};

struct Minute {
  TimePoint began_at{};
  Duration span{};
  Duration uptime{};              // of the daemon, at its end
  std::int64_t unix_time_ms = 0;  // of its beginning; 0: nobody had told the time

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

  // In it.
  Duration closed{};  // both main contactors commanded closed
  std::int64_t charge_out_uAs = 0;
  std::int64_t charge_in_uAs = 0;
  std::int64_t energy_out_mWh = 0;
  std::int64_t energy_in_mWh = 0;
  Duration uncounted{};                       // without a usable current: what flowed then is not in the sums
  std::uint16_t modules_answering_min = 0;    // at its worst
  std::bitset<fault_count> faults_present;    // at any time of it, by FaultId
  std::bitset<fault_count> warnings_present;  //
};
static_assert(std::is_trivially_copyable_v<Minute>, "handed over between threads by copying");

}  // namespace bmu
