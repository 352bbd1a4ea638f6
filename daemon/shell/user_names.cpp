#include "daemon/shell/user_names.hpp"

#include <charconv>
#include <fstream>
#include <string_view>

namespace bmu {

/// name:password:number:...; lines that are something else have no number there. Of two names the first counts.
UserNames::UserNames(const std::string& file) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const std::size_t name_end = line.find(':');
    const std::size_t number_at = name_end == std::string::npos ? name_end : line.find(':', name_end + 1);
    if (name_end == 0 || number_at == std::string::npos) continue;
    std::uint32_t user_id = 0;
    const char* const end = line.data() + line.size();
    const auto parsed = std::from_chars(line.data() + number_at + 1, end, user_id);
    if (parsed.ec == std::errc{} && parsed.ptr != end && *parsed.ptr == ':') {
      names_.emplace(user_id, line.substr(0, name_end));
    }
  }
}

std::string UserNames::name_of(std::uint32_t user_id) const {
  const auto found = names_.find(user_id);
  return found == names_.end() ? "" : found->second;
}

std::string UserNames::text_of(std::uint32_t user_id) const {
  const std::string name = name_of(user_id);
  return (name.empty() ? "" : name + " (") + "user " + std::to_string(user_id) + (name.empty() ? "" : ")");
}

}  // namespace bmu
