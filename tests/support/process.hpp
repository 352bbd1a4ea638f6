// A program of this project as a child process: its output goes to files, its end is waited for, and it is never left
// behind.
#pragma once

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {

namespace test {

/// Maximum wait for an event that must come: ends a test that hangs, and decides nothing else. On a busy machine a
/// program may get no processor for seconds.
inline constexpr std::chrono::milliseconds hang_max{60'000};

}  // namespace test

[[nodiscard]] inline std::string read_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

struct ProcessOptions {
  std::vector<std::string> environment;  // "NAME=value", added to that of the test
  std::string out_file = "/dev/null";
  std::string err_file = "/dev/null";
  int err_fd = -1;  // instead of err_file
};

class Process {
 public:
  Process(std::vector<std::string> command, const ProcessOptions& options) {
    pid_ = ::fork();
    REQUIRE(pid_ >= 0);
    if (pid_ == 0) become(std::move(command), options);
    end_ = OwnedFd(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
    REQUIRE(end_.is_open());
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }

  void signal(int number) const { REQUIRE(::kill(pid_, number) == 0); }
  /// Exit status, or 128 + signal; -1 if it has not ended in that time.
  [[nodiscard]] int wait(std::chrono::milliseconds at_most) {
    pollfd wait{.fd = end_.get(), .events = POLLIN, .revents = 0};
    if (::poll(&wait, 1, static_cast<int>(at_most.count())) <= 0) return -1;
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  [[noreturn]] static void become(std::vector<std::string> command, const ProcessOptions& options) {
    const int out = ::open(options.out_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    const int err =
        options.err_fd >= 0 ? options.err_fd : ::open(options.err_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(err, STDERR_FILENO);
    for (const std::string& variable : options.environment) {
      const std::size_t equals = variable.find('=');
      ::setenv(variable.substr(0, equals).c_str(), variable.substr(equals + 1).c_str(), 1);
    }
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (std::string& argument : command) arguments.push_back(argument.data());
    arguments.push_back(nullptr);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }

  pid_t pid_ = -1;
  OwnedFd end_;
};

[[nodiscard]] inline std::string program(const std::string& name) {
  return test::in_build("bin/" + name);
}

struct Finished {
  int status = -1;
  std::string out;
  std::string err;
};

/// Runs a program to its end.
[[nodiscard]] inline Finished run_program(std::vector<std::string> command, std::vector<std::string> environment = {}) {
  const TemporaryFolder folder;
  Process process(std::move(command),
                  {.environment = std::move(environment), .out_file = folder / "out", .err_file = folder / "err"});
  const int status = process.wait(test::hang_max);
  return {.status = status, .out = read_file(folder / "out"), .err = read_file(folder / "err")};
}

}  // namespace bmu
