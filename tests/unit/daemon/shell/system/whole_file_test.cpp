// Files written by tools: completely or not at all.
#include "daemon/shell/system/whole_file.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

namespace {

std::string content_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("a file is written whole, and what was there stays until then", "[unit][whole_file]") {
  const TemporaryFolder folder;
  const std::string page = folder / "page.html";
  REQUIRE(write_whole_file(page, "old"));
  CHECK(content_of(page) == "old");
  std::filesystem::create_directory(page + ".part");  // nothing can be written there
  const auto written = write_whole_file(page, "new");
  REQUIRE_FALSE(written);
  CHECK(written.error() == "Is a directory");
  CHECK(content_of(page) == "old");
  std::filesystem::remove(page + ".part");
  REQUIRE(write_whole_file(page, "new"));
  CHECK(content_of(page) == "new");
  CHECK_FALSE(std::filesystem::exists(page + ".part"));
  constexpr auto owner_alone = std::filesystem::perms::owner_read | std::filesystem::perms::owner_write;
  std::filesystem::permissions(page, owner_alone);
  REQUIRE(write_whole_file(page, "newer"));
  CHECK(std::filesystem::status(page).permissions() == owner_alone);
  CHECK(write_whole_file(folder / "nowhere/page.html", "").error() == "No such file or directory");
}

TEST_CASE("a link to a file stays one, and what is no file is written as it is", "[unit][whole_file]") {
  const TemporaryFolder folder;
  const std::string page = folder.file("page.html", "old");
  const std::string link = folder / "link.html";
  std::filesystem::create_symlink(page, link);
  REQUIRE(write_whole_file(link, "new"));
  CHECK(std::filesystem::is_symlink(link));
  CHECK(content_of(page) == "new");
  REQUIRE(write_whole_file("/dev/null", "new"));
  CHECK(std::filesystem::is_character_file("/dev/null"));
  CHECK(write_whole_file("/dev/full", "new").error() == "No space left on device");
  // Writing the other name of a file does not change the content of this one.
  std::filesystem::create_hard_link(page, folder / "hard.html");
  REQUIRE(write_whole_file(folder / "hard.html", "newer"));
  CHECK(content_of(page) == "new");
}

TEST_CASE("a file is known by whatever name", "[unit][whole_file]") {
  const TemporaryFolder folder;
  const std::string log = folder.file("drive.log", "");
  const std::string other = folder.file("other.log", "");
  std::filesystem::create_symlink(log, folder / "link.log");
  std::filesystem::create_hard_link(log, folder / "hard.log");
  for (const char* name : {"drive.log", "link.log", "hard.log", "./drive.log"}) {
    CAPTURE(name);
    CHECK(same_file_among(folder / name, {"", other, log}) == log);
  }
  CHECK(same_file_among(other, {"", log, "-"}).empty());
  CHECK(same_file_among(folder / "new.log", {"", log}).empty());
  CHECK(same_file_among("", {"", log}).empty());
}
