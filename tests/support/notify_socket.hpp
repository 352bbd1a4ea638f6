// The service manager's side of its socket, for tests of the daemon's notifications.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {

class NotifySocket {
 public:
  explicit NotifySocket(std::string path)
      : path_(std::move(path)), fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    REQUIRE(::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address()), sizeof(sockaddr_un)) == 0);
  }

  [[nodiscard]] std::optional<std::string> next(std::chrono::milliseconds at_most) {
    pollfd wait{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    if (::poll(&wait, 1, static_cast<int>(at_most.count())) <= 0) return std::nullopt;
    std::array<char, 512> buffer{};
    const ssize_t count = ::recv(fd_.get(), buffer.data(), buffer.size(), 0);
    return std::string(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  }
  [[nodiscard]] bool hears(const std::string& wanted, std::chrono::milliseconds at_most) {
    const auto deadline = std::chrono::steady_clock::now() + at_most;
    while (std::chrono::steady_clock::now() < deadline) {
      if (next(std::chrono::milliseconds(500)) == wanted) return true;
    }
    return false;
  }
  /// Sends to itself until the queue is full.
  void fill() {
    const OwnedFd sender(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0));
    while (::sendto(sender.get(), "x", 1, MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&address()),
                    sizeof(sockaddr_un)) == 1) {
    }
  }
  void drain() {
    while (next(std::chrono::milliseconds(0))) {
    }
  }

 private:
  const sockaddr_un& address() {
    address_.sun_family = AF_UNIX;
    path_.copy(address_.sun_path, sizeof(address_.sun_path) - 1);
    return address_;
  }

  std::string path_;
  OwnedFd fd_;
  sockaddr_un address_{};
};

}  // namespace bmu::test
