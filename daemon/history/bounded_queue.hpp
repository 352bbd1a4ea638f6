// Queue between two threads for a producer that must never wait: its capacity is fixed and allocated at construction,
// and push() fails when it is full. One thread pushes, one other pops.
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
  /// Capacity of `size` items, above 0.
  explicit BoundedQueue(std::size_t size) : slots_(size + 1) {}

  /// Stores a copy. False: the queue is full. Never waits.
  [[nodiscard]] bool push(const Item& item) {
    const std::size_t at = pushed_.load(std::memory_order_relaxed);
    const std::size_t next = (at + 1) % slots_.size();
    if (next == popped_.load(std::memory_order_acquire)) return false;
    slots_[at] = item;
    pushed_.store(next, std::memory_order_release);
    return true;
  }

  /// Number of items; for the thread that pops, a lower bound.
  [[nodiscard]] std::size_t size() const {
    const std::size_t end = pushed_.load(std::memory_order_acquire);
    const std::size_t begin = popped_.load(std::memory_order_acquire);
    return (end + slots_.size() - begin) % slots_.size();
  }
  /// Items from the oldest on; `index` below size(). Only in the thread that pops.
  [[nodiscard]] const Item& operator[](std::size_t index) const {
    return slots_[(popped_.load(std::memory_order_relaxed) + index) % slots_.size()];
  }
  /// Removes the first `count` items.
  void pop(std::size_t count) {
    popped_.store((popped_.load(std::memory_order_relaxed) + count) % slots_.size(), std::memory_order_release);
  }

 private:
  std::vector<Item> slots_;  // one more than the capacity: distinguishes full from empty
  std::atomic<std::size_t> pushed_ = 0;
  std::atomic<std::size_t> popped_ = 0;
};

}  // namespace bmu
