// Full-length recording in files.
#include "daemon/shell/recorder/record_files.hpp"

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

/// Frame of ten bytes; every fifth second begins a part.
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

TEST_CASE("what a disk does not take waits for it", "[unit][recording][F75]") {
  const TemporaryFolder parent;
  RecordFiles files({.folder = parent / "later"});
  for (int number = 0; number < 3; ++number) files.add(second(number));
  CHECK(files.last_error() == "read folder " + (parent / "later") + ": No such file or directory");
  CHECK(files.path().empty());
  CHECK(files.is_waiting());
  std::filesystem::create_directory(parent.path() / "later");
  files.add(second(3));
  CHECK(files.is_waiting());  // not every second: retries do not empty a full disk
  for (int number = 4; number < 8; ++number) files.add(second(number));
  CHECK_FALSE(files.is_waiting());
  CHECK(files.last_error().empty());
  CHECK(files.frames_lost() == 0);
  CHECK(files.bytes_written() == 80);
  files.end();
  CHECK(files_of(parent / "later").at("drive-19700101T000000.000Z.log.zst").size() == 80);
}

TEST_CASE("after a minute the oldest parts are lost and counted, and the next begins a file of its own",
          "[unit][recording][F75]") {
  const TemporaryFolder parent;
  std::filesystem::create_directory(parent.path() / "disk");
  RecordFiles files({.folder = parent / "disk", .file_bytes = 100, .retry = 1s});
  for (int number = 0; number < 12; ++number) files.add(second(number));
  std::filesystem::rename(parent / "disk", parent / "away");  // there is no folder for the file after a full one
  for (int number = 12; number < 98; ++number) files.add(second(number));
  CHECK(files.is_waiting());
  CHECK_FALSE(files.last_error().empty());
  const std::uint64_t lost = files.frames_lost();
  CHECK(lost == 20);  // from 20 to 39: whole parts
  std::filesystem::rename(parent / "away", parent / "disk");
  for (int number = 98; number < 106; ++number) files.add(second(number));
  files.end();
  CHECK(files.frames_lost() == lost);
  const auto found = files_of(parent / "disk");
  CHECK(found.begin()->second.substr(0, 2) == "0 ");
  std::uint64_t seconds = 0;
  for (const auto& [name, text] : found) {
    seconds += text.size() / 10;
    const int first = std::stoi(text);
    CHECK(first % 5 == 0);
    for (std::size_t at = 0; at < text.size(); at += 10) {
      CHECK(std::stoi(text.substr(at)) == first + static_cast<int>(at / 10));  // no file has a gap
    }
  }
  CHECK(seconds + lost == 106);
}

TEST_CASE("what waits at the end is tried, and else lost", "[unit][recording][F75]") {
  const TemporaryFolder parent;
  RecordFiles files({.folder = parent / "nowhere"});
  for (int number = 0; number < 7; ++number) files.add(second(number));
  files.end();
  CHECK(files.frames_lost() == 7);
  CHECK_FALSE(files.last_error().empty());
  CHECK_FALSE(files.is_waiting());
}

TEST_CASE("no more waits for a disk than there is memory for", "[unit][recording][F75]") {
  const TemporaryFolder parent;
  RecordFiles files({.folder = parent / "nowhere", .wait_max_bytes = 100});
  for (int number = 0; number < 10; ++number) files.add(second(number));
  CHECK(files.frames_lost() == 0);
  files.add(second(10));
  CHECK(files.frames_lost() == 5);  // a whole part
}
