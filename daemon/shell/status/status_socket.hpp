// The Unix socket of bmuctl: a line of JSON in, a line of JSON out, for a few clients at once.
//
// A client can neither hold nor starve the control loop: nothing here blocks, one request is answered per call, lines
// and queues are bounded, and a client that sends nonsense without end or does not read is cut off. A watching client
// that reads slowly misses pictures: at most one waits for it. The answering function interprets the lines. Nor can one
// user starve another: where all connections are taken, another user gets the most silent one of the user with most of
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/shell/status/peer.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct StatusReply {
  std::string line;                        // without the newline
  std::optional<Duration> picture_period;  // from now on this client gets the picture with this period
  std::string refusal{};                   // reason why nothing was done, as in the line; "" if something was
  bool is_later = false;                   // no line yet: answer_later() will send it
};

struct StatusSocketOptions {
  std::string path;
  std::string own_directory = "/run/bmud";  // created if it is missing; no other is
  bool is_for_all = false;                  // all users may connect; else the file's owner and group
  std::size_t clients_max = 16;
  std::size_t request_bytes_max = 4096;
  /// A client that gets a reply while it leaves more than this unread is dropped. So at most this and one line wait for
  /// a client.
  std::size_t unread_bytes_max = std::size_t{1024} * 1024;
  /// A watching client that has read nothing of a picture for this long is dropped: one that was stopped and not
  /// continued.
  Duration untaken_max = std::chrono::minutes(1);
};

class StatusSocket {
 public:
  using Answer = std::function<StatusReply(std::string_view request, const Peer& peer)>;
  using Picture = std::function<std::string()>;
  /// "" accepts the peer; otherwise the line that is sent before the connection is closed.
  using Door = std::function<std::string(const Peer& peer)>;

  /// Replaces the socket file of a dead daemon, never that of a running one. Creates its own directory if need be.
  [[nodiscard]] static Result<std::unique_ptr<StatusSocket>, OsError> open(const StatusSocketOptions& options);
  StatusSocket(const StatusSocket&) = delete;
  StatusSocket& operator=(const StatusSocket&) = delete;
  /// Removes the socket file.
  ~StatusSocket();

  /// A rejected client takes no other one's connection. Present clients are checked, too: the rules may have changed.
  void set_door(Door door);
  /// As StatusSocketOptions::is_for_all.
  [[nodiscard]] Result<void, OsError> set_for_all(bool is_for_all);

  /// Readable (level) when serve() has something to do.
  [[nodiscard]] int fd() const { return poll_.get(); }
  /// Accepts, reads, writes, and answers at most one request.
  void serve(const Answer& answer);
  /// The reply to a request that was to be answered later. Until then the next requests of its client wait. A client
  /// that has gone meanwhile does not get it.
  void answer_later(std::uint64_t connection, std::string_view line);
  /// Requests that have been read already are waiting: call serve() again, whatever the state of fd().
  [[nodiscard]] bool has_waiting_requests() const;
  /// Sends the picture to those clients that are due and have read the one before. It is made once for all, and only if
  /// it is sent.
  void publish(TimePoint now, const Picture& picture);

  [[nodiscard]] std::size_t client_count() const { return clients_.size(); }
  [[nodiscard]] std::uint64_t clients_dropped() const { return clients_dropped_; }

 private:
  struct Client;

  StatusSocket(StatusSocketOptions options, OwnedFd poll, OwnedFd listener);

  void accept_clients();
  void hear_new_clients(bool hears);
  /// Takes a connection from a user with more of them than this one would have.
  [[nodiscard]] bool make_room_for(const Peer& peer);
  void turn_away(Client& client, std::string_view line);
  void read_from(Client& client);
  void answer_one(const Answer& answer);
  void answer_line(Client& client, const Answer& answer);
  void queue(Client& client, std::string_view line);
  void write_to(Client& client);
  void watch_writable(Client& client, bool wanted);
  void drop(Client& client);
  [[nodiscard]] bool is_picture_due(Client& client, TimePoint now);
  void remove_finished();
  [[nodiscard]] bool has_request(const Client& client) const;

  StatusSocketOptions options_;
  Door door_;
  OwnedFd poll_;
  OwnedFd listener_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::size_t next_turn_ = 0;
  bool is_deaf_ = false;  // accepts no clients until the next tick
  std::uint64_t connections_ = 0;
  std::uint64_t requests_ = 0;
  std::uint64_t clients_dropped_ = 0;
};

/// {"ok":false,"error":{"code":...,"message":...}}
[[nodiscard]] std::string error_line(std::string_view code, std::string_view message);

}  // namespace bmu
