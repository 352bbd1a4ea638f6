// /etc/passwd and /etc/group: names and their ids, read as files. A query of the system for a name may take as long as
// its directory server does, and no part of the daemon can wait for that.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace bmu {

struct Account {
  std::string name;
  std::uint32_t number = 0;
};

/// One account per line, name:password:number:...; other lines are left out. Empty if the file cannot be read.
[[nodiscard]] std::vector<Account> read_accounts(const std::string& file);

}  // namespace bmu
