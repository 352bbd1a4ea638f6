// Features of a row that only other manufacturers' protocols need: little-endian fields of any width, offsets,
// documented ranges, 29-bit identifiers, nodes counted in another digit, frames without their end.
#include <array>

#include "protocol/dbc.hpp"
#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/contracts.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

constexpr SignalSpec field(ByteOrder order, std::uint8_t first_bit, std::uint8_t bit_count) {
  return {.name = "field", .first_bit = first_bit, .bit_count = bit_count, .order = order};
}

constexpr SignalSpec temperature{
    .name = "temperature_dC", .first_bit = byte(0), .bit_count = 8, .unit = Unit::dC, .scale = 10, .offset = -400};
constexpr SignalSpec threshold{.name = "threshold_Ohm",
                               .first_bit = byte(0),
                               .bit_count = 16,
                               .unit = Unit::Ohm,
                               .scale = 1'000,
                               .order = ByteOrder::little,
                               .documented = {30, 1'000}};

constexpr SignalSpec pair_signals[] = {
    {.name = "voltage_uV",
     .first_bit = bit_le(0, 0),
     .bit_count = 14,
     .unit = Unit::uV,
     .scale = 1'000,
     .order = ByteOrder::little},
    {.name = "flags", .first_bit = bit_le(1, 6), .bit_count = 2, .order = ByteOrder::little},
};
constexpr MessageSpec pair_of{.name = "PAIR",
                              .base_id = 0x601,
                              .node_min = 1,
                              .node_max = 11,
                              .node_shift = 4,
                              .length = 8,
                              .length_min = 2,
                              .signals = pair_signals};
constexpr MessageSpec far_away{
    .name = "FAR_AWAY", .base_id = 0x1806'E5F4, .is_extended = true, .signals = pair_signals};
constexpr MessageSpec far_twin{.name = "FAR_TWIN", .base_id = 0x1806'E5F4, .is_extended = true};
constexpr MessageSpec near_by{.name = "NEAR_BY", .base_id = 0x123};
constexpr MessageSpec far_123{.name = "FAR_123", .base_id = 0x123, .is_extended = true};

constexpr const MessageSpec* rows[] = {&pair_of, &near_by, &far_away, &far_123};
constexpr Catalogue catalogue{"test", rows};
static_assert(check_catalogue(catalogue));

constexpr const MessageSpec* twins[] = {&far_away, &far_twin};
static_assert(!check_catalogue(Catalogue{"twins", twins}));

/// Whether a row with these two fields is valid.
consteval bool may_stand_beside(SignalSpec one, SignalSpec other) {
  one.name = "one";
  other.name = "other";
  const std::array<SignalSpec, 2> signals{one, other};
  return check_message({.name = "BOTH", .base_id = 1, .signals = signals});
}

static_assert(may_stand_beside(field(ByteOrder::little, bit_le(0, 0), 14), field(ByteOrder::big, bit(1, 7), 2)));
static_assert(!may_stand_beside(field(ByteOrder::little, bit_le(0, 0), 14), field(ByteOrder::big, bit(1, 5), 1)));
// By bit numbers these two would overlap, by their bits they do not; and vice versa.
static_assert(may_stand_beside(field(ByteOrder::little, bit_le(0, 4), 4), field(ByteOrder::big, bit(0, 3), 4)));
static_assert(!may_stand_beside(field(ByteOrder::little, bit_le(0, 0), 4), field(ByteOrder::big, bit(0, 3), 4)));
static_assert(!may_stand_beside(field(ByteOrder::little, bit_le(3, 0), 16), field(ByteOrder::big, byte(4), 8)));

CanFrame with_bytes(CanFrame frame, const FrameBytes& bytes) {
  frame.data = bytes;
  return frame;
}

}  // namespace

TEST_CASE("a little-endian field of any width lies where its bits are counted from the lowest",
          "[unit][protocol][contract]") {
  Random random(3);
  for (unsigned first_bit = 0; first_bit < 64; ++first_bit) {
    for (unsigned bit_count = 1; first_bit + bit_count <= 64; ++bit_count) {
      FrameBytes bytes{};
      for (std::uint8_t& one : bytes) one = static_cast<std::uint8_t>(random.next());
      std::uint64_t wanted = 0;
      for (unsigned index = 0; index < bit_count; ++index) {
        const unsigned at = first_bit + index;
        wanted |= std::uint64_t{(unsigned{bytes[at / 8]} >> (at % 8)) & 1U} << index;
      }
      REQUIRE(extract_bits(bytes, first_bit, bit_count, ByteOrder::little) == wanted);
      FrameBytes copy{};
      insert_bits(copy, first_bit, bit_count, wanted, ByteOrder::little);
      REQUIRE(extract_bits(copy, first_bit, bit_count, ByteOrder::little) == wanted);
    }
  }
}

TEST_CASE("fields of every place and width keep the contracts of a signal, in both orders",
          "[unit][protocol][contract]") {
  Random random(4);
  for (const ByteOrder order : {ByteOrder::big, ByteOrder::little}) {
    for (std::uint8_t first_bit = 0; first_bit < 64; first_bit = static_cast<std::uint8_t>(first_bit + 5)) {
      for (const unsigned width : {1U, 2U, 7U, 8U, 12U, 14U, 31U}) {
        const auto bit_count = static_cast<std::uint8_t>(width);
        if (first_bit + bit_count > 64) continue;
        check_signal_contracts(field(order, first_bit, bit_count), random);
      }
    }
  }
}

TEST_CASE("an offset is what raw 0 means, both ways and in the DBC", "[unit][protocol]") {
  Random random(5);
  check_signal_contracts(temperature, random);
  CHECK(decode_signal(temperature, {0}) == known(-400));
  CHECK(decode_signal(temperature, {65}) == known(250));
  CHECK(raw_for(temperature, 254) == 65);
  CHECK(raw_for(temperature, -1'000) == 0);
  CHECK(raw_for(temperature, 99'999) == 255);
  constexpr SignalSpec signals[] = {temperature};
  const MessageSpec message{.name = "HEAT", .base_id = 1, .length = 1, .signals = signals};
  const MessageSpec* const one[] = {&message};
  const std::string dbc = dbc_text(Catalogue("test", one), {});
  CHECK(dbc.find(" SG_ temperature : 7|8@0+ (1,-40) [-40|215] \"C\" Vector__XXX\n") != std::string::npos);
}

TEST_CASE("a number outside its documented range is out of range, and what is sent is held within",
          "[unit][protocol]") {
  Random random(6);
  check_signal_contracts(threshold, random);
  CHECK(decode_signal(threshold, {29, 0}) == not_known(Validity::out_of_range));
  CHECK(decode_signal(threshold, {30, 0}) == known(30'000));
  CHECK(decode_signal(threshold, {0xE8, 0x03}) == known(1'000'000));
  CHECK(decode_signal(threshold, {0xE9, 0x03}) == not_known(Validity::out_of_range));
  CHECK(raw_for(threshold, 1) == 30);
  CHECK(raw_for(threshold, 5'000'000) == 1'000);
}

TEST_CASE("fourteen bits of a voltage and two of flags share two bytes", "[unit][protocol]") {
  const FrameBytes bytes{0xD8, 0x8F};
  CHECK(decode_signal(pair_signals[0], bytes) == known(4'056'000));
  CHECK(decode_signal(pair_signals[1], bytes) == known(2));
  CHECK(dbc_start_bit(pair_signals[0]) == 0);
  CHECK(dbc_start_bit(pair_signals[1]) == 14);
}

TEST_CASE("a signal may exist for several values of its selector", "[unit][protocol]") {
  constexpr SignalSpec some{
      .name = "some", .bit_count = 8, .selected_by = 0x23, .selected_count = 3, .selected_step = 0x10};
  for (int selector = 0; selector < 256; ++selector) {
    CHECK(is_selected(some, selector) == (selector == 0x23 || selector == 0x33 || selector == 0x43));
  }
}

TEST_CASE("identifiers of 11 and of 29 bits are told apart", "[unit][protocol]") {
  CHECK(catalogue.find(make_frame(near_by)).message == &near_by);
  CHECK(catalogue.find(make_frame(far_123)).message == &far_123);
  CHECK(catalogue.find(make_frame(far_away)).message == &far_away);
  CHECK(catalogue.find(0x123).message == &near_by);
  CHECK(catalogue.find(0x1806'E5F4).message == nullptr);
  CHECK(catalogue.row_of(make_frame(far_away)) == 2);
  CHECK(catalogue.row_of(data_frame(0x124, 8)) == Catalogue::no_row);
  CHECK(make_frame(far_away).is_extended);
}

TEST_CASE("nodes may be counted in another digit of the identifier", "[unit][protocol]") {
  CHECK(make_frame(pair_of, 11).id == 0x6B1);
  CHECK(catalogue.find(0x6B1).node == 11);
  CHECK(catalogue.find(0x611).node == 1);
  CHECK(catalogue.find(0x612).message == nullptr);
  CHECK(catalogue.find(0x601).message == nullptr);
}

TEST_CASE("a 29-bit frame is of wrong form only where nobody has its identifier", "[unit][protocol]") {
  ReceiveCheck check(catalogue, ReceiveCheck::Role::listener);
  CHECK(check.check(make_frame(far_away)).message == &far_away);
  CHECK(check.check(make_frame(far_away)).is_accepted);
  CanFrame frame = make_frame(far_away);
  frame.id += 1;
  CHECK(check.check(frame).reason == RejectReason::wrong_form);
  frame = make_frame(far_away);
  frame.is_remote = true;
  CHECK(check.check(frame).reason == RejectReason::wrong_form);
  CHECK(check.check(frame).message == nullptr);
  frame = make_frame(far_away);
  frame.length = 7;
  CHECK(check.check(frame).reason == RejectReason::wrong_length);
  CHECK(check.counts().accepted == 2);
}

TEST_CASE("a frame may leave out what has no signal, and no more", "[unit][protocol]") {
  ReceiveCheck check(catalogue, ReceiveCheck::Role::listener);
  CanFrame frame = make_frame(pair_of, 1);
  for (std::uint8_t length = 0; length <= 8; ++length) {
    frame.length = length;
    CHECK(check.check(frame).is_accepted == (length >= 2));
  }
}

TEST_CASE("in a DBC, a 29-bit identifier has bit 31 set", "[unit][protocol][dbc]") {
  const std::string dbc = dbc_text(catalogue, {});
  CHECK(dbc.find("BO_ 2550588916 FAR_AWAY: 8 BMU\n") != std::string::npos);
  CHECK(dbc.find("BO_ 291 NEAR_BY: 8 BMU\n") != std::string::npos);
}

// --- BMW's checksum and counter -------------------------------------------------------------------------------------

namespace {

constexpr SignalSpec bmw_signals[] = {
    {.name = "counter", .first_bit = bit(6, 7), .bit_count = 4, .documented = {0, 14}}};
constexpr MessageSpec bmw{.name = "BMW",
                          .base_id = 0x080,
                          .node_max = 7,
                          .protection = Protection::nibble_counter_crc,
                          .sender = Sender::module,
                          .signals = bmw_signals};
constexpr const MessageSpec* bmw_rows[] = {&bmw};
constexpr Catalogue bmw_catalogue{"bmw", bmw_rows};
static_assert(check_catalogue(bmw_catalogue));

CanFrame bmw_frame(std::uint8_t counter, std::uint8_t first = 0) {
  CanFrame frame = with_bytes(make_frame(bmw, 3), {first});
  seal(bmw, counter, frame);
  return frame;
}

}  // namespace

TEST_CASE("BMW's checksum is over the identifier, low byte first, and seven bytes", "[unit][protocol]") {
  // Frames of a car's controller to modules 0 to 7, and the checksums they had.
  const FrameBytes bytes{0xC7, 0x10, 0x00, 0x50, 0x20, 0x00, 0x50};
  constexpr std::array<std::uint8_t, 8> wanted{0x4A, 0x2F, 0x80, 0xE5, 0xC3, 0xA6, 0x09, 0x6C};
  for (std::uint8_t node = 0; node < wanted.size(); ++node) {
    CHECK(frame_crc_1d(with_bytes(make_frame(bmw, node), bytes)) == wanted.at(node));
  }
}

TEST_CASE("BMW's counter goes from 0 to 14 in the high nibble and leaves the low one alone", "[unit][protocol]") {
  for (unsigned counter = 0; counter < 32; ++counter) {
    CanFrame frame = with_bytes(make_frame(bmw, 3), {0, 0, 0, 0, 0, 0, 0xF4});
    seal(bmw, static_cast<std::uint8_t>(counter), frame);
    CHECK(frame.data[6] == ((counter % 15) << 4U | 4U));
    CHECK(counter_of(bmw, frame) == counter % 15);
    CHECK_FALSE(content_fault(bmw, frame));
  }
}

TEST_CASE("BMW's frames with counter 15, which is never used, are refused and counted", "[unit][protocol]") {
  ReceiveCheck check(bmw_catalogue, ReceiveCheck::Role::listener);
  CHECK(check.check(bmw_frame(14)).is_accepted);
  CanFrame frame = bmw_frame(0);
  frame.data[6] = 0xF0;
  CHECK(check.check(frame).reason == RejectReason::wrong_crc);
  frame.data[7] = frame_crc_1d(frame);
  CHECK(check.check(frame).reason == RejectReason::wrong_counter);
  CHECK(check.counts().rejected[static_cast<std::size_t>(RejectReason::wrong_counter)] == 1);
  CHECK(check.rejected_under(frame.id) == 2);
  CHECK(to_text(RejectReason::wrong_counter) == "wrong counter");
  // It stored no counter that the next frame could repeat.
  CHECK(check.check(bmw_frame(0)).is_accepted);
}

TEST_CASE("BMW's frames with a counter that was there are repeated, or conflict", "[unit][protocol]") {
  ReceiveCheck check(bmw_catalogue, ReceiveCheck::Role::listener);
  CHECK(check.check(bmw_frame(1)).is_accepted);
  CHECK(check.check(bmw_frame(1)).reason == RejectReason::repeated_counter);
  CHECK(check.check(bmw_frame(1, 9)).reason == RejectReason::conflicting);
  CHECK(check.check(bmw_frame(2, 9)).is_accepted);
  CanFrame damaged = bmw_frame(3);
  damaged.data[2] ^= 0x10U;
  CHECK(check.check(damaged).reason == RejectReason::wrong_crc);
  // With the identifier of another module its checksum is wrong.
  CanFrame moved = bmw_frame(3);
  moved.id = bmw.id_of(4);
  CHECK(check.check(moved).reason == RejectReason::wrong_crc);
  // 80h is POLL on the internal bus, and polls no module here.
  CHECK(check.check(bmw_frame(4)).is_accepted);
}
