// Checks of the modules of a pack file: their capacity; and for third-party modules, which do not monitor their cells
// by themselves, the margins that replace it (docs/foreign-modules.md).
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// Margin to the cell file's limits: only the master opens a pack of such modules, and they report whole millivolts, so
/// it must open somewhat earlier.
inline constexpr std::int32_t foreign_margin_uV = 10'000;
/// Amount by which a cell reads low while it is bled, from a log of an i3. The amount is unknown for an Outlander.
inline constexpr std::int32_t foreign_bled_low_uV = 40'000;

/// Distance below the cell file's highest voltage at which such a pack must open.
[[nodiscard]] constexpr std::int32_t foreign_overvoltage_margin_uV(const CoreConfig& core) {
  return foreign_margin_uV + (core.balancing.is_enabled ? foreign_bled_low_uV : 0);
}

/// `place` is the root of the pack file; values that were already rejected are not checked.
void check_modules(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
