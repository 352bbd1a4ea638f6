#include "tools/bmudump/error_text.hpp"

#include <span>
#include <string_view>

namespace bmu::dump {
namespace {

struct Word {
  std::uint32_t code;
  std::string_view text;
};

// Bits of the identifier, which are error classes.
constexpr std::uint32_t lost_arbitration = 0x002;
constexpr std::uint32_t controller = 0x004;
constexpr std::uint32_t protocol = 0x008;
constexpr std::uint32_t transceiver = 0x010;
constexpr std::uint32_t has_counters = 0x200;

constexpr Word class_words[] = {
    {0x001, "TX timeout"},
    {lost_arbitration, "arbitration lost"},
    {controller, "controller"},
    {protocol, "protocol error"},
    {transceiver, "transceiver"},
    {0x020, "no acknowledgement"},
    {0x040, "bus-off"},
    {0x080, "bus error"},
    {0x100, "controller restarted"},
};
constexpr Word controller_words[] = {
    {0x01, "receive buffer overflowed"},
    {0x02, "send buffer overflowed"},
    {0x04, "receive errors at warning level"},
    {0x08, "send errors at warning level"},
    {0x10, "error-passive (receive)"},
    {0x20, "error-passive (transmit)"},
    {0x40, "error-active"},
};
constexpr Word violation_words[] = {
    {0x01, "bit error"},           {0x02, "form error"}, {0x04, "stuff error"},       {0x08, "dominant bit error"},
    {0x10, "recessive bit error"}, {0x20, "overload"},   {0x40, "active error flag"}, {0x80, "during transmission"},
};
constexpr Word location_words[] = {
    {0x02, "identifier bits 28 to 21"},
    {0x03, "start of frame"},
    {0x04, "SRR bit"},
    {0x05, "IDE bit"},
    {0x06, "identifier bits 20 to 18"},
    {0x07, "identifier bits 17 to 13"},
    {0x08, "CRC"},
    {0x09, "reserved bit 0"},
    {0x0A, "data"},
    {0x0B, "length code"},
    {0x0C, "RTR bit"},
    {0x0D, "reserved bit 1"},
    {0x0E, "identifier bits 4 to 0"},
    {0x0F, "identifier bits 12 to 5"},
    {0x12, "intermission"},
    {0x18, "CRC delimiter"},
    {0x19, "acknowledgement slot"},
    {0x1A, "end of frame"},
    {0x1B, "acknowledgement delimiter"},
};
constexpr Word transceiver_words[] = {
    {0x04, "CANH wire open"},         {0x05, "CANH shorted to battery"}, {0x06, "CANH shorted to supply"},
    {0x07, "CANH shorted to ground"}, {0x40, "CANL wire open"},          {0x50, "CANL shorted to battery"},
    {0x60, "CANL shorted to supply"}, {0x70, "CANL shorted to ground"},  {0x80, "CANL shorted to CANH"},
};

std::string_view word_of(std::span<const Word> words, std::uint32_t code) {
  for (const Word& word : words) {
    if (word.code == code) return word.text;
  }
  return {};
}

class Printer {
 public:
  Printer(const CanFrame& frame, TextWriter& out) : frame_(&frame), out_(&out) {}

  void print() {
    for (const Word& one : class_words) {
      if ((frame_->id & one.code) == 0) continue;
      separate();
      out_->text(one.text);
      print_details(one.code);
    }
    if (is_first_) out_->text("unknown class");
    print_counters();
  }

 private:
  void separate() {
    if (!is_first_) out_->text(", ");
    is_first_ = false;
  }
  void print_details(std::uint32_t error_class) {
    switch (error_class) {
      case lost_arbitration: return print_arbitration(frame_->data[0]);
      case controller: return print_bits(controller_words, frame_->data[1]);
      case protocol:
        print_bits(violation_words, frame_->data[2]);
        return print_place(word_of(location_words, frame_->data[3]));
      case transceiver: return print_wire(word_of(transceiver_words, frame_->data[4]));
      default: return;
    }
  }
  void print_bits(std::span<const Word> words, std::uint8_t bits) {
    std::string_view separator = ": ";
    for (const Word& word : words) {
      if ((bits & word.code) == 0) continue;
      out_->text(separator);
      out_->text(word.text);
      separator = " and ";
    }
  }
  void print_place(std::string_view place) {
    if (place.empty()) return;
    out_->text(" at ");
    out_->text(place);
  }
  void print_wire(std::string_view wire) {
    if (wire.empty()) return;
    out_->text(": ");
    out_->text(wire);
  }
  void print_arbitration(std::uint8_t bit) {
    if (bit == 0) return;
    out_->text(" at bit ");
    out_->decimal(bit);
  }
  /// Older drivers send the counters without setting their class bit.
  void print_counters() {
    const std::uint8_t sending = frame_->data[6];
    const std::uint8_t receiving = frame_->data[7];
    if ((frame_->id & has_counters) == 0 && sending == 0 && receiving == 0) return;
    out_->text(", counters: send ");
    out_->decimal(sending);
    out_->text(", receive ");
    out_->decimal(receiving);
  }

  const CanFrame* frame_;
  TextWriter* out_;
  bool is_first_ = true;
};

}  // namespace

void print_error_frame(const CanFrame& frame, TextWriter& out) {
  Printer(frame, out).print();
}

}  // namespace bmu::dump
