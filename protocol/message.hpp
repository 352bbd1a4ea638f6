// A message: a row that says everything about one kind of frame; and the catalogue that finds the row of an identifier.
//
// The rules a row must keep (fields inside the frame, no overlap, unit tokens, counter and checksum where they belong)
// are checked when the program is compiled: see check_message and check_catalogue, asserted beside the tables.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class Sender : std::uint8_t { bmu, mmu, pdu, sensor };

[[nodiscard]] std::string_view to_text(Sender sender);

enum class Protection : std::uint8_t {
  none,
  counter_crc,             // b6 counter, b7 CRC-8H2F over identifier and b0 to b6
  counter_crc_complement,  // the same, and b1 must be the complement of b0
  channel_counter,         // the current sensor: b0 names the channel, b1 .3-.0 a 4-bit counter, no CRC
};

struct MessageSpec {
  std::string_view name;
  std::uint16_t base_id = 0;
  std::uint8_t node_min = 0;  // identifier = base_id + node; 0 to 0: one identifier only
  std::uint8_t node_max = 0;
  std::uint8_t length = 8;
  Protection protection = Protection::none;
  Sender sender = Sender::bmu;
  Duration period{};         // nominal; 0: on request or on change
  std::uint8_t channel = 0;  // for channel_counter: what b0 must be
  std::span<const SignalSpec> signals;
  std::string_view meaning;

  [[nodiscard]] constexpr bool has_node() const { return node_max > 0; }
};

[[nodiscard]] constexpr bool has_crc(const MessageSpec& message) {
  return message.protection == Protection::counter_crc || message.protection == Protection::counter_crc_complement;
}

inline constexpr std::size_t signal_count_max = 24;

/// Index of a signal in a row, found while compiling; an unknown name does not compile.
[[nodiscard]] consteval std::size_t signal_index(const MessageSpec& message, std::string_view name) {
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    if (message.signals[index].name == name) return index;
  }
  throw "this message has no such signal";
}

/// A name as a template argument: read<internal_bus::status, "cell_count">(frame).
template <std::size_t Size>
struct SignalName {
  std::array<char, Size> text{};
  consteval SignalName(const char (&name)[Size]) { std::copy_n(name, Size, text.begin()); }
  [[nodiscard]] constexpr std::string_view view() const { return {text.data(), Size - 1}; }
};

/// The value of one signal of a frame that passed its receive check.
template <const MessageSpec& Message, SignalName Name>
[[nodiscard]] constexpr SignalValue read(const CanFrame& frame) {
  constexpr std::size_t index = signal_index(Message, Name.view());
  return decode_signal(Message.signals[index], frame.data);
}
/// The same for flags, masks, counters and selectors, which have no "unknown".
template <const MessageSpec& Message, SignalName Name>
[[nodiscard]] constexpr std::int64_t read_raw(const CanFrame& frame) {
  constexpr std::size_t index = signal_index(Message, Name.view());
  return raw_of(Message.signals[index], frame.data);
}
template <const MessageSpec& Message, SignalName Name>
constexpr void write(CanFrame& frame, const SignalValue& value) {
  constexpr std::size_t index = signal_index(Message, Name.view());
  encode_signal(Message.signals[index], value, frame.data);
}
template <const MessageSpec& Message, SignalName Name>
constexpr void write(CanFrame& frame, std::int64_t value) {
  write<Message, Name>(frame, known(value));
}

/// An empty frame of this kind: identifier and length set, every byte 0.
[[nodiscard]] constexpr CanFrame make_frame(const MessageSpec& message, std::uint8_t node = 0) {
  return data_frame(message.base_id + std::uint32_t{node}, message.length);
}

/// Writes counter and checksum as the row's protection wants them. Last step before sending.
constexpr void seal(const MessageSpec& message, std::uint8_t counter, CanFrame& frame) {
  if (message.protection == Protection::channel_counter) {
    frame.data[0] = message.channel;
    frame.data[1] = static_cast<std::uint8_t>((frame.data[1] & 0xF0) | (counter & 0x0F));
  }
  if (message.protection == Protection::counter_crc_complement) {
    frame.data[1] = static_cast<std::uint8_t>(~frame.data[0]);
  }
  if (has_crc(message)) {
    frame.data[6] = counter;
    frame.data[7] = frame_crc(frame);
  }
}

