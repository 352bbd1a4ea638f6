// Output files and error messages.
#pragma once

#include <string>

namespace bmu::cell {

/// Prints one line on standard error, with the program's name.
void complain(const std::string& text);

/// Writes atomically (daemon/shell/system/whole_file.hpp). False, and an error message, if that fails.
[[nodiscard]] bool write_file(const std::string& file, const std::string& text);

}  // namespace bmu::cell
