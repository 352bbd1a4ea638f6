// Why a limit is where it is, in the few words that fit beside it.
#pragma once

#include <string>

#include "tools/bmuctl/reply.hpp"

namespace bmu {

/// Of one of the limits in "status": what was seen where, and what it does with the current.
/// "cell voltage low: cell 2.7 (no. 19) at 2.9001 V, zero at 2.8000 V"; "component: main fuse"; "continuous limit"
[[nodiscard]] std::string limit_reason(const Reply& limit);

/// The same in at most `width` columns, if leaving out what the limit does with the current makes it fit.
[[nodiscard]] std::string limit_reason(const Reply& limit, std::size_t width);

}  // namespace bmu
