#include "tools/bmuctl/client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

namespace bmu {

namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds connect_max{1000};

std::string explained(const std::string& path, int error) {
  const std::string where = "no daemon at '" + path + "': ";
  if (error == ENOENT) return where + "socket does not exist; is bmud running, or is another --socket needed?";
  std::error_code ignored;
  if (error == ECONNREFUSED && !std::filesystem::is_socket(path, ignored)) return where + "not a socket";
  if (error == ECONNREFUSED) return where + "connection refused (bmud has stopped)";
  if (error == EACCES) return where + "permission denied (root or membership of the socket's group is required)";
  return where + std::strerror(error);
}

}  // namespace

Result<Client, std::string> Client::connect(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty()) return failure(explained(path, ENOENT));
  if (path.size() >= sizeof(address.sun_path)) return failure(explained(path, ENAMETOOLONG));
  std::copy(path.begin(), path.end(), address.sun_path);
  OwnedFd socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return failure(explained(path, errno));
  // connect() and send() wait only while the daemon's queue is full, and at most this long.
  const timeval at_most{.tv_sec = connect_max.count() / 1000, .tv_usec = 0};
  static_cast<void>(::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &at_most, sizeof(at_most)));
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return failure(explained(path, errno));
  }
  return Client(std::move(socket));
}

Result<void, std::string> Client::send_line(std::string_view line) {
  const std::string text = std::string(line) + "\n";
  const ssize_t sent = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL);
  // A refused client gets the reason before the daemon closes the connection, perhaps before its
  // request is sent: the reason is still in the receive queue.
  const bool is_turned_away = sent < 0 && errno == EPIPE;
  if (sent == static_cast<ssize_t>(text.size()) || is_turned_away) return {};
  return failure(std::string("the daemon takes no request: ") + std::strerror(errno));
}

bool Client::take_in() {
  std::array<char, 16384> buffer{};
  while (true) {
    const ssize_t count = ::recv(socket_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count == 0) return false;
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    input_.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

std::optional<std::string> Client::next_line() {
  const std::size_t end = input_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = input_.substr(0, end);
  input_.erase(0, end + 1);
  return line;
}

Result<std::string, std::string> Client::read_line(std::chrono::milliseconds at_most) {
  const auto deadline = steady_clock::now() + at_most;
  bool has_gone = false;
  bool was_last_look = false;
  while (true) {
    if (auto line = next_line()) return *line;
    if (has_gone) return failure(std::string("the daemon closed the connection"));
    if (was_last_look) return failure(std::string("the daemon does not answer"));
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - steady_clock::now());
    // An answer may have arrived while this process did not run: the socket is checked again after the deadline.
    was_last_look = left.count() <= 0;
    pollfd wait{.fd = socket_.get(), .events = POLLIN, .revents = 0};
    if (::poll(&wait, 1, was_last_look ? 0 : static_cast<int>(left.count())) > 0) has_gone = !take_in();
  }
}

}  // namespace bmu
