#include "tools/bmudump/protocol_doc.hpp"

#include <array>
#include <bit>
#include <cstdio>

namespace bmu::dump {
namespace {

std::string hex(std::uint32_t number) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%03X", static_cast<unsigned>(number));
  return text.data();
}

std::string identifier_text(const MessageSpec& message) {
  return message.has_node() ? hex(message.base_id) + "+n" : hex(message.base_id);
}

/// "b2 .7 to b3 .4", "b0-1" or "b1 .3".
std::string place_text(const SignalSpec& signal) {
  const unsigned last_bit = signal.first_bit + signal.bit_count - 1U;
  const std::string first_byte = "b" + std::to_string(signal.first_bit / 8);
  const std::string last_byte = "b" + std::to_string(last_bit / 8);
  const std::string first_in_byte = " ." + std::to_string(7 - signal.first_bit % 8);
  const std::string last_in_byte = "." + std::to_string(7 - last_bit % 8);
  if (signal.first_bit % 8 == 0 && signal.bit_count % 8 == 0) {
    return signal.bit_count == 8 ? first_byte : first_byte + "-" + std::to_string(last_bit / 8);
  }
  if (signal.bit_count == 1) return first_byte + first_in_byte;
  if (signal.first_bit / 8 == last_bit / 8) return first_byte + first_in_byte + "-" + last_in_byte;
  return first_byte + first_in_byte + " to " + last_byte + " " + last_in_byte;
}

std::string type_text(const SignalSpec& signal) {
  if (signal.unit == Unit::text) return "8 letters";
  return (signal.is_signed ? "s" : "u") + std::to_string(signal.bit_count);
}

std::string step_text(const SignalSpec& signal) {
  const std::string_view token = spec_of(signal.unit).token;
  return token.empty() ? "" : std::to_string(signal.scale) + " " + std::string(token);
}

std::string raw_text(const SignalSpec& signal, std::int64_t raw) {
  if (signal.bit_count < 8) return std::to_string(raw);
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%0*llXh", signal.bit_count / 4,
                static_cast<unsigned long long>(static_cast<std::uint64_t>(raw) & mask_of(signal.bit_count)));
  return text.data();
}

/// "3 communication", or of bits ".2 communication".
std::string name_text(const SignalSpec& signal, const RawName& name) {
  const std::string number = is_bit_set(signal)
                                 ? "." + std::to_string(std::countr_zero(static_cast<std::uint64_t>(name.raw)))
                                 : std::to_string(name.raw);
  return number + " " + std::string(name.name);
}

std::string remarks_text(const SignalSpec& signal) {
  std::string text;
  const auto add = [&text](const std::string& remark) { text += (text.empty() ? "" : ", ") + remark; };
  if (signal.selected_by >= 0) add("only in operation " + std::to_string(signal.selected_by));
  for (const RawName& name : signal.names) add(name_text(signal, name));
  for (const SpecialCode& code : signal.special) {
    add(raw_text(signal, code.raw) + " " + std::string(to_text(code.meaning)));
  }
  if (signal.raw_limit > 0) add("raw up to " + std::to_string(signal.raw_limit));
  if (signal.rounding == Rounding::towards_zero) add("rounded towards zero");
  if (is_cell_mask(signal)) add("a bit a cell, cell 1 lowest");
  return text;
}

std::string heading_text(const MessageSpec& message) {
  std::string text = "#### " + std::string(message.name) + "\n\n" + identifier_text(message) + ", " +
                     std::to_string(message.length) + " bytes, sent by " + std::string(to_text(message.sender));
  if (message.period > Duration{}) text += ", every " + std::to_string(to_ms(message.period)) + " ms";
  return text + ": " + std::string(message.meaning) + ".\n\n";
}

std::string message_text(const MessageSpec& message) {
  std::string text = heading_text(message) + "| place | type | signal | step | remarks |\n|---|---|---|---|---|\n";
  for (const SignalSpec& signal : message.signals) {
    text += "| " + place_text(signal) + " | " + type_text(signal) + " | `" + std::string(signal.name) + "` | " +
            step_text(signal) + " | " + remarks_text(signal) + " |\n";
  }
  if (has_crc(message)) text += "| b7 | u8 | `crc` |  | CRC-8H2F |\n";
  return text + "\n";
}

std::string bus_text(const Catalogue& catalogue, const std::string& title) {
  std::string text = "### " + title + "\n\n";
  for (const MessageSpec* message : catalogue.messages()) text += message_text(*message);
  return text;
}

}  // namespace

std::string protocol_doc(const DumpCatalogue& catalogue) {
  return bus_text(catalogue.internal(), "Messages of the internal bus") +
         bus_text(catalogue.vehicle(), "Messages of the vehicle bus");
}

}  // namespace bmu::dump
