#include "daemon/shell/status/account_file.hpp"

#include <charconv>
#include <fstream>

namespace bmu {

std::vector<Account> read_accounts(const std::string& file) {
  std::vector<Account> accounts;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const std::size_t name_end = line.find(':');
    const std::size_t number_at = name_end == std::string::npos ? name_end : line.find(':', name_end + 1);
    if (name_end == 0 || number_at == std::string::npos) continue;
    std::uint32_t number = 0;
    const char* const end = line.data() + line.size();
    const auto parsed = std::from_chars(line.data() + number_at + 1, end, number);
    if (parsed.ec == std::errc{} && parsed.ptr != end && *parsed.ptr == ':') {
      accounts.push_back({.name = line.substr(0, name_end), .number = number});
    }
  }
  return accounts;
}

}  // namespace bmu
