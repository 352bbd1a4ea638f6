// Receive check of a module: the counterpart of receive_check.hpp for a node that receives only the frames of its
// master. It handles three identifiers, POLL, COMMAND to all and COMMAND to its node, and is passed no others. Same
// rules, same reasons, same counts; it stores three counters instead of those of all identifiers.
//
// State: about 140 bytes, no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/receive_check.hpp"

namespace bmu {

class RequestCheck {
 public:
  /// Checks a received POLL or COMMAND, counts the result and, if accepted, stores its counter.
  CheckedFrame check(const CanFrame& frame);
  /// Resets counters, keeps counts: the next frame of each identifier is accepted.
  void forget_counters() { heard_ = {}; }

  [[nodiscard]] const ReceiveCounts& counts() const { return counts_; }

 private:
  /// Last accepted request. A COMMAND to a new node number has another identifier than before.
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
