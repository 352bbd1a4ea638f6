#include "tools/bmudump/identify/device_fit.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/receive_check.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"
#include "tools/bmudump/identify/letters.hpp"

namespace bmu::dump {
namespace {

/// Ranges chosen for bmudump, far above those of batteries of up to a thousand volts and their devices.
struct UnitBounds {
  Unit unit;
  std::int64_t min;
  std::int64_t max;
};
constexpr UnitBounds bounds_table[] = {
    {Unit::uV, 0, 5'000'000},           {Unit::mV, -1'500'000, 1'500'000},
    {Unit::mA, -3'300'000, 3'300'000},  {Unit::dC, -1'000, 2'000},
    {Unit::permille, -1'000, 1'100},    {Unit::ppm, -1'000'000, 1'100'000},
    {Unit::W, -10'000'000, 10'000'000}, {Unit::uAs, -100'000 * uAs_per_Ah, 100'000 * uAs_per_Ah},
};

const UnitBounds* bounds_of(const SignalSpec& signal) {
  const auto* const found = std::find_if(std::begin(bounds_table), std::end(bounds_table),
                                         [&signal](const UnitBounds& one) { return one.unit == signal.unit; });
  return found == std::end(bounds_table) ? nullptr : found;
}

bool is_plausible(const SignalSpec& signal, const SignalValue& value) {
  const UnitBounds* const bounds = bounds_of(signal);
  return bounds == nullptr || !value.is_valid() || (value.value >= bounds->min && value.value <= bounds->max);
}

/// True if its names cover all values that it may have.
bool is_list(const SignalSpec& signal) {
  constexpr std::size_t names_min = 2;
  constexpr std::uint8_t bits_max = 8;
  return signal.names.size() >= names_min && signal.bit_count <= bits_max && !is_bit_set(signal);
}

bool is_named(const SignalSpec& signal, std::int64_t raw) {
  if (!is_list(signal) || find_special(signal, raw) != nullptr) return true;
  return std::any_of(signal.names.begin(), signal.names.end(), [raw](const RawName& one) { return one.raw == raw; });
}

/// A mark of a maker, in contrast, has a range.
bool is_name(const SignalSpec& signal) {
  return signal.unit == Unit::text && signal.documented.max == 0;
}

/// Bytes of other devices occasionally start with one or two printable ones.
bool is_readable(const SignalSpec& signal, std::int64_t raw) {
  constexpr std::size_t letters_min = 3;
  if (!is_name(signal)) return true;
  const Letters letters = letters_of(signal, raw);
  return is_text(letters.view()) && printable_count(letters.view()) >= std::min(letters_min, letters.count);
}

/// Share of all values of this field's bits that fit: 0 to 1.
double share_that_fits(const SignalSpec& signal) {
  if (is_name(signal)) return 0.0;
  const double all = std::ldexp(1.0, signal.bit_count);
  if (is_list(signal)) return static_cast<double>(signal.names.size()) / all;
  const RawRange range = raw_range(signal);
  auto min = static_cast<double>(range.min);
  auto max = static_cast<double>(range.max);
  if (const UnitBounds* const bounds = bounds_of(signal)) {
    const auto raw_of_bound = [&signal](std::int64_t bound) {
      return static_cast<double>(bound - signal.offset) / static_cast<double>(signal.scale);
    };
    min = std::max(min, std::ceil(raw_of_bound(bounds->min)));
    max = std::min(max, std::floor(raw_of_bound(bounds->max)));
  }
  return std::max(0.0, max - min + 1.0) / all;
}

/// Filler bytes that senders use under any identifier if they have no data: all bits clear, or all set.
bool is_filling(const CanFrame& frame) {
  const std::uint8_t first = frame.data[0];
  const bool is_same = std::all_of(frame.data.begin(), frame.data.begin() + frame.length,
                                   [first](std::uint8_t byte) { return byte == first; });
  return is_same && (first == 0x00 || first == 0xFF);
}

}  // namespace

Fit fit_of(const MessageSpec& message, const CanFrame& frame) {
  constexpr double share_max = 0.5;
  if (content_fault(message, frame)) return Fit::no;
  const bool is_sealed = has_crc(message);
  double share = message.protection == Protection::none ? 1.0 : 0.0;
  const std::int64_t selector = message.signals.empty() ? 0 : raw_of(message.signals.front(), frame.data);
  for (const SignalSpec& signal : message.signals) {
    if (!is_selected(signal, selector)) continue;
    const std::int64_t raw = raw_of(signal, frame.data);
    const SignalValue value = value_of_raw(signal, raw);
    if (value.validity == Validity::out_of_range) return Fit::no;
    if (is_sealed) continue;
    if (!is_plausible(signal, value) || !is_named(signal, raw) || !is_readable(signal, raw)) return Fit::no;
    if (value.is_valid()) share *= share_that_fits(signal);
  }
  return share <= share_max && !is_filling(frame) ? Fit::proven : Fit::unproven;
}

}  // namespace bmu::dump
