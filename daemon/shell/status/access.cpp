#include "daemon/shell/status/access.hpp"

#include <algorithm>
#include <utility>

#include "daemon/shell/status/account_file.hpp"
#include "daemon/shell/status/status_socket.hpp"

namespace bmu {

namespace {

bool is_member(const Peer& peer, const std::optional<std::uint32_t>& group) {
  if (!group) return false;
  return peer.group_id == *group ||
         std::find(peer.more_groups.begin(), peer.more_groups.end(), *group) != peer.more_groups.end();
}

}  // namespace

AccessGroups access_groups(const std::string& group_file) {
  AccessGroups groups;
  for (const Account& account : read_accounts(group_file)) {
    if (account.name == readers_group && !groups.readers) groups.readers = account.number;
    if (account.name == admins_group && !groups.admins) groups.admins = account.number;
  }
  return groups;
}

bool may(const AccessRules& rules, const Peer& peer, Right right) {
  const bool may_control =
      peer.user_id == 0 || peer.user_id == rules.own_user_id || is_member(peer, rules.groups.admins);
  if (right == Right::control) return may_control;
  return may_control || !rules.groups.has_any() || is_member(peer, rules.groups.readers);
}

Access::Access(const AccessRules& rules, UserNames users, SparingLog::Log log)
    : rules_(rules), users_(std::move(users)), refusals_(std::move(log)) {}

void Access::replace(const AccessGroups& groups, UserNames users) {
  rules_.groups = groups;
  users_ = std::move(users);
}

std::string Access::who_may(Right right) const {
  std::string text = "root";
  if (right == Right::read && rules_.groups.readers) text += ", members of " + std::string(readers_group);
  if (rules_.groups.admins) text += ", members of " + std::string(admins_group);
  if (rules_.own_user_id != 0) text += ", and the user of the daemon, " + users_.text_of(rules_.own_user_id);
  return text;
}

std::string Access::refuse(const Peer& peer, Right right, std::string_view what, TimePoint now) {
  refusals_.log(now, "access denied: " + users_.text_of(peer) + ": " + std::string(what));
  return error_line("not_allowed", users_.text_of(peer.user_id) + " is not permitted to " + std::string(what) +
                                       "; permitted: " + who_may(right));
}

void Access::note_refused(std::string_view what_and_why, TimePoint now) {
  refusals_.log(now, "refused: " + std::string(what_and_why));
}

std::string Access::text() const {
  const std::string control = "status socket: control: " + who_may(Right::control);
  if (is_by_group()) return control + "; read: " + who_may(Right::read);
  return control + "; read: every user that can connect (neither group " + std::string(readers_group) + " nor " +
         std::string(admins_group) + " exists)";
}

}  // namespace bmu
