// The door of a module unit: what receive_check.hpp is for those who hear the whole bus, for one who listens to its
// master alone. Three identifiers concern it: POLL, COMMAND to all, COMMAND to its node; it is shown those and no
// other. Same rules, same reasons, same counts; it remembers three counters instead of those of all identifiers.
//
// State: about 140 bytes, no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/receive_check.hpp"

namespace bmu {

class RequestCheck {
 public:
  /// Judges a received POLL or COMMAND, counts the verdict and, if accepted, remembers its counter.
  CheckedFrame check(const CanFrame& frame);
  /// Forgets counters, keeps counts: the next frame of each identifier is taken again.
  void forget_counters() { heard_ = {}; }

  [[nodiscard]] const ReceiveCounts& counts() const { return counts_; }

 private:
  /// The last one accepted. A COMMAND to a new node number is another identifier than before.
  struct Heard {
    bool exists = false;
    std::uint32_t id = 0;
    std::uint8_t counter = 0;
    std::uint8_t crc = 0;
  };
  enum Slot : std::uint8_t { poll, command_to_all, command_to_us };

  [[nodiscard]] static Slot slot_of(const MessageMatch& match);

  ReceiveCounts counts_;
  std::array<Heard, 3> heard_{};
};

}  // namespace bmu
