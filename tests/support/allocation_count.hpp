// How often the program asked for heap memory: for tests of what promises not to; and a limit to it, for tests of what
// has to do with less.
//
// A test program that links allocation_count.cpp has every form of operator new replaced by one that counts.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bmu::test {

[[nodiscard]] std::uint64_t allocation_count();

/// While it lives, whoever asks for more at once, in whatever thread, gets std::bad_alloc.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::size_t bytes_max);
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
  ~AllocationLimit();
};

}  // namespace bmu::test
