// What the daemon tells people. Lines go to the journal when that is where stderr leads, otherwise to stderr itself.
//
// A full pipe or a stopped journald must never hold the control loop: lines go through a bounded queue to a thread of
// its own. When the queue is full the oldest line gives way; what was lost is counted, and told once there is room.
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

  explicit Journal(Severity least, std::size_t queue_lines = default_queue_lines);
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  /// Gives the thread up instead of waiting for a sink that is blocked.
  ~Journal();

  /// Never blocks. From any thread; all else from one.
  void log(Severity severity, std::string_view line);
  /// Logs how many lines were lost since it last said so, if any and if there is room again. Now and then.
  void tell_lost();
  [[nodiscard]] std::uint64_t lines_lost() const;
  /// Waits until everything is written, at most so long. False: the sink is blocked, and leaving the process by
  /// exit() could wait for it too; leave by _exit().
  [[nodiscard]] bool flush(Duration at_most);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace bmu
