#include "tests/support/allocation_count.hpp"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

// ThreadSanitizer's operators come as a whole and cannot be replaced: with it nothing is counted and nothing limited.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define BMUD_COUNTS_NOTHING
#endif
#endif

namespace {

std::atomic<std::uint64_t> allocations{0};
std::atomic<std::size_t> limit_bytes{std::numeric_limits<std::size_t>::max()};

#ifndef BMUD_COUNTS_NOTHING
void* counted(std::size_t size) noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (size > limit_bytes.load(std::memory_order_relaxed)) return nullptr;
  return std::malloc(size == 0 ? 1 : size);
}

void* counted_aligned(std::size_t size, std::align_val_t alignment) noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  const auto step = static_cast<std::size_t>(alignment);
  return std::aligned_alloc(step, (size + step - 1) / step * step);
}

void* or_throw(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
#endif

}  // namespace

std::uint64_t bmu::test::allocation_count() {
  return allocations.load(std::memory_order_relaxed);
}

bmu::test::AllocationLimit::AllocationLimit(std::size_t bytes_max) {
  limit_bytes.store(bytes_max, std::memory_order_relaxed);
}

bmu::test::AllocationLimit::~AllocationLimit() {
  limit_bytes.store(std::numeric_limits<std::size_t>::max(), std::memory_order_relaxed);
}

#ifndef BMUD_COUNTS_NOTHING
// All forms, so that the library or a sanitizer provides none while its counterpart is replaced here.
void* operator new(std::size_t size) {
  return or_throw(counted(size));
}
void* operator new[](std::size_t size) {
  return or_throw(counted(size));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size);
}
void* operator new(std::size_t size, std::align_val_t a) {
  return or_throw(counted_aligned(size, a));
}
void* operator new[](std::size_t size, std::align_val_t a) {
  return or_throw(counted_aligned(size, a));
}
void* operator new(std::size_t size, std::align_val_t a, const std::nothrow_t&) noexcept {
  return counted_aligned(size, a);
}
void* operator new[](std::size_t size, std::align_val_t a, const std::nothrow_t&) noexcept {
  return counted_aligned(size, a);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t, const std::nothrow_t&) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t, const std::nothrow_t&) noexcept {
  std::free(memory);
}
#endif
