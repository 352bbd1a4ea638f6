// A shipped pack with changes to its file, as the core's configuration: for tests that need no JSON of their own, which
// takes five seconds to compile in each source. The messages of the pack file reader are the subject of
// changed_pack.hpp.
#pragma once

#include <string_view>

#include "daemon/core/types/core_config.hpp"

namespace bmu::test {

/// The configuration that the file `name` of config/packs gives after `patch`, a JSON merge patch (RFC 7386): an object
/// with keys that replace those of the file, and remove them where the value is null. Throws std::runtime_error with
/// the problems of the pack file if it is refused, and the exception of nlohmann::json if the patch is no JSON.
[[nodiscard]] CoreConfig patched_pack(std::string_view patch, std::string_view name = "demo-48s.json");

}  // namespace bmu::test
