// Files that are written, and complaints.
#pragma once

#include <string>

namespace bmu::cell {

/// One line on standard error, with the program's name.
void complain(const std::string& text);

/// Whole or not at all (daemon/shell/system/whole_file.hpp). False, and a complaint, if that fails.
[[nodiscard]] bool write_file(const std::string& file, const std::string& text);

}  // namespace bmu::cell
