// Access rights on the status socket, checked for each request against the peer credentials that the kernel reports.
//
//   read      see the pack           members of the group bmud, and all who may control
//   control   change something       members of the group bmud-admin, root, and the user the daemon runs as
//
// A peer is a member by its primary group or by any other that it had when it connected: a user who was put into a
// group later has to connect again, as everywhere. The group ids are those of /etc/group at start, or at the last
// reload; a group that only a directory server has does not count.
//
// Without either group, as in a development run, there is nothing to distinguish users by: the mode of the socket file
// alone decides who may connect, and all who may connect may read. (docs/decisions/0016-who-may-do-what.md)
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/shell/status/peer.hpp"
#include "daemon/shell/status/user_names.hpp"
#include "daemon/shell/system/sparing_log.hpp"
#include "protocol/time.hpp"

namespace bmu {

inline constexpr std::string_view readers_group = "bmud";
inline constexpr std::string_view admins_group = "bmud-admin";

enum class Right : std::uint8_t { read, control };

/// No value for a group that does not exist.
struct AccessGroups {
  std::optional<std::uint32_t> readers;
  std::optional<std::uint32_t> admins;

  [[nodiscard]] constexpr bool has_any() const { return readers || admins; }
};

[[nodiscard]] AccessGroups access_groups(const std::string& group_file = "/etc/group");

struct AccessRules {
  std::uint32_t own_user_id = 0;  // user that the daemon runs as
  AccessGroups groups;
};

/// Pure: the complete decision.
[[nodiscard]] bool may(const AccessRules& rules, const Peer& peer, Right right);

/// The rules in force, and the replies to refused peers.
class Access {
 public:
  /// `log`: for refusals, at a rate with which no client can flood it.
  Access(const AccessRules& rules, UserNames users, SparingLog::Log log);

  [[nodiscard]] bool may(const Peer& peer, Right right) const { return bmu::may(rules_, peer, right); }
  /// Logs the attempt. Returns the reply: user, refused action, and the users who may. `what`: "read here".
  [[nodiscard]] std::string refuse(const Peer& peer, Right right, std::string_view what, TimePoint now);
  /// Logs, at the same rate, a permitted request that was refused for another reason.
  void note_refused(std::string_view what_and_why, TimePoint now);
  void tell_left_out(TimePoint now) { refusals_.tell_left_out(now); }
  /// For a reload: accounts may have changed as well.
  void replace(const AccessGroups& groups, UserNames users);

  [[nodiscard]] const UserNames& users() const { return users_; }
  /// The mode of the file keeps no user from connecting: one that may not read gets a reply with the reason.
  [[nodiscard]] bool is_by_group() const { return rules_.groups.has_any(); }
  /// The rules in force, for the log at start.
  [[nodiscard]] std::string text() const;

 private:
  [[nodiscard]] std::string who_may(Right right) const;

  AccessRules rules_;
  UserNames users_;
  SparingLog refusals_;
};

}  // namespace bmu
