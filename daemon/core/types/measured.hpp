// A measurement: value, sample time and validity. Every consumer checks its age.
#pragma once

#include <cstdint>

#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

template <class T>
struct Measured {
  T value{};
  TimePoint taken_at{};
  Validity validity = Validity::unknown;  // unknown: also if never measured

  [[nodiscard]] constexpr bool is_valid() const { return validity == Validity::valid; }
  /// Sampled at most `age_max` ago. A sample time in the future is invalid and not fresh.
  [[nodiscard]] constexpr bool is_fresh(TimePoint now, Duration age_max) const {
    return taken_at != TimePoint{} && now >= taken_at && now - taken_at <= age_max;
  }
  /// The check that is required before a value is used.
  [[nodiscard]] constexpr bool is_usable(TimePoint now, Duration age_max) const {
    return is_valid() && is_fresh(now, age_max);
  }
};

using Voltage_uV = Measured<std::int32_t>;
using Voltage_mV = Measured<std::int32_t>;
using Current_mA = Measured<std::int32_t>;
using Temperature_dC = Measured<std::int32_t>;

/// Converts a decoded signal; a value outside the range of the type is out of range, never clipped.
[[nodiscard]] constexpr Measured<std::int32_t> measured(const SignalValue& signal, TimePoint taken_at) {
  if (!signal.is_valid()) return {0, taken_at, signal.validity};
  if (signal.value > INT32_MAX || signal.value < INT32_MIN) return {0, taken_at, Validity::out_of_range};
  return {static_cast<std::int32_t>(signal.value), taken_at, Validity::valid};
}

}  // namespace bmu
