// A pseudo-terminal: the daemon gets one end of it, the test uses the other.
#pragma once

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {

class PseudoTerminal {
 public:
  PseudoTerminal() : end_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    REQUIRE(end_.is_open());
    REQUIRE(::grantpt(end_.get()) == 0);
    REQUIRE(::unlockpt(end_.get()) == 0);
    std::array<char, 64> name{};
    REQUIRE(::ptsname_r(end_.get(), name.data(), name.size()) == 0);
    name_ = name.data();
    // It would echo until the daemon has set it up.
    termios settings{};
    REQUIRE(::tcgetattr(end_.get(), &settings) == 0);
    ::cfmakeraw(&settings);
    REQUIRE(::tcsetattr(end_.get(), TCSANOW, &settings) == 0);
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  void hang_up() { end_ = OwnedFd(); }

  void type(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = ::write(end_.get(), bytes.data(), bytes.size());
      if (count > 0) {
        bytes.remove_prefix(static_cast<std::size_t>(count));
        continue;
      }
      REQUIRE(errno == EAGAIN);
      pollfd wait{.fd = end_.get(), .events = POLLOUT, .revents = 0};
      REQUIRE(::poll(&wait, 1, 60'000) == 1);
    }
  }
  /// Writes until nothing more is accepted for `stalled`; returns the number of bytes written.
  [[nodiscard]] std::size_t type_some(std::string_view bytes, std::chrono::milliseconds stalled) const {
    std::size_t typed = 0;
    while (typed < bytes.size()) {
      const ssize_t count = ::write(end_.get(), bytes.data() + typed, bytes.size() - typed);
      if (count > 0) {
        typed += static_cast<std::size_t>(count);
        continue;
      }
      pollfd wait{.fd = end_.get(), .events = POLLOUT, .revents = 0};
      if (::poll(&wait, 1, static_cast<int>(stalled.count())) != 1) break;
    }
    return typed;
  }
  /// Everything up to this text, the text included; everything received if it does not come in time.
  [[nodiscard]] std::string read_to(std::string_view end, std::chrono::milliseconds at_most = std::chrono::minutes(1)) {
    const auto deadline = std::chrono::steady_clock::now() + at_most;
    while (read_.find(end) == std::string::npos) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      pollfd wait{.fd = end_.get(), .events = POLLIN, .revents = 0};
      if (left.count() <= 0 || ::poll(&wait, 1, static_cast<int>(left.count())) <= 0) break;
      std::array<char, 4096> buffer{};
      const ssize_t count = ::read(end_.get(), buffer.data(), buffer.size());
      if (count > 0) read_.append(buffer.data(), static_cast<std::size_t>(count));
      if (count <= 0 && errno != EAGAIN && errno != EIO) break;
    }
    const std::size_t found = read_.find(end);
    const std::size_t size = found == std::string::npos ? read_.size() : found + end.size();
    std::string text = read_.substr(0, size);
    read_.erase(0, size);
    return text;
  }
  /// Sends a command and returns the line that answers it.
  [[nodiscard]] std::string ask(std::string_view line) {
    type(std::string(line) + "\r\n");
    return read_to("\r\n");
  }
  [[nodiscard]] termios settings() const {
    termios settings{};
    REQUIRE(::tcgetattr(end_.get(), &settings) == 0);
    return settings;
  }

 private:
  OwnedFd end_;
  std::string name_;
  std::string read_;
};

}  // namespace bmu::test
