// Names of users, for records that say who did something. As /etc/passwd had them at start: asking the system for a
// name may take as long as its directory server likes, and the control loop cannot wait.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace bmu {

class UserNames {
 public:
  explicit UserNames(const std::string& file = "/etc/passwd");

  /// "" for somebody who is not in the file.
  [[nodiscard]] std::string name_of(std::uint32_t user_id) const;
  /// "anna (user 1000)", "user 1000".
  [[nodiscard]] std::string text_of(std::uint32_t user_id) const;

 private:
  std::map<std::uint32_t, std::string> names_;
};

}  // namespace bmu
