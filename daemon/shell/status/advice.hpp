// What somebody needs who stands before the pack without the pages of the manual: what most often lies behind a fault,
// and what each reason against closing means and asks for. What to do about a fault is in its own row
// (fault_table.hpp).
//
// Words only, and nothing decides by them: they stand here and not in the core. `bmuctl faults` and `why` show them,
// and docs/faults.md and docs/why-does-it-not-close.md are made of them.
#pragma once

#include <string_view>

#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/faults/fault_table.hpp"

namespace bmu {

/// What most often lies behind the fault, the likeliest first; half a sentence.
[[nodiscard]] std::string_view usual_cause_of(FaultId id);

struct BlockerAdvice {
  Blocker blocker;
  std::string_view meaning;  // whole sentences
  std::string_view remedy;   // half a sentence, as a fault's
};

[[nodiscard]] const BlockerAdvice& advice_on(Blocker blocker);

}  // namespace bmu
