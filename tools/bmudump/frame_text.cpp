#include "tools/bmudump/frame_text.hpp"

#include <algorithm>
#include <string>

#include "tools/bmudump/error_text.hpp"

namespace bmu::dump {
namespace {

constexpr std::string_view hex_digits = "0123456789ABCDEF";
constexpr std::size_t label_width = 17;  // CONTACTOR_COMMAND
constexpr std::string_view unknown_label = "unknown";

// The longest line: every signal with its piece, a cell mask or eight escaped letters behind it, and its unit.
constexpr std::size_t signal_room = 2 * Piece::room + 64;
static_assert(signal_count_max * signal_room + 6 * bus_name_length_max + 1'536 <= TextWriter::line_room);

/// Text of a quantity that is no number: eight letters, the first in the highest byte.
std::array<char, 8> letters_of(std::int64_t raw) {
  std::array<char, 8> letters{};
  for (std::size_t index = 0; index < letters.size(); ++index) {
    letters[index] = static_cast<char>(static_cast<std::uint64_t>(raw) >> (56 - 8 * index));
  }
  return letters;
}

std::string_view name_of_raw(const SignalSpec& signal, std::int64_t raw) {
  for (const RawName& name : signal.names) {
    if (name.raw == raw) return name.name;
  }
  return {};
}

void print_cells(std::int64_t mask, TextWriter& out) {
  if (mask == 0) return out.text("none");
  for (int cell = 1; mask != 0; ++cell, mask >>= 1) {
    if ((mask & 1) == 0) continue;
    out.decimal(cell);
    if ((mask >> 1) != 0) out.letter(',');
  }
}

void print_hex_bytes(const CanFrame& frame, TextWriter& out) {
  for (std::size_t index = 0; index < frame.length; ++index) out.hex(frame.data[index], 2);
}

void print_spaced_bytes(const CanFrame& frame, TextWriter& out) {
  out.letter('[');
  out.decimal(frame.length);
  out.letter(']');
  for (std::size_t index = 0; index < frame.length; ++index) {
    out.letter(' ');
    out.hex(frame.data[index], 2);
  }
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
  const std::string label_on(style.is_coloured ? "\x1b[1m" : "");
  for (const MessageSpec* message : catalogue.all().messages()) {
    MessagePlan plan;
    plan.json_lead = Piece(",\"message\":\"" + std::string(message->name) + "\",\"node\":");
    for (const SignalSpec& signal : message->signals) plan.signals.push_back(plan_of(signal, colours_));
    plans_.push_back(std::move(plan));
  }
  for (std::size_t id = 0; id < Catalogue::id_count; ++id) {
    const MessageMatch match = catalogue.all().find(static_cast<std::uint32_t>(id));
    std::string label(match.message == nullptr ? unknown_label : match.message->name);
    if (match.message != nullptr && match.message->has_node()) label += " node " + std::to_string(match.node);
    label.resize(std::max(label.size(), label_width), ' ');
    std::string text = " " + three_hex_digits(id) + " ";
    label_of_id_[id] = Piece(text.append(label_on).append(label).append(colours_.off));
  }
}

FrameText::SignalPlan FrameText::plan_of(const SignalSpec& signal, const Colours& colours) {
  const UnitSpec& unit = spec_of(signal.unit);
  SignalPlan plan;
  plan.text_lead =
      Piece("  " + std::string(colours.name) + std::string(name_without_unit(signal)) + std::string(colours.off) + " ");
  plan.text_unit = Piece(unit.symbol.empty() ? "" : " " + std::string(unit.symbol));
  plan.json_lead = Piece("\"" + std::string(signal.name) + "\":");
  plan.spec = &signal;
  plan.steps_per_raw = signal.scale % unit.divisor == 0 ? signal.scale / unit.divisor : 0;
  plan.divisor = unit.divisor;
  plan.decimals = unit.decimals;
  plan.is_brief_counter = signal.name == "counter" || signal.name == "complement";
  if (signal.unit == Unit::text) {
    plan.show = Show::text;
  } else if (!signal.names.empty()) {
    plan.show = Show::name;
  } else if (signal.bit_count == 1) {
    plan.show = Show::flag;
  } else if (is_cell_mask(signal)) {
    plan.show = Show::cells;
  }
  return plan;
}

void FrameText::print_text(const SeenFrame& seen, TextWriter& out) {
  const CanFrame& frame = seen.line.frame;
  out.begin_line();
  start_->print(seen.line, out);
  if (id_digits(frame) == 3) {
    out.piece(label_of_id_[frame.id]);
  } else {
    out.letter(' ');
    out.hex(frame.id, 8);
    out.letter(' ');
    out.text(unknown_label);
    out.spaces(label_width - unknown_label.size() - 5);  // keeps the column of the data
  }
  print_meaning(seen, out);
  out.letter('\n');
}

void FrameText::print_meaning(const SeenFrame& seen, TextWriter& out) const {
  if (!seen.verdict.is_accepted) return print_raw(seen, out);
  print_signals(plans_[catalogue_->row_of(seen.line.frame.id)], seen.line.frame, out);
}

void FrameText::print_signals(const MessagePlan& plan, const CanFrame& frame, TextWriter& out) const {
  const std::uint64_t word = load_big_endian(frame.data);
  std::int64_t selector = -1;
  bool is_empty = true;
  for (const SignalPlan& one : plan.signals) {
    const std::int64_t raw = raw_of(*one.spec, word);
    if (&one == plan.signals.data()) selector = raw;
    const bool is_absent = one.spec->selected_by >= 0 && one.spec->selected_by != selector;
    if (is_absent || is_left_out(one, raw)) continue;
    out.piece(one.text_lead);
    print_value(one, raw, out);
    is_empty = false;
  }
  if (is_empty && !plan.signals.empty()) out.text("  nothing set");
}

bool FrameText::is_left_out(const SignalPlan& plan, std::int64_t raw) const {
  if (!style_.is_brief) return false;
  const bool says_no = raw == 0 && (plan.show == Show::flag || plan.show == Show::cells);
  return says_no || plan.is_brief_counter;
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
      out.scaled(is_whole ? raw * plan.steps_per_raw : divide_to_nearest(value.value, plan.divisor), plan.decimals);
      return out.piece(plan.text_unit);
    }
    case Show::flag: return out.text(raw != 0 ? "yes" : "no");
    case Show::cells: return print_cells(raw, out);
    case Show::text: {
      const std::array<char, 8> letters = letters_of(raw);
      return out.json_string({letters.data(), letters.size()});
    }
    case Show::name: {
      const std::string_view name = name_of_raw(*plan.spec, raw);
      return name.empty() ? out.decimal(raw) : out.text(name);
    }
  }
}

void FrameText::print_raw(const SeenFrame& seen, TextWriter& out) const {
  const CanFrame& frame = seen.line.frame;
  out.text("  ");
  if (seen.line.kind == LogLineKind::fd_frame) return out.text("not classic CAN");
  if (frame.is_remote) {
    out.text("remote frame, asks for ");
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
  print_spaced_bytes(frame, out);
  if (style_.has_letters) print_letters(frame, out);
}

void FrameText::print_letters(const CanFrame& frame, TextWriter& out) {
  out.text("  '");
  for (std::size_t index = 0; index < frame.length; ++index) {
    const std::uint8_t one = frame.data[index];
    out.letter(one >= 0x20 && one < 0x7F ? static_cast<char>(one) : '.');
  }
  out.letter('\'');
}

void FrameText::print_json(const SeenFrame& seen, TextWriter& out) const {
  const CanFrame& frame = seen.line.frame;
  const CheckedFrame& verdict = seen.verdict;
  out.begin_line();
  out.text("{\"time_s\":");
  out.time(seen.line.time_us);
  out.text(",\"bus\":");
  out.json_string(seen.line.bus);
  out.text(",\"id\":\"");
  out.hex(frame.id, id_digits(frame));
  out.letter('"');
  if (style_.has_direction && seen.line.direction != Direction::unknown) {
    out.text(seen.line.direction == Direction::sent ? ",\"direction\":\"sent\"" : ",\"direction\":\"received\"");
  }
  if (verdict.message == nullptr) {
    out.text(",\"message\":null,\"node\":null,\"ok\":null");
    print_json_raw(seen.line, out);
  } else {
    print_json_verdict(plans_[catalogue_->row_of(frame.id)], seen, out);
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
  if (line.kind == LogLineKind::fd_frame) out.text(",\"fd\":true");
  if (line.frame.is_remote) out.text(",\"remote\":true");
  if (line.frame.is_error) {
    out.text(",\"error\":true,\"text\":\"");
    print_error_frame(line.frame, out);  // words of ours: nothing to escape
    out.letter('"');
  }
  out.text(",\"data\":\"");
  if (!line.frame.is_remote) print_hex_bytes(line.frame, out);
  out.letter('"');
}

void FrameText::print_json_signals(const MessagePlan& plan, const CanFrame& frame, TextWriter& out) {
  out.text(",\"signals\":");
  const std::uint64_t word = load_big_endian(frame.data);
  std::int64_t selector = -1;
  bool is_first = true;
  for (const SignalPlan& one : plan.signals) {
    const std::int64_t raw = raw_of(*one.spec, word);
    if (is_first) selector = raw;
    if (one.spec->selected_by >= 0 && one.spec->selected_by != selector) continue;
    out.letter(is_first ? '{' : ',');
    is_first = false;
    out.piece(one.json_lead);
    const SignalValue value = value_of_raw(*one.spec, raw);
    if (one.show == Show::text) {
      const std::array<char, 8> letters = letters_of(raw);
      out.json_string({letters.data(), letters.size()});
    } else if (value.is_valid()) {
      out.decimal(value.value);
    } else {
      out.text("null");
    }
  }
  out.letter('}');
}

}  // namespace bmu::dump
