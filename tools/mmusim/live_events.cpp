#include "tools/mmusim/live_events.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tools/common/byte_order_mark.hpp"

namespace bmu::sim {
namespace {

constexpr std::size_t line_length_max = 4096;

/// Opened for writing too, so that it does not end when its last writer closes it.
OwnedFd open_pipe(const std::string& name) {
  return OwnedFd(::open(name.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
}

/// False for a file: additions to it cannot be waited for.
bool can_be_waited_for(const OwnedFd& fd) {
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) return false;
  return S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode) || ::isatty(fd.get()) != 0;
}

}  // namespace

Result<LiveEvents, OsError> LiveEvents::open(const std::string& name) {
  const bool is_input = name == "-";
  OwnedFd fd = is_input ? OwnedFd(::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)) : open_pipe(name);
  const std::string shown = is_input ? "standard input" : name;
  if (!fd.is_open())
    return failure(OsError{errno, shown + ": cannot be opened, expected a pipe (mkfifo), or - for standard input"});
  if (!can_be_waited_for(fd)) {
    return failure(OsError{0, shown + ": found neither a pipe nor a terminal; events in a file are a --scenario"});
  }
  return LiveEvents(std::move(fd), shown);
}

std::vector<LiveEvents::Line> LiveEvents::read() {
  std::vector<Line> lines;
  std::array<char, line_length_max> part{};
  const auto count = ::read(fd_.get(), part.data(), part.size());
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return lines;
  // A terminal that returns an error delivers no further input.
  is_over_ = count <= 0;
  for (std::ptrdiff_t i = 0; i < count; ++i) take(part.at(static_cast<std::size_t>(i)), lines);
  if (is_over_) end_line(lines);
  return lines;
}

void LiveEvents::take(char character, std::vector<Line>& lines) {
  if (character == '\n') return end_line(lines);
  // One character more than permitted marks a line that is too long.
  if (begun_.size() <= line_length_max) begun_.push_back(character);
}

void LiveEvents::end_line(std::vector<Line>& lines) {
  const bool is_too_long = begun_.size() > line_length_max;
  begun_.erase(0, begun_.size() - without_byte_order_mark(begun_).size());  // of a file that was written into the pipe
  begun_.erase(std::min(begun_.find('#'), begun_.size()));
  if (is_too_long) {
    lines.push_back({.number = number_, .text = begun_, .is_too_long = true});
  } else if (begun_.find_first_not_of(" \t\r") != std::string::npos) {
    lines.push_back({.number = number_, .text = begun_});
  }
  begun_.clear();
  ++number_;
}

}  // namespace bmu::sim
