// Talks to the service manager: ready, stopping, alive, and one line for people.
//
// Datagrams are sent by ourselves, because sd_notify() of libsystemd waits when the manager's queue is full, and the
// control loop must not. Nobody listening, a full queue, a socket that is gone: all the same, counted and nothing else.
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
  /// Reads NOTIFY_SOCKET and the watchdog's variables.
  ServiceNotify();

  /// Everything is set up and the outputs are open. Repeated until the manager took it: losing this one would make it
  /// wait for us until its time-out.
  void ready();
  void stopping();
  /// Another configuration is about to be taken up, or refused: ready() says when that is over.
  void reloading();
  /// Until ready(), or the end, there will be no tick: what has to be written and opened may take longer than the
  /// watchdog waits.
  void away();
  /// A tick has been decided in full: we are alive. Sent every third of the watchdog's time at most.
  void tick_decided(TimePoint now);
  /// What people see in `systemctl status`. Sent when it has changed, at most once a second.
  void status(TimePoint now, std::string_view line);

  [[nodiscard]] std::uint64_t sends_failed() const { return sends_failed_; }

 private:
  bool send(std::string_view text);

  std::string address_;  // empty: nobody to tell
  OwnedFd socket_;
  std::uint64_t watchdog_us_ = 0;  // 0: none
  std::optional<Duration> alive_period_;
  TimePoint alive_sent_at_{};
  TimePoint status_sent_at_{};
  std::string status_;
  bool is_ready_untold_ = false;
  bool is_away_ = false;  // the manager has been asked to be patient
  std::uint64_t sends_failed_ = 0;
};

}  // namespace bmu
