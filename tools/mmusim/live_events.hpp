// Live events: lines of the script language without their time, on standard input or a named pipe, each executed on
// arrival. For a bench with an operator at the key; repeatable sequences are scripts.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu::sim {

class LiveEvents {
 public:
  struct Line {
    std::uint32_t number = 0;  // from 1
    std::string text;
    bool is_too_long = false;  // more than 4096 bytes: not executed, because a part is missing
  };

  /// "-" is standard input, which stays open for other users. A named pipe has no end: its writers may open and close
  /// it. The error names found and expected; a file is neither of both, and is used as a script.
  [[nodiscard]] static Result<LiveEvents, OsError> open(const std::string& name);

  /// For epoll. Level triggered: one call of read() reads a part.
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Complete lines, without empty ones and comments. Never waits when fd() is readable.
  [[nodiscard]] std::vector<Line> read();
  /// True if standard input has ended; text after its last newline counts as a line.
  [[nodiscard]] bool is_over() const { return is_over_; }

 private:
  LiveEvents(OwnedFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  void take(char character, std::vector<Line>& lines);
  void end_line(std::vector<Line>& lines);

  OwnedFd fd_;
  std::string name_;
  std::string begun_;  // of the incomplete line
  std::uint32_t number_ = 1;
  bool is_over_ = false;
};

}  // namespace bmu::sim
