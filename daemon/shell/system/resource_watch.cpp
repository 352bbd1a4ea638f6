#include "daemon/shell/system/resource_watch.hpp"

#include <array>
#include <cstdio>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"

namespace bmu {

std::optional<DiskSpace> disk_space(const std::string& folder) {
  struct statvfs status {};
  if (::statvfs(folder.c_str(), &status) != 0) return std::nullopt;
  return DiskSpace{.free_bytes = std::uint64_t{status.f_bavail} * status.f_frsize,
                   .total_bytes = std::uint64_t{status.f_blocks} * status.f_frsize};
}

std::optional<std::uint64_t> resident_bytes() {
  const OwnedFd file(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  std::array<char, 128> buffer{};
  if (!file.is_open() || ::read(file.get(), buffer.data(), buffer.size() - 1) <= 0) return std::nullopt;
  unsigned long long total_pages = 0;
  unsigned long long resident_pages = 0;
  if (std::sscanf(buffer.data(), "%llu %llu", &total_pages, &resident_pages) != 2) return std::nullopt;
  return resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace bmu
