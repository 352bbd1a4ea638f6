// What the system refused: the errno value and what we were doing, for a line a person can act on.
#pragma once

#include <cstring>
#include <string>

namespace bmu {

struct OsError {
  int code = 0;      // errno; 0 when the refusal is our own (wrong name, wrong version)
  std::string what;  // what was tried, on what: "bind vcan0"
};

[[nodiscard]] inline std::string to_text(const OsError& error) {
  return error.code == 0 ? error.what : error.what + ": " + std::strerror(error.code);
}

}  // namespace bmu
