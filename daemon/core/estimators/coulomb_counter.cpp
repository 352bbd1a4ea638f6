#include "daemon/core/estimators/coulomb_counter.hpp"

#include <algorithm>

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

std::int32_t soc_permille_from_ocv(const CellModel& cell, std::int32_t ocv_uV) {
  const auto& table = cell.ocv;
  if (ocv_uV <= table[0].ocv_uV) return table[0].soc_permille;
  for (std::size_t index = 1; index < table.size(); ++index) {
    const OcvPoint& low = table[index - 1];
    const OcvPoint& high = table[index];
    if (ocv_uV > high.ocv_uV) continue;
    const std::int64_t rise = std::int64_t{ocv_uV} - low.ocv_uV;
    const std::int64_t span_permille = high.soc_permille - low.soc_permille;
    return static_cast<std::int32_t>(low.soc_permille +
                                     divide_to_nearest(rise * span_permille, high.ocv_uV - low.ocv_uV));
  }
  return table.back().soc_permille;
}

void CoulombCounter::init(const CoreConfig& config) {
  cell_ = config.cell;
  config_ = config.soc;
  gap_max_ = config.ages.pack_current;
}

void CoulombCounter::observe(const Measured<std::int32_t>& current_mA, const Measured<std::int32_t>& pack_voltage_mV) {
  const Measured<std::int32_t> previous = last_mA_;
  last_mA_ = current_mA;
  if (previous.taken_at == TimePoint{}) return;
  const Duration span = current_mA.taken_at - previous.taken_at;
  if (!current_mA.is_valid() || !previous.is_valid() || span <= 0ns || span > gap_max_) {
    if (state_.is_started && span > 0ns) state_.uncounted += span;
    return;
  }
  const std::int64_t mean_mA = divide_to_nearest(std::int64_t{previous.value} + current_mA.value, 2);
  count(mean_mA, span);
  if (pack_voltage_mV.is_usable(current_mA.taken_at, gap_max_)) count_energy(mean_mA, pack_voltage_mV.value, span);
}

void CoulombCounter::count(std::int64_t mean_mA, Duration span) {
  charge_rest_ += mean_mA * span.count();
  state_.flowed_uAs += carry(charge_rest_, products_per_uAs);
  if (!state_.is_started) return;
  state_.depth_of_discharge_uAs = state_.flowed_uAs - started_at_uAs_;
  const std::int64_t left_uAs = cell_.capacity_uAs - state_.depth_of_discharge_uAs;
  const std::int64_t left_permille = divide_to_nearest(left_uAs * 1000, cell_.capacity_uAs);
  state_.soc_permille = static_cast<std::int32_t>(std::clamp<std::int64_t>(left_permille, 0, 1000));
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

bool CoulombCounter::update(TimePoint now, bool contactors_open, const Measured<std::int32_t>& current_mA,
                            const Measured<std::int32_t>& cell_voltage_average_uV) {
  if (state_.is_started) return false;
  const bool is_resting = contactors_open && current_mA.is_valid() && cell_voltage_average_uV.is_valid() &&
                          current_mA.value <= config_.rest_current_mA && current_mA.value >= -config_.rest_current_mA;
  if (!is_resting) {
    resting_since_ = {};
    return false;
  }
  if (resting_since_ == TimePoint{}) resting_since_ = now;
  if (now - resting_since_ < config_.rest) return false;
  state_.is_started = true;
  state_.soc_permille = soc_permille_from_ocv(cell_, cell_voltage_average_uV.value);
  state_.depth_of_discharge_uAs = cell_.capacity_uAs / 1000 * (1000 - state_.soc_permille);
  started_at_uAs_ = state_.flowed_uAs - state_.depth_of_discharge_uAs;
  return true;
}

}  // namespace bmu
