#include "mmu/devices/can_inverter.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

/// The inverter reduces its current from this share of a voltage limit before it on.
constexpr double fade_share = 0.005;

/// 1 far from the voltage limit, 0 at it and beyond.
double share_left(double left_V, double limit_V) {
  return limit_V > 0.0 ? std::clamp(left_V / (limit_V * fade_share), 0.0, 1.0) : 1.0;
}

}  // namespace

void CanInverter::observe(const CanFrame& frame, TimePoint now) {
  if (!is_there()) return;
  if (driver_->hear(frame, told_) == BatteryWord::limits) told_at_ = now;
}

double CanInverter::allowed_A(TimePoint now, double link_V) const {
  const bool is_told = told_at_ != TimePoint{} && now - told_at_ <= driver_->battery_life;
  if (!is_told || (driver_->stops_at_alarm && told_.alarms != 0)) return 0.0;
  const double charge_V = told_.charge_voltage_limit_mV * 1e-3;
  const double discharge_V = told_.discharge_voltage_limit_mV * 1e-3;
  const double charge_A =
      told_.may_charge ? told_.charge_limit_mA * 1e-3 * share_left(charge_V - link_V, charge_V) : 0.0;
  const double discharge_A =
      told_.may_discharge ? told_.discharge_limit_mA * 1e-3 * share_left(link_V - discharge_V, discharge_V) : 0.0;
  return std::clamp(demand_A, -charge_A, discharge_A);
}

double CanInverter::step(TimePoint now, double link_V) {
  if (!is_there()) return 0.0;
  const double span_s = stepped_at_ == TimePoint{} ? 0.0 : to_s(now - stepped_at_);
  stepped_at_ = now;
  const double wanted_A = obeys ? allowed_A(now, link_V) : demand_A;
  const bool is_more = std::abs(wanted_A) > std::abs(current_A_);
  const double most_A = (is_more ? rise_A_per_s : fall_A_per_s) * span_s;
  current_A_ = std::clamp(wanted_A, current_A_ - most_A, current_A_ + most_A);
  return current_A_;
}

InverterFrames CanInverter::words(TimePoint now, double link_V) {
  if (!is_there() || now < word_at_) return {};
  word_at_ += driver_->keep_alive_period;
  if (is_silent) return {};
  return driver_->words({.voltage_mV = known(std::llround(link_V * 1e3)),
                         .current_mA = known(std::llround(current_A_ * 1e3)),
                         .temperature_dC = known(250),
                         .has_failed = has_failed});
}

}  // namespace bmu
