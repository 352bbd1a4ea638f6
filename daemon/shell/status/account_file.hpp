// /etc/passwd and /etc/group: names and their numbers, read as files. Asking the system for a name may take as long as
// its directory server likes, and nobody here can wait for that.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace bmu {

struct Account {
  std::string name;
  std::uint32_t number = 0;
};

/// name:password:number:... a line; what is something else is left out. Empty if the file cannot be read.
[[nodiscard]] std::vector<Account> read_accounts(const std::string& file);

}  // namespace bmu
