#include "daemon/shell/status/status_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace bmu {

struct StatusSocket::Client {
  OwnedFd socket;
  Peer peer;
  std::string input;
  std::string output;
  std::size_t output_sent = 0;  // bytes of `output`
  std::optional<Duration> picture_period;
  TimePoint picture_at{};
  std::size_t unread_seen = 0;  // at the last check whether a picture is due
  TimePoint took_at{};          // last check at which less was unread than before
  std::uint64_t asked_at = 0;   // number of its last request, counted over all clients
  bool awaits_answer = false;   // a deferred one
  bool has_ended = false;       // sends no more; its requests are still answered
  bool is_closing = false;      // close once everything is written
  bool is_finished = false;     // to be removed

  [[nodiscard]] std::size_t unread() const { return output.size() - output_sent; }
};

namespace {

constexpr mode_t mode_for_group = 0660;
constexpr mode_t mode_for_all = 0666;
constexpr int directory_mode = 0755;
constexpr int backlog = 16;
constexpr int events_per_call = 32;

OsError os_error(std::string what) {
  return {.code = errno, .what = std::move(what)};
}

Result<sockaddr_un, OsError> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return failure(OsError{.code = 0, .what = "status socket " + path + ": a path of 1 to 107 bytes is needed"});
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

OwnedFd make_stream_socket() {
  return OwnedFd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

const sockaddr* plain(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

/// Another directory that is missing is more likely a typing error than intended.
Result<void, OsError> make_own_directory(const std::string& path, const std::string& own_directory) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos || slash == 0) return {};
  const std::string directory = path.substr(0, slash);
  struct stat status {};
  if (::stat(directory.c_str(), &status) == 0) return {};
  if (directory != own_directory) {
    return failure(os_error("status socket " + path + ": directory " + directory +
                            " does not exist; create it, or choose another path with --socket"));
  }
  if (::mkdir(directory.c_str(), directory_mode) == 0 || errno == EEXIST) return {};
  return failure(os_error("status socket " + path + ": cannot create the directory " + directory +
                          "; create it, run bmud as a service, or choose another path with --socket"));
}

/// A socket file without a listener was left by a daemon that died.
Result<void, OsError> remove_stale(const std::string& path, const sockaddr_un& address) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return {};
  if (!S_ISSOCK(status.st_mode)) {
    return failure(OsError{.code = EEXIST, .what = "status socket " + path + " exists and is not a socket"});
  }
  const OwnedFd probe = make_stream_socket();
  if (!probe.is_open()) return failure(os_error("status socket " + path));
  const bool answers = ::connect(probe.get(), plain(address), sizeof(address)) == 0;
  if (answers || errno == EAGAIN) {
    return failure(OsError{.code = 0, .what = "another bmud is running on " + path});
  }
  if (errno != ECONNREFUSED) return failure(os_error("status socket " + path));
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return failure(os_error("remove the stale socket " + path));
  return {};
}

bool set_mode(const StatusSocketOptions& options) {
  return ::chmod(options.path.c_str(), options.is_for_all ? mode_for_all : mode_for_group) == 0;
}

bool add_to_poll(int poll, int fd, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.fd = fd;
  return ::epoll_ctl(poll, EPOLL_CTL_ADD, fd, &event) == 0;
}

}  // namespace

