#include "daemon/shell/serial_console.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "daemon/history/helper_thread.hpp"
#include "daemon/shell/owned_fd.hpp"
#include "daemon/shell/serial_lines.hpp"
#include "daemon/shell/serial_port.hpp"

namespace bmu {

namespace {

using std::chrono::steady_clock;

// With more than this unread no input is taken; a read of the smallest lines adds about as much again.
constexpr std::size_t unread_max = 4'096;
constexpr std::size_t read_size = 64;
// The dump runs no further ahead of the reader.
constexpr std::size_t dump_ahead = 1'024;
// Somebody who sends orders without end must not fill the log of the daemon.
constexpr int told_per_second_max = 5;
constexpr Duration end_max = 500ms;

}  // namespace

struct SerialConsole::Shared {
  Shared(SerialConsoleOptions the_options, SerialConsoleActions the_actions)
      : options(std::move(the_options)), actions(std::move(the_actions)) {}

  const SerialConsoleOptions options;
  const SerialConsoleActions actions;
  OwnedFd ending;  // readable: the thread is to end

  std::mutex mutex;  // also held while an action is called that reaches beyond us
  std::condition_variable changed;
  bool has_to_end = false;
  bool is_running = false;

  // The thread's alone.
  OwnedFd port;
  SerialLines lines;
  std::string output;
  NextLogLine dump;  // empty: none is under way
  std::uint64_t dumped = 0;
  bool is_service_on = false;
  std::string told;  // what is wrong with the device; told once
  steady_clock::time_point told_since{};
  int told_count = 0;

  void run();
  [[nodiscard]] bool is_ending();
  void tell(Severity severity, const std::string& line);
  void tell_order(const SerialLine& line, const std::string& answer);
  void open_port();
  void lose_port(const std::string& why);
  void serve();
  void read_input();
  void take_line(const SerialLine& line);
  void fill_output();
  void set_service(bool is_on);
  void add_service_line();
  void write_output();
};

void SerialConsole::Shared::run() {
  while (!is_ending()) {
    if (!port.is_open()) open_port();
    if (port.is_open()) {
      serve();
    } else {
      pollfd wait{.fd = ending.get(), .events = POLLIN, .revents = 0};
      ::poll(&wait, 1, static_cast<int>(to_ms(options.look_again)));
    }
  }
  set_service(false);
  close_serial_port(std::exchange(port, {}));
  const std::lock_guard lock(mutex);
  is_running = false;
  changed.notify_all();
}

bool SerialConsole::Shared::is_ending() {
  const std::lock_guard lock(mutex);
  return has_to_end;
}

/// Nothing is told once whom we tell it to may be gone.
void SerialConsole::Shared::tell(Severity severity, const std::string& line) {
  const std::lock_guard lock(mutex);
  if (!has_to_end) actions.log(severity, line);
}

void SerialConsole::Shared::tell_order(const SerialLine& line, const std::string& answer) {
  const auto now = steady_clock::now();
  if (now - told_since >= 1s) {
    told_since = now;
    told_count = 0;
  }
  if (++told_count > told_per_second_max) return;
  tell(Severity::info, "serial console " + options.device + ": \"" + line.text + "\"" +
                           (answer.empty() ? "" : ": " + answer.substr(0, answer.find('\r'))));
}

void SerialConsole::Shared::open_port() {
  auto opened = open_serial_port(options.device, options.bit_rate_Bd);
  if (!opened) {
    const std::string why = to_text(opened.error());
    if (std::exchange(told, why) != why) tell(Severity::warning, "serial console: " + why + "; looked for again");
    return;
  }
  port = std::move(*opened);
  told.clear();
  tell(Severity::info, "serial console on " + options.device + " with " + std::to_string(options.bit_rate_Bd) + " Bd");
}

/// What was begun is nobody's any more: not the line, not the answer, not the dump.
void SerialConsole::Shared::lose_port(const std::string& why) {
  close_serial_port(std::exchange(port, {}));
  lines.forget();
  output.clear();
  dump = nullptr;
  set_service(false);
  tell(Severity::warning, "serial console: " + options.device + " is gone (" + why + "); looked for again");
  pollfd wait{.fd = ending.get(), .events = POLLIN, .revents = 0};
  ::poll(&wait, 1, static_cast<int>(to_ms(options.look_again)));
}

void SerialConsole::Shared::serve() {
  fill_output();
  add_service_line();
  const bool takes_input = output.size() < unread_max;
  const auto events = static_cast<short>((takes_input ? POLLIN : 0) | (output.empty() ? 0 : POLLOUT));
  std::array<pollfd, 2> wait{
      {{.fd = port.get(), .events = events, .revents = 0}, {.fd = ending.get(), .events = POLLIN, .revents = 0}}};
  const int wait_ms = is_service_on ? static_cast<int>(to_ms(options.service_look)) : -1;
  if (::poll(wait.data(), wait.size(), wait_ms) < 0) return;  // interrupted
  const short happened = wait[0].revents;
  if ((happened & POLLIN) != 0) read_input();
  if (port.is_open() && (happened & POLLOUT) != 0) write_output();
  if (port.is_open() && (happened & POLLIN) == 0 && (happened & (POLLHUP | POLLERR | POLLNVAL)) != 0) {
    lose_port("hung up");
  }
}

void SerialConsole::Shared::read_input() {
  std::array<char, read_size> bytes{};
  const ssize_t count = ::read(port.get(), bytes.data(), bytes.size());
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (count <= 0) return lose_port(count == 0 ? "hung up" : std::strerror(errno));
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (const auto line = lines.take(bytes.at(i))) take_line(*line);
  }
}

