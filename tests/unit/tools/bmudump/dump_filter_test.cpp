// Filters of bmudump pass the same frames as those of candump.
#include <string>
#include <vector>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tools/bmudump/filter.hpp"

namespace {

using namespace bmu;

dump::Filter filter_of(const std::vector<std::string>& words) {
  dump::Filter filter;
  for (const std::string& word : words) {
    INFO(word);
    REQUIRE(filter.add(word, internal_bus::catalogue));
  }
  return filter;
}

const CanFrame standard_123 = data_frame(0x123, 8);
const CanFrame standard_124 = data_frame(0x124, 8);
const CanFrame extended_123{.id = 0x123, .is_extended = true, .length = 8};
const CanFrame extended_long{.id = 0x18FF'5123, .is_extended = true, .length = 8};
const CanFrame remote_123{.id = 0x123, .is_remote = true, .length = 8};
const CanFrame bus_off{.id = 0x40, .is_error = true, .length = 8};
const CanFrame no_answer{.id = 0x20, .is_error = true, .length = 8};

/// Frames above that pass, in their order, as ones and zeros.
std::string passing(const std::vector<std::string>& words) {
  const dump::Filter filter = filter_of(words);
  std::string text;
  for (const CanFrame& frame :
       {standard_123, standard_124, extended_123, extended_long, remote_123, bus_off, no_answer}) {
    text += filter.passes(frame) ? '1' : '0';
  }
  return text;
}

}  // namespace

TEST_CASE("without a word everything passes", "[unit][bmudump]") {
  CHECK(passing({}) == "1111111");
}

TEST_CASE("a mask compares where it has ones, and neither width nor remote bit unless it says so", "[unit][bmudump]") {
  CHECK(passing({"123:7FF"}) == "1011100");
  CHECK(passing({"123:7F8"}) == "1111100");
  CHECK(passing({"123:C00007FF"}) == "1000000");
  CHECK(passing({"00000123:DFFFFFFF"}) == "0010000");
  CHECK(passing({"18FF5123:DFFFFFFF"}) == "0001000");
  CHECK(passing({"0:0"}) == "1111100");
}

TEST_CASE("an inverse mask lets all others through, and 0~0 nothing", "[unit][bmudump]") {
  CHECK(passing({"123~7FF"}) == "0100000");
  CHECK(passing({"0~0"}) == "0000000");
}

TEST_CASE("one mask of several suffices, unless they are joined", "[unit][bmudump]") {
  CHECK(passing({"123:7FF", "124:7FF"}) == "1111100");
  CHECK(passing({"120:7F0", "124~7FF", "j"}) == "1011100");
  CHECK(passing({"120:7F0", "124~7FF", "J", "#40"}) == "1011110");
}

TEST_CASE("error frames pass by their class only, and alone it hides nothing else", "[unit][bmudump]") {
  CHECK(passing({"#40"}) == "1111110");
  CHECK(passing({"#FFFFFFFF"}) == "1111111");
  CHECK(passing({"0~0", "#60"}) == "0000011");
}

TEST_CASE("a plain identifier is of its own width, eight digits are 29 bits", "[unit][bmudump]") {
  CHECK(passing({"123"}) == "1000100");
  CHECK(passing({"0x124"}) == "0100000");
  CHECK(passing({"00000123"}) == "0010000");
  CHECK(passing({"18FF5123", "123"}) == "1001100");
}

TEST_CASE("names of messages stand for their identifiers", "[unit][bmudump]") {
  const dump::Filter cells = filter_of({"cells_*"});
  CHECK(cells.passes(data_frame(0x141, 8)));
  CHECK(cells.passes(data_frame(0x23F, 8)));
  CHECK_FALSE(cells.passes(data_frame(0x101, 8)));
  CHECK(filter_of({"CELLS_1", "103:7FF", "j"}).passes(data_frame(0x143, 8)) == false);
}

TEST_CASE("what is no filter is refused", "[unit][bmudump]") {
  for (const char* word : {"", "NO_SUCH", "123:", ":7FF", "123:7FG", "#", "#XY", "20000000", "123456789"}) {
    dump::Filter filter;
    INFO(word);
    CHECK_FALSE(filter.add(word, internal_bus::catalogue));
  }
}
