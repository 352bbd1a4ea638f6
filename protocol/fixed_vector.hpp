// Vector with fixed capacity and inline storage, for all growing data of the pure parts; never uses the heap.
#pragma once

#include <array>
#include <cstddef>

#include "protocol/assert.hpp"

namespace bmu {

template <class T, std::size_t Capacity>
class FixedVector {
 public:
  using value_type = T;

  /// Appends. The caller guarantees the capacity for its worst case; exceeding it is a bug (BMU_ASSERT).
  constexpr void push_back(const T& value) {
    BMU_ASSERT(size_ < Capacity);
    items_[size_++] = value;
  }
  /// Appends if the capacity allows; otherwise returns false.
  [[nodiscard]] constexpr bool try_push_back(const T& value) {
    if (size_ == Capacity) return false;
    items_[size_++] = value;
    return true;
  }
  constexpr void clear() { size_ = 0; }

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] static constexpr std::size_t capacity() { return Capacity; }

  [[nodiscard]] constexpr T& operator[](std::size_t index) {
    BMU_ASSERT(index < size_);
    return items_[index];
  }
  [[nodiscard]] constexpr const T& operator[](std::size_t index) const {
    BMU_ASSERT(index < size_);
    return items_[index];
  }
  [[nodiscard]] constexpr T& back() { return (*this)[size_ - 1]; }
  [[nodiscard]] constexpr const T& back() const { return (*this)[size_ - 1]; }

  [[nodiscard]] constexpr T* begin() { return items_.data(); }
  [[nodiscard]] constexpr T* end() { return items_.data() + size_; }
  [[nodiscard]] constexpr const T* begin() const { return items_.data(); }
  [[nodiscard]] constexpr const T* end() const { return items_.data() + size_; }

 private:
  std::array<T, Capacity> items_{};
  std::size_t size_ = 0;
};

}  // namespace bmu
