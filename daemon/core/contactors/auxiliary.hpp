// Control of the fan, the heater and the output that enables the motor controller (BMU_15, RR_4).
//
// Fan: on from `fan_on` at the hottest cell until it is back at `fan_off`. Heater: on from `heater_on` at the coldest
// cell until `heater_off`; never with a hot cell, and never unless all cell temperatures are known. Either stops after
// its maximum run time and stays off for a pause: a device that has not helped by then is defective. Runs with gaps
// between them count together; a gap gives back its share of the pause, so that one as long as the pause gives back
// all.
//
// Motor controller: enabled while the pack is closed and may be discharged, and, if there is a throttle, from its "on"
// share until it is below its "off" share.
#pragma once

#include <cstdint>

#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/signal.hpp"

namespace bmu {

struct AuxiliaryInputs {
  TimePoint now{};
  bool may_drive = false;  // closed, and discharging is allowed
  bool may_run = false;    // the daemon is neither shutting down nor asleep
  Spread cell_temperature_dC;
  SignalValue throttle_permille;
};

struct AuxiliaryOutputs {
  bool motor_enable = false;
  bool fan = false;
  bool heater = false;
};

class Auxiliary {
 public:
  void init(const AuxiliaryConfig& config) { config_ = config; }
  AuxiliaryOutputs step(const AuxiliaryInputs& in);

 private:
  /// Device with a limited run time.
  struct Runner {
    bool is_on = false;
    bool is_pausing = false;
    Duration has_run{};
    TimePoint stepped_at{};
    TimePoint paused_at{};

    void count(Duration span, Duration run_max, Duration pause);
    void step(bool wants, TimePoint now, Duration run_max, Duration pause);
  };

  AuxiliaryConfig config_;
  Runner fan_;
  Runner heater_;
  bool is_enabled_ = false;
  BMU_FIELDS(skipped(config_), fan_, heater_, is_enabled_)
};

}  // namespace bmu
