// Count of the program's heap allocations, for tests of functions that promise none; and a limit on their size, for
// tests of functions that must cope with less memory.
//
// A test program that links allocation_count.cpp has every form of operator new replaced by one that counts.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bmu::test {

[[nodiscard]] std::uint64_t allocation_count();

/// During its lifetime a larger single allocation in any thread throws std::bad_alloc.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::size_t bytes_max);
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
  ~AllocationLimit();
};

}  // namespace bmu::test
