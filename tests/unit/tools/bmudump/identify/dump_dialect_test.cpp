// Detection of the dialect of a pack, and decoding of the bus by the detected one.
#include <array>
#include <string>
#include <vector>

#include <unistd.h>

#include "tests/support/catch.hpp"
#include "tools/bmudump/dump.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;

CanFrame text_frame(std::uint32_t id, std::string_view text) {
  CanFrame frame = data_frame(id, static_cast<std::uint8_t>(text.size()));
  for (std::size_t index = 0; index < text.size(); ++index) frame.data[index] = static_cast<std::uint8_t>(text[index]);
  return frame;
}

/// 622h as long as that of elithion, with its own name.
constexpr SignalSpec other_status_signals[] = {{.name = "other_state", .first_bit = byte(0), .bit_count = 8}};
constexpr MessageSpec other_status{
    .name = "OTHER_STATUS", .base_id = 0x622, .length = 7, .signals = other_status_signals, .meaning = "of a test"};
constexpr const MessageSpec* other_rows[] = {&vehicle_bus::pack_name, &other_status};
constexpr Dialect two_dialects[] = {
    {.name = "iha", .pack_name = "IHA BMS1", .rows = vehicle_bus::rows},
    {.name = "other", .pack_name = "Other 99", .status_length = 7, .rows = other_rows},
};

/// Standard output for a log.
std::string text_of(const std::vector<CanFrame>& frames, const std::string& dialect) {
  std::array<int, 2> ends{};
  REQUIRE(::pipe(ends.data()) == 0);
  const Options options;
  const Catalogues catalogues({}, two_dialects, dialect);
  const Filter filter;
  Dump dump(options, catalogues, filter, {}, ends[1]);
  for (const CanFrame& frame : frames) {
    CHECK(dump.show({.kind = LogLineKind::frame, .time_us = 1'000'000, .bus = "can0", .frame = frame}));
  }
  CHECK(dump.finish(exit_ok) == exit_ok);
  ::close(ends[1]);
  std::array<char, 4'096> text{};
  const ssize_t size = ::read(ends[0], text.data(), text.size());
  ::close(ends[0]);
  return {text.data(), static_cast<std::size_t>(size)};
}

}  // namespace

TEST_CASE("a pack is known by its name in 620h", "[unit][bmudump][dialect]") {
  DialectWatch watch(dialect_table, 0x620);
  CHECK(watch.spoken() == nullptr);
  CHECK_FALSE(watch.note(data_frame(0x123, 8)));
  CHECK_FALSE(watch.note(text_frame(0x620, "MyPack 1")));
  CHECK(watch.spoken() == nullptr);
  CHECK(watch.sign() == "620h says \"MyPack 1\"");
  CHECK(watch.note(text_frame(0x620, "Elithion")));
  REQUIRE(watch.spoken() != nullptr);
  CHECK(watch.spoken()->name == "elithion");
  CHECK_FALSE(watch.note(text_frame(0x620, "Elithion")));
  CHECK(watch.note(text_frame(0x620, "IHA BMS1")));
  CHECK(watch.spoken()->name == "iha");
}

TEST_CASE("without a name, a 622h of seven bytes is elithion's and one of six is anybody's",
          "[unit][bmudump][dialect]") {
  DialectWatch watch(dialect_table, 0x6A0);
  CHECK_FALSE(watch.note(data_frame(0x6A2, 6)));
  CHECK(watch.spoken() == nullptr);
  CHECK(watch.note(data_frame(0x6A2, 7)));
  REQUIRE(watch.spoken() != nullptr);
  CHECK(watch.spoken()->name == "elithion");
  CHECK(watch.sign() == "6A2h has 7 bytes");
}

TEST_CASE("bytes that are no text, or not all of it, are no pack's name", "[unit][bmudump][dialect]") {
  DialectWatch watch(dialect_table, 0x620);
  CanFrame car = data_frame(0x620, 8);
  car.data = {1, 2, 3, 4, 5, 6, 7, 8};
  CHECK_FALSE(is_pack_name(car));
  CHECK_FALSE(watch.note(car));
  CHECK_FALSE(is_pack_name(data_frame(0x620, 8)));
  CHECK_FALSE(is_pack_name(text_frame(0x620, "Orion")));
  CHECK_FALSE(watch.note(text_frame(0x620, "Orion")));
  CHECK(watch.sign().empty());
  CHECK(is_pack_name(text_frame(0x620, "BMUD    ")));
  CHECK_FALSE(watch.note(text_frame(0x620, "BMUD    ")));
  CHECK(watch.sign() == "620h says \"BMUD    \"");
}

TEST_CASE("a 622h of seven bytes chooses how vehicle messages are read, and none of them is a pack's for it",
          "[unit][bmudump][dialect]") {
  const CanFrame name = text_frame(0x620, "MyPack 1");
  const std::string car = text_of({data_frame(0x622, 7), data_frame(0x622, 8)}, "auto");
  CHECK(car.find("OTHER_STATUS") == std::string::npos);
  CHECK(car.find("PACK_STATUS") == std::string::npos);
  const std::string pack = text_of({data_frame(0x622, 7), name, data_frame(0x622, 7), data_frame(0x622, 8)}, "auto");
  CHECK(pack.find("622 unknown            [7]") != std::string::npos);
  CHECK(pack.find("622 OTHER_STATUS       other_state 0") != std::string::npos);
  CHECK(pack.find("622 OTHER_STATUS       !! wrong length  [8]") != std::string::npos);
}

TEST_CASE("frames that are no data frames of 11 bits tell nothing", "[unit][bmudump][dialect]") {
  DialectWatch watch(dialect_table, 0x620);
  CanFrame frame = text_frame(0x620, "Elithion");
  frame.is_extended = true;
  CHECK_FALSE(watch.note(frame));
  frame = data_frame(0x622, 7);
  frame.is_remote = true;
  CHECK_FALSE(watch.note(frame));
}

TEST_CASE("a bus that names its dialect is read by it from then on", "[unit][bmudump][dialect]") {
  const std::vector<CanFrame> frames{text_frame(0x620, "IHA BMS1"), data_frame(0x622, 6), text_frame(0x620, "Other 99"),
                                     data_frame(0x622, 7)};
  const std::string text = text_of(frames, "auto");
  CHECK(text.find("622 PACK_STATUS        state fault") != std::string::npos);
  CHECK(text.find("622 OTHER_STATUS       other_state 0") != std::string::npos);
}

TEST_CASE("a dialect that was chosen stays", "[unit][bmudump][dialect]") {
  const std::string other = text_of({text_frame(0x620, "IHA BMS1"), data_frame(0x622, 7)}, "other");
  CHECK(other.find("622 OTHER_STATUS") != std::string::npos);
  const std::string iha = text_of({text_frame(0x620, "Other 99"), data_frame(0x622, 7)}, "iha");
  CHECK(iha.find("622 PACK_STATUS        !! wrong length") != std::string::npos);
}
