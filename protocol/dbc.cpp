#include "protocol/dbc.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

namespace bmu {
namespace {

/// One BO_ entry: a row for one node.
struct Instance {
  const MessageSpec* message;
  std::uint8_t node;

  [[nodiscard]] unsigned id() const {
    constexpr unsigned extended_flag = 0x8000'0000;
    return message->id_of(node) | (message->is_extended ? extended_flag : 0U);
  }
};

/// The checksum is not a signal of a row, but readers of the DBC need to see the byte.
constexpr SignalSpec crc_signal{.name = "crc", .first_bit = byte(7), .bit_count = 8};

std::string two_digits(unsigned number) {
  return {static_cast<char>('0' + number / 10), static_cast<char>('0' + number % 10)};
}

std::string node_name(std::uint8_t node) {
  return "_N" + two_digits(node);
}

std::string number(double value) {
  std::array<char, 400> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr;
  return {text.data(), end};
}

std::string name_of(const Instance& one) {
  std::string name(one.message->name);
  if (!one.message->has_node()) return name;
  return name + (one.node == 0 && one.message->node_0_is_all ? "_ALL" : node_name(one.node));
}

std::string sender_of(const Instance& one) {
  std::string name(to_text(one.message->sender));
  const bool is_module = one.message->sender == Sender::mmu || one.message->sender == Sender::module;
  return is_module && one.message->has_node() ? name + node_name(one.node) : name;
}

std::vector<Instance> instances_of(const Catalogue& catalogue, std::span<const std::uint8_t> nodes) {
  std::vector<Instance> all;
  for (const MessageSpec* message : catalogue.messages()) {
    const bool has_all = message->has_node() && message->node_0_is_all;
    if (!message->has_node() || has_all) all.push_back({message, 0});
    if (!message->has_node()) continue;
    const unsigned first = has_all ? 1U : message->node_min;
    for (const std::uint8_t node : nodes) {
      if (node >= first && node <= message->node_max) all.push_back({message, node});
    }
  }
  return all;
}

std::vector<SignalSpec> signals_of(const MessageSpec& message) {
  std::vector<SignalSpec> all(message.signals.begin(), message.signals.end());
  if (has_crc(message)) all.push_back(crc_signal);
  return all;
}

std::string nodes_line(std::span<const Instance> instances) {
  std::vector<std::string> names;
  for (const Instance& one : instances) {
    const std::string name = sender_of(one);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  std::string line = "BU_:";
  for (const std::string& name : names) line += " " + name;
  return line + "\n";
}

std::string range_text(const SignalSpec& signal) {
  if (signal.bit_count == 64) return "[0|0]";  // eight characters or bytes: not a number, no range
  const RawRange range = raw_range(signal);
  const auto shown = [&signal](std::int64_t raw) {
    return number(shown_value(signal, raw * signal.scale + signal.offset));
  };
  return "[" + shown(range.min) + "|" + shown(range.max) + "]";
}

std::string multiplexing(const MessageSpec& message, std::size_t index) {
  const auto is_selected = [](const SignalSpec& signal) { return signal.selected_by >= 0; };
  if (index < message.signals.size() && is_selected(message.signals[index])) {
    return " m" + std::to_string(message.signals[index].selected_by);
  }
  const bool is_selector = index == 0 && std::any_of(message.signals.begin(), message.signals.end(), is_selected);
  return is_selector ? " M" : "";
}

std::string message_text(const Instance& one) {
  std::string text = "BO_ " + std::to_string(one.id()) + " " + name_of(one) + ": " +
                     std::to_string(one.message->length) + " " + sender_of(one) + "\n";
  const std::vector<SignalSpec> signals = signals_of(*one.message);
  for (std::size_t index = 0; index < signals.size(); ++index) {
    const SignalSpec& signal = signals[index];
    text += " SG_ " + std::string(name_without_unit(signal)) + multiplexing(*one.message, index) + " : " +
            std::to_string(dbc_start_bit(signal)) + "|" + std::to_string(signal.bit_count) +
            (signal.order == ByteOrder::big ? "@0" : "@1") + (signal.is_signed ? "-" : "+") + " (" +
            number(shown_value(signal, signal.scale)) + "," + number(shown_value(signal, signal.offset)) + ") " +
            range_text(signal) + " \"" + std::string(spec_of(signal.unit).symbol) + "\" Vector__XXX\n";
  }
  return text + "\n";
}

std::string crc_comment(Protection protection) {
  return protection == Protection::nibble_counter_crc
             ? "CRC-8, polynomial 1Dh, start 0, over identifier (low byte first) and b0 to b6"
             : "CRC-8H2F over identifier (high byte first) and b0 to b6";
}

std::string signal_comment(const MessageSpec& message, const SignalSpec& signal) {
  if (signal.name == crc_signal.name) return crc_comment(message.protection);
  if (signal.unit == Unit::text) {
    return std::to_string(signal.bit_count / 8) + " ASCII characters, first one in the most significant byte";
  }
  if (signal.rounding == Rounding::towards_zero) return "rounded towards zero";
  if (is_cell_mask(signal)) return "one bit a cell, cell 1 lowest";
  return {};
}

std::string comments_of(const Instance& one) {
  const std::string id = std::to_string(one.id());
  std::string text = "CM_ BO_ " + id + " \"" + std::string(one.message->meaning) + "\";\n";
  for (const SignalSpec& signal : signals_of(*one.message)) {
    const std::string comment = signal_comment(*one.message, signal);
    if (comment.empty()) continue;
    text.append("CM_ SG_ ").append(id).append(" ").append(name_without_unit(signal));
    text.append(" \"").append(comment).append("\";\n");
  }
  return text;
}

std::string cycle_time_of(const Instance& one) {
  const std::int64_t period_ms = to_ms(one.message->period);
  if (period_ms == 0) return {};
  return "BA_ \"GenMsgCycleTime\" BO_ " + std::to_string(one.id()) + " " + std::to_string(period_ms) + ";\n";
}

std::string value_names_of(const Instance& one) {
  std::string text;
  for (const SignalSpec& signal : one.message->signals) {
    if (signal.names.empty() && signal.special.empty()) continue;
    text += "VAL_ " + std::to_string(one.id()) + " " + std::string(name_without_unit(signal));
    for (const RawName& name : signal.names)
      text += " " + std::to_string(name.raw) + " \"" + std::string(name.name) + "\"";
    for (const SpecialCode& code : signal.special) {
      text += " " + std::to_string(code.raw) + " \"" + std::string(to_text(code.meaning)) + "\"";
    }
    text += " ;\n";
  }
  return text;
}

/// The values of the selector for which a signal exists. Written for all selected signals of a message if one of them
/// has more than one value.
std::string selections_of(const Instance& one) {
  const std::span<const SignalSpec> signals = one.message->signals;
  const auto is_many = [](const SignalSpec& signal) { return signal.selected_by >= 0 && signal.selected_count > 1; };
  if (std::none_of(signals.begin(), signals.end(), is_many)) return {};
  std::string text;
  for (const SignalSpec& signal : signals) {
    if (signal.selected_by < 0) continue;
    text.append("SG_MUL_VAL_ ").append(std::to_string(one.id())).append(" ").append(name_without_unit(signal));
    text.append(" ").append(name_without_unit(signals.front()));
    for (int turn = 0; turn < signal.selected_count; ++turn) {
      const std::string value = std::to_string(signal.selected_by + turn * signal.selected_step);
      text.append(turn == 0 ? " " : ", ").append(value).append("-").append(value);
    }
    text += ";\n";
  }
  return text;
}

}  // namespace

std::string dbc_text(const Catalogue& catalogue, std::span<const std::uint8_t> nodes) {
  const std::vector<Instance> instances = instances_of(catalogue, nodes);
  std::string text = "VERSION \"" BMUD_VERSION "\"\n\n\nNS_ :\n\nBS_:\n\n" + nodes_line(instances) + "\n\n";
  for (const Instance& one : instances) text += message_text(one);
  text += "CM_ \"bmud " + std::string(catalogue.name()) + " bus, made from the tables its codecs use\";\n";
  for (const Instance& one : instances) text += comments_of(one);
  text += "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n";
  for (const Instance& one : instances) text += cycle_time_of(one);
  for (const Instance& one : instances) text += value_names_of(one);
  for (const Instance& one : instances) text += selections_of(one);
  return text;
}

}  // namespace bmu
