// Prints one frame as one line: text (names, values, units) or JSON. Everything fixed about a message is prepared once,
// so that a line costs a few block copies and one number per signal.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/candump.hpp"
#include "protocol/receive_check.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"
#include "tools/bmudump/line_start.hpp"
#include "tools/bmudump/text_writer.hpp"

namespace bmu::dump {

/// A frame of the log, with the result of its bus's receive check.
struct SeenFrame {
  const LogLine& line;
  const CheckedFrame& verdict;
};

class FrameText {
 public:
  struct Style {
    bool is_coloured = false;
    bool is_brief = false;     // omit flags that are not set, empty cell masks and counters
    bool is_short = false;     // "cell_voltage_1 3.6512 V  _2 3.6498", and only the name of a flag
    bool has_letters = false;  // bytes that are shown, also as letters
  };

  /// `start` may be shared by several objects: one log may need several catalogues.
  FrameText(const DumpCatalogue& catalogue, const Style& style, LineStart& start);

  void print_text(const SeenFrame& seen, TextWriter& out);
  void print_json(const SeenFrame& seen, TextWriter& out) const;
  /// The signals of a frame that passed its check, or else its failure or kind and its bytes; two spaces before each.
  void print_meaning(const SeenFrame& seen, TextWriter& out) const;

 private:
  enum class Show : std::uint8_t { number, flag, set_flag, name, bits, cells, text };

  enum class LeftOut : std::uint8_t { never, where_zero, always };

  struct SignalPlan {
    Piece text_lead;  // "  cell_voltage_1 "
    Piece text_unit;  // " V"
    Piece json_lead;  // "\"cell_voltage_1_uV\":"
    const SignalSpec* spec = nullptr;
    std::int64_t steps_per_raw = 0;  // last digits shown per raw count; 0: not a whole number
    std::int64_t steps_of_zero = 0;  // last digits shown for raw 0
    std::int64_t divisor = 1;
    int decimals = 0;
    Show show = Show::number;
    LeftOut left_out = LeftOut::never;
  };
  struct MessagePlan {
    std::vector<SignalPlan> signals;
    Piece json_lead;  // ",\"message\":\"CELLS_1\",\"node\":"
  };
  struct Colours {
    std::string_view name, odd, bad, off;
  };

  [[nodiscard]] Show show_of(const SignalSpec& signal) const;
  [[nodiscard]] SignalPlan plan_of(const SignalSpec& signal, std::string_view name) const;
  [[nodiscard]] std::vector<SignalPlan> plans_of(const MessageSpec& message) const;
  void print_signals(const MessagePlan& plan, const CanFrame& frame, TextWriter& out) const;
  void print_value(const SignalPlan& plan, std::int64_t raw, TextWriter& out) const;
  [[nodiscard]] LeftOut left_out_of(const SignalSpec& signal, Show show) const;
  static void print_json_verdict(const MessagePlan& plan, const SeenFrame& seen, TextWriter& out);
  static void print_json_raw(const LogLine& line, TextWriter& out);
  static void print_json_long(const LogLine& line, TextWriter& out);
  static void print_json_signals(const MessagePlan& plan, const CanFrame& frame, TextWriter& out);
  void print_other_label(const SeenFrame& seen, TextWriter& out) const;
  void print_raw(const SeenFrame& seen, TextWriter& out) const;
  void print_long(const LogLine& line, TextWriter& out) const;

  const DumpCatalogue* catalogue_;
  Style style_;
  LineStart* start_;
  Colours colours_;
  std::vector<MessagePlan> plans_;  // by row
  std::vector<Piece> label_of_id_;  // " 143 CELLS_1 node 3      "
};

}  // namespace bmu::dump
