#include "tools/bmudump/device_fit.hpp"

#include <algorithm>

#include "protocol/receive_check.hpp"
#include "tools/bmudump/dump_catalogue.hpp"

namespace bmu::dump {
namespace {

/// Bounds of ours, far around what batteries of up to a thousand volts have with all that belongs to them.
struct UnitBounds {
  Unit unit;
  std::int64_t min;
  std::int64_t max;
};
constexpr UnitBounds bounds_table[] = {
    {Unit::uV, 0, 10'000'000}, {Unit::mV, -1'500'000, 1'500'000}, {Unit::mA, -3'300'000, 3'300'000},
    {Unit::dC, -1'000, 2'000}, {Unit::permille, -1'000, 1'100},   {Unit::ppm, -1'000'000, 1'100'000},
};

bool is_plausible(const SignalSpec& signal, const SignalValue& value) {
  const auto* const bounds = std::find_if(std::begin(bounds_table), std::end(bounds_table),
                                          [&signal](const UnitBounds& one) { return one.unit == signal.unit; });
  if (bounds == std::end(bounds_table) || !value.is_valid()) return true;
  return value.value >= bounds->min && value.value <= bounds->max;
}

bool is_named(const SignalSpec& signal, std::int64_t raw) {
  constexpr std::size_t names_min = 2;
  constexpr std::uint8_t bits_max = 8;
  const bool is_list = signal.names.size() >= names_min && signal.bit_count <= bits_max;
  if (!is_list || is_bit_set(signal) || find_special(signal, raw) != nullptr) return true;
  return std::any_of(signal.names.begin(), signal.names.end(), [raw](const RawName& one) { return one.raw == raw; });
}

}  // namespace

bool fits(const MessageSpec& message, const CanFrame& frame) {
  if (content_fault(message, frame)) return false;
  if (message.signals.empty()) return true;
  const bool is_proven = has_crc(message);
  const std::int64_t selector = raw_of(message.signals.front(), frame.data);
  return std::all_of(message.signals.begin(), message.signals.end(), [&](const SignalSpec& signal) {
    if (!is_selected(signal, selector)) return true;
    const std::int64_t raw = raw_of(signal, frame.data);
    const SignalValue value = value_of_raw(signal, raw);
    if (value.validity == Validity::out_of_range) return false;
    return is_proven || (is_plausible(signal, value) && is_named(signal, raw));
  });
}

}  // namespace bmu::dump
