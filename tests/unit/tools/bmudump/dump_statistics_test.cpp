// Statistics of bmudump: rates, gaps, failures and bits of each identifier; and error frames as text.
#include <string>

#include "protocol/can_bits.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tools/bmudump/error_text.hpp"
#include "tools/bmudump/statistics.hpp"
#include "tools/bmudump/words.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;

const CheckedFrame unknown{};
const CheckedFrame good{.message = &internal_bus::cells_1, .node = 3, .is_accepted = true};
const CheckedFrame bad{.message = &internal_bus::cells_1, .node = 3, .reason = RejectReason::wrong_crc};

LogLine line_at(std::int64_t time_us, const CanFrame& frame) {
  return {.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = frame};
}

std::string words_of(const CanFrame& frame) {
  TextWriter out(-1);
  out.begin_line();
  print_error_frame(frame, out);
  return std::string(out.pending());
}

CanFrame error_frame(std::uint32_t classes, std::array<std::uint8_t, 8> data) {
  return {.id = classes, .is_error = true, .length = 8, .data = data};
}

}  // namespace

TEST_CASE("a gap is between frames that passed, and its end is known", "[unit][bmudump][statistics]") {
  BusStatistics bus;
  const CanFrame frame = data_frame(0x143, 8);
  bus.count(line_at(0, frame), bad);
  bus.count(line_at(1'000'000, frame), good);
  bus.count(line_at(1'100'000, frame), good);
  bus.count(line_at(1'300'000, frame), bad);
  const IdStatistics* const row = bus.count(line_at(1'500'000, frame), good);
  REQUIRE(row != nullptr);
  CHECK(row->gap_max_us == 400'000);
  CHECK(row->gap_end_us == 1'500'000);
  CHECK(row->frames == 5);
  CHECK(row->accepted == 3);
  CHECK(row->failed_total() == 2);
  CHECK(row->failed[static_cast<std::size_t>(RejectReason::wrong_crc)] == 2);
  CHECK(row->rate_per_s() == Approx(4 / 1.5));
  CHECK(row->bits == 5 * bits_on_wire(frame));
  CHECK(bus.failed == 2);
}

TEST_CASE("a row keeps the message that some of its frames were, and says how many were not",
          "[unit][bmudump][statistics]") {
  BusStatistics bus;
  const CanFrame frame = data_frame(0x143, 8);
  const IdStatistics* const row = bus.count(line_at(0, frame), unknown);
  REQUIRE(row != nullptr);
  CHECK(row->message == nullptr);
  CHECK(failures_text(*row).empty());
  bus.count(line_at(100'000, frame), good);
  bus.count(line_at(200'000, frame), bad);
  bus.count(line_at(300'000, frame), unknown);
  CHECK(row->message == good.message);
  CHECK(row->node == 3);
  CHECK(row->unknown() == 2);
  CHECK(failures_text(*row) == "wrong crc 1, unknown 2");
}

TEST_CASE("of unknown identifiers every frame counts, time going back makes no gap", "[unit][bmudump][statistics]") {
  BusStatistics bus;
  const CanFrame frame{.id = 0x18FF'50E5, .is_extended = true, .length = 2};
  bus.count(line_at(5'000'000, frame), unknown);
  bus.count(line_at(3'000'000, frame), unknown);
  const IdStatistics* const row = bus.count(line_at(3'250'000, frame), unknown);
  REQUIRE(row != nullptr);
  CHECK(row->gap_max_us == 250'000);
  CHECK(row->rate_per_s() == Approx(1.0));
  CHECK(bus.unknown == 3);
  CHECK(bus.extended_ids() == std::vector<std::uint32_t>{0x18FF'50E5});
}

TEST_CASE("a flood of 29-bit identifiers is counted in bounded memory", "[unit][bmudump][statistics]") {
  BusStatistics bus;
  for (std::uint32_t id = 0; id < 100'000; ++id) {
    bus.count(line_at(id, {.id = id, .is_extended = true}), unknown);
  }
  CHECK(bus.extended_ids().size() == BusStatistics::extended_ids_max);
  CHECK(bus.without_row == 100'000 - BusStatistics::extended_ids_max);
  CHECK(bus.unknown == 100'000);
}

TEST_CASE("the load is without the first frame, and error frames take no bits", "[unit][bmudump][statistics]") {
  BusStatistics bus;
  const CanFrame frame = data_frame(0x143, 8);
  bus.count(line_at(0, frame), good);
  bus.count(line_at(500, error_frame(0x40, {})), unknown);
  bus.count(line_at(1'000, frame), good);
  CHECK(bus.load_bit_per_s() == Approx(static_cast<double>(bits_on_wire(frame)) * 1e3));
  CHECK(bus.error == 1);
  CHECK(bus.frames == 3);
}

TEST_CASE("error frames are told in words", "[unit][bmudump]") {
  CHECK(words_of(error_frame(0x040, {})) == "bus-off");
  CHECK(words_of(error_frame(0x004, {0, 0x30})) == "controller: error-passive (receive) and error-passive (transmit)");
  CHECK(words_of(error_frame(0x002, {7})) == "arbitration lost at bit 7");
  CHECK(words_of(error_frame(0x088, {0, 0, 0x84, 0x0A})) ==
        "protocol error: stuff error and during transmission at data, bus error");
  CHECK(words_of(error_frame(0x010, {0, 0, 0, 0, 0x07})) == "transceiver: CANH shorted to ground");
  CHECK(words_of(error_frame(0x220, {0, 0, 0, 0, 0, 0, 128, 3})) ==
        "no acknowledgement, counters: send 128, receive 3");
  CHECK(words_of(error_frame(0x200, {})) == "unknown class, counters: send 0, receive 0");
}

TEST_CASE("the longest error frame fits where it is written", "[unit][bmudump]") {
  std::size_t longest = 0;
  for (unsigned place = 0; place < 256; ++place) {
    const auto byte = static_cast<std::uint8_t>(place);
    const CanFrame frame = error_frame(0x1FFF'FFFF, {255, 255, 255, byte, byte, 255, 255, 255});
    longest = std::max(longest, words_of(frame).size());
  }
  CHECK(longest < 1'000);
}
