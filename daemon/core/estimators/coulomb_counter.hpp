// State of charge by counting current, started from the open-circuit voltage of a pack at rest.
//
//   SOC(t) = SOC(0) - (1/C) * integral of I dt                            (FS_4, without losses for now)
//
// The sums are exact integers, so that a month of counting drifts only as far as the sensor does. SOC never steps: it
// is set once, by a rest long enough, and from then on only counted. A hole in the current longer than the sensor's age
// limit is not bridged by a guess; it is remembered as uncounted time.
#pragma once

#include <cstdint>

#include "daemon/core/core_config.hpp"
#include "daemon/core/measured.hpp"

namespace bmu {

struct ChargeState {
  std::int64_t flowed_uAs = 0;              // out of the pack since the first sample, whether or not SOC is known
  bool is_started = false;                  // false: every number of charge below is meaningless
  std::int64_t depth_of_discharge_uAs = 0;  // may exceed the capacity, and be negative after overcharge
  std::int32_t soc_permille = 0;            // 0 to 1000
  std::int64_t energy_in_mWh = 0;           // since start
  std::int64_t energy_out_mWh = 0;
  Duration uncounted{};  // time without a usable current since the SOC was started
};

/// SOC of a rested cell from its voltage, by linear interpolation; the ends are flat.
[[nodiscard]] std::int32_t soc_permille_from_ocv(const CellModel& cell, std::int32_t ocv_uV);

class CoulombCounter {
 public:
  void init(const CoreConfig& config);

  /// Every current sample as it arrives, with the pack voltage known at that moment (unknown: energy is not counted).
  void observe(const Measured<std::int32_t>& current_mA, const Measured<std::int32_t>& pack_voltage_mV);
  /// Once a tick while nothing is started: watches for a rest and starts from it. True when this call started it.
  [[nodiscard]] bool update(TimePoint now, bool contactors_open, const Measured<std::int32_t>& current_mA,
                            const Measured<std::int32_t>& cell_voltage_average_uV);

  [[nodiscard]] const ChargeState& state() const { return state_; }

 private:
  void count(std::int64_t mean_mA, Duration span);
  void count_energy(std::int64_t mean_mA, std::int64_t voltage_mV, Duration span);

  CellModel cell_;
  SocConfig config_;
  Duration gap_max_{};
  ChargeState state_;
  Measured<std::int32_t> last_mA_;
  std::int64_t charge_rest_ = 0;     // mA * ns, not yet a whole uAs
  std::int64_t started_at_uAs_ = 0;  // what had flowed when depth_of_discharge_uAs was nothing
  std::int64_t energy_in_rest_ = 0;  // mV * mA * us, not yet a whole mWh
  std::int64_t energy_out_rest_ = 0;
  TimePoint resting_since_{};
};

}  // namespace bmu
