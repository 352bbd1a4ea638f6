// A connection to the daemon's status socket: lines out, lines in, and never a wait without an end.
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
  /// The error is a sentence for people.
  [[nodiscard]] static Result<Client, std::string> connect(const std::string& path);

  [[nodiscard]] Result<void, std::string> send_line(std::string_view line);
  /// The next line, at most so long from now.
  [[nodiscard]] Result<std::string, std::string> read_line(std::chrono::milliseconds at_most);

  /// For a loop of one's own: readable when there is something to take in.
  [[nodiscard]] int fd() const { return socket_.get(); }
  /// Takes in what is there, without waiting. False: the daemon has gone.
  [[nodiscard]] bool take_in();
  [[nodiscard]] std::optional<std::string> next_line();

 private:
  explicit Client(OwnedFd socket) : socket_(std::move(socket)) {}

  OwnedFd socket_;
  std::string input_;
};

}  // namespace bmu
