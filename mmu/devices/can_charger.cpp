#include "mmu/devices/can_charger.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

/// A charger reduces its current from this share of its voltage below it on.
constexpr double fade_share = 0.002;

}  // namespace

void CanChargers::observe(const CanFrame& frame, TimePoint now) {
  const bool is_deaf = (troubles & bit_of(ChargerTrouble::no_command)) != 0;
  if (!is_there() || is_deaf) return;
  const std::optional<ChargerCommand> command = driver_->order_of(frame);
  if (!command || command->unit >= unit_count_ || !is_live(command->unit)) return;
  Unit& unit = units_[command->unit];
  const bool is_cleared = unit.order.clears_errors && !command->order.clears_errors;
  unit.order = command->order;
  unit.told_at = now;
  if (is_cleared) unit.latched &= driver_->supply_troubles;
}

std::uint16_t CanChargers::causes(const Unit& unit, TimePoint now) const {
  constexpr std::uint16_t no_command = bit_of(ChargerTrouble::no_command);
  const bool has_waited = now - std::max(unit.told_at, unit.live_at) > driver_->command_life;
  return static_cast<std::uint16_t>((troubles & ~no_command) | (has_waited ? no_command : 0));
}

void CanChargers::follow_mains(std::size_t index, TimePoint now) {
  Unit& unit = units_[index];
  if (is_live(index)) {
    unit.latched |= static_cast<std::uint16_t>(causes(unit, now) & driver_->latched_troubles);
  } else {
    unit = {.live_at = now};
  }
}

bool CanChargers::is_told(const Unit& unit, TimePoint now) const {
  return unit.told_at != TimePoint{} && now - unit.told_at <= driver_->command_life;
}

bool CanChargers::is_fed(TimePoint now) const {
  const auto asks = [this, now](const Unit& unit) { return is_told(unit, now) && unit.order.requests_mains; };
  if (!is_live(0)) return false;
  return !is_post || std::any_of(units_.begin(), units_.begin() + unit_count_, asks);
}

double CanChargers::ordered_A(TimePoint now, double link_V) const {
  double sum_A = 0.0;
  for (std::size_t index = 0; index < unit_count_; ++index) {
    const Unit& unit = units_[index];
    const bool is_stopped = ((causes(unit, now) | unit.latched) & driver_->stopping_troubles) != 0;
    if (!is_told(unit, now) || !unit.order.is_enabled || is_stopped) continue;
    const double left_V = unit.order.voltage_mV * 1e-3 - link_V;
    const double share = std::clamp(left_V / (unit.order.voltage_mV * 1e-3 * fade_share), 0.0, 1.0);
    sum_A += unit.order.current_mA * 1e-3 * share;
  }
  return sum_A;
}

double CanChargers::step(TimePoint now, double rating_A, double link_V, bool obeys, bool ever_less) {
  const double span_s = stepped_at_ == TimePoint{} ? 0.0 : to_s(now - stepped_at_);
  stepped_at_ = now;
  for (std::size_t index = 0; index < unit_count_; ++index) follow_mains(index, now);
  const bool has_power = is_fed(now);
  double wanted_A = has_power ? rating_A : 0.0;
  if (obeys) wanted_A = std::min(wanted_A, ordered_A(now, link_V));
  if (!ever_less) wanted_A = std::max(wanted_A, gives_A_);
  if (!has_power) wanted_A = gives_A_ = 0.0;
  gives_A_ = std::clamp(wanted_A, gives_A_ - fall_A_per_s * span_s, gives_A_ + rise_A_per_s * span_s);
  return gives_A_;
}

ChargerFrames CanChargers::report(TimePoint now, double link_V, double flows_A) {
  if (!is_there() || now < report_at_) return {};
  // All units within a period, one after the other.
  report_at_ += driver_->report_period / unit_count_;
  const std::uint8_t unit = next_unit_;
  next_unit_ = static_cast<std::uint8_t>((next_unit_ + 1) % unit_count_);
  if (!is_live(unit)) return {};
  ChargerReport report;
  report.voltage_mV = known(std::llround(link_V * 1e3));
  report.current_mA = known(std::llround(flows_A * 1e3 / live_count));
  report.mains_voltage_mV = known(is_fed(now) ? 230'000 : 0);
  report.mains_current_mA = known(std::llround(flows_A * link_V / 230.0 * 1e3 / live_count));
  report.temperature_dC = known(350);
  Unit& own = units_[unit];
  report.troubles = causes(own, now) | own.latched;
  const ChargerFrames all = driver_->reports(unit, report);
  if (driver_->slow_period == Duration{}) return all;
  const bool is_slow_due = now >= own.slow_at;
  if (is_slow_due) own.slow_at = now + driver_->slow_period;
  ChargerFrames due;
  for (std::size_t index = 0; index < all.size(); ++index) {
    if (is_slow_due || index < driver_->fast_count) due.push_back(all[index]);
  }
  return due;
}

}  // namespace bmu
