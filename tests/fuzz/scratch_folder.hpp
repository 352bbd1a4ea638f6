// A folder for what must be a file with a name, as SQLite wants it. Gone with the process, unless that ends badly.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include "tests/fuzz/fuzz.hpp"

namespace bmu::fuzz {

class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "bmud-fuzz.XXXXXX").string();
    FUZZ_CHECK(::mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  /// The only file in it: whatever another input left beside it is gone.
  [[nodiscard]] std::string file(std::string_view content) const {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) std::filesystem::remove(entry);
    std::ofstream out(path_ / "file", std::ios::binary);
    out << content << std::flush;
    FUZZ_CHECK(out.good());
    return (path_ / "file").string();
  }

 private:
  std::filesystem::path path_;
};

}  // namespace bmu::fuzz
