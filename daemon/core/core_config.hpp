// Everything the core is told about a pack, once, before the first observation. Filled by config/pack_config.* from a
// JSON file and already valid when it arrives here; units are those of the names, whatever the file used.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "protocol/fixed_vector.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// A decision is due every so often; the worst that an observation waits for one.
inline constexpr Duration tick_period = 10ms;

inline constexpr std::size_t modules_max = internal_bus::node_count_max;
inline constexpr std::size_t cells_max = modules_max * internal_bus::cells_per_module_max;

struct ModuleConfig {
  std::uint8_t node = 1;                      // 1 to 63, unique
  std::uint8_t cell_count = 12;               // 1 to 12
  std::uint8_t temperature_sensor_count = 4;  // cell sensors, 0 to 4; at least one in the whole pack
};

struct OcvPoint {
  std::int32_t soc_permille = 0;
  std::int32_t ocv_uV = 0;
};

/// A cell (or parallel block of cells): what the maker's data and our measurements say about it.
struct CellModel {
  FixedVector<OcvPoint, 64> ocv;  // at least two points from 0 to 1000 permille, both columns strictly rising
  std::int64_t capacity_uAs = 0;
  double series_resistance_Ohm = 0.0;  // what a current step shows at once
  double rc_resistance_Ohm = 0.0;      // one relaxation pair behind it
  double rc_time_constant_s = 0.0;
  double heat_capacity_J_per_K = 0.0;
  double heat_transfer_W_per_K = 0.0;  // to the surrounding air
  // The maker's absolute limits. Limits of the pack outside these are refused when the file is read.
  std::int32_t voltage_min_uV = 0;
  std::int32_t voltage_max_uV = 0;
  std::int32_t temperature_min_dC = 0;
  std::int32_t temperature_max_dC = 0;
};

/// One watched limit. `warn` is reported and derates; `open` is the fault. Reaching a threshold counts as exceeding it.
/// For lower limits warn > open, for upper limits warn < open. The unit is the one of the fault's row.
struct LimitConfig {
  std::int32_t warn = 0;
  std::int32_t open = 0;
  std::int32_t hysteresis = 0;  // how far back behind a threshold a value must be before it counts as good again
  Duration confirm = 150ms;     // how long, and over at least two samples, before the fault is believed
  Duration clear = 1s;          // how long good, before the cause counts as gone
};

struct LimitsConfig {
  LimitConfig cell_undervoltage;      // uV
  LimitConfig cell_overvoltage;       // uV
  LimitConfig cell_overtemperature;   // dC
  LimitConfig cell_undertemperature;  // dC
  LimitConfig discharge_overcurrent;  // mA out of the pack
  LimitConfig charge_overcurrent;     // mA into the pack, as a positive number
  LimitConfig pack_voltage_mismatch;  // mV between the sum of cells and the pack voltage
};

/// How old each signal may be. Older is stale, and stale is never good. Nominal periods stand in the rows of
/// protocol/tables/internal_bus.hpp.
struct AgeConfig {
  Duration cell_voltage = 300ms;
  Duration temperature = 350ms;
  Duration module_status = 300ms;
  Duration pack_current = 200ms;
  Duration pack_voltage = 250ms;  // and the link voltage
  Duration pdu_status = 200ms;
};

struct CurrentLimitConfig {
  std::int32_t discharge_continuous_mA = 0;
  std::int32_t charge_continuous_mA = 0;
};

struct PollConfig {
  Duration period = 100ms;
  std::uint8_t temperature_every = 1;  // temperatures in every n-th poll
};

struct ContactorConfig {
  Duration settle = 100ms;            // after a contactor was commanded, before the next step
  Duration feedback_timeout = 300ms;  // auxiliary contact against command
  Duration precharge_timeout = 3s;
  std::int32_t precharge_done_permille = 950;   // link voltage of pack voltage
  std::int32_t precharge_current_max_mA = 500;  // and the current has fallen to this
};

struct SensorConfig {
  bool little_endian = false;
  bool invert_current = false;  // when the sensor counts charging as positive
};

struct SocConfig {
  std::int32_t rest_current_mA = 200;  // below this, contactors open, the open-circuit voltage may start the SOC
  Duration rest = 1s;                  // for this long
};

struct VehicleConfig {
  std::uint16_t base_id = vehicle_bus::default_base_id;
  std::array<char, 8> name{'B', 'M', 'U', 'D', ' ', ' ', ' ', ' '};     // 620h
  std::array<char, 8> version{'S', 'W', ':', ' ', '0', '.', '1', '0'};  // 621h
};

struct CoreConfig {
  FixedVector<ModuleConfig, modules_max> modules;  // in the order of their cells' numbers in the pack
  CellModel cell;
  LimitsConfig limits;
  AgeConfig ages;
  CurrentLimitConfig current;
  PollConfig poll;
  ContactorConfig contactors;
  SensorConfig sensor;
  SocConfig soc;
  VehicleConfig vehicle;
  std::uint64_t hash = 0;  // of the file's bytes: in the log, the status and every recording
};

/// Cells of the whole pack.
[[nodiscard]] constexpr std::size_t cell_count(const CoreConfig& config) {
  std::size_t count = 0;
  for (const ModuleConfig& module : config.modules) count += module.cell_count;
  return count;
}

/// What a change of current shows at once, over all cells.
[[nodiscard]] inline std::int64_t pack_resistance_uOhm(const CoreConfig& config) {
  return std::llround(config.cell.series_resistance_Ohm * 1e6) * static_cast<std::int64_t>(cell_count(config));
}

}  // namespace bmu
