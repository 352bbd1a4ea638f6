// Names of users, for records of their actions: as in /etc/passwd when it was read (account_file.hpp).
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "daemon/shell/status/peer.hpp"

namespace bmu {

class UserNames {
 public:
  explicit UserNames(const std::string& file = "/etc/passwd");

  /// "" for a user who is not in the file.
  [[nodiscard]] std::string name_of(std::uint32_t user_id) const;
  /// "anna (user 1000)", "user 1000".
  [[nodiscard]] std::string text_of(std::uint32_t user_id) const;
  /// "anna (user 1000, process 4711)", "user 1000, process 4711".
  [[nodiscard]] std::string text_of(const Peer& peer) const;

 private:
  std::map<std::uint32_t, std::string> names_;
};

}  // namespace bmu
