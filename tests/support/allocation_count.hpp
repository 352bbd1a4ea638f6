// How often the program asked for heap memory: for tests of what promises not to.
//
// A test program that links allocation_count.cpp has every form of operator new replaced by one that counts.
#pragma once

#include <cstdint>

namespace bmu::test {

[[nodiscard]] std::uint64_t allocation_count();

}  // namespace bmu::test
