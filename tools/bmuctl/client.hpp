// A connection to the daemon's status socket: sends and receives lines, and every wait has a limit.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu {

class Client {
 public:
  /// The error is a sentence for the user.
  [[nodiscard]] static Result<Client, std::string> connect(const std::string& path);

  [[nodiscard]] Result<void, std::string> send_line(std::string_view line);
  /// The next line, after at most `at_most` from now.
  [[nodiscard]] Result<std::string, std::string> read_line(std::chrono::milliseconds at_most);

  /// For a caller's own loop: readable when take_in() has something to read.
  [[nodiscard]] int fd() const { return socket_.get(); }
  /// Reads the available bytes without waiting. False: the daemon closed the connection.
  [[nodiscard]] bool take_in();
  [[nodiscard]] std::optional<std::string> next_line();

 private:
  explicit Client(OwnedFd socket) : socket_(std::move(socket)) {}

  OwnedFd socket_;
  std::string input_;
};

}  // namespace bmu
