// A measurement: value, when it was taken, and whether it is one at all. Who uses it asks how old it is.
#pragma once

#include <cstdint>

#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

template <class T>
struct Measured {
  T value{};
  TimePoint taken_at{};
  Validity validity = Validity::unknown;  // never measured counts as unknown

  [[nodiscard]] constexpr bool is_valid() const { return validity == Validity::valid; }
  /// Taken at most `age_max` ago. A time of taking in the future is absurd and not fresh.
  [[nodiscard]] constexpr bool is_fresh(TimePoint now, Duration age_max) const {
    return taken_at != TimePoint{} && now >= taken_at && now - taken_at <= age_max;
  }
  /// The one question before a value is used.
  [[nodiscard]] constexpr bool is_usable(TimePoint now, Duration age_max) const {
    return is_valid() && is_fresh(now, age_max);
  }
};

using Voltage_uV = Measured<std::int32_t>;
using Voltage_mV = Measured<std::int32_t>;
using Current_mA = Measured<std::int32_t>;
using Temperature_dC = Measured<std::int32_t>;

/// Takes a decoded signal over; out of the type's range counts as out of range, never clipped.
[[nodiscard]] constexpr Measured<std::int32_t> measured(const SignalValue& signal, TimePoint taken_at) {
  if (!signal.is_valid()) return {0, taken_at, signal.validity};
  if (signal.value > INT32_MAX || signal.value < INT32_MIN) return {0, taken_at, Validity::out_of_range};
  return {static_cast<std::int32_t>(signal.value), taken_at, Validity::valid};
}

}  // namespace bmu
