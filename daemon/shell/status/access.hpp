// Who may do what on the status socket. It is decided for each request, by what the kernel says of whoever connected.
//
//   read      look at the pack       members of the group bmud, and whoever may control
//   control   change something       members of the group bmud-admin, root, and the user the daemon runs as
//
// A peer is a member by its first group or by any other that it had when it connected: somebody who was put into a
// group later has to connect anew, as everywhere. The groups' numbers are those /etc/group had at start, or at the last
// reload; a group that only a directory server knows does not count.
//
// Where neither group is there, as in a development run, there is nobody to tell apart: the mode of the socket's file
// alone then says who may connect, and whoever may, reads. (docs/decisions/0016-who-may-do-what.md)
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

/// Nothing for a group that is not there.
struct AccessGroups {
  std::optional<std::uint32_t> readers;
  std::optional<std::uint32_t> admins;

  [[nodiscard]] constexpr bool has_any() const { return readers || admins; }
};

[[nodiscard]] AccessGroups access_groups(const std::string& group_file = "/etc/group");

struct AccessRules {
  std::uint32_t own_user_id = 0;  // whom the daemon runs as
  AccessGroups groups;
};

/// Pure: the whole of the decision.
[[nodiscard]] bool may(const AccessRules& rules, const Peer& peer, Right right);

/// The rules in force, and what is said to those they refuse.
class Access {
 public:
  /// `log`: for refusals, of which only so many are logged as nobody can flood it with.
  Access(const AccessRules& rules, UserNames users, SparingLog::Log log);

  [[nodiscard]] bool may(const Peer& peer, Right right) const { return bmu::may(rules_, peer, right); }
  /// Logs the attempt. The answer: who asked, what for, and who may. `what`: "read here".
  [[nodiscard]] std::string refuse(const Peer& peer, Right right, std::string_view what, TimePoint now);
  /// Logs, as sparingly, what somebody may, and was refused for another reason.
  void note_refused(std::string_view what_and_why, TimePoint now);
  void tell_left_out(TimePoint now) { refusals_.tell_left_out(now); }
  /// Of a reload: accounts may have changed as well.
  void replace(const AccessGroups& groups, UserNames users);

  [[nodiscard]] const UserNames& users() const { return users_; }
  /// Nobody is kept from connecting by the file's mode: who may not read is told so, and why.
  [[nodiscard]] bool is_by_group() const { return rules_.groups.has_any(); }
  /// What holds, for the log at start.
  [[nodiscard]] std::string text() const;

 private:
  [[nodiscard]] std::string who_may(Right right) const;

  AccessRules rules_;
  UserNames users_;
  SparingLog refusals_;
};

}  // namespace bmu
