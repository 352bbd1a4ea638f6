// Reading of a file that the user named.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/result.hpp"

namespace bmu {

inline constexpr const char* wanted_file = "a readable file of at most 1 MiB";

/// The file's bytes, or a text of what was found instead. Only regular files: a pipe or a device could block
/// permanently or never end.
[[nodiscard]] Result<std::string, std::string> read_file(const std::filesystem::path& file);

}  // namespace bmu
