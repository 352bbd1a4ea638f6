// A message row, which completely describes one kind of frame, and the catalogue that finds the row of an identifier.
//
// An identifier is base_id + node, or, in a protocol that encodes the node in another digit, base_id + node * 2 to the
// node_shift. Identifiers of 29 bits (is_extended) are a separate set: 351h and 00000351h are two identifiers.
//
// The rules of a row (fields inside the frame, no overlap, unit suffixes, counter and checksum where they belong) are
// checked at compile time: see check_message and check_catalogue, asserted beside the tables.
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

/// `bmu` is this program, the master of the pack, also on the bus of a third-party device. `module` is a module with a
/// third-party protocol.
enum class Sender : std::uint8_t {
  bmu,
  mmu,
  pdu,
  sensor,
  charger,
  inverter,
  insulation_monitor,
  module,
  tool,  // requests cell data from a master: a display, a laptop
};

[[nodiscard]] std::string_view to_text(Sender sender);

enum class Protection : std::uint8_t {
  none,
  counter_crc,             // b6 counter, b7 CRC-8H2F over identifier and b0 to b6
  counter_crc_complement,  // the same, and b1 must be the complement of b0
  channel_counter,         // current sensor: b0 is the channel, b1 .3-.0 a 4-bit counter, no CRC
  nibble_counter_crc,      // BMW's modules: b6 .7-.4 a counter from 0 to 14, b7 CRC 1Dh (frame_crc_1d)
};

struct MessageSpec {
  std::string_view name;
  std::uint32_t base_id = 0;
  bool is_extended = false;   // 29 bits
  std::uint8_t node_min = 0;  // identifier = base_id + (node << node_shift); 0 to 0: one identifier only
  std::uint8_t node_max = 0;
  std::uint8_t node_shift = 0;
  bool node_0_is_all = false;   // node 0 addresses all nodes
  std::uint8_t length = 8;      // as sent
  std::uint8_t length_min = 0;  // if some senders omit the end; 0: none does
  Protection protection = Protection::none;
  Sender sender = Sender::bmu;
  Duration period{};         // nominal; 0: on request or on change
  std::uint8_t channel = 0;  // for channel_counter: required value of b0
  std::span<const SignalSpec> signals;
  std::string_view meaning;

  [[nodiscard]] constexpr bool has_node() const { return node_max > 0; }
  [[nodiscard]] constexpr std::uint32_t id_of(std::uint32_t node) const { return base_id + (node << node_shift); }
  /// Minimum length of a frame of this kind.
  [[nodiscard]] constexpr std::uint8_t shortest() const { return length_min > 0 ? length_min : length; }
};

/// The counter of nibble_counter_crc goes from 0 to 14.
inline constexpr unsigned nibble_counter_values = 15;

/// Whether b7 is a checksum.
[[nodiscard]] constexpr bool has_crc(const MessageSpec& message) {
  return message.protection == Protection::counter_crc || message.protection == Protection::counter_crc_complement ||
         message.protection == Protection::nibble_counter_crc;
}
/// Expected b7. Precondition: the row has a checksum.
[[nodiscard]] constexpr std::uint8_t crc_wanted(const MessageSpec& message, const CanFrame& frame) {
  return message.protection == Protection::nibble_counter_crc ? frame_crc_1d(frame) : frame_crc(frame);
}
/// Counter of a frame. Precondition: the row has one.
[[nodiscard]] constexpr std::uint8_t counter_of(const MessageSpec& message, const CanFrame& frame) {
  switch (message.protection) {
    case Protection::channel_counter: return frame.data[1] & 0x0FU;
    case Protection::nibble_counter_crc: return static_cast<std::uint8_t>(frame.data[6] >> 4U);
    default: return frame.data[6];
  }
}

inline constexpr std::size_t signal_count_max = 80;
/// Limit for the signals of one frame: those selected by its selector.
inline constexpr std::size_t shown_signals_max = 32;

/// Index of a signal in a row, found at compile time; an unknown name does not compile.
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
  return CanFrame{.id = message.id_of(node), .is_extended = message.is_extended, .length = message.length};
}

