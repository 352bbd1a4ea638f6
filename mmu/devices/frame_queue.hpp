// Queue of frames to be sent, each with its send time, in the order of their insertion. Frames beyond the capacity are
// lost.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

template <std::size_t Capacity>
class FrameQueue {
 public:
  void push(const CanFrame& frame, TimePoint leaves_at) {
    if (is_full()) return;
    queue_[(first_ + count_) % Capacity] = {leaves_at, frame};
    ++count_;
  }
  /// The next frame, if it is due.
  [[nodiscard]] std::optional<CanFrame> pop(TimePoint now) {
    if (count_ == 0 || queue_[first_].leaves_at > now) return std::nullopt;
    const CanFrame frame = queue_[first_].frame;
    first_ = (first_ + 1) % Capacity;
    --count_;
    return frame;
  }
  void clear() { count_ = 0; }
  [[nodiscard]] bool is_empty() const { return count_ == 0; }
  [[nodiscard]] bool is_full() const { return count_ == Capacity; }

 private:
  struct OnItsWay {
    TimePoint leaves_at{};
    CanFrame frame;
  };
  std::array<OnItsWay, Capacity> queue_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace bmu
