// How much room there is: on the disk the state is kept on, and in this process's memory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace bmu {

struct ResourceLimits {
  std::uint64_t disk_free_min_bytes = 50'000'000;
  std::uint64_t disk_free_min_permille = 20;     // of the whole disk
  std::uint64_t memory_max_bytes = 200'000'000;  // resident; some ten times what we need
};

struct DiskSpace {
  std::uint64_t free_bytes = 0;  // for us: what is reserved for others does not count
  std::uint64_t total_bytes = 0;
};

/// Either is too little. A file system that does not count its room (total 0) has enough.
[[nodiscard]] constexpr bool is_low(const DiskSpace& disk, const ResourceLimits& limits) {
  if (disk.total_bytes == 0) return false;
  return disk.free_bytes < limits.disk_free_min_bytes ||
         disk.free_bytes < disk.total_bytes / 1'000 * limits.disk_free_min_permille;
}

/// Nothing if the system does not say. May wait for the disk.
[[nodiscard]] std::optional<DiskSpace> disk_space(const std::string& folder);
/// Resident memory of this process (VmRSS); nothing if the system does not say.
[[nodiscard]] std::optional<std::uint64_t> resident_bytes();

}  // namespace bmu
