// The commands of the serial console, a row each: CellC:xx, LogReq, Service:on and Service:off, Help. What they answer
// is docs/serial.md.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "daemon/shell/serial/serial_lines.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// What became of a CellC that was not refused.
struct CellCountSet {
  bool is_in_force = false;  // else from the next start on
};

/// Refused: why, for people.
using SetCellCount = std::function<Result<CellCountSet, std::string>(std::size_t cell_count)>;

struct SerialReply {
  std::string text{};             // lines, each ended by CR LF
  bool dumps_log = false;         // and then the log
  std::optional<bool> service{};  // the service mode is switched on or off
  bool is_order = false;          // somebody wanted something done: for the log of the daemon
};

/// Of any line, good or not; `set` is called for a CellC with a number.
[[nodiscard]] SerialReply answer_serial(const SerialLine& line, const SetCellCount& set);

}  // namespace bmu
