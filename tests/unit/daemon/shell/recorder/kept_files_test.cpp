// Rotated files with a limited total size.
#include "daemon/shell/recorder/kept_files.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

namespace {

std::vector<std::string> names_in(const KeptFiles& files) {
  const auto list = files.list();
  REQUIRE(list);
  std::vector<std::string> names;
  for (const KeptFile& file : *list) names.push_back(file.name);
  return names;
}

void make(const TemporaryFolder& folder, const std::string& name, std::size_t size) {
  static_cast<void>(folder.file(name, std::string(size, 'x')));
}

constexpr std::int64_t set_us = 1'700'000'000'000'000;  // 2023-11-14
constexpr std::int64_t second_us = 1'000'000;

/// Creates a file of 100 bytes and returns its name.
std::string name_of_new(const KeptFiles& files, std::int64_t unix_time_us, std::string_view word = {}) {
  auto file = files.create(unix_time_us, word);
  REQUIRE(file);
  REQUIRE(file->append(std::string(100, 'x')));
  return std::filesystem::path(file->path()).filename().string();
}

}  // namespace

TEST_CASE("a file's name says when it began, and of what it is", "[unit][recording]") {
  const TemporaryFolder folder;
  const KeptFiles files(folder.path().string(), "drive");
  CHECK(name_of_new(files, -5) == "drive-19700101T000000.000Z.log.zst");
  CHECK(name_of_new(files, 1'700'000'000'123'456) == "drive-20231114T221320.123Z.log.zst");
  CHECK(name_of_new(files, 1'700'000'060'000'000, "fault-Cell_undervoltage/../x") ==
        "drive-20231114T221420.000Z-fault-cell-undervoltage----x.log.zst");
  CHECK(name_of_new(files, 1'700'000'060'000'000, "fault-Cell_undervoltage/../x") ==
        "drive-20231114T221420.000Z-fault-cell-undervoltage----x-2.log.zst");
}

TEST_CASE("the oldest go first, the newest stays, others are not ours", "[unit][recording]") {
  const TemporaryFolder folder;
  for (const char* name : {"drive-3.log.zst", "drive-1.log.zst", "drive-2.log.zst", "drive-4.log.zst"}) {
    make(folder, name, 100);
  }
  make(folder, "drive-0.log", 100);
  make(folder, "blackbox-0.log.zst", 100);
  std::filesystem::create_directory(folder.path() / "drive-0.log.zst");
  const KeptFiles files(folder.path().string(), "drive");
  CHECK(names_in(files).size() == 4);

  SECTION("by their size") {
    // 400 bytes, and room for 100 more.
    REQUIRE(files.make_room({.total_bytes = 500}, 100));
    CHECK(names_in(files).size() == 4);
    REQUIRE(files.make_room({.total_bytes = 499}, 100));
    CHECK(names_in(files) == std::vector<std::string>{"drive-2.log.zst", "drive-3.log.zst", "drive-4.log.zst"});
    REQUIRE(files.make_room({.total_bytes = 1}, 100));
    CHECK(names_in(files) == std::vector<std::string>{"drive-4.log.zst"});
  }
  SECTION("by their number, of which one is still to come") {
    REQUIRE(files.make_room({.count_max = 5}, 0));
    CHECK(names_in(files).size() == 4);
    REQUIRE(files.make_room({.count_max = 3}, 0));
    CHECK(names_in(files) == std::vector<std::string>{"drive-3.log.zst", "drive-4.log.zst"});
  }
  SECTION("some before the others") {
    make(folder, "drive-3-routine-x.log.zst", 100);
    REQUIRE(files.make_room({.count_max = 5}, 0, "-routine-"));
    CHECK(names_in(files) ==
          std::vector<std::string>{"drive-1.log.zst", "drive-2.log.zst", "drive-3.log.zst", "drive-4.log.zst"});
  }
  SECTION("without limits none") {
    REQUIRE(files.make_room({}, 1'000'000));
    CHECK(names_in(files).size() == 4);
  }
  CHECK(std::filesystem::exists(folder / "drive-0.log"));
  CHECK(std::filesystem::exists(folder / "blackbox-0.log.zst"));
  CHECK(std::filesystem::exists(folder / "drive-0.log.zst"));
}

TEST_CASE("a file that begins before the clock is set is newer than those that were there", "[unit][recording]") {
  const TemporaryFolder folder;
  const KeptFiles files(folder.path().string(), "drive");
  // Two starts without a clock after one with; in the second of them the clock is set while it runs.
  std::vector<std::string> begun;
  for (const std::int64_t at_us :
       {set_us, set_us + 60 * second_us, 9 * second_us, 70 * second_us, 5 * second_us, set_us + 600 * second_us}) {
    begun.push_back(name_of_new(files, at_us));
  }
  CHECK(begun[2] == "drive-19700101T000009.000Z-after-20231114T221420.000Z-1.log.zst");
  CHECK(begun[4] == "drive-19700101T000005.000Z-after-20231114T221420.000Z-3.log.zst");
  CHECK(begun[5] == "drive-20231114T222320.000Z.log.zst");
  CHECK(names_in(files) == begun);
  const std::string last = name_of_new(files, 0);
  REQUIRE(files.make_room({.total_bytes = 300}, 100));
  CHECK(names_in(files) == std::vector<std::string>{begun[5], last});
}

TEST_CASE("files without a set clock are in the order in which they were begun, however many there are",
          "[unit][recording]") {
  const TemporaryFolder folder;
  const KeptFiles files(folder.path().string(), "blackbox");
  std::vector<std::string> begun;
  // The first is from a folder without such a file.
  for (int count = 0; count < 12; ++count) begun.push_back(name_of_new(files, (100 - count) * second_us, "fault-x"));
  CHECK(begun[0] == "blackbox-19700101T000140.000Z-fault-x.log.zst");
  CHECK(begun[11] == "blackbox-19700101T000129.000Z-after-19700101T000140.000Z-11-fault-x.log.zst");
  CHECK(names_in(files) == begun);
  // The preceding file may have been removed.
  REQUIRE(files.make_room({.count_max = 3}, 0));
  begun.push_back(name_of_new(files, 7 * second_us, "routine-y"));
  CHECK(names_in(files) == std::vector<std::string>{begun[10], begun[11], begun[12]});
  begun.push_back(name_of_new(files, 3 * second_us, "fault-z"));
  REQUIRE(files.make_room({.count_max = 4}, 0, "-routine-"));
  CHECK(names_in(files) == std::vector<std::string>{begun[10], begun[11], begun[13]});
}

TEST_CASE("a clock that was set back does not make a file old", "[unit][recording]") {
  const TemporaryFolder folder;
  const KeptFiles files(folder.path().string(), "drive");
  const std::string ahead = name_of_new(files, set_us + 86'400 * second_us);
  const std::string back = name_of_new(files, set_us);
  const std::string same = name_of_new(files, set_us);
  CHECK(names_in(files) == std::vector<std::string>{ahead, back, same});
}

TEST_CASE("names that only look like those of a file without a clock are in order all the same", "[unit][recording]") {
  const TemporaryFolder folder;
  const std::vector<std::string> names{"drive-1.log.zst", "drive-20231114T221320.000Z-after-.log.zst",
                                       "drive-20231114T221320.000Z-after-20231114T221320.000Z-x.log.zst",
                                       "drive-20231114T221320.000Z-after-20231114T221320.000Z.log.zst",
                                       "drive-20231114T221320.000Z-after-2023111xT221320.000Z-1.log.zst"};
  for (const std::string& name : names) make(folder, name, 1);
  const KeptFiles files(folder.path().string(), "drive");
  CHECK(names_in(files) == names);
  CHECK(name_of_new(files, set_us + second_us) == "drive-20231114T221321.000Z.log.zst");
}

TEST_CASE("a folder that is not there is told", "[unit][recording]") {
  const TemporaryFolder folder;
  const KeptFiles files(folder / "none", "drive");
  const auto made = files.make_room({.count_max = 1}, 0);
  REQUIRE_FALSE(made);
  CHECK(to_text(made.error()) == "read folder " + (folder / "none") + ": No such file or directory");
}
