#include "tests/support/needs.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace bmu::test {

namespace {

bool has_pseudo_terminals() {
  const int end = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (end < 0) return false;
  std::array<char, 64> name{};
  const bool is_one = ::grantpt(end) == 0 && ::unlockpt(end) == 0 && ::ptsname_r(end, name.data(), name.size()) == 0;
  const int other = is_one ? ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC) : -1;
  if (other >= 0) ::close(other);
  ::close(end);
  return other >= 0;
}

/// 135 kB per bus, two buses per test, up to 32 tests in parallel (tools/test), and the files of killed tests.
constexpr std::uint64_t shared_memory_min_bytes = 16'000'000;

bool has_room_for_buses() {
  struct statvfs room {};
  return ::statvfs("/dev/shm", &room) == 0 && room.f_bavail * room.f_frsize >= shared_memory_min_bytes;
}

}  // namespace

std::vector<MissingNeed> missing_needs() {
  std::vector<MissingNeed> missing;
  if (!has_pseudo_terminals()) missing.push_back({"[pty]", "no pseudo-terminals (/dev/ptmx, /dev/pts)"});
  if (!has_room_for_buses()) missing.push_back({"[bus]", "less than 16 MB free in /dev/shm"});
  return missing;
}

std::string without(const std::string& pattern, const std::vector<MissingNeed>& missing) {
  std::string excluded;
  for (const MissingNeed& need : missing) excluded += "~" + need.tag;
  // In front: after a name it would belong to the name. A comma separates alternatives, each with its own exclusions.
  std::string result = excluded;
  bool is_escaped = false;
  for (const char letter : pattern) {
    result += letter;
    if (letter == ',' && !is_escaped) result += excluded;
    is_escaped = letter == '\\' && !is_escaped;
  }
  return result;
}

}  // namespace bmu::test
