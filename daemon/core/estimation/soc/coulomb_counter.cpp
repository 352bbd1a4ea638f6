#include "daemon/core/estimation/soc/coulomb_counter.hpp"

namespace bmu {

namespace {

constexpr std::int64_t products_per_uAs = 1'000'000;          // 1 uAs = 1e-6 As; 1 mA * 1 ns = 1e-12 As
constexpr std::int64_t products_per_mWh = 3'600'000'000'000;  // 1 mWh = 3.6 Ws; 1 mV * 1 mA * 1 us = 1e-12 Ws

/// Moves whole units out of `rest` and returns them.
std::int64_t carry(std::int64_t& rest, std::int64_t unit) {
  const std::int64_t whole = rest / unit;
  rest -= whole * unit;
  return whole;
}

}  // namespace

void CoulombCounter::init(const CoreConfig& config) {
  gap_max_ = config.ages.pack_current;
}

void CoulombCounter::observe(const Measured<std::int32_t>& current_mA, const Measured<std::int32_t>& pack_voltage_mV) {
  const Measured<std::int32_t> previous = last_mA_;
  last_mA_ = current_mA;
  state_.counted_until = current_mA.taken_at;
  if (previous.taken_at == TimePoint{}) return;
  const Duration span = current_mA.taken_at - previous.taken_at;
  if (!current_mA.is_valid() || !previous.is_valid() || span <= 0ns || span > gap_max_) {
    if (span > 0ns) state_.uncounted += span;
    return;
  }
  const std::int64_t mean_mA = divide_to_nearest(std::int64_t{previous.value} + current_mA.value, 2);
  count(mean_mA, span);
  if (pack_voltage_mV.is_usable(current_mA.taken_at, gap_max_)) count_energy(mean_mA, pack_voltage_mV.value, span);
}

void CoulombCounter::count(std::int64_t mean_mA, Duration span) {
  const std::int64_t charge = mean_mA * span.count();
  charge_rest_ += charge;
  if (charge >= 0) {
    out_rest_ += charge;
    state_.out_uAs += carry(out_rest_, products_per_uAs);
  } else {
    in_rest_ -= charge;
    state_.in_uAs += carry(in_rest_, products_per_uAs);
  }
  state_.counted += span;
  state_.flowed_uAs += carry(charge_rest_, products_per_uAs);
}

void CoulombCounter::count_energy(std::int64_t mean_mA, std::int64_t voltage_mV, Duration span) {
  const std::int64_t span_us = span.count() / 1000;
  const std::int64_t energy = mean_mA * voltage_mV * span_us;
  if (energy >= 0) {
    energy_out_rest_ += energy;
    state_.energy_out_mWh += carry(energy_out_rest_, products_per_mWh);
  } else {
    energy_in_rest_ -= energy;
    state_.energy_in_mWh += carry(energy_in_rest_, products_per_mWh);
  }
}

}  // namespace bmu
