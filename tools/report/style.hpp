// Style sheet of a report, and the read-out under the pointer. Both are embedded in the page: it needs no network.
#pragma once

#include <string_view>

namespace bmu::report {

extern const std::string_view page_style;
/// Optional: the page is complete without it.
extern const std::string_view page_script;

}  // namespace bmu::report
