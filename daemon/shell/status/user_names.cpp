#include "daemon/shell/status/user_names.hpp"

#include "daemon/shell/status/account_file.hpp"

namespace bmu {

/// The first name of an id counts.
UserNames::UserNames(const std::string& file) {
  for (Account& account : read_accounts(file)) names_.emplace(account.number, std::move(account.name));
}

std::string UserNames::name_of(std::uint32_t user_id) const {
  const auto found = names_.find(user_id);
  return found == names_.end() ? "" : found->second;
}

std::string UserNames::text_of(std::uint32_t user_id) const {
  const std::string name = name_of(user_id);
  return (name.empty() ? "" : name + " (") + "user " + std::to_string(user_id) + (name.empty() ? "" : ")");
}

std::string UserNames::text_of(const Peer& peer) const {
  const std::string name = name_of(peer.user_id);
  const std::string numbers = "user " + std::to_string(peer.user_id) + ", process " + std::to_string(peer.process_id);
  return name.empty() ? numbers : name + " (" + numbers + ")";
}

}  // namespace bmu
