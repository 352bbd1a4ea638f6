// Files that a tool writes: whole or not at all, and never one that it reads.
#pragma once

#include <string>
#include <vector>

#include "protocol/result.hpp"

namespace bmu {

/// Written beside it (`.part`) and then renamed, so that what was there stays as it was until all of it could be
/// written; its permissions stay, too. What is no regular file, as /dev/stdout or a pipe, is written as it is. The
/// error is the system's reason.
[[nodiscard]] Result<void, std::string> write_whole_file(const std::string& path, const std::string& text);

/// The one of `files` that is `path`, by whatever name or link; "" if none is, or there is no such file yet.
[[nodiscard]] std::string same_file_among(const std::string& path, const std::vector<std::string>& files);

}  // namespace bmu
