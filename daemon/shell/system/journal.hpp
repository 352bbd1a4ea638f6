// The log of the daemon. Lines go to the journal if stderr is connected to it, otherwise to stderr itself.
//
// A full pipe or a stopped journald must never hold the control loop: lines go through a bounded queue to a thread of
// its own. When the queue is full the oldest line is dropped; lost lines are counted, and logged once there is room.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "daemon/core/records/event.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// "debug", "info", "warning", "error".
[[nodiscard]] std::optional<Severity> severity_from_text(std::string_view text);

class Journal {
 public:
  static constexpr std::size_t default_queue_lines = 1024;

  /// Throws std::system_error if the system refuses the thread that writes.
  explicit Journal(Severity least, std::size_t queue_lines = default_queue_lines);
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  /// Abandons the thread instead of waiting for a blocked sink.
  ~Journal();

  /// Never blocks. Callable from any thread; all other members from one thread only.
  void log(Severity severity, std::string_view line);
  /// Logs how many lines were lost since its last line, if any and if there is room again. Call it periodically.
  void tell_lost();
  [[nodiscard]] std::uint64_t lines_lost() const;
  /// Waits until everything is written, at most `at_most`. False: the sink is blocked, and exit() could wait for it
  /// too; leave the process by _exit().
  [[nodiscard]] bool flush(Duration at_most);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace bmu
