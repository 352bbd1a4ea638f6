#include "daemon/shell/serial/serial_lines.hpp"

#include <utility>

namespace bmu {

std::optional<SerialLine> SerialLines::take(char byte) {
  const bool is_rest_of_end = byte == '\n' && was_cr_;
  was_cr_ = byte == '\r';
  if (is_rest_of_end) return std::nullopt;
  if (byte == '\r' || byte == '\n') {
    SerialLine line = std::exchange(line_, {});
    if (line.kind != SerialLine::Kind::good) line.text.clear();
    const bool is_empty = line.kind == SerialLine::Kind::good && line.text.empty();
    return is_empty ? std::nullopt : std::optional(std::move(line));
  }
  if (line_.kind != SerialLine::Kind::good) return std::nullopt;
  if (byte < ' ' || byte > '~') {
    line_.kind = SerialLine::Kind::unprintable;
  } else if (line_.text.size() == line_max) {
    line_.kind = SerialLine::Kind::too_long;
  } else {
    line_.text.push_back(byte);
  }
  return std::nullopt;
}

void SerialLines::forget() {
  line_ = {};
  was_cr_ = false;
}

}  // namespace bmu
