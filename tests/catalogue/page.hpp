// docs/reaction-times.md: results of the catalogue, committed and compared with every run.
#pragma once

#include <string>
#include <string_view>

namespace bmu::test {

/// "| 21 | a module falls silent | ", which identifies a line of the page.
[[nodiscard]] std::string page_line_begin(int number, std::string_view what);
/// The line of a case as committed; empty if there is none.
[[nodiscard]] std::string committed_line(int number, std::string_view what);
/// BMUD_REWRITE is set: the page is to be written, not compared.
[[nodiscard]] bool is_rewriting();

}  // namespace bmu::test
