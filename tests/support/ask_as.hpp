// One request to a status socket by another user: a child process gives up its credentials before it connects.
#pragma once

#include <array>
#include <csignal>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <grp.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {

inline constexpr std::uint32_t nobody = 65'534;

/// Credentials of the client. Only root can take those of another user.
struct Asker {
  std::uint32_t user_id = nobody;
  std::uint32_t group_id = nobody;
  std::vector<std::uint32_t> more_groups{};
};

/// Takes the credentials; for a child process, which exits if it may not.
inline void become(const Asker& asker) {
  if (::setgroups(asker.more_groups.size(), asker.more_groups.data()) != 0 || ::setgid(asker.group_id) != 0 ||
      ::setuid(asker.user_id) != 0) {
    ::_exit(1);
  }
}

/// Returns the connection; the process exits if it cannot connect.
[[nodiscard]] inline int connect_to_socket(const std::string& socket_path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  socket_path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) ::_exit(2);
  return fd;
}

/// Exits with a status that shows how far it got, which a failing test prints.
[[noreturn]] inline void connect_and_ask(const std::optional<Asker>& asker, const std::string& socket_path,
                                         const std::string& question, int answer_fd) {
  if (asker) become(*asker);
  const int fd = connect_to_socket(socket_path);
  const std::string line = question + "\n";
  // A rejected client may find the connection closed already; the reply to it can be read nevertheless.
  static_cast<void>(::send(fd, line.data(), line.size(), MSG_NOSIGNAL));
  std::array<char, 65536> buffer{};
  const ssize_t count = ::recv(fd, buffer.data(), buffer.size(), 0);
  ::_exit(count > 0 && ::write(answer_fd, buffer.data(), static_cast<std::size_t>(count)) == count ? 0 : 4);
}

/// The first 64 KiB of the reply, which must be complete in them. Without an asker as the user of the test.
[[nodiscard]] inline nlohmann::json ask_as(const std::optional<Asker>& asker, const std::string& socket_path,
                                           const std::string& question) {
  std::array<int, 2> ends{};
  REQUIRE(::pipe2(ends.data(), O_CLOEXEC) == 0);
  const OwnedFd read_end(ends[0]);
  OwnedFd write_end(ends[1]);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) connect_and_ask(asker, socket_path, question, ends[1]);
  write_end = OwnedFd();
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  REQUIRE(WEXITSTATUS(status) == 0);
  std::array<char, 65536> buffer{};
  const ssize_t count = ::read(read_end.get(), buffer.data(), buffer.size());
  return nlohmann::json::parse(std::string(buffer.data(), count > 0 ? static_cast<std::size_t>(count) : 0));
}

/// The given number of connections of another user for the lifetime of this object; no request is sent over them.
class SilentConnections {
 public:
  SilentConnections(const Asker& asker, const std::string& socket_path, int count) {
    std::array<int, 2> ends{};
    REQUIRE(::pipe2(ends.data(), O_CLOEXEC) == 0);
    const OwnedFd read_end(ends[0]);
    OwnedFd write_end(ends[1]);
    child_ = ::fork();
    REQUIRE(child_ >= 0);
    if (child_ == 0) hold(asker, socket_path, count, ends[1]);
    write_end = OwnedFd();
    char done = 0;
    REQUIRE(::read(read_end.get(), &done, 1) == 1);
  }
  SilentConnections(const SilentConnections&) = delete;
  SilentConnections& operator=(const SilentConnections&) = delete;
  ~SilentConnections() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }

 private:
  [[noreturn]] static void hold(const Asker& asker, const std::string& socket_path, int count, int done_fd) {
    become(asker);
    for (int i = 0; i < count; ++i) static_cast<void>(connect_to_socket(socket_path));
    if (::write(done_fd, "1", 1) != 1) ::_exit(3);
    while (true) ::pause();
  }

  pid_t child_ = -1;
};

}  // namespace bmu::test