std::string error_line(std::string_view code, std::string_view message) {
  const nlohmann::ordered_json line = {{"ok", false}, {"error", {{"code", code}, {"message", message}}}};
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Result<std::unique_ptr<StatusSocket>, OsError> StatusSocket::open(const StatusSocketOptions& options) {
  const auto address = address_of(options.path);
  if (!address) return failure(address.error());
  if (auto made = make_own_directory(options.path, options.own_directory); !made) return failure(made.error());
  if (auto removed = remove_stale(options.path, *address); !removed) return failure(removed.error());

  OwnedFd listener = make_stream_socket();
  OwnedFd poll(::epoll_create1(EPOLL_CLOEXEC));
  if (!listener.is_open() || !poll.is_open()) return failure(os_error("status socket " + options.path));
  if (::bind(listener.get(), plain(*address), sizeof(*address)) != 0) {
    return failure(os_error("bind the status socket " + options.path));
  }
  // Before listen() no client can connect, so the mode is right for each of them.
  if (!set_mode(options) || ::listen(listener.get(), backlog) != 0 ||
      !add_to_poll(poll.get(), listener.get(), EPOLLIN)) {
    return failure(os_error("status socket " + options.path));
  }
  return std::unique_ptr<StatusSocket>(new StatusSocket(options, std::move(poll), std::move(listener)));
}

StatusSocket::StatusSocket(StatusSocketOptions options, OwnedFd poll, OwnedFd listener)
    : options_(std::move(options)), poll_(std::move(poll)), listener_(std::move(listener)) {}

StatusSocket::~StatusSocket() {
  ::unlink(options_.path.c_str());
}

Result<void, OsError> StatusSocket::set_for_all(bool is_for_all) {
  options_.is_for_all = is_for_all;
  if (!set_mode(options_)) return failure(os_error("status socket " + options_.path));
  return {};
}

void StatusSocket::set_door(Door door) {
  door_ = std::move(door);
  for (const auto& client : clients_) {
    if (const std::string refusal = door_(client->peer); !refusal.empty()) turn_away(*client, refusal);
  }
  remove_finished();
}

void StatusSocket::serve(const Answer& answer) {
  std::array<epoll_event, events_per_call> events{};
  const int count = ::epoll_wait(poll_.get(), events.data(), events_per_call, 0);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    if (event.data.fd == listener_.get()) {
      accept_clients();
      continue;
    }
    const auto client = std::find_if(clients_.begin(), clients_.end(),
                                     [&](const auto& one) { return one->socket.get() == event.data.fd; });
    if (client == clients_.end()) continue;
    if ((event.events & EPOLLOUT) != 0) write_to(**client);
    // Hung up: reported by every wait, and the recipient of the answer is gone.
    if ((event.events & EPOLLHUP) != 0 && (*client)->awaits_answer) (*client)->is_finished = true;
    if ((event.events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0) read_from(**client);
  }
  answer_one(answer);
  remove_finished();
}

void StatusSocket::accept_clients() {
  // One per call: the listener stays readable while there are more.
  OwnedFd socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket.is_open()) {
    // Without a descriptor left for it (EMFILE, ENFILE) a client waits on, and the listener stays readable: the loop
    // that waits for it would never sleep again.
    if (errno != EAGAIN && errno != ECONNABORTED) hear_new_clients(false);
    return;
  }
  auto client = std::make_unique<Client>();
  client->socket = std::move(socket);
  client->peer = peer_of(client->socket.get());
  client->peer.connection = ++connections_;
  // First, so that a user who may not even read cannot take all connections.
  if (const std::string refusal = door_ ? door_(client->peer) : ""; !refusal.empty()) {
    return turn_away(*client, refusal);
  }
  if (clients_.size() >= options_.clients_max && !make_room_for(client->peer)) {
    return turn_away(*client, error_line("too_many_clients", "all connections in use; retry later"));
  }
  if (add_to_poll(poll_.get(), client->socket.get(), EPOLLIN)) clients_.push_back(std::move(client));
}

bool StatusSocket::make_room_for(const Peer& peer) {
  const auto connections_of = [this](std::uint32_t user_id) {
    return std::count_if(clients_.begin(), clients_.end(),
                         [&](const auto& client) { return client->peer.user_id == user_id; });
  };
  const auto gives_up_before = [&](const auto& one, const auto& other) {
    const auto rank = [&](const Client& client) {
      return std::tuple(client.awaits_answer, -connections_of(client.peer.user_id), client.picture_period.has_value(),
                        client.asked_at);
    };
    return rank(*one) < rank(*other);
  };
  const auto found = std::min_element(clients_.begin(), clients_.end(), gives_up_before);
  // More than the new client's user would have: otherwise two users would displace each other in turn.
  if (found == clients_.end() || (*found)->awaits_answer ||
      connections_of((*found)->peer.user_id) <= connections_of(peer.user_id) + 1) {
    return false;
  }
  turn_away(**found, error_line("too_many_clients", "connection closed: limit reached and another user is waiting"));
  remove_finished();
  return true;
}

