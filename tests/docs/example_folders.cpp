// Overlays the files of a page's example on the project's files, as if the example had been added to the project.
#include <filesystem>

#include "tests/support/folders.hpp"

namespace bmu::test {

std::string in_source(std::string_view path) {
  std::string shown = std::string(BMUD_EXAMPLE_DIR "/").append(path);
  return std::filesystem::is_regular_file(shown) ? shown : std::string(BMUD_SOURCE_DIR "/").append(path);
}

std::string in_build(std::string_view path) {
  return std::string(BMUD_BUILD_DIR "/").append(path);
}

}  // namespace bmu::test
