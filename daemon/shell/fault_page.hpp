// The page of all faults (docs/faults.md), made from the rows of the fault table: what each watches, how long it must
// last, what it does, how it goes away, and what to do about it.
#pragma once

#include <string>

namespace bmu {

/// Markdown, a section a fault. What a pack file sets is named by its key; what is the same for every pack is a number.
[[nodiscard]] std::string fault_page_markdown();

}  // namespace bmu
