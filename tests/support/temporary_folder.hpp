// A folder of its own for each test, removed with it: tests run in parallel, so no name may be shared between two. A
// failure to create or write throws, which ends a test, a fuzzer and a benchmark alike.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

namespace bmu {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "bmud-test.XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
    path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  // A failure to remove it is no failure of the test, and a destructor must not throw.
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string operator/(const std::string& name) const { return (path_ / name).string(); }

  /// Writes a file with these bytes into the folder and returns its path.
  // NOLINTNEXTLINE(modernize-use-nodiscard): some write a file that another one names
  std::string file(const std::string& name, std::string_view content) const {
    std::ofstream out(path_ / name, std::ios::binary);
    out << content << std::flush;
    if (!out) throw std::system_error(errno, std::generic_category(), (path_ / name).string());
    return (path_ / name).string();
  }

  /// The same as the only file in the folder: files of other inputs are removed.
  [[nodiscard]] std::string only_file(const std::string& name, std::string_view content) const {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) std::filesystem::remove(entry);
    return file(name, content);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace bmu
