// Files that a tool writes: completely or not at all, and never one that it reads.
#pragma once

#include <string>
#include <vector>

#include "protocol/result.hpp"

namespace bmu {

/// Writes beside the file (`.part`) and then renames, so that the old content stays until the new one has been written
/// in full; permissions are kept, too. A path that is not a regular file, e.g. /dev/stdout or a pipe, is written
/// directly. The error is the reason of the system.
[[nodiscard]] Result<void, std::string> write_whole_file(const std::string& path, const std::string& text);

/// The one of `files` that is the same file as `path`, by whatever name or link; "" if none is, or none exists yet.
[[nodiscard]] std::string same_file_among(const std::string& path, const std::vector<std::string>& files);

}  // namespace bmu
