// The Unix socket bmuctl talks to: a line of JSON in, a line of JSON out, for a few clients at once.
//
// A client can neither hold nor starve the control loop: nothing here blocks, one request is answered per call, lines
// and queues are bounded, and who sends nonsense without end or does not read is cut off. Who watches and reads slowly
// misses pictures: at most one waits for a client. What a line means is the business of the answering function. Nor can
// one user starve another: where all connections are taken, somebody else takes the most silent one of who has most of
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
  std::optional<Duration> picture_period;  // from now on this client gets the picture that often
  std::string refusal{};                   // why nothing was done, as the line says; "" if something was
  bool is_later = false;                   // no line yet: answer_later() will bring it
};

struct StatusSocketOptions {
  std::string path;
  std::string own_directory = "/run/bmud";  // made if it is missing; no other is
  bool is_for_all = false;                  // everybody may connect; else the file's owner and group
  std::size_t clients_max = 16;
  std::size_t request_bytes_max = 4096;
  /// A client that gets an answer while it leaves more than this unread is dropped. So what waits for a client is at
  /// most this and one line.
  std::size_t unread_bytes_max = std::size_t{1024} * 1024;
  /// A client that watches and has taken nothing of a picture for so long is dropped: one that was stopped and not
  /// continued.
  Duration untaken_max = std::chrono::minutes(1);
};

class StatusSocket {
 public:
  using Answer = std::function<StatusReply(std::string_view request, const Peer& peer)>;
  using Picture = std::function<std::string()>;
  /// "" lets somebody in; else the line that is sent before the connection is closed.
  using Door = std::function<std::string(const Peer& peer)>;

  /// Takes the place of a dead daemon's socket file, never of a living one's. Makes its own directory if need be.
  [[nodiscard]] static Result<std::unique_ptr<StatusSocket>, OsError> open(const StatusSocketOptions& options);
  StatusSocket(const StatusSocket&) = delete;
  StatusSocket& operator=(const StatusSocket&) = delete;
  /// Removes the socket file.
  ~StatusSocket();

  /// Who is kept out takes nobody's place. Those who are connected are asked about, too: rules may have changed.
  void set_door(Door door);
  /// As StatusSocketOptions::is_for_all.
  [[nodiscard]] Result<void, OsError> set_for_all(bool is_for_all);

  /// Readable (level) when serve() has something to do.
  [[nodiscard]] int fd() const { return poll_.get(); }
  /// Accepts, reads, writes, and answers at most one request.
  void serve(const Answer& answer);
  /// What a request that was to be answered later is answered with. Until then its client's next ones wait. One who has
  /// gone meanwhile misses it.
  void answer_later(std::uint64_t connection, std::string_view line);
  /// Requests wait that have been read already: serve() again, whatever fd() says.
  [[nodiscard]] bool has_waiting_requests() const;
  /// Sends the picture to those whose time it is and who have read the one before. It is made once for all, and only if
  /// it is sent.
  void publish(TimePoint now, const Picture& picture);

  [[nodiscard]] std::size_t client_count() const { return clients_.size(); }
  [[nodiscard]] std::uint64_t clients_dropped() const { return clients_dropped_; }

 private:
  struct Client;

  StatusSocket(StatusSocketOptions options, OwnedFd poll, OwnedFd listener);

  void accept_clients();
  void hear_new_clients(bool hears);
  /// Takes a connection from who has more of them than this one would have.
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
  bool is_deaf_ = false;  // to new clients, until the next tick
  std::uint64_t connections_ = 0;
  std::uint64_t requests_ = 0;
  std::uint64_t clients_dropped_ = 0;
};

/// {"ok":false,"error":{"code":...,"message":...}}
[[nodiscard]] std::string error_line(std::string_view code, std::string_view message);

}  // namespace bmu
