#include "tools/bmudump/protocol_doc.hpp"

#include <array>
#include <bit>
#include <cstdio>

namespace bmu::dump {
namespace {

constexpr const char* internal_title = "Messages of the internal bus";
constexpr const char* vehicle_title = "Messages of the vehicle bus";

std::string hex(std::uint32_t number) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%03X", static_cast<unsigned>(number));
  return text.data();
}

std::string identifier_text(const MessageSpec& message) {
  if (!message.has_node()) return hex(message.base_id);
  const std::string step = message.node_shift == 0 ? "" : std::to_string(1U << message.node_shift);
  return hex(message.base_id) + "+" + step + "n";
}

std::string length_text(const MessageSpec& message) {
  const std::string longest = std::to_string(message.length) + " bytes";
  return message.length_min == 0 ? longest : std::to_string(message.length_min) + " to " + longest;
}

/// "b2 .7 to b3 .4", "b0-1" or "b1 .3".
std::string place_text(const SignalSpec& signal) {
  const auto in_byte = [&signal](unsigned bit) { return signal.order == ByteOrder::big ? 7 - bit % 8 : bit % 8; };
  const unsigned last_bit = signal.first_bit + signal.bit_count - 1U;
  const std::string first_byte = "b" + std::to_string(signal.first_bit / 8);
  const std::string last_byte = "b" + std::to_string(last_bit / 8);
  const std::string first_in_byte = " ." + std::to_string(in_byte(signal.first_bit));
  const std::string last_in_byte = "." + std::to_string(in_byte(last_bit));
  if (signal.first_bit % 8 == 0 && signal.bit_count % 8 == 0) {
    return signal.bit_count == 8 ? first_byte : first_byte + "-" + std::to_string(last_bit / 8);
  }
  if (signal.bit_count == 1) return first_byte + first_in_byte;
  if (signal.first_bit / 8 == last_bit / 8) return first_byte + first_in_byte + "-" + last_in_byte;
  return first_byte + first_in_byte + " to " + last_byte + " " + last_in_byte;
}

std::string type_text(const SignalSpec& signal) {
  if (signal.unit == Unit::text) return std::to_string(signal.bit_count / 8) + " letters";
  const bool is_little = signal.order == ByteOrder::little && signal.bit_count > 8;
  return (signal.is_signed ? "s" : "u") + std::to_string(signal.bit_count) + (is_little ? " LE" : "");
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

/// "3 communication", or for bits ".2 communication".
std::string name_text(const SignalSpec& signal, const RawName& name) {
  const std::string number = is_bit_set(signal)
                                 ? "." + std::to_string(std::countr_zero(static_cast<std::uint64_t>(name.raw)))
                                 : std::to_string(name.raw);
  return number + " " + std::string(name.name);
}

/// "3", or for several "32, 33, 34".
std::string selected_text(const SignalSpec& signal) {
  std::string text;
  for (int turn = 0; turn < signal.selected_count; ++turn) {
    text += (turn == 0 ? "" : ", ") + std::to_string(signal.selected_by + turn * signal.selected_step);
  }
  return text;
}

std::string remarks_text(const SignalSpec& signal) {
  std::string text;
  const auto add = [&text](const std::string& remark) { text += (text.empty() ? "" : ", ") + remark; };
  if (signal.selected_by >= 0) add("only in operation " + selected_text(signal));
  for (const RawName& name : signal.names) add(name_text(signal, name));
  for (const SpecialCode& code : signal.special) {
    add(raw_text(signal, code.raw) + " " + std::string(to_text(code.meaning)));
  }
  if (signal.offset != 0) add("raw 0 is " + std::to_string(signal.offset));
  if (signal.raw_limit > 0) add("raw up to " + std::to_string(signal.raw_limit));
  if (signal.documented.max > 0) {
    add("raw " + std::to_string(signal.documented.min) + " to " + std::to_string(signal.documented.max));
  }
  if (signal.rounding == Rounding::towards_zero) add("rounded towards zero");
  if (is_cell_mask(signal)) add("a bit a cell, cell 1 lowest");
  return text;
}

std::string heading_text(const MessageSpec& message) {
  std::string text = "#### " + std::string(message.name) + "\n\n" + identifier_text(message) + ", " +
                     length_text(message) + ", sent by " + std::string(to_text(message.sender));
  if (message.period > Duration{}) text += ", every " + std::to_string(to_ms(message.period)) + " ms";
  return text + ": " + std::string(message.meaning) + ".\n\n";
}

std::string message_text(const MessageSpec& message) {
  std::string text = heading_text(message) + "| place | type | signal | step | remarks |\n|---|---|---|---|---|\n";
  for (const SignalSpec& signal : message.signals) {
    text += "| " + place_text(signal) + " | " + type_text(signal) + " | `" + std::string(signal.name) + "` | " +
            step_text(signal) + " | " + remarks_text(signal) + " |\n";
  }
  const bool is_bmw = message.protection == Protection::nibble_counter_crc;
  if (has_crc(message)) text += std::string("| b7 | u8 | `crc` |  | ") + (is_bmw ? "CRC-8, 1Dh" : "CRC-8H2F") + " |\n";
  return text + "\n";
}

std::string bus_text(const Catalogue& catalogue, const std::string& title, const std::string& note = "") {
  std::string text = "### " + title + "\n\n" + (note.empty() ? "" : note + ".\n\n");
  for (const MessageSpec* message : catalogue.messages()) text += message_text(*message);
  return text;
}

}  // namespace

std::string device_doc(const std::vector<DeviceWord>& words, const DumpCatalogue& own, bool sensor_little_endian) {
  std::string text;
  for (const DeviceWord& word : words) {
    if (word.is_internal) text += bus_text(own.internal(), internal_title);
    if (word.is_vehicle) text += bus_text(own.vehicle(), vehicle_title);
    if (word.device == nullptr) continue;
    text += bus_text(catalogue_of(*word.device, sensor_little_endian), std::string(word.device->title),
                     numbers_note(*word.device));
  }
  return text;
}

std::string protocol_doc(const DumpCatalogue& own) {
  return bus_text(own.internal(), internal_title) + bus_text(own.vehicle(), vehicle_title);
}

}  // namespace bmu::dump
