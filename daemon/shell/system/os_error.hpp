// Error of a system call: the errno value and the attempted action, for a line a person can act on.
#pragma once

#include <cstring>
#include <string>

namespace bmu {

struct OsError {
  int code = 0;      // errno; 0 when bmud itself refuses (wrong name, wrong version)
  std::string what;  // attempted action and its object: "bind vcan0"
};

[[nodiscard]] inline std::string to_text(const OsError& error) {
  return error.code == 0 ? error.what : error.what + ": " + std::strerror(error.code);
}

}  // namespace bmu
