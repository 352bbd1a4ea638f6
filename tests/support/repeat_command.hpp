// The parts of a command that runs a failed case of a property again.
#pragma once

#include <cstdlib>
#include <string>

namespace bmu::test {

/// A test's name for the command line. Catch2 separates names by commas and reads brackets as tags.
[[nodiscard]] inline std::string as_argument(const std::string& name) {
  std::string text;
  for (const char character : name) {
    if (character == ',' || character == '[' || character == ']') text += '\\';
    text += character;
  }
  return '"' + text + '"';
}

/// A variable of the environment; "": not set.
[[nodiscard]] inline std::string setting(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  return value == nullptr ? "" : value;
}

}  // namespace bmu::test
