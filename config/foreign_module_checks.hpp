// What a pack file may ask of its modules, whosever they are: what they have room for; and of modules of another maker,
// which watch nothing by themselves, what stands in for it (docs/foreign-modules.md).
#pragma once

#include "config/json_reader.hpp"
#include "config/pack_config.hpp"

namespace bmu {

/// `place` is the root of the pack file; values that were already refused are not judged.
void check_modules(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
