// Advice for a user at the pack without the pages of the manual: the typical causes of a fault, and the meaning and
// remedy of each blocker. The remedy of a fault is in its own row (fault_table.hpp).
//
// Texts only, and no decision depends on them: so they are here and not in the core. `bmuctl faults` and `why` show
// them, and docs/faults.md and docs/why-does-it-not-close.md are generated from them.
#pragma once

#include <string_view>

#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/faults/fault_table.hpp"

namespace bmu {

/// Typical causes of the fault, the likeliest first; half a sentence.
[[nodiscard]] std::string_view usual_cause_of(FaultId id);

struct BlockerAdvice {
  Blocker blocker;
  std::string_view meaning;  // whole sentences
  std::string_view remedy;   // half a sentence, as a fault's
};

[[nodiscard]] const BlockerAdvice& advice_on(Blocker blocker);

}  // namespace bmu
