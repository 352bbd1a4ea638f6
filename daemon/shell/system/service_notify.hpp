// Notifications to the service manager: ready, reloading, stopping, watchdog, and one status line for people.
//
// Sends the datagrams itself, because sd_notify() of libsystemd waits when the queue of the manager is full, and the
// control loop must not. A missing receiver, a full queue and a removed socket are counted and have no other effect.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/time.hpp"

namespace bmu {

class ServiceNotify {
 public:
  /// Reads NOTIFY_SOCKET and the variables of the watchdog.
  ServiceNotify();

  /// Everything is set up and the outputs are open. Repeated until the manager has received it: without it the manager
  /// would wait until its timeout.
  void ready();
  void stopping();
  /// Another configuration is about to be loaded, or refused: ready() reports the end of that.
  void reloading();
  /// Extends the watchdog timeout, as no tick follows until ready(), or the end: writing and opening may take longer
  /// than the watchdog waits.
  void away();
  /// A tick has been decided in full: feeds the watchdog. Sent at most every third of the watchdog timeout.
  void tick_decided(TimePoint now);
  /// The line of `systemctl status`. Sent when it has changed, at most once a second.
  void status(TimePoint now, std::string_view line);

  [[nodiscard]] std::uint64_t sends_failed() const { return sends_failed_; }

 private:
  bool send(std::string_view text);

  std::string address_;  // empty: no service manager
  OwnedFd socket_;
  std::uint64_t watchdog_us_ = 0;  // 0: none
  std::optional<Duration> alive_period_;
  TimePoint alive_sent_at_{};
  TimePoint status_sent_at_{};
  std::string status_;
  bool is_ready_untold_ = false;
  bool is_away_ = false;  // the manager has the extended watchdog timeout
  std::uint64_t sends_failed_ = 0;
};

}  // namespace bmu
