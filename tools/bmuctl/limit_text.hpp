// The reason for a limit, as a short text beside it.
#pragma once

#include <string>

#include "tools/bmuctl/reply.hpp"

namespace bmu {

/// For one of the limits in "status": the value, its position, and its effect on the current.
/// "cell voltage low: cell 2.7 (no. 19) at 2.9001 V, zero at 2.8000 V"; "component: main fuse"; "continuous limit"
[[nodiscard]] std::string limit_reason(const Reply& limit);

/// The same in at most `width` columns, if omitting the effect on the current makes it fit.
[[nodiscard]] std::string limit_reason(const Reply& limit, std::size_t width);

}  // namespace bmu
