// Cells that a module bleeds by the commands of one core: for a core with commands that the recorded module never
// received. The module follows them immediately, and to the second (docs/bus-protocol.md, "Minutes of balancing").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/fnv.hpp"
#include "protocol/frame.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

class ToldBleeding {
 public:
  /// A COMMAND to this module, or to all; operations other than to balance and to stop that are ignored.
  void note(const CanFrame& command, TimePoint at);

  /// Both received the same commands, in the same order.
  [[nodiscard]] bool is_as(const ToldBleeding& other) const { return orders_ == other.orders_; }
  /// Cells with any command, cell 1 in the lowest bit; the state of the others is unknown here.
  [[nodiscard]] std::uint16_t told() const { return told_; }
  [[nodiscard]] std::uint16_t on(TimePoint now) const;

 private:
  void note_minutes(std::size_t cell, std::int64_t minutes, TimePoint at);

  std::uint64_t orders_ = fnv_start;
  std::uint16_t told_ = 0;
  std::array<std::int64_t, internal_bus::cells_per_module_max> minutes_{};
  std::array<TimePoint, internal_bus::cells_per_module_max> until_{};
};

}  // namespace bmu
