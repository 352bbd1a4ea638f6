#include "tests/support/folders.hpp"

namespace bmu::test {

std::string in_source(std::string_view path) {
  return std::string(BMUD_SOURCE_DIR "/").append(path);
}

std::string in_build(std::string_view path) {
  return std::string(BMUD_BUILD_DIR "/").append(path);
}

}  // namespace bmu::test