void SerialConsole::Shared::take_line(const SerialLine& line) {
  dump = nullptr;
  SerialReply reply = answer_serial(line, actions.set_cell_count);
  if (reply.service && !actions.set_service)
    reply = {.text = "Refused: nothing is measured here\r\n", .is_order = true};
  output += reply.text;
  if (reply.service) set_service(*reply.service);
  if (reply.is_order) tell_order(line, reply.text);
  if (!reply.dumps_log) return;
  dump = actions.log_source();
  dumped = 0;
}

void SerialConsole::Shared::fill_output() {
  while (dump && output.size() < dump_ahead) {
    const auto line = dump();
    if (line && *line) {
      output += **line + "\r\n";
      ++dumped;
      continue;
    }
    dump = nullptr;
    if (!line) {
      output += "The log cannot be read: " + line.error() + "\r\n";
    } else {
      output += dumped == 0 ? "Log is empty\r\n" : "End of log: " + std::to_string(dumped) + " lines\r\n";
    }
  }
}

/// Nothing is switched once what it reaches may be gone.
void SerialConsole::Shared::set_service(bool is_on) {
  if (std::exchange(is_service_on, is_on) == is_on) return;
  const std::lock_guard lock(mutex);
  if (!has_to_end) actions.set_service(is_on);
}

void SerialConsole::Shared::add_service_line() {
  if (!is_service_on || dump || output.size() >= dump_ahead) return;
  const std::lock_guard lock(mutex);
  if (has_to_end) return;
  if (const auto line = actions.take_service_line()) output += *line + "\r\n";
}

void SerialConsole::Shared::write_output() {
  const ssize_t count = ::write(port.get(), output.data(), output.size());
  if (count > 0) output.erase(0, static_cast<std::size_t>(count));
  if (count < 0 && errno != EAGAIN && errno != EINTR) lose_port(std::strerror(errno));
}

Result<std::unique_ptr<SerialConsole>, OsError> SerialConsole::start(const SerialConsoleOptions& options,
                                                                     SerialConsoleActions actions) {
  auto shared = std::make_shared<Shared>(options, std::move(actions));
  shared->ending = OwnedFd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!shared->ending.is_open()) return failure(OsError{.code = errno, .what = "eventfd for the serial console"});
  std::unique_ptr<SerialConsole> console(new SerialConsole(shared));
  const auto started = start_helper(console->thread_, "bmud-serial", shared);
  if (started) return console;
  return failure(OsError{.code = started.error(), .what = "start the thread of the serial console"});
}

SerialConsole::SerialConsole(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

SerialConsole::~SerialConsole() {
  static_cast<void>(::eventfd_write(shared_->ending.get(), 1));  // from now on it does not wait, and sees has_to_end
  end_or_leave(thread_, *shared_, end_max);
}

}  // namespace bmu
