#include "daemon/core/measurement/charger_table.hpp"

#include <algorithm>
#include <optional>

namespace bmu {

namespace {

/// Maximum delay: other traffic on the bus, and a tick.
constexpr Duration lateness_max = 100ms;

Duration silence_of(Duration period) {
  return period * 5 / 2 + lateness_max;
}

bool is_recent(TimePoint at, Duration period, TimePoint now) {
  return at != TimePoint{} && now - at <= silence_of(period);
}

void count_value(const SignalValue& value, ChargerUnit& unit) {
  if (value.validity == Validity::out_of_range) ++unit.values_out_of_range;
  if (value.validity == Validity::unknown) ++unit.values_unknown;
}

}  // namespace

bool ChargerTable::observe(const CanFrame& frame, TimePoint at) {
  if (!is_there()) return false;
  if (const std::optional<std::uint8_t> unit = driver().commanded_unit(frame)) {
    if (*unit < unit_count()) foreign_command_at_ = at;
    return true;
  }
  std::array<ChargerReport, charger_units_max> reports{};
  for (std::size_t index = 0; index < reports.size(); ++index) {
    reports[index] = units_[index].report;
    reports[index].temperature_dC = not_known(Validity::unchanged);
  }
  const ChargerNews news = driver().take(frame, reports);
  if (news.word == ChargerWord::none) return false;
  if (news.unit >= unit_count()) return true;  // a unit that is not in the pack file
  ChargerUnit& unit = units_[news.unit];
  if (news.word == ChargerWord::refused) {
    ++unit.frames_refused;
    return true;
  }
  SignalValue& temperature_dC = reports[news.unit].temperature_dC;
  if (temperature_dC.validity == Validity::unchanged) {
    temperature_dC = unit.report.temperature_dC;
  } else {
    count_value(temperature_dC, unit);
    unit.temperature_at = at;
  }
  unit.report = reports[news.unit];
  const bool has_talked = is_talking(news.unit, at);
  if (news.word == ChargerWord::troubles) unit.troubles_at = at;
  if (news.word == ChargerWord::values) {
    unit.values_at = at;
    count_value(unit.report.voltage_mV, unit);
    count_value(unit.report.current_mA, unit);
    if (unit.report.voltage_mV.is_valid() && unit.report.current_mA.is_valid()) unit.numbers_at = at;
  }
  if (!has_talked && is_talking(news.unit, at)) unit.talks_since = at;
  return true;
}

void ChargerTable::forget_values() {
  for (ChargerUnit& unit : units_) {
    unit.report = {};
    unit.values_at = unit.numbers_at = unit.troubles_at = unit.temperature_at = {};
  }
}

Duration ChargerTable::silence_max() const {
  return silence_of(driver().report_period);
}

bool ChargerTable::has_recent_values(std::size_t index, TimePoint now) const {
  return index < unit_count() && is_recent(units_[index].values_at, driver().report_period, now);
}

bool ChargerTable::is_talking(std::size_t index, TimePoint now) const {
  if (index >= unit_count()) return false;
  const ChargerUnit& unit = units_[index];
  const Duration slow = driver().slow_period;
  return is_recent(unit.numbers_at, driver().report_period, now) &&
         (slow == Duration{} || is_recent(unit.troubles_at, slow, now));
}

SignalValue ChargerTable::temperature_dC(std::size_t index, TimePoint now) const {
  const Duration period = std::max(driver().slow_period, driver().report_period);
  const ChargerUnit& unit = units_[index];
  return is_recent(unit.temperature_at, period, now) ? unit.report.temperature_dC : not_known();
}

std::size_t ChargerTable::talking_count(TimePoint now) const {
  std::size_t count = 0;
  for (std::size_t index = 0; index < unit_count(); ++index) count += is_talking(index, now) ? 1U : 0U;
  return count;
}

Measured<std::int32_t> ChargerTable::current_mA(TimePoint now) const {
  Measured<std::int32_t> sum;
  std::int64_t sum_mA = 0;
  for (std::size_t index = 0; index < unit_count(); ++index) {
    if (!has_recent_values(index, now)) continue;
    const ChargerUnit& unit = units_[index];
    if (!unit.report.current_mA.is_valid()) return {};
    sum_mA += unit.report.current_mA.value;
    const bool is_older = sum.taken_at == TimePoint{} || unit.values_at < sum.taken_at;
    if (is_older) sum.taken_at = unit.values_at;
  }
  return sum.taken_at == TimePoint{} ? sum : measured(known(sum_mA), sum.taken_at);
}

Measured<std::int32_t> ChargerTable::voltage_mV(TimePoint now) const {
  Measured<std::int32_t> highest;
  for (std::size_t index = 0; index < unit_count(); ++index) {
    const ChargerUnit& unit = units_[index];
    if (!has_recent_values(index, now) || !unit.report.voltage_mV.is_valid()) continue;
    const Measured<std::int32_t> one = measured(unit.report.voltage_mV, unit.values_at);
    if (!highest.is_valid() || one.value > highest.value) highest = one;
  }
  return highest;
}

ChargerTable::Troubles ChargerTable::troubles(TimePoint now, bool is_asked) const {
  for (std::size_t index = 0; index < unit_count(); ++index) {
    const std::uint16_t bits = troubles_among(units_[index].report.troubles, is_asked);
    if (bits != 0 && has_recent_values(index, now)) return {bits, static_cast<std::uint8_t>(index + 1)};
  }
  return {};
}

}  // namespace bmu
