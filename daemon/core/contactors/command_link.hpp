// Monitor of the contactor commands: determines by their echoes whether they are transmitted.
//
// A frame that was handed to the kernel may wait in the send queue, because no node acknowledges it or the bus is
// saturated. It is still sent later, in order, and a power distribution unit that has opened by itself meanwhile
// follows it. So at most two commands wait, the second because an echo may be lost on this host, unless the commanded
// outputs have changed; and no other frame of this node is queued behind them. When the bus recovers, the command
// "open" is a few frames behind. This requires a send queue of at least six frames; the kernel's default is ten and
// more.
//
//   note_sent          a command was handed over        note_echo   it, or an older one, was transmitted
//   note_failed        it was not accepted              forget      the bus was down, and its queue discarded
//   note_echoes_lost   received frames were lost on this host, possibly echoes among them
#pragma once

#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Maximum time from a command to its echo before the pack opens. With the 50 ms between two commands this stays below
/// the 200 ms after which the power distribution unit opens by itself. As long as the longest permitted stall of the
/// control loop: an echo that waits to be read is not missing.
inline constexpr Duration command_wait_max = 130ms;
/// A command without an echo for longer is stuck, and so are two of them once the second is sent: nothing is queued
/// behind.
inline constexpr Duration command_wait_usual = 20ms;
inline constexpr std::uint8_t commands_waiting_max = 2;
/// After this time without any echo the next command is sent nevertheless.
inline constexpr Duration command_wait_given_up = 500ms;

class CommandLink {
 public:
  /// The periodic command, or one with changed outputs, should be sent now.
  [[nodiscard]] bool is_due(TimePoint now, bool has_changed) const;
  void note_sent(std::uint8_t counter, TimePoint now);
  void note_echo(std::uint8_t counter);
  void note_failed();
  void note_echoes_lost() { waiting_ = 0; }
  void forget() { *this = {}; }

  /// A command was echoed since the bus came up, and none waits for its echo for longer than `command_wait_max`.
  [[nodiscard]] bool is_on_bus(TimePoint now) const;
  [[nodiscard]] bool is_stuck(TimePoint now) const;

 private:
  bool has_sent_ = false;
  bool has_echoed_ = false;  // at least once since the bus came up
  bool has_failed_ = false;
  std::uint8_t waiting_ = 0;  // commands sent since the last echo
  std::uint8_t counter_ = 0;
  TimePoint due_at_{};
  TimePoint sent_at_{};
  TimePoint unconfirmed_since_{};  // zero: no command waits for its echo
  BMU_FIELDS(has_sent_, has_echoed_, has_failed_, waiting_, counter_, due_at_, sent_at_, unconfirmed_since_)
};

}  // namespace bmu