// --- rules of a row -------------------------------------------------------------------------------------------------

[[nodiscard]] constexpr bool ends_with_token(std::string_view name, std::string_view token) {
  if (token.empty()) return true;
  return name.size() > token.size() + 1 && name.ends_with(token) && name[name.size() - token.size() - 1] == '_';
}

[[nodiscard]] constexpr bool may_overlap(const SignalSpec& one, const SignalSpec& other) {
  return one.selected_by != other.selected_by && one.selected_by >= 0 && other.selected_by >= 0;
}

[[nodiscard]] constexpr bool check_signal(const SignalSpec& signal, unsigned length) {
  const bool fits = signal.bit_count >= 1 && signal.first_bit + unsigned{signal.bit_count} <= length * 8;
  const bool whole_bytes = signal.order == ByteOrder::big || (signal.first_bit % 8 == 0 && signal.bit_count % 8 == 0);
  return fits && whole_bytes && signal.scale > 0 && ends_with_token(signal.name, spec_of(signal.unit).token);
}

[[nodiscard]] constexpr bool check_message(const MessageSpec& message) {
  const unsigned room = has_crc(message) ? 7 : message.length;  // b7 is the checksum, which is no signal
  if (message.length > 8 || (has_crc(message) && message.length != 8) || message.signals.size() > signal_count_max) {
    return false;
  }
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    const SignalSpec& one = message.signals[i];
    if (!check_signal(one, room)) return false;
    for (std::size_t j = 0; j < i; ++j) {
      const SignalSpec& other = message.signals[j];
      const bool apart =
          one.first_bit >= other.first_bit + other.bit_count || other.first_bit >= one.first_bit + one.bit_count;
      if ((!apart && !may_overlap(one, other)) || one.name == other.name) return false;
    }
  }
  return true;
}

// --- catalogue ------------------------------------------------------------------------------------------------------

/// A message row and the node an identifier addresses.
struct MessageMatch {
  const MessageSpec* message = nullptr;  // null: no such identifier here
  std::uint8_t node = 0;
};

/// All messages of a bus, found by 11-bit identifier in constant time (one table read).
class Catalogue {
 public:
  static constexpr std::size_t id_count = 2048;

  constexpr Catalogue(std::string_view name, std::span<const MessageSpec* const> messages)
      : name_(name), messages_(messages) {
    row_of_id_.fill(none);
    for (std::size_t row = 0; row < messages.size(); ++row) {
      for (unsigned node = messages[row]->node_min; node <= messages[row]->node_max; ++node) {
        const std::size_t id = messages[row]->base_id + std::size_t{node};
        ids_unique_ = ids_unique_ && id < id_count && row_of_id_[id] == none;
        if (id < id_count) row_of_id_[id] = static_cast<std::uint8_t>(row);
      }
    }
  }

  [[nodiscard]] constexpr MessageMatch find(std::uint32_t id) const {
    if (id >= id_count || row_of_id_[id] == none) return {};
    const MessageSpec* message = messages_[row_of_id_[id]];
    return {message, static_cast<std::uint8_t>(id - message->base_id)};
  }
  [[nodiscard]] constexpr std::span<const MessageSpec* const> messages() const { return messages_; }
  [[nodiscard]] constexpr std::string_view name() const { return name_; }
  [[nodiscard]] constexpr bool ids_unique() const { return ids_unique_; }

 private:
  static constexpr std::uint8_t none = 0xFF;

  std::string_view name_;
  std::span<const MessageSpec* const> messages_;
  std::array<std::uint8_t, id_count> row_of_id_{};
  bool ids_unique_ = true;
};

[[nodiscard]] constexpr bool check_catalogue(const Catalogue& catalogue) {
  if (!catalogue.ids_unique() || catalogue.messages().size() >= 0xFF) return false;
  return std::all_of(catalogue.messages().begin(), catalogue.messages().end(),
                     [](const MessageSpec* message) { return check_message(*message); });
}

}  // namespace bmu
