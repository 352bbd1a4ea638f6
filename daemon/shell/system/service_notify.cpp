#include "daemon/shell/system/service_notify.hpp"

#include <algorithm>
#include <cstdlib>
#include <ctime>

#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>

namespace bmu {

namespace {

// Three messages within the watchdog timeout: one of them has to arrive.
constexpr int alive_messages_per_watchdog = 3;
constexpr Duration status_period = 1s;
// Timeout between two sessions: each part abandons a hanging disk after half a second at most.
constexpr const char* patience = "WATCHDOG=1\nWATCHDOG_USEC=5000000";

}  // namespace

ServiceNotify::ServiceNotify() {
  const char* address = std::getenv("NOTIFY_SOCKET");  // NOLINT(concurrency-mt-unsafe): no thread sets it
  if (address == nullptr) return;
  address_ = address;
  const bool is_address = address_.size() > 1 && (address_.front() == '/' || address_.front() == '@');
  if (!is_address || address_.size() >= sizeof(sockaddr_un::sun_path)) {
    address_.clear();
    return;
  }
  socket_ = OwnedFd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (sd_watchdog_enabled(0, &watchdog_us_) > 0) {
    alive_period_ = std::chrono::microseconds(watchdog_us_) / alive_messages_per_watchdog;
  }
}

bool ServiceNotify::send(std::string_view text) {
  if (address_.empty()) return true;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(address_.begin(), address_.end(), address.sun_path);
  if (address_.front() == '@') address.sun_path[0] = '\0';  // an abstract name
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  const auto sent = ::sendto(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                             reinterpret_cast<const sockaddr*>(&address), length);
  if (sent < 0) ++sends_failed_;
  return sent >= 0;
}

void ServiceNotify::ready() {
  // In one message: whichever is lost, the usual watchdog timeout applies before the daemon counts as ready.
  const std::string strict = is_away_ ? "\nWATCHDOG_USEC=" + std::to_string(watchdog_us_) : "";
  is_ready_untold_ = !send("READY=1" + strict);
  if (!is_ready_untold_) is_away_ = false;
}

void ServiceNotify::reloading() {
  is_ready_untold_ = false;
  // CLOCK_MONOTONIC, as the manager: it stands still while the machine sleeps.
  timespec its{};
  clock_gettime(CLOCK_MONOTONIC, &its);
  const auto us = std::chrono::seconds(its.tv_sec) + std::chrono::microseconds(its.tv_nsec / 1000);
  send("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(us.count()));
}

void ServiceNotify::away() {
  if (alive_period_) is_away_ = send(patience);
}

void ServiceNotify::stopping() {
  is_ready_untold_ = false;
  send("STOPPING=1");
}

void ServiceNotify::tick_decided(TimePoint now) {
  if (is_ready_untold_) ready();
  if (!alive_period_ || now - alive_sent_at_ < *alive_period_) return;
  if (send("WATCHDOG=1")) alive_sent_at_ = now;
}

void ServiceNotify::status(TimePoint now, std::string_view line) {
  if (line == status_ || now - status_sent_at_ < status_period) return;
  status_sent_at_ = now;
  status_ = line;
  send("STATUS=" + status_);
}

}  // namespace bmu
