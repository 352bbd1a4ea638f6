#include "daemon/core/contactors/auxiliary.hpp"

#include <algorithm>

namespace bmu {

void Auxiliary::Runner::count(Duration span, Duration run_max, Duration pause) {
  if (is_on) {
    has_run += span;
    return;
  }
  const double share = span < pause ? static_cast<double>(span.count()) / static_cast<double>(pause.count()) : 1.0;
  const auto given_back = Duration{static_cast<Duration::rep>(share * static_cast<double>(run_max.count()))};
  has_run = std::max(has_run - given_back, Duration{});
}

void Auxiliary::Runner::step(bool wants, TimePoint now, Duration run_max, Duration pause) {
  count(now - stepped_at, run_max, pause);
  stepped_at = now;
  if (is_pausing && now - paused_at >= pause) {
    is_pausing = false;
    has_run = {};
  }
  if (!is_pausing && has_run >= run_max) {
    is_pausing = true;
    paused_at = now;
  }
  is_on = wants && !is_pausing;
}

AuxiliaryOutputs Auxiliary::step(const AuxiliaryInputs& in) {
  const Spread& cells = in.cell_temperature_dC;
  const bool fan_wanted = cells.is_known() && cells.max >= (fan_.is_on ? config_.fan_off_dC + 1 : config_.fan_on_dC);
  fan_.step(in.may_run && fan_wanted, in.now, config_.fan_run_max, config_.pause);

  const bool is_cold = cells.min <= (heater_.is_on ? config_.heater_off_dC - 1 : config_.heater_on_dC);
  const bool heating_wanted = cells.is_complete() && is_cold && cells.max < config_.heater_hot_dC;
  heater_.step(in.may_run && heating_wanted, in.now, config_.heater_run_max, config_.pause);

  const bool has_throttle = config_.throttle_on_permille > 0;
  const std::int32_t from_permille = is_enabled_ ? config_.throttle_off_permille : config_.throttle_on_permille;
  const bool is_throttle_up = in.throttle_permille.is_valid() && in.throttle_permille.value >= from_permille;
  is_enabled_ = in.may_drive && (!has_throttle || is_throttle_up);
  return {.motor_enable = is_enabled_, .fan = fan_.is_on, .heater = heater_.is_on};
}

}  // namespace bmu
