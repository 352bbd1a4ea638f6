#include "daemon/core/plausibility/charger_watch.hpp"

#include <algorithm>
#include <cstdlib>

namespace bmu {

namespace {

/// Current into the pack; the sensor counts the current out of it. The minimum of the type becomes its maximum.
std::int32_t into(std::int32_t current_mA) {
  return static_cast<std::int32_t>(std::min<std::int64_t>(-std::int64_t{current_mA}, INT32_MAX));
}

std::int32_t tolerance(std::int32_t of, std::int32_t permille, std::int32_t least) {
  return std::max(least, static_cast<std::int32_t>(std::int64_t{of} * permille / 1'000));
}

/// Compares two sensors of one voltage, with the tolerance of each, which includes the losses in the wires between
/// them.
bool is_another_voltage(const Measured<std::int32_t>& told_mV, const Measured<std::int32_t>& pack_mV) {
  if (!told_mV.is_valid() || !pack_mV.is_valid()) return false;
  const std::int32_t allowed_mV =
      2 * tolerance(pack_mV.value, ChargerWatch::voltage_tolerance_permille, ChargerWatch::voltage_tolerance_min_mV);
  return std::abs(std::int64_t{told_mV.value} - pack_mV.value) > allowed_mV;
}

}  // namespace

void ChargerWatch::update(const ChargerWatchInputs& in) {
  if (!in.table->is_there()) return;
  is_plugged_in_ = in.is_plugged_in;
  look_for_silence(in);
  follow_asked(in);
  look_for_excess(in);
  look_for_contradiction(in);
  look_for_mirror(in);
}

void ChargerWatch::look_for_silence(const ChargerWatchInputs& in) {
  if (!in.is_plugged_in) {
    charging_units_ = 0;
    silent_unit_ = 0;
    return;
  }
  silent_unit_ = 0;
  for (std::size_t index = 0; index < in.table->unit_count(); ++index) {
    const auto bit = static_cast<std::uint16_t>(1U << index);
    const bool talks = in.table->is_talking(index, in.now);
    if (talks && in.is_enabled) charging_units_ |= bit;
    if (talks && !in.is_enabled) charging_units_ &= static_cast<std::uint16_t>(~bit);
    const bool has_gone = !talks && (charging_units_ & bit) != 0;
    if (has_gone && silent_unit_ == 0) silent_unit_ = static_cast<std::uint8_t>(index + 1);
  }
}

/// Keeps the maximum of each span: a command older than the settling time is discarded, and none earlier.
void ChargerWatch::follow_asked(const ChargerWatchInputs& in) {
  const std::int32_t asked_mA = in.is_enabled ? in.asked_mA : 0;
  const Duration length = in.table->driver().settle / spans;
  if (in.now - span_began_at_ > in.table->driver().settle * 2) {
    most_mA_.fill(asked_mA);
    span_began_at_ = in.now;
  }
  for (; in.now - span_began_at_ >= length; span_began_at_ += length) {
    span_ = (span_ + 1) % most_mA_.size();
    most_mA_[span_] = asked_mA;
  }
  most_mA_[span_] = std::max(most_mA_[span_], asked_mA);
  const bool is_other =
      std::abs(asked_mA - steady_mA_) > tolerance(steady_mA_, tolerance_permille, current_tolerance_min_mA);
  if (!in.is_enabled || is_other || steady_since_ == TimePoint{}) {
    steady_mA_ = asked_mA;
    steady_since_ = in.now;
  }
  if (in.is_enabled) stopped_since_ = {};
  if (in.is_enabled || stopped_since_ != TimePoint{}) return;
  stopped_since_ = in.now;
  stopped_from_mA_ = ceiling_mA();
}

void ChargerWatch::count_told(const Measured<std::int32_t>& told, std::int32_t most_mA, TimePoint now) {
  if (!told.is_valid() || told.value <= most_mA) {
    told_over_ = 0;
    return;
  }
  // The oldest part of the sum is newer than the last counted sum: every unit has reported since.
  if (told.taken_at <= told_over_at_) return;
  told_over_at_ = now;
  if (told_over_ < told_over_min) ++told_over_;
}

/// Maximum current after a stop: any at first, then less than was commanded, and finally none. `least_mA`: current that
/// counts as none.
std::int32_t ChargerWatch::stopped_max_mA(const ChargerWatchInputs& in, std::int32_t least_mA) const {
  const Duration settle = in.table->driver().settle;
  const Duration since = in.now - stopped_since_;
  if (since > settle) return least_mA;
  if (since <= begins_within(settle)) return INT32_MAX;
  return std::max(least_mA, static_cast<std::int32_t>(std::int64_t{stopped_from_mA_} * unbegun_permille / 1'000));
}

void ChargerWatch::look_for_excess(const ChargerWatchInputs& in) {
  const Measured<std::int32_t>& sensed = in.pack->current_mA;
  const Measured<std::int32_t> told = in.table->current_mA(in.now);
  const std::int32_t into_mA = sensed.is_valid() ? into(sensed.value) : 0;
  const std::int32_t told_mA = told.is_valid() ? told.value : 0;
  const bool is_asked = stopped_since_ == TimePoint{};
  const std::int32_t current_max_mA =
      ceiling_mA() + tolerance(ceiling_mA(), tolerance_permille, current_tolerance_min_mA);
  // Each unit has its own error.
  const auto units = static_cast<std::int32_t>(std::max<std::size_t>(in.table->unit_count(), 1));
  const std::int32_t told_max_mA =
      ceiling_mA() + tolerance(ceiling_mA(), tolerance_permille, units * current_tolerance_min_mA);
  count_told(told, is_asked ? told_max_mA : stopped_max_mA(in, units * stopped_mA), in.now);
  // If a vehicle may brake, the sensor and the chargers must agree.
  keeps_on_ = in.is_alone ? !is_asked && into_mA > stopped_max_mA(in, stopped_mA)
                          : !is_asked && into_mA > stopped_mA && told_over_ >= told_over_min;
  const bool can_sensor_judge = in.is_alone && sensed.is_valid();
  const bool is_sensed = can_sensor_judge && into_mA > current_max_mA;
  const bool is_told = told_mA > told_max_mA && (!can_sensor_judge || told_over_ >= told_over_min);
  const Measured<std::int32_t> voltage = in.table->voltage_mV(in.now);
  const std::int32_t voltage_max_mV =
      in.asked_mV + tolerance(in.asked_mV, voltage_tolerance_permille, voltage_tolerance_min_mV);
  const bool is_current = is_asked && (is_sensed || is_told);
  const bool is_voltage = voltage.is_valid() && voltage.value > voltage_max_mV;
  runs_away_ = in.is_plugged_in && (is_current || is_voltage);
  const bool is_by_voltage = is_voltage && !is_current;
  runs_away_at_ = is_by_voltage ? voltage.taken_at : is_sensed ? sensed.taken_at : told.taken_at;
  if (!runs_away_) return;
  excess_ = {.is_voltage = is_by_voltage,
             .given = is_by_voltage ? voltage.value
                      : is_sensed   ? into_mA
                                    : told_mA,
             .asked = is_by_voltage ? in.asked_mV : ceiling_mA(),
             .allowed = is_by_voltage ? voltage_max_mV
                        : is_sensed   ? current_max_mA
                                      : told_max_mA};
}

/// Compares reports and sensor while a steady current is commanded, or after a stop. Loads beside the charger may take
/// part of its current, but hardly half of it.
void ChargerWatch::look_for_contradiction(const ChargerWatchInputs& in) {
  const Measured<std::int32_t>& sensed = in.pack->current_mA;
  const Measured<std::int32_t> told = in.table->current_mA(in.now);
  const Duration patience = in.table->driver().settle + in.table->silence_max();
  const bool has_stopped = stopped_since_ != TimePoint{} && in.now - stopped_since_ > patience;
  contradicts_ = has_stopped && told.is_valid() && told.value > stopped_mA;
  const bool is_settled = in.is_enabled && in.now - steady_since_ > patience;
  if (!is_settled) return;
  contradicts_ = is_another_voltage(in.table->voltage_mV(in.now), in.pack->pack_voltage_mV);
  if (!in.is_alone || !sensed.is_valid() || !told.is_valid()) return;
  const std::int32_t allowed_mA = tolerance(told.value, tolerance_permille, current_tolerance_min_mA);
  const bool tells_less = into(sensed.value) > told.value + 2 * allowed_mA;
  const bool tells_more = into(sensed.value) < told.value / 2 - 2 * allowed_mA;
  contradicts_ = contradicts_ || tells_less || tells_more;
}

void ChargerWatch::look_for_mirror(const ChargerWatchInputs& in) {
  const Measured<std::int32_t>& sensed = in.pack->current_mA;
  const Measured<std::int32_t> told = in.table->current_mA(in.now);
  if (!in.is_plugged_in || !in.is_alone || !sensed.is_valid() || !told.is_valid()) return;
  const bool is_much = told.value > stopped_mA && sensed.value > stopped_mA;
  const std::int32_t allowed_mA = tolerance(told.value, tolerance_permille, current_tolerance_min_mA);
  if (is_much && std::abs(sensed.value - told.value) <= allowed_mA) mirrored_at_ = in.now;
}

}  // namespace bmu
