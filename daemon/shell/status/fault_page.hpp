// The page of all faults (docs/faults.md), generated from the rows of the fault table: condition, confirm time,
// reaction, end, typical causes and remedy of each; and the same for the reasons against closing.
#pragma once

#include <string>

namespace bmu {

/// Markdown, a section per fault. A setting of the pack file appears as its key; a value that is the same for every
/// pack as a number.
[[nodiscard]] std::string fault_page_markdown();

/// For docs/why-does-it-not-close.md: a section for each reason against closing, with the daemon's text as its heading.
[[nodiscard]] std::string blocker_sections_markdown();

}  // namespace bmu