/// Writes counter and checksum as the row's protection requires. Last step before sending.
constexpr void seal(const MessageSpec& message, std::uint8_t counter, CanFrame& frame) {
  if (message.protection == Protection::channel_counter) {
    frame.data[0] = message.channel;
    frame.data[1] = static_cast<std::uint8_t>((frame.data[1] & 0xF0) | (counter & 0x0F));
  }
  if (message.protection == Protection::counter_crc_complement) {
    frame.data[1] = static_cast<std::uint8_t>(~frame.data[0]);
  }
  if (message.protection == Protection::nibble_counter_crc) {
    frame.data[6] = static_cast<std::uint8_t>((frame.data[6] & 0x0FU) | ((counter % nibble_counter_values) << 4U));
  } else if (has_crc(message)) {
    frame.data[6] = counter;
  }
  if (has_crc(message)) frame.data[7] = crc_wanted(message, frame);
}

// --- rules of a row -------------------------------------------------------------------------------------------------

[[nodiscard]] constexpr bool ends_with_token(std::string_view name, std::string_view token) {
  if (token.empty()) return true;
  return name.size() > token.size() + 1 && name.ends_with(token) && name[name.size() - token.size() - 1] == '_';
}

[[nodiscard]] constexpr bool may_overlap(const SignalSpec& one, const SignalSpec& other) {
  if (one.selected_by < 0 || other.selected_by < 0) return false;
  for (int turn = 0; turn < one.selected_count; ++turn) {
    if (is_selected(other, one.selected_by + turn * one.selected_step)) return false;
  }
  return true;
}

[[nodiscard]] constexpr std::uint64_t occupied_bits(const SignalSpec& signal) {
  return occupied_bits(signal.first_bit, signal.bit_count, signal.order);
}

[[nodiscard]] constexpr bool check_signal(const SignalSpec& signal, unsigned length) {
  const bool fits = signal.bit_count >= 1 && signal.first_bit + unsigned{signal.bit_count} <= length * 8;
  // Rounding towards zero applies to the raw value; with an offset it would be ambiguous which zero is meant.
  const bool rounds_rightly = signal.rounding == Rounding::nearest || signal.offset == 0;
  const bool is_selected_rightly = signal.selected_count >= 1 && signal.selected_step >= 1;
  const bool has_one_range = signal.raw_limit == 0 || signal.documented.max == 0;
  return fits && signal.scale > 0 && rounds_rightly && is_selected_rightly && has_one_range &&
         ends_with_token(signal.name, spec_of(signal.unit).token);
}

/// Number of signals in a frame with this value of the selector.
[[nodiscard]] constexpr std::size_t signals_with(const MessageSpec& message, std::int64_t selector) {
  std::size_t count = 0;
  for (const SignalSpec& signal : message.signals) {
    if (is_selected(signal, selector)) ++count;
  }
  return count;
}

/// Checks lengths and counts, and that a protected message has an 11-bit identifier (the receive check stores counters
/// by 11-bit identifier only) and a fixed length.
[[nodiscard]] constexpr bool check_form(const MessageSpec& message) {
  const bool is_long_enough = message.length <= 8 && message.length_min <= message.length;
  const bool is_protected_rightly =
      message.protection == Protection::none || (!message.is_extended && message.length_min == 0);
  return is_long_enough && is_protected_rightly && (!has_crc(message) || message.length == 8) &&
         message.signals.size() <= signal_count_max;
}

/// Number of bytes in which the signal must lie. b7 is excluded if it is the checksum. The end that some senders omit
/// (its bytes are then 0) may only have signals for which 0 is a special code.
[[nodiscard]] constexpr unsigned room_of(const MessageSpec& message, const SignalSpec& signal) {
  if (has_crc(message)) return 7;
  return find_special(signal, 0) != nullptr ? message.length : message.shortest();
}

[[nodiscard]] constexpr bool check_message(const MessageSpec& message) {
  if (!check_form(message)) return false;
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    const SignalSpec& one = message.signals[i];
    if (!check_signal(one, room_of(message, one)) || signals_with(message, one.selected_by) > shown_signals_max)
      return false;
    for (std::size_t j = 0; j < i; ++j) {
      const SignalSpec& other = message.signals[j];
      const bool apart = (occupied_bits(one) & occupied_bits(other)) == 0;
      if ((!apart && !may_overlap(one, other)) || one.name == other.name) return false;
    }
  }
  return true;
}

