// A recording at full length in files.
#include "daemon/shell/record_files.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

namespace {

/// Ten bytes; every fifth second begins a part.
RecordFrame second(int number) {
  const TimePoint from{std::chrono::seconds(number)};
  std::string text = std::to_string(number);
  text.resize(10, ' ');
  return {.bytes = std::make_shared<const std::string>(text),
          .begins_part = number % 5 == 0,
          .from = from,
          .until = from + 1s,
          .unix_time_us = std::int64_t{number} * 1'000'000};
}

std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    files[entry.path().filename().string()] = {std::istreambuf_iterator<char>(file), {}};
  }
  return files;
}

}  // namespace

TEST_CASE("a file that is full ends where a part begins", "[unit][recording]") {
  const TemporaryFolder folder;
  RecordFiles files({.folder = folder.path().string(), .file_bytes = 60});
  for (int number = 0; number < 22; ++number) files.add(second(number));
  files.end();
  const auto found = files_of(folder.path().string());
  REQUIRE(found.size() == 3);
  CHECK(found.begin()->first == "drive-19700101T000000.000Z.log.zst");
  // 60 bytes are reached with the sixth second, and the next part begins with the eleventh.
  CHECK(found.begin()->second.size() == 100);
  CHECK(std::next(found.begin())->first == "drive-19700101T000010.000Z.log.zst");
  CHECK(std::next(found.begin(), 2)->second.substr(0, 2) == "20");
  CHECK(files.bytes_written() == 220);
  CHECK(files.frames_lost() == 0);
}

TEST_CASE("the oldest files of a recording go", "[unit][recording]") {
  const TemporaryFolder folder;
  RecordFiles files({.folder = folder.path().string(), .file_bytes = 50, .total_bytes = 120});
  for (int number = 0; number < 40; ++number) files.add(second(number));
  std::size_t total = 0;
  for (const auto& [name, text] : files_of(folder.path().string())) total += text.size();
  CHECK(total <= 120 + 50);
  CHECK(files_of(folder.path().string()).rbegin()->first == "drive-19700101T000035.000Z.log.zst");
}

TEST_CASE("a recording begins again with the part after a disk has failed", "[unit][recording][F75]") {
  const TemporaryFolder parent;
  RecordFiles files({.folder = parent / "later"});
  for (int number = 0; number < 3; ++number) files.add(second(number));
  CHECK(files.last_error() == "read folder " + (parent / "later") + ": No such file or directory");
  CHECK(files.path().empty());
  std::filesystem::create_directory(parent.path() / "later");
  for (int number = 3; number < 8; ++number) files.add(second(number));
  CHECK(files.last_error().empty());
  CHECK(files.frames_lost() == 5);
  CHECK(files_of(parent / "later").at("drive-19700101T000005.000Z.log.zst") == "5         6         7         ");
}
