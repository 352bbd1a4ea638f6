// Files that may take so much room and no more.
#include "daemon/shell/kept_files.hpp"

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

}  // namespace

TEST_CASE("a file's name says when it began, and of what it is", "[unit][recording]") {
  const KeptFiles files("/there", "drive");
  CHECK(files.path_for(1'700'000'000'123'456) == "/there/drive-20231114T221320.123Z.log.zst");
  CHECK(files.path_for(1'700'000'000'000'000, "fault-Cell_undervoltage/../x") ==
        "/there/drive-20231114T221320.000Z-fault-cell-undervoltage----x.log.zst");
  CHECK(files.path_for(-5) == "/there/drive-19700101T000000.000Z.log.zst");
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

TEST_CASE("a folder that is not there is told", "[unit][recording]") {
  const TemporaryFolder folder;
  const KeptFiles files(folder / "none", "drive");
  const auto made = files.make_room({.count_max = 1}, 0);
  REQUIRE_FALSE(made);
  CHECK(to_text(made.error()) == "read folder " + (folder / "none") + ": No such file or directory");
}
