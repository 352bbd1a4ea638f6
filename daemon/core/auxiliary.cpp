#include "daemon/core/auxiliary.hpp"

namespace bmu {

void Auxiliary::Runner::step(bool wants, TimePoint now, Duration run_max, Duration pause) {
  if (is_pausing && now - changed_at >= pause) is_pausing = false;
  const bool is_too_long = is_on && now - changed_at >= run_max;
  const bool next = wants && !is_pausing && !is_too_long;
  if (next == is_on) return;
  is_pausing = is_pausing || is_too_long;
  is_on = next;
  changed_at = now;
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
