#include "tools/bmudump/frame_text.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string>

#include "tools/bmudump/error_text.hpp"
#include "tools/bmudump/identify/letters.hpp"
#include "tools/bmudump/words.hpp"

namespace bmu::dump {
namespace {

constexpr std::string_view hex_digits = "0123456789ABCDEF";
constexpr std::size_t label_width = 17;  // CONTACTOR_COMMAND
constexpr std::string_view label_on = "\x1b[1m";

// The longest line: every signal with its piece, a cell mask or eight escaped letters after it, and its unit; or every
// byte of CAN XL, as two digits and a letter. The remainder includes the names of bits, because no message has many of
// them.
constexpr std::size_t signal_room = 2 * Piece::room + 64;
constexpr std::size_t rest_room = 6 * bus_name_length_max + 1'536;
static_assert(shown_signals_max * signal_room + rest_room <= TextWriter::line_room);
static_assert(xl_bytes_max * 4 + rest_room <= TextWriter::line_room);

std::string_view name_of_raw(const SignalSpec& signal, std::int64_t raw) {
  for (const RawName& name : signal.names) {
    if (name.raw == raw) return name.name;
  }
  return {};
}

/// True for cell_voltage_2 after cell_voltage_1: numbers, which are never omitted, of one kind.
bool is_next_of(const SignalSpec& before, const SignalSpec& signal) {
  const auto stem = [](const SignalSpec& one) {
    const std::string_view name = name_without_unit(one);
    const std::size_t end = name.rfind('_');
    const bool is_numbered = end != std::string_view::npos && end + 1 < name.size() &&
                             name.find_first_not_of("0123456789", end + 1) == std::string_view::npos;
    return is_numbered && one.bit_count > 1 && one.names.empty() ? name.substr(0, end) : std::string_view();
  };
  return !stem(signal).empty() && stem(before) == stem(signal) && before.selected_by == signal.selected_by;
}

void print_bits(const SignalSpec& signal, std::int64_t raw, TextWriter& out) {
  std::string_view separator;
  for (const RawName& one : signal.names) {
    if ((raw & one.raw) == 0) continue;
    out.text(separator);
    out.text(one.name);
    separator = ", ";
  }
  if (raw == 0) out.text("none");
}

void print_cells(std::int64_t mask, TextWriter& out) {
  if (mask == 0) return out.text("none");
  for (int cell = 1; mask != 0; ++cell, mask >>= 1) {
    if ((mask & 1) == 0) continue;
    out.decimal(cell);
    if ((mask >> 1) != 0) out.letter(',');
  }
}

using Bytes = std::span<const std::uint8_t>;

void print_hex_bytes(Bytes bytes, TextWriter& out) {
  for (const std::uint8_t byte : bytes) out.hex(byte, 2);
}

void print_spaced_bytes(Bytes bytes, TextWriter& out) {
  for (const std::uint8_t byte : bytes) {
    out.letter(' ');
    out.hex(byte, 2);
  }
}

void print_letters_or_bytes(std::string_view letters, TextWriter& out) {
  if (is_text(letters)) return out.json_string(letters);
  out.text("no text:");
  for (const char one : letters) {
    out.letter(' ');
    out.hex(static_cast<std::uint8_t>(one), 2);
  }
}

void print_letters(Bytes bytes, TextWriter& out) {
  out.text("  '");
  for (const std::uint8_t one : bytes) out.letter(one >= 0x20 && one < 0x7F ? static_cast<char>(one) : '.');
  out.letter('\'');
}

Bytes bytes_of(const CanFrame& frame) {
  return {frame.data.data(), frame.length};
}

int id_digits(const CanFrame& frame) {
  return frame.is_extended || frame.is_error ? 8 : 3;
}

std::string three_hex_digits(std::size_t id) {
  return {hex_digits[(id >> 8) & 0xF], hex_digits[(id >> 4) & 0xF], hex_digits[id & 0xF]};
}

}  // namespace

FrameText::FrameText(const DumpCatalogue& catalogue, const Style& style, LineStart& start)
    : catalogue_(&catalogue), style_(style), start_(&start), label_of_id_(Catalogue::id_count) {
  if (style.is_coloured) colours_ = {"\x1b[2m", "\x1b[33m", "\x1b[1;31m", "\x1b[0m"};
  for (const MessageSpec* message : catalogue.all().messages()) {
    MessagePlan plan;
    const std::string dialect = catalogue.is_vehicle(plans_.size())
                                    ? "\"dialect\":\"" + std::string(catalogue.dialect().name) + "\","
                                    : std::string();
    plan.json_lead = Piece(",\"message\":\"" + std::string(message->name) + "\"," + dialect + "\"node\":");
    plan.signals = plans_of(*message);
    plans_.push_back(std::move(plan));
  }
  for (std::size_t id = 0; id < Catalogue::id_count; ++id) {
    const MessageMatch match = catalogue.all().find(static_cast<std::uint32_t>(id));
    std::string label = name_text(match.message, match.node);
    label.resize(std::max(label.size(), label_width), ' ');
    std::string text = " " + three_hex_digits(id) + " ";
    label_of_id_[id] = Piece(text.append(style.is_coloured ? label_on : "").append(label).append(colours_.off));
  }
}

std::vector<FrameText::SignalPlan> FrameText::plans_of(const MessageSpec& message) const {
  std::vector<SignalPlan> plans;
  const SignalSpec* before = nullptr;
  for (const SignalSpec& signal : message.signals) {
    const std::string_view name = name_without_unit(signal);
    const bool goes_on = style_.is_short && before != nullptr && is_next_of(*before, signal);
    plans.push_back(plan_of(signal, goes_on ? name.substr(name.rfind('_')) : name));
    if (goes_on) plans.back().text_unit = Piece("");
    before = &signal;
  }
  return plans;
}

FrameText::Show FrameText::show_of(const SignalSpec& signal) const {
  if (signal.unit == Unit::text) return Show::text;
  if (is_bit_set(signal)) return Show::bits;
  if (!signal.names.empty()) return Show::name;
  if (signal.bit_count == 1) return style_.is_short ? Show::set_flag : Show::flag;
  return is_cell_mask(signal) ? Show::cells : Show::number;
}

FrameText::LeftOut FrameText::left_out_of(const SignalSpec& signal, Show show) const {
  if (show == Show::set_flag) return LeftOut::where_zero;
  if (!style_.is_brief) return LeftOut::never;
  if (signal.name == "counter" || signal.name == "complement") return LeftOut::always;
  const bool says_no_with_zero = show == Show::flag || show == Show::bits || show == Show::cells;
  return says_no_with_zero ? LeftOut::where_zero : LeftOut::never;
}

FrameText::SignalPlan FrameText::plan_of(const SignalSpec& signal, std::string_view name) const {
  const UnitSpec& unit = spec_of(signal.unit);
  SignalPlan plan;
  plan.show = show_of(signal);
  const std::string_view space = plan.show == Show::set_flag ? "" : " ";
  plan.text_lead = Piece(std::string("  ").append(colours_.name).append(name).append(colours_.off).append(space));
  plan.text_unit = Piece(unit.symbol.empty() ? "" : " " + std::string(unit.symbol));
  plan.json_lead = Piece("\"" + std::string(signal.name) + "\":");
  plan.spec = &signal;
  const bool is_whole = signal.scale % unit.divisor == 0 && signal.offset % unit.divisor == 0;
  plan.steps_per_raw = is_whole ? signal.scale / unit.divisor : 0;
  plan.steps_of_zero = is_whole ? signal.offset / unit.divisor : 0;
  plan.divisor = unit.divisor;
  plan.decimals = unit.decimals;
  plan.left_out = left_out_of(signal, plan.show);
  return plan;
}

void FrameText::print_text(const SeenFrame& seen, TextWriter& out) {
  const CanFrame& frame = seen.line.frame;
  out.begin_line();
  start_->print(seen.line, out);
  // A frame that cannot be the message of its identifier has no label (Dump::judge); a remote frame has no contents to
  // check.
  const bool has_label = seen.verdict.message != nullptr || frame.is_remote;
  const bool is_short = id_digits(frame) == 3 && seen.line.kind == LogLineKind::frame;
  if (is_short && (has_label || catalogue_->all().row_of(frame) == Catalogue::no_row)) {
    out.piece(label_of_id_[frame.id]);
  } else {
    print_other_label(seen, out);
  }
  print_meaning(seen, out);
  out.letter('\n');
}

void FrameText::print_other_label(const SeenFrame& seen, TextWriter& out) const {
  const LogLine& line = seen.line;
  const MessageSpec* const message = seen.verdict.message;
  std::string label = line.kind == LogLineKind::frame ? name_text(message, seen.verdict.node)
                      : long_frame_of(line).is_xl     ? "CAN XL"
                                                      : "CAN FD";
  const auto digits = static_cast<std::size_t>(id_digits(line.frame));
  constexpr std::size_t width = label_width + 3;  // keeps the column of the data
  out.letter(' ');
  out.hex(line.frame.id, static_cast<int>(digits));
  out.letter(' ');
  const bool is_bold = style_.is_coloured && message != nullptr;
  out.text(is_bold ? label_on : "");
  out.text(label);
  out.spaces(std::max(width, label.size() + digits) - label.size() - digits);
  out.text(is_bold ? colours_.off : "");
}

void FrameText::print_meaning(const SeenFrame& seen, TextWriter& out) const {
  if (!seen.verdict.is_accepted) return print_raw(seen, out);
  print_signals(plans_[catalogue_->all().row_of(seen.line.frame)], seen.line.frame, out);
}

void FrameText::print_signals(const MessagePlan& plan, const CanFrame& frame, TextWriter& out) const {
  const std::uint64_t word = load_big_endian(frame.data);
  std::int64_t selector = -1;
  bool is_empty = true;
  for (const SignalPlan& one : plan.signals) {
    const std::int64_t raw = raw_of(*one.spec, word);
    if (&one == plan.signals.data()) selector = raw;
    if (!is_selected(*one.spec, selector)) continue;
    if (one.left_out != LeftOut::never && (raw == 0 || one.left_out == LeftOut::always)) continue;
    out.piece(one.text_lead);
    print_value(one, raw, out);
    is_empty = false;
  }
  if (is_empty && !plan.signals.empty()) out.text("  nothing set");
}

void FrameText::print_value(const SignalPlan& plan, std::int64_t raw, TextWriter& out) const {
  const SignalValue value = value_of_raw(*plan.spec, raw);
  if (!value.is_valid()) {
    out.text(colours_.odd);
    out.text(to_text(value.validity));
    return out.text(colours_.off);
  }
  switch (plan.show) {
    case Show::number: {
      const bool is_whole = plan.steps_per_raw != 0;
      out.scaled(
          is_whole ? raw * plan.steps_per_raw + plan.steps_of_zero : divide_to_nearest(value.value, plan.divisor),
          plan.decimals);
      return out.piece(plan.text_unit);
    }
    case Show::flag: return out.text(raw != 0 ? "yes" : "no");
    case Show::set_flag: return;
    case Show::bits: return print_bits(*plan.spec, raw, out);
    case Show::cells: return print_cells(raw, out);
    case Show::text: return print_letters_or_bytes(letters_of(*plan.spec, raw).view(), out);
    case Show::name: {
      const std::string_view name = name_of_raw(*plan.spec, raw);
      return name.empty() ? out.decimal(raw) : out.text(name);
    }
  }
}

void FrameText::print_raw(const SeenFrame& seen, TextWriter& out) const {
  const CanFrame& frame = seen.line.frame;
  out.text("  ");
  if (seen.line.kind == LogLineKind::fd_frame) return print_long(seen.line, out);
  if (frame.is_remote) {
    out.text("remote frame, requests ");
    out.decimal(frame.length);
    return out.text(" bytes");
  }
  if (frame.is_error) {
    out.text(colours_.bad);
    out.text("error frame: ");
    print_error_frame(frame, out);
    out.text(colours_.off);
    out.text("  ");
  } else if (seen.verdict.message != nullptr) {
    out.text(colours_.bad);
    out.text("!! ");
    out.text(to_text(seen.verdict.reason));
    out.text(colours_.off);
    out.text("  ");
  }
  out.letter('[');
  out.decimal(frame.length);
  out.letter(']');
  print_spaced_bytes(bytes_of(frame), out);
  if (style_.has_letters) print_letters(bytes_of(frame), out);
}

/// Prints the length in two digits, as candump does to distinguish CAN FD from classic CAN.
void FrameText::print_long(const LogLine& line, TextWriter& out) const {
  std::array<std::uint8_t, xl_bytes_max> room;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by unpack
  const Bytes bytes(room.data(), unpack(long_frame_of(line), room));
  out.letter('[');
  if (bytes.size() < 10) out.letter('0');
  out.decimal(static_cast<std::int64_t>(bytes.size()));
  out.letter(']');
  print_spaced_bytes(bytes, out);
  if (style_.has_letters) print_letters(bytes, out);
}

void FrameText::print_json(const SeenFrame& seen, TextWriter& out) const {
  const CanFrame& frame = seen.line.frame;
  const CheckedFrame& verdict = seen.verdict;
  out.begin_line();
  out.text("{\"time_s\":");
  if (seen.line.number != 0) {
    out.text("null,\"number\":");
    out.decimal(seen.line.number);
  } else {
    out.time(seen.line.time_us);
  }
  out.text(",\"bus\":");
  out.json_string(seen.line.bus);
  out.text(",\"id\":\"");
  out.hex(frame.id, id_digits(frame));
  out.letter('"');
  if (seen.line.direction != Direction::unknown) {
    out.text(seen.line.direction == Direction::sent ? ",\"direction\":\"sent\"" : ",\"direction\":\"received\"");
  }
  if (seen.line.length_code != 0) {
    out.text(",\"length_code\":");
    out.decimal(seen.line.length_code);
  }
  if (verdict.message == nullptr) {
    out.text(",\"message\":null,\"node\":null,\"ok\":null");
    print_json_raw(seen.line, out);
  } else {
    print_json_verdict(plans_[catalogue_->all().row_of(frame)], seen, out);
  }
  out.text("}\n");
}

void FrameText::print_json_verdict(const MessagePlan& plan, const SeenFrame& seen, TextWriter& out) {
  out.piece(plan.json_lead);
  if (seen.verdict.message->has_node()) {
    out.decimal(seen.verdict.node);
  } else {
    out.text("null");
  }
  if (seen.verdict.is_accepted) {
    out.text(",\"ok\":true");
    return print_json_signals(plan, seen.line.frame, out);
  }
  out.text(",\"ok\":false,\"reason\":");
  out.json_string(to_text(seen.verdict.reason));
  print_json_raw(seen.line, out);
}

void FrameText::print_json_raw(const LogLine& line, TextWriter& out) {
  if (line.kind == LogLineKind::fd_frame) return print_json_long(line, out);
  if (line.frame.is_remote) {
    out.text(",\"remote\":true,\"length\":");
    out.decimal(line.frame.length);
  }
  if (line.frame.is_error) {
    out.text(",\"error\":true,\"text\":\"");
    print_error_frame(line.frame, out);  // fixed texts: nothing to escape
    out.letter('"');
  }
  out.text(",\"data\":\"");
  if (!line.frame.is_remote) print_hex_bytes(bytes_of(line.frame), out);
  out.letter('"');
}

void FrameText::print_json_long(const LogLine& line, TextWriter& out) {
  const LongFrame frame = long_frame_of(line);
  std::array<std::uint8_t, xl_bytes_max> room;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by unpack
  const Bytes bytes(room.data(), unpack(frame, room));
  if (frame.is_xl) {
    out.text(",\"xl\":true");
  } else {
    out.text(",\"fd\":true,\"fd_flags\":");
    out.decimal(frame.flags);
  }
  out.text(",\"data\":\"");
  print_hex_bytes(bytes, out);
  out.letter('"');
}

void FrameText::print_json_signals(const MessagePlan& plan, const CanFrame& frame, TextWriter& out) {
  out.text(plan.signals.empty() ? ",\"signals\":{" : ",\"signals\":");
  const std::uint64_t word = load_big_endian(frame.data);
  std::int64_t selector = -1;
  bool is_first = true;
  for (const SignalPlan& one : plan.signals) {
    const std::int64_t raw = raw_of(*one.spec, word);
    if (is_first) selector = raw;
    if (!is_selected(*one.spec, selector)) continue;
    out.letter(is_first ? '{' : ',');
    is_first = false;
    out.piece(one.json_lead);
    const SignalValue value = value_of_raw(*one.spec, raw);
    const Letters letters = one.show == Show::text ? letters_of(*one.spec, raw) : Letters{};
    if (letters.count > 0 && value.is_valid() && is_text(letters.view())) {
      out.json_string(letters.view());
    } else if (letters.count == 0 && value.is_valid()) {
      out.decimal(value.value);
    } else {
      out.text("null");
    }
  }
  out.letter('}');
}

}  // namespace bmu::dump
