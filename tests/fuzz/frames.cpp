// Frames of every bus and device: the receive check, and the codec both ways.
//
// Input: which bus (1; from 80h on, which device), then 12 bytes per frame: properties (`How`, below), identifier (2),
// length, 8 data bytes.
#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/tables/vehicle_bus_elithion.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

namespace {

constexpr const Catalogue* catalogues[] = {&internal_bus::catalogue, &internal_bus::catalogue_little_endian_sensor,
                                           &vehicle_bus::catalogue, &vehicle_bus_elithion::catalogue};

const Catalogue& catalogue_of(std::uint8_t which) {
  constexpr unsigned first_device = 0x80;
  if (which < first_device) return *catalogues[which % std::size(catalogues)];
  return *all_devices()[(which - first_device) % all_devices().size()]->catalogue;
}

struct How {
  std::uint8_t bits = 0;

  [[nodiscard]] bool is_extended() const { return (bits & 0x01U) != 0; }
  [[nodiscard]] bool is_remote() const { return (bits & 0x02U) != 0; }
  [[nodiscard]] bool is_error() const { return (bits & 0x04U) != 0; }
  /// With the length and checksum of its row, which random bytes would not match.
  [[nodiscard]] bool is_sealed() const { return (bits & 0x08U) != 0; }
  [[nodiscard]] bool is_sent() const { return (bits & 0x10U) != 0; }
};

CanFrame next_frame(fuzz::Numbers& input, const How& how, const Catalogue& catalogue) {
  CanFrame frame{.id = input.next<std::uint16_t>(),
                 .is_extended = how.is_extended(),
                 .is_remote = how.is_remote(),
                 .is_error = how.is_error()};
  if (!how.is_extended()) frame.id %= Catalogue::id_count;
  // Two bytes do not match any 29-bit identifier: one of the catalogue is used.
  const MessageSpec& chosen = *catalogue.messages()[frame.id % catalogue.messages().size()];
  if (how.is_extended() && chosen.is_extended) frame.id = chosen.base_id;
  frame.length = input.next<std::uint8_t>() % 9;
  for (std::uint8_t& byte : frame.data) byte = input.next<std::uint8_t>();
  const MessageMatch match = catalogue.find(frame);
  if (how.is_sealed() && match.message != nullptr) {
    frame.length = match.message->length;
    seal(*match.message, counter_of(*match.message, frame), frame);
  }
  return frame;
}

/// True if the row has the signal for the selector value in this frame.
bool has_signal(const MessageSpec& message, const SignalSpec& signal, const CanFrame& frame) {
  return is_selected(signal, raw_of(message.signals[0], frame.data));
}

bool has_wrong_form(const CanFrame& frame) {
  return frame.is_remote || frame.is_error;
}

/// Decoded values are the same after they have been encoded and decoded again.
void check_codec(const MessageMatch& match, const CanFrame& frame) {
  const MessageSpec& message = *match.message;
  CanFrame again = make_frame(message, match.node);
  for (const SignalSpec& signal : message.signals) {
    const SignalValue value = decode_signal(signal, frame.data);
    // A value outside the range of a field without a code for it cannot be sent.
    const bool can_be_sent = value.is_valid() || !signal.special.empty();
    if (has_signal(message, signal, frame) && can_be_sent) encode_signal(signal, value, again.data);
  }
  for (const SignalSpec& signal : message.signals) {
    if (!has_signal(message, signal, frame)) continue;
    const SignalValue value = decode_signal(signal, frame.data);
    const SignalValue value_again = decode_signal(signal, again.data);
    if (value.is_valid() || find_special(signal, raw_of(signal, frame.data)) != nullptr) {
      FUZZ_CHECK(value_again == value);
    } else if (!signal.special.empty()) {
      FUZZ_CHECK(!value_again.is_valid());
    }
  }
  seal(message, counter_of(message, frame), again);
  FUZZ_CHECK(!has_wrong_form(again) && !content_fault(message, again));
}

void check_verdict(const ReceiveCheck& before, const ReceiveCheck& after, const CheckedFrame& verdict,
                   const CanFrame& frame) {
  FUZZ_CHECK(after.counts().accepted == before.counts().accepted + (verdict.is_accepted ? 1 : 0));
  FUZZ_CHECK(after.counts().rejected_total() == before.counts().rejected_total() + (verdict.is_accepted ? 0 : 1));
  if (!verdict.is_accepted) return;
  FUZZ_CHECK(verdict.message != nullptr && frame.id == verdict.message->id_of(verdict.node));
  FUZZ_CHECK(frame.is_extended == verdict.message->is_extended);
  FUZZ_CHECK(!has_wrong_form(frame) && !content_fault(*verdict.message, frame));
  check_codec({verdict.message, verdict.node}, frame);
  // A repeated frame is refused; except from a module that identifies itself unsolicited, as often as it likes.
  ReceiveCheck second = after;
  const bool is_counted = verdict.message->protection != Protection::none;
  const bool is_unsolicited = verdict.message == &internal_bus::ident && frame.data[6] == 0;
  FUZZ_CHECK(second.check(frame).is_accepted == (!is_counted || is_unsolicited));
}

void show(const CanFrame& frame, const How& how, ReceiveCheck& check) {
  if (how.is_sent()) return check.note_sent(frame);
  const ReceiveCheck before = check;
  const CheckedFrame verdict = check.check(frame);
  check_verdict(before, check, verdict, frame);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Numbers input(data, size);
  const Catalogue& catalogue = catalogue_of(input.next<std::uint8_t>());
  ReceiveCheck master(catalogue, ReceiveCheck::Role::master);
  ReceiveCheck listener(catalogue, ReceiveCheck::Role::listener);
  for (int count = 0; count < 64 && !input.is_empty(); ++count) {
    const How how{input.next<std::uint8_t>()};
    const CanFrame frame = next_frame(input, how, catalogue);
    show(frame, how, master);
    show(frame, how, listener);
    const MessageMatch match = catalogue.find(frame);
    if (match.message != nullptr && frame.length == match.message->length) check_codec(match, frame);
  }
  return 0;
}
