// The commands a client of the status socket may give, one row each: the right it takes, and what it is answered with.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/shell/status/access.hpp"
#include "daemon/shell/status/status_socket.hpp"
#include "daemon/shell/status/status_view.hpp"

namespace bmu {

/// What the commands need of the daemon.
struct StatusActions {
  std::function<StatusView()> make_view;
  /// Returns when the command has been decided on: the reply tells what it did.
  std::function<void(const CommandGiven&)> carry_out;
  /// Who did what, for the log.
  std::function<void(std::string_view)> log;
  Access& access;
  /// Takes up the pack file anew: refused, or answered once it is known how that went.
  std::function<StatusReply(const Peer&)> reload;
};

/// {"ok":true,"cmd":COMMAND,...}
[[nodiscard]] std::string reply_line(std::string_view command, const Json& content);
/// A reply that says why nothing was done.
[[nodiscard]] StatusReply refusal(std::string_view code, std::string_view why);

/// What a command takes: `right`, and control where its request has the key `control_key`.
struct CommandRight {
  std::string_view name;
  Right right{};
  std::string_view control_key;  // "": none
};

/// Of every command there is.
[[nodiscard]] std::vector<CommandRight> command_rights();

class StatusRequests {
 public:
  explicit StatusRequests(StatusActions actions);

  /// One request line in, one reply line out; never throws.
  [[nodiscard]] StatusReply answer(std::string_view request, const Peer& peer) const;
  /// What watching clients get each period: status, cells, faults and why of one instant, as one line.
  [[nodiscard]] std::string picture() const;

  // The rows' functions.
  [[nodiscard]] StatusReply clear(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply wake(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply accept_modules(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply assign_module(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply balance(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply watch(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusReply reload(const Json& request, const Peer& peer) const;
  [[nodiscard]] StatusView view() const { return actions_.make_view(); }

 private:
  [[nodiscard]] StatusReply answer_json(const Json& request, const Peer& peer) const;
  [[nodiscard]] std::string who(const Peer& peer) const { return actions_.access.users().text_of(peer); }
  void log_clear(const Peer& peer, Authority authority, const Json& cleared, const Json& still_present) const;

  StatusActions actions_;
};

}  // namespace bmu
