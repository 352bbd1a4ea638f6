// What somebody wants to happen now: lines of the script language without their time, on standard input or a named
// pipe, each as soon as it is there. For a bench, where a person turns the key; what is to be repeated is a script.
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
    bool is_too_long = false;  // more than 4096 bytes: not to be taken, for something is missing
  };

  /// "-" is standard input, which goes on being whoever's it is. A named pipe has no end: who writes into it may come
  /// and go. The error names what was found and what was wanted; a file is none of both, and a script.
  [[nodiscard]] static Result<LiveEvents, OsError> open(const std::string& name);

  /// For epoll. Level triggered: a call of read() takes a part.
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Whole lines, without those that are empty or a comment. Never waits when fd() is readable.
  [[nodiscard]] std::vector<Line> read();
  /// Standard input has ended; what stood there without an end of line is a line, too.
  [[nodiscard]] bool is_over() const { return is_over_; }

 private:
  LiveEvents(OwnedFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  void take(char character, std::vector<Line>& lines);
  void end_line(std::vector<Line>& lines);

  OwnedFd fd_;
  std::string name_;
  std::string begun_;  // of the line that has not ended
  std::uint32_t number_ = 1;
  bool is_over_ = false;
};

}  // namespace bmu::sim
