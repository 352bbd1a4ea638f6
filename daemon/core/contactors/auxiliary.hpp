// Fan, heater, and the line that lets the motor controller work (BMU_15, RR_4).
//
// Fan: from `fan_on` at the hottest cell until it is back at `fan_off`. Heater: from `heater_on` at the coldest cell
// until `heater_off`; never with a cell that is hot, and never a pack whose temperatures are not all known. Either
// stops after its longest run and stays off for a pause: what has not helped by then is broken. Runs with gaps between
// them count together; a gap gives back its share of the pause, so that one as long as the pause gives back all.
//
// Motor controller: on while the pack is closed and may be discharged, and, where there is a throttle, from its "on"
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
  bool may_run = false;    // the daemon is neither ending nor resting, and knows its lines
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
  /// Something that may run for so long at once.
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
