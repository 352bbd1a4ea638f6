// What a pack file may ask of its modules, whosever they are: what they have room for; and of modules of another maker,
// which watch nothing by themselves, what stands in for it (docs/foreign-modules.md).
#pragma once

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// Nobody but the master opens a pack of such modules, and they report whole millivolts: it has to do so a little
/// earlier than the cell file's limits.
inline constexpr std::int32_t foreign_margin_uV = 10'000;
/// A cell reads low while it is bled, in a log of an i3 by so much. It is not known by how much with an Outlander.
inline constexpr std::int32_t foreign_bled_low_uV = 40'000;

/// How far below the cell file's highest voltage such a pack has to open.
[[nodiscard]] constexpr std::int32_t foreign_overvoltage_margin_uV(const CoreConfig& core) {
  return foreign_margin_uV + (core.balancing.is_enabled ? foreign_bled_low_uV : 0);
}

/// `place` is the root of the pack file; values that were already refused are not judged.
void check_modules(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
