// Free space on the disk of the state file, and memory use of this process.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace bmu {

struct ResourceLimits {
  std::uint64_t disk_free_min_bytes = 50'000'000;
  std::uint64_t disk_free_min_permille = 20;     // of the whole disk
  std::uint64_t memory_max_bytes = 200'000'000;  // resident; some ten times the normal use
};

struct DiskSpace {
  std::uint64_t free_bytes = 0;  // for this process: blocks reserved for others do not count
  std::uint64_t total_bytes = 0;
};

/// Either value is below its minimum. A file system that does not report its size (total 0) has enough.
[[nodiscard]] constexpr bool is_low(const DiskSpace& disk, const ResourceLimits& limits) {
  if (disk.total_bytes == 0) return false;
  return disk.free_bytes < limits.disk_free_min_bytes ||
         disk.free_bytes < disk.total_bytes / 1'000 * limits.disk_free_min_permille;
}

/// No value if the system does not report it. May wait for the disk.
[[nodiscard]] std::optional<DiskSpace> disk_space(const std::string& folder);
/// Resident memory of this process (VmRSS); no value if the system does not report it.
[[nodiscard]] std::optional<std::uint64_t> resident_bytes();

}  // namespace bmu
