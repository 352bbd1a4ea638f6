// How a report looks, and the read-out under the pointer. Both stand in the page: it needs no network.
#pragma once

#include <string_view>

namespace bmu::report {

extern const std::string_view page_style;
/// The page says all without it.
extern const std::string_view page_script;

}  // namespace bmu::report
