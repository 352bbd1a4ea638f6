// The commands of the serial console, a row each: CellC:xx, LogReq, Service:on and Service:off, Help. Replies:
// docs/serial.md.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "daemon/shell/serial/serial_lines.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Result of a CellC that was not refused.
struct CellCountSet {
  bool is_in_force = false;  // false: from the next start on
};

/// The error: reason of the refusal, for people.
using SetCellCount = std::function<Result<CellCountSet, std::string>(std::size_t cell_count)>;

struct SerialReply {
  std::string text{};             // lines, each ended by CR LF
  bool dumps_log = false;         // the log follows
  std::optional<bool> service{};  // the service mode is switched on or off
  bool is_order = false;          // a command with an effect: for the log of the daemon
};

/// Answers any line, valid or not; `set` is called for a CellC with a number.
[[nodiscard]] SerialReply answer_serial(const SerialLine& line, const SetCellCount& set);

}  // namespace bmu