void StatusSocket::turn_away(Client& client, std::string_view line) {
  const std::string text = std::string(line) + "\n";
  static_cast<void>(::send(client.socket.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  drop(client);
}

bool StatusSocket::has_request(const Client& client) const {
  if (client.is_closing || client.is_finished || client.awaits_answer) return false;
  return client.input.find('\n') != std::string::npos || client.input.size() > options_.request_bytes_max;
}

bool StatusSocket::has_waiting_requests() const {
  return std::any_of(clients_.begin(), clients_.end(), [this](const auto& client) { return has_request(*client); });
}

void StatusSocket::read_from(Client& client) {
  if (client.is_finished) return;
  std::array<char, 4096> buffer{};
  const ssize_t count = ::recv(client.socket.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (count < 0) {
    if (errno != EAGAIN && errno != EINTR) client.is_finished = true;
    return;
  }
  if (count == 0) {
    // Readable (level) permanently from now on, so it is taken out of the poll unless something is left to be written.
    client.has_ended = true;
    watch_writable(client, client.unread() > 0);
    return;
  }
  if (client.is_closing) return;  // cut off: further input is ignored
  client.input.append(buffer.data(), static_cast<std::size_t>(count));
  // No more than a line and one read ahead is accepted: the sender waits until these are answered.
  if (client.input.size() > options_.request_bytes_max) watch_writable(client, client.unread() > 0);
}

void StatusSocket::answer_one(const Answer& answer) {
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    Client& client = *clients_[(next_turn_ + i) % clients_.size()];
    if (!has_request(client)) {
      if (client.has_ended && !client.awaits_answer && client.unread() == 0) client.is_finished = true;
      continue;
    }
    next_turn_ = (next_turn_ + i + 1) % clients_.size();
    answer_line(client, answer);
    return;
  }
}

void StatusSocket::answer_line(Client& client, const Answer& answer) {
  const std::size_t end = client.input.find('\n');
  if (end == std::string::npos || end > options_.request_bytes_max) {
    client.input.clear();
    client.is_closing = true;
    ++clients_dropped_;
    queue(client,
          error_line("too_long", "request too long, maximum " + std::to_string(options_.request_bytes_max) + " bytes"));
    return;
  }
  const std::string line = client.input.substr(0, end);
  client.input.erase(0, end + 1);
  client.asked_at = ++requests_;
  const StatusReply reply = answer(line, client.peer);
  if (reply.picture_period) {
    client.picture_period = reply.picture_period;
    client.picture_at = {};
  }
  client.awaits_answer = reply.is_later;
  if (!reply.line.empty()) queue(client, reply.line);
  watch_writable(client, client.unread() > 0);
}

void StatusSocket::answer_later(std::uint64_t connection, std::string_view line) {
  for (const auto& client : clients_) {
    if (client->peer.connection != connection || !client->awaits_answer) continue;
    client->awaits_answer = false;
    queue(*client, line);
  }
  remove_finished();
}

void StatusSocket::hear_new_clients(bool hears) {
  epoll_event event{};
  if (hears) event.events = EPOLLIN;
  event.data.fd = listener_.get();
  if (::epoll_ctl(poll_.get(), EPOLL_CTL_MOD, listener_.get(), &event) == 0) is_deaf_ = !hears;
}

void StatusSocket::publish(TimePoint now, const Picture& picture) {
  if (is_deaf_) hear_new_clients(true);
  std::string line;
  for (const auto& client : clients_) {
    if (!is_picture_due(*client, now)) continue;
    if (line.empty()) line = picture();
    const TimePoint next = client->picture_at + *client->picture_period;
    client->picture_at = next > now ? next : now + *client->picture_period;
    queue(*client, line);
    client->unread_seen = client->unread();
    client->took_at = now;
  }
  remove_finished();
}

/// A client that was not running for seconds, as on a machine that is busy, needs the newest picture and none of those
/// before. Drops one that reads nothing any more.
bool StatusSocket::is_picture_due(Client& client, TimePoint now) {
  if (!client.picture_period || client.is_finished || now < client.picture_at) return false;
  const std::size_t unread = client.unread();
  if (unread == 0) return true;
  if (unread < client.unread_seen) client.took_at = now;
  client.unread_seen = unread;
  if (now - client.took_at > options_.untaken_max) drop(client);
  return false;
}

void StatusSocket::queue(Client& client, std::string_view line) {
  if (client.unread() > options_.unread_bytes_max) return drop(client);
  client.output.erase(0, std::exchange(client.output_sent, 0));
  client.output.append(line);
  client.output.push_back('\n');
  write_to(client);
}

void StatusSocket::write_to(Client& client) {
  if (client.is_finished) return;
  const ssize_t count = ::send(client.socket.get(), client.output.data() + client.output_sent, client.unread(),
                               MSG_NOSIGNAL | MSG_DONTWAIT);
  if (count < 0 && errno != EAGAIN && errno != EINTR) client.is_finished = true;
  if (count > 0) client.output_sent += static_cast<std::size_t>(count);
  const bool has_all = client.has_ended && !client.awaits_answer && !has_request(client);
  if (client.unread() == 0 && (client.is_closing || has_all)) {
    client.is_finished = true;
  }
  watch_writable(client, client.unread() > 0);
}

void StatusSocket::watch_writable(Client& client, bool wanted) {
  const bool takes_input = !client.has_ended && client.input.size() <= options_.request_bytes_max;
  epoll_event event{};
  event.events = (takes_input ? EPOLLIN : 0U) | (wanted ? EPOLLOUT : 0U);
  event.data.fd = client.socket.get();
  static_cast<void>(::epoll_ctl(poll_.get(), EPOLL_CTL_MOD, client.socket.get(), &event));
}

void StatusSocket::drop(Client& client) {
  client.is_finished = true;
  ++clients_dropped_;
}

void StatusSocket::remove_finished() {
  const auto is_finished = [](const auto& client) { return client->is_finished; };
  clients_.erase(std::remove_if(clients_.begin(), clients_.end(), is_finished), clients_.end());
  if (next_turn_ >= clients_.size()) next_turn_ = 0;
}

}  // namespace bmu
