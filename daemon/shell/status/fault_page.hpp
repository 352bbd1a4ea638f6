// The page of all faults (docs/faults.md), made from the rows of the fault table: what each watches, how long it must
// last, what it does, how it goes away, what is often behind it and what to do; and the same for what speaks against
// closing.
#pragma once

#include <string>

namespace bmu {

/// Markdown, a section a fault. What a pack file sets is named by its key; what is the same for every pack is a number.
[[nodiscard]] std::string fault_page_markdown();

/// Of docs/why-does-it-not-close.md: a section for each reason against closing, headed as the daemon words it.
[[nodiscard]] std::string blocker_sections_markdown();

}  // namespace bmu
