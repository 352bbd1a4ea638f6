// A vector with its room inside: what grows in the pure parts grows in here, and never on the heap.
#pragma once

#include <array>
#include <cstddef>

#include "protocol/assert.hpp"

namespace bmu {

template <class T, std::size_t Capacity>
class FixedVector {
 public:
  using value_type = T;

  /// Appends. Room is a promise of the caller, who knows his worst case; breaking it is a bug.
  constexpr void push_back(const T& value) {
    BMU_ASSERT(size_ < Capacity);
    items_[size_++] = value;
  }
  /// Appends if there is room; false if not.
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
