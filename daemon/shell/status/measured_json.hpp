// Measured values as JSON: a value with its validity and age, and minimum, maximum and average of one over the pack.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

template <class T>
[[nodiscard]] std::string_view validity_text(const Measured<T>& measured, TimePoint now, Duration age_max) {
  if (measured.taken_at == TimePoint{}) return "never seen";
  if (!measured.is_fresh(now, age_max)) return "stale";
  return to_text(measured.validity);
}

/// Three members: `stem` with its unit, the value or null; and validity and age under the name without the unit.
void put_measured(JsonText& to, std::string_view stem, Unit unit, const Measured<std::int32_t>& measured,
                  const CoreView& view, Duration age_max);
void put_spread(JsonText& to, std::string_view name, const Spread& spread, Unit unit, const CoreView& view);

[[nodiscard]] inline std::int64_t in_permille(double share) {
  return std::llround(share * 1e3);
}

}  // namespace bmu
