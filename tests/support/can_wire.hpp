// A classic CAN bus as time: one frame after the other, the lowest identifier of those that wait first, each for as
// long as its bits take. No errors, no bus-off; what a fault does to a frame is done before it gets here.
//
//   put(station, frame)   the frame waits in its station's queue; only the head of a queue takes part in arbitration,
//                         as in a controller with one transmit buffer behind the kernel's queue
//   start_if_idle(now)    arbitration: the winner is on the wire until `done_at`
//   take_done(now)        the frame whose last bit has passed by then
//
// A frame takes the longest that bit stuffing can make of it: 135 bits with eight bytes (ISO 11898-1: 44 bits around
// the data, 3 between frames, a stuff bit after every four of the 34 + 8n bits that can be stuffed). So no answer of a
// real bus comes later than here.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu::test {

enum class Station : std::uint8_t { master = 0, module_first = 1, pdu = 64, sensor = 65, stranger = 66 };

/// With an 11-bit identifier, interframe space included.
[[nodiscard]] constexpr Duration time_on_wire(const CanFrame& frame, std::int64_t bits_per_s = 500'000) {
  const std::int64_t bytes = frame.is_remote ? 0 : frame.length;
  const std::int64_t extension = frame.is_extended ? 20 : 0;
  const std::int64_t stuffed = 34 + extension + 8 * bytes;
  const std::int64_t bits = 47 + extension + 8 * bytes + (stuffed - 1) / 4;
  return Duration{bits * 1'000'000'000 / bits_per_s};
}
static_assert(time_on_wire({.length = 8}) == 270us);

class CanWire {
 public:
  struct Carried {
    Station from{};
    CanFrame frame;
    TimePoint done_at{};
  };

  void put(Station station, const CanFrame& frame) { queues_[station].push_back(frame); }
  void start_if_idle(TimePoint now);
  [[nodiscard]] std::optional<Carried> take_done(TimePoint now);
  /// When the frame on the wire is through; TimePoint::max() if there is none.
  [[nodiscard]] TimePoint done_at() const { return carried_ ? carried_->done_at : TimePoint::max(); }
  [[nodiscard]] std::size_t waiting(Station station) const;
  /// What waits in a station's queue is lost: the interface went away.
  void drop_queue(Station station) { queues_.erase(station); }
  /// A station that gets no acknowledgement, or is not there, takes no part in arbitration.
  void set_silent(Station station, bool is_silent) { is_silent_[station] = is_silent; }

 private:
  std::map<Station, std::deque<CanFrame>> queues_;
  std::map<Station, bool> is_silent_;
  std::optional<Carried> carried_;
};

}  // namespace bmu::test