// --- catalogue ------------------------------------------------------------------------------------------------------

/// A message row and the node that an identifier addresses.
struct MessageMatch {
  const MessageSpec* message = nullptr;  // null: the identifier is not in this catalogue
  std::uint8_t node = 0;
};

/// All messages of a bus, found by 11-bit identifier in constant time (one table read); the few of 29 bits by search.
class Catalogue {
 public:
  static constexpr std::size_t id_count = 2048;
  static constexpr std::uint32_t extended_id_max = 0x1FFF'FFFF;
  static constexpr std::uint8_t no_row = 0xFF;

  constexpr Catalogue(std::string_view name, std::span<const MessageSpec* const> messages)
      : name_(name), messages_(messages) {
    row_of_id_.fill(no_row);
    for (std::size_t row = 0; row < messages.size(); ++row) {
      for (unsigned node = messages[row]->node_min; node <= messages[row]->node_max; ++node) {
        take_id(messages[row]->id_of(node), static_cast<std::uint8_t>(row));
      }
    }
  }

  /// Match of an 11-bit identifier.
  [[nodiscard]] constexpr MessageMatch find(std::uint32_t id) const {
    return id < id_count ? match(id, row_of_id_[id]) : MessageMatch{};
  }
  /// Match of either kind of identifier; also of a remote or an error frame.
  [[nodiscard]] constexpr MessageMatch find(const CanFrame& frame) const {
    return frame.is_extended ? match(frame.id, extended_row(frame.id)) : find(frame.id);
  }
  /// Index in messages(); no_row if there is none.
  [[nodiscard]] constexpr std::uint8_t row_of(const CanFrame& frame) const {
    if (frame.is_extended) return extended_row(frame.id);
    return frame.id < id_count ? row_of_id_[frame.id] : no_row;
  }
  [[nodiscard]] constexpr std::span<const MessageSpec* const> messages() const { return messages_; }
  [[nodiscard]] constexpr std::string_view name() const { return name_; }
  [[nodiscard]] constexpr bool ids_unique() const { return ids_unique_; }

 private:
  constexpr void take_id(std::uint32_t id, std::uint8_t row) {
    if (messages_[row]->is_extended) {
      has_extended_ = true;
      ids_unique_ = ids_unique_ && id <= extended_id_max && extended_row(id) == row;
      return;
    }
    ids_unique_ = ids_unique_ && id < id_count && row_of_id_[id] == no_row;
    if (id < id_count) row_of_id_[id] = row;
  }
  /// First row with this identifier.
  [[nodiscard]] constexpr std::uint8_t extended_row(std::uint32_t id) const {
    for (std::size_t row = 0; has_extended_ && row < messages_.size(); ++row) {
      const MessageSpec& message = *messages_[row];
      if (!message.is_extended || id < message.id_of(message.node_min)) continue;
      const std::uint32_t node = (id - message.base_id) >> message.node_shift;
      if (node <= message.node_max && message.id_of(node) == id) return static_cast<std::uint8_t>(row);
    }
    return no_row;
  }
  [[nodiscard]] constexpr MessageMatch match(std::uint32_t id, std::uint8_t row) const {
    if (row == no_row) return {};
    const MessageSpec* message = messages_[row];
    return {message, static_cast<std::uint8_t>((id - message->base_id) >> message->node_shift)};
  }

  std::string_view name_;
  std::span<const MessageSpec* const> messages_;
  std::array<std::uint8_t, id_count> row_of_id_{};
  bool has_extended_ = false;
  bool ids_unique_ = true;
};

[[nodiscard]] constexpr bool check_catalogue(const Catalogue& catalogue) {
  if (!catalogue.ids_unique() || catalogue.messages().size() >= 0xFF) return false;
  return std::all_of(catalogue.messages().begin(), catalogue.messages().end(),
                     [](const MessageSpec* message) { return check_message(*message); });
}

}  // namespace bmu
