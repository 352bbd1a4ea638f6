#include "tools/common/standard_output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <poll.h>
#include <unistd.h>

#include "daemon/shell/cli/exit_codes.hpp"

namespace bmu {

namespace {

/// errno of the first write that failed; 0: none failed. Used by one thread.
int first_error = 0;
constexpr int unknown_error = -1;

void keep(int error) {
  if (first_error == 0) first_error = error;
}

/// Waits, because another process that shares the output made it non-blocking.
bool wait_for_room() {
  pollfd room{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  return ::poll(&room, 1, -1) == 1 || errno == EINTR;
}

bool has_reader_gone() {
  pollfd reader{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  return ::poll(&reader, 1, 0) == 1 && (reader.revents & POLLERR) != 0;
}

}  // namespace

void write_out(const std::string& text) {
  std::size_t done = 0;
  while (done < text.size() && first_error == 0) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN && wait_for_room()) continue;
    if (count <= 0) return keep(count == 0 ? EIO : errno);
    done += static_cast<std::size_t>(count);
  }
}

bool has_output_failed() {
  return first_error != 0 && first_error != EPIPE;
}

int end_output(const char* program, int status) {
  // An earlier write of stdio may have failed; its cause is no longer known.
  if (std::fflush(stdout) != 0) {
    keep(errno);
  } else if (std::ferror(stdout) != 0) {
    keep(has_reader_gone() ? EPIPE : unknown_error);
  }
  if (!has_output_failed()) return status;
  const char* const why = first_error == unknown_error ? "some of it is lost" : std::strerror(first_error);
  std::fprintf(stderr, "%s: cannot write: %s\n", program, why);
  return exit_codes::exit_system;
}

}  // namespace bmu
