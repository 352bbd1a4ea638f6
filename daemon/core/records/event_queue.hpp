// Queue of events until a decision returns them, in order. Full: the newest is dropped and counted.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/records/event.hpp"
#include "protocol/fields.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

/// Limits the copying in a tick; a burst of events is spread over ticks, none is reordered.
inline constexpr std::size_t events_per_tick = 24;
using TickEvents = FixedVector<Event, events_per_tick>;

class EventQueue {
 public:
  void push(const Event& event) {
    if (count_ == slots_.size()) {
      ++dropped_;
      return;
    }
    slots_[(first_ + count_) % slots_.size()] = event;
    ++count_;
  }
  /// Moves as many as fit.
  void move_to(TickEvents& out) {
    while (count_ > 0 && out.try_push_back(slots_[first_])) {
      first_ = (first_ + 1) % slots_.size();
      --count_;
    }
  }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  // Room for every module to be identified and every fault to be confirmed within one tick.
  std::array<Event, 256> slots_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint64_t dropped_ = 0;
  [[nodiscard]] bool are_fields_possible() const { return first_ < slots_.size() && count_ <= slots_.size(); }
  BMU_FIELDS(slots_, first_, count_, dropped_)
};

}  // namespace bmu
