// The commands of the status socket, one row each: the right that it requires, and its reply.
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

/// Functions of the daemon that the commands use.
struct StatusActions {
  std::function<StatusView()> make_view;
  /// Returns when the command has been decided on: the reply reports its effect.
  std::function<void(const CommandGiven&)> carry_out;
  /// The log of actions, with their users.
  std::function<void(std::string_view)> log;
  Access& access;
  /// Reloads the pack file: refused, or answered once the result is known.
  std::function<StatusReply(const Peer&)> reload;
};

/// {"ok":true,"cmd":COMMAND,...}
[[nodiscard]] std::string reply_line(std::string_view command, const Json& content);
/// A reply with the reason why nothing was done.
[[nodiscard]] StatusReply refusal(std::string_view code, std::string_view why);

/// Right that a command requires: `right`, and control where its request has the key `control_key`.
struct CommandRight {
  std::string_view name;
  Right right{};
  std::string_view control_key;  // "": none
};

/// Of all commands.
[[nodiscard]] std::vector<CommandRight> command_rights();

class StatusRequests {
 public:
  explicit StatusRequests(StatusActions actions);

  /// One request line in, one reply line out; never throws.
  [[nodiscard]] StatusReply answer(std::string_view request, const Peer& peer) const;
  /// Content for watching clients, once each period: status, cells, faults and why of one instant, as one line.
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
