#include "daemon/core/contactors/precharge_guard.hpp"

#include <algorithm>

namespace bmu {

namespace {

constexpr std::int64_t us_per_s = 1'000'000;

std::int64_t to_us(Duration span) {
  return std::chrono::duration_cast<std::chrono::microseconds>(span).count();
}

/// mV * mV / Ohm is uW.
std::int64_t energy_uJ(std::int64_t across_mV, std::int64_t resistance_Ohm, Duration span) {
  return across_mV * across_mV / resistance_Ohm * to_us(span) / us_per_s;
}

}  // namespace

void PrechargeGuard::init(const ContactorConfig& config) {
  *this = {};
  config_ = config;
  budget_uJ_ = config.precharge_resistance_Ohm > 0 ? std::int64_t{config.precharge_energy_J} * 1'000'000 : 0;
}

void PrechargeGuard::update(TimePoint now, bool is_precharging, bool is_measured, std::int32_t pack_mV,
                            std::int32_t link_mV) {
  const Duration span = updated_at_ == TimePoint{} ? Duration{} : std::min<Duration>(now - updated_at_, 1s);
  updated_at_ = now;
  if (budget_uJ_ == 0) return;
  if (!was_precharging_) this_try_uJ_ = 0;
  if (was_precharging_ && !is_precharging) last_try_uJ_ = this_try_uJ_;
  was_precharging_ = is_precharging;
  // The rate is not rounded down to zero, which would never cool in short ticks: a budget of joules, a time of seconds.
  const std::int64_t cooled_uJ =
      budget_uJ_ / std::max<std::int64_t>(to_ms(config_.precharge_cool_down), 1) * to_ms(span);
  // If the voltages are unknown, all of the pack voltage counts: the resistor may be warmer than measured.
  const std::int64_t across_mV = is_measured ? std::int64_t{pack_mV} - link_mV : pack_mV;
  const std::int64_t heated_uJ =
      is_precharging ? energy_uJ(across_mV, config_.precharge_resistance_Ohm, span) : std::int64_t{0};
  this_try_uJ_ += heated_uJ;
  heat_uJ_ = std::max<std::int64_t>(heat_uJ_ + heated_uJ - cooled_uJ, 0);
}

void PrechargeGuard::restore(const PrechargeMemory& memory) {
  tries_failed_ = memory.tries_failed;
  if (budget_uJ_ == 0) return;
  heat_uJ_ = std::max<std::int64_t>(memory.heat_uJ, 0);
  last_try_uJ_ = std::max<std::int64_t>(memory.last_try_uJ, 0);
}

PrechargeMemory PrechargeGuard::memory(bool is_precharging) const {
  if (!is_precharging) return {heat_uJ_, last_try_uJ_, tries_failed_};
  const auto tries = static_cast<std::uint8_t>(std::min(tries_failed_ + 1, int{config_.precharge_tries}));
  return {std::max(heat_uJ_, budget_uJ_), budget_uJ_, tries};
}

PrechargeFailure PrechargeGuard::note_end(PrechargeFailure failure) {
  is_retrying_ = false;
  if (failure == PrechargeFailure::none) tries_failed_ = 0;
  if (failure != PrechargeFailure::too_slow) return failure;
  ++tries_failed_;
  is_retrying_ = tries_failed_ < config_.precharge_tries;
  if (is_retrying_) return PrechargeFailure::none;
  tries_failed_ = 0;
  return failure;
}

void PrechargeGuard::forget_tries() {
  tries_failed_ = 0;
  is_retrying_ = false;
}

bool PrechargeGuard::is_cool() const {
  // An attempt that used the whole budget, or more, may be repeated from cold: it ends at the budget.
  return heat_uJ_ + std::min(last_try_uJ_, budget_uJ_) <= budget_uJ_;
}

}  // namespace bmu
