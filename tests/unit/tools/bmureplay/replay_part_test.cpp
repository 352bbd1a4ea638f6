// Recording cut into its parts, in bounded memory.
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/bmureplay/part.hpp"

using namespace bmu;
using namespace bmu::replay;

namespace {

const std::string head = "# bmud-recording 1\n";

std::vector<Part> parts_of(PartReader& reader) {
  std::vector<Part> parts;
  while (std::optional<Part> part = reader.next()) parts.push_back(std::move(*part));
  return parts;
}

std::string lines(int count) {
  std::string text;
  for (int number = 0; number < count; ++number) text += "# line\n";
  return text;
}

}  // namespace

TEST_CASE("parts begin with a head, and know their first line", "[unit][recording]") {
  const TemporaryFolder folder;
  PartReader reader({folder.file("a.log", "# black-box x\n" + head + lines(2) + head + lines(1))});
  const std::vector<Part> parts = parts_of(reader);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].text == "# black-box x\n" + head + lines(2));
  CHECK(parts[0].first_line == 1);
  CHECK(parts[1].text == head + lines(1));
  CHECK(parts[1].first_line == 5);
  CHECK(reader.damages().empty());
}

TEST_CASE("a byte-order mark before a recording is passed over", "[unit][recording]") {
  const TemporaryFolder folder;
  const std::string mark = "\xEF\xBB\xBF";
  for (const std::string& before : {mark, mark + mark}) {
    PartReader reader({folder.file("a.log", before + head + lines(2) + before + head + lines(1))});
    const std::vector<Part> parts = parts_of(reader);
    REQUIRE(parts.size() == 2);
    CHECK(parts[0].text == head + lines(2));
    CHECK(parts[1].text == head + lines(1));
    CHECK(reader.damages().empty());
  }
  PartReader reader({folder.file("a.log", mark)});
  CHECK(parts_of(reader).empty());
}

TEST_CASE("a part without end is cut off and named, and the next one is read", "[unit][recording]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("a.log", head + lines(100) + head + lines(3));
  PartReader reader({file}, 200);
  const std::vector<Part> parts = parts_of(reader);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].text == head + lines(25));  // 19 bytes and 25 times 7
  CHECK(parts[0].ends_torn);
  CHECK(parts[1].text == head + lines(3));
  CHECK(parts[1].first_line == 102);
  CHECK_FALSE(parts[1].ends_torn);
  REQUIRE(reader.damages().size() == 1);
  CHECK(reader.damages()[0].file == file);
  CHECK(reader.damages()[0].line == 27);
  CHECK(reader.damages()[0].goes_on_line == 102);
  CHECK(reader.damages()[0].text.find("longer than any of a recording, which has at most 200 bytes") !=
        std::string::npos);
}

TEST_CASE("a part may be as long as the bound and no longer", "[unit][recording]") {
  const TemporaryFolder folder;
  const std::string text = head + lines(10);
  for (const std::size_t bytes_max : {text.size(), text.size() - 1}) {
    PartReader reader({folder.file("a.log", text)}, bytes_max);
    const std::vector<Part> parts = parts_of(reader);
    REQUIRE(parts.size() == 1);
    CHECK(parts[0].ends_torn == (bytes_max < text.size()));
  }
}

TEST_CASE("lines without a head are bounded as well", "[unit][recording]") {
  const TemporaryFolder folder;
  PartReader reader({folder.file("a.log", lines(100) + head + lines(3))}, 70);
  const std::vector<Part> parts = parts_of(reader);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].text == lines(10));
  CHECK(parts[1].text == head + lines(3));
}

TEST_CASE("of a part without its head the next head begins another one", "[unit][recording]") {
  const TemporaryFolder folder;
  for (const std::string& line :
       {std::string("(1.000000) can0 143#11\n"), std::string("# (1.000000) tick 0 0\n"), std::string("junk\n")}) {
    PartReader reader({folder.file("a.log", "# black-box x\n" + line + head + lines(3))});
    const std::vector<Part> parts = parts_of(reader);
    REQUIRE(parts.size() == 2);
    CHECK(parts[0].text == "# black-box x\n" + line);
    CHECK(parts[1].text == head + lines(3));
    CHECK(parts[1].first_line == 3);
  }
}

TEST_CASE("a part behind a damaged begin knows its first line and is whole", "[unit][recording]") {
  const TemporaryFolder folder;
  const std::string plain = folder.file("a.log", lines(5) + head + lines(2));
  REQUIRE(std::system(("zstd -q " + plain).c_str()) == 0);
  std::ostringstream packed;
  packed << std::ifstream(plain + ".zst", std::ios::binary).rdbuf();
  PartReader reader({folder.file("b.log.zst", "odd " + packed.str())});
  const std::vector<Part> parts = parts_of(reader);
  REQUIRE(parts.size() == 1);
  CHECK(parts[0].text == head + lines(2));
  CHECK(parts[0].first_line == 6);
  CHECK_FALSE(parts[0].ends_torn);
  REQUIRE(reader.damages().size() == 1);
  CHECK(reader.damages()[0].text == "bytes 0 to 4: no zstd frame begins here, but one behind it");
  CHECK(reader.damages()[0].goes_on_line == 6);
}

TEST_CASE("of a file that is full of damages not all are told", "[unit][recording]") {
  const TemporaryFolder folder;
  std::string text = head;
  const std::string long_line(LineReader::buffer_size + 1, 'x');
  for (std::size_t number = 0; number < 3; ++number) text += long_line + "\n";
  PartReader reader({folder.file("a.log", text)});
  CHECK(parts_of(reader).size() == 1);
  CHECK(reader.damages().size() == 3);
  std::vector<std::string> missing(damages_max + 10, folder / "none");
  PartReader without_files(missing);
  CHECK(parts_of(without_files).empty());
  CHECK(without_files.has_failed());
  CHECK(without_files.damages().size() == damages_max);
}

TEST_CASE("a last line without its end is named and left out", "[unit][recording]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("a.log", head + lines(2) + "# (1.000000) tick 04a0e551");
  PartReader reader({file, folder.file("b.log", head + lines(1))});
  const std::vector<Part> parts = parts_of(reader);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].text == head + lines(2));
  CHECK(parts[0].ends_torn);
  CHECK(parts[1].text == head + lines(1));
  CHECK_FALSE(parts[1].ends_torn);
  REQUIRE(reader.damages().size() == 1);
  CHECK(reader.damages()[0].file == file);
  CHECK(reader.damages()[0].line == 4);
  CHECK(reader.damages()[0].text == "the last line has no end: the file was cut off there");
}
