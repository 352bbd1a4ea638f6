// Parser of a line of the serial console's log or service mode: "I:21.350A C:3.9848,3.9851".
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

namespace bmu::test {

/// The values after "C:", for the key C, up to the next space, separated by commas. A line without the key fails the
/// test.
[[nodiscard]] inline std::vector<std::string> values_of(const std::string& line, const std::string& key) {
  INFO(line);
  const std::size_t at = line.find(" " + key + ":");
  REQUIRE(at != std::string::npos);
  std::istringstream list(line.substr(at + key.size() + 2, line.find(' ', at + 1) - at - key.size() - 2));
  std::vector<std::string> values;
  for (std::string value; std::getline(list, value, ',');) values.push_back(value);
  return values;
}

}  // namespace bmu::test
