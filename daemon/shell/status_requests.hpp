// The commands a client of the status socket may give, one row each, and what they are answered with.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "daemon/shell/status_socket.hpp"
#include "daemon/shell/status_view.hpp"

namespace bmu {

/// What the commands need of the daemon.
struct StatusActions {
  std::function<StatusView()> make_view;
  /// Returns when the command has been decided on: the reply tells what it did.
  std::function<void(const CommandGiven&)> carry_out;
  /// Who did what, for the log.
  std::function<void(std::string_view)> log;
  /// The user the daemon runs as: besides root the only one whose clear may have authority.
  std::uint32_t own_user_id = 0;
};

class StatusRequests {
 public:
  explicit StatusRequests(StatusActions actions);

  /// One request line in, one reply line out; never throws.
  [[nodiscard]] StatusReply answer(std::string_view request, const Peer& peer) const;
  /// What watching clients get each period: status, cells, faults and why of one instant, as one line.
  [[nodiscard]] std::string picture() const;

  // The rows' functions.
  [[nodiscard]] StatusReply clear(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply wake(const Peer& peer) const;
  [[nodiscard]] StatusReply accept_modules(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply assign_module(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply balance(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply watch(const Json& request) const;
  [[nodiscard]] StatusView view() const { return actions_.make_view(); }

 private:
  [[nodiscard]] bool has_authority(const Peer& peer) const;
  [[nodiscard]] StatusReply not_allowed(const Peer& peer, std::string_view what) const;
  void log_clear(const Peer& peer, Authority authority, const Json& cleared, const Json& still_present) const;

  StatusActions actions_;
};

}  // namespace bmu
