// Default path of the history, if the user gives none.
#pragma once

#include <string>

namespace bmu {

/// The database of the daemon behind this socket, else the one of the service.
[[nodiscard]] std::string history_file(const std::string& socket);

}  // namespace bmu
