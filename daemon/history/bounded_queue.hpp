// A queue between two threads, one of which may never wait: it has room for so many, made at the start, and says no
// when that is used up. One thread pushes, one other pops.
#pragma once

#include <atomic>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace bmu {

template <class Item>
class BoundedQueue {
  static_assert(std::is_trivially_copyable_v<Item>, "pushing must not allocate");

 public:
  /// Room for `size` items, above 0.
  explicit BoundedQueue(std::size_t size) : slots_(size + 1) {}

  /// Takes a copy. False: there is no room. Never waits.
  [[nodiscard]] bool push(const Item& item) {
    const std::size_t at = pushed_.load(std::memory_order_relaxed);
    const std::size_t next = (at + 1) % slots_.size();
    if (next == popped_.load(std::memory_order_acquire)) return false;
    slots_[at] = item;
    pushed_.store(next, std::memory_order_release);
    return true;
  }

  /// How many there are; for the thread that pops, at least so many.
  [[nodiscard]] std::size_t size() const {
    const std::size_t end = pushed_.load(std::memory_order_acquire);
    const std::size_t begin = popped_.load(std::memory_order_acquire);
    return (end + slots_.size() - begin) % slots_.size();
  }
  /// The one that was pushed first, and those behind it; `index` below size(). Only where it is popped.
  [[nodiscard]] const Item& operator[](std::size_t index) const {
    return slots_[(popped_.load(std::memory_order_relaxed) + index) % slots_.size()];
  }
  /// The first `count` of them are done with.
  void pop(std::size_t count) {
    popped_.store((popped_.load(std::memory_order_relaxed) + count) % slots_.size(), std::memory_order_release);
  }

 private:
  std::vector<Item> slots_;  // one more than there is room for: full is not empty
  std::atomic<std::size_t> pushed_ = 0;
  std::atomic<std::size_t> popped_ = 0;
};

}  // namespace bmu
