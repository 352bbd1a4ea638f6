// Whether our contactor commands get onto the bus, told by their echoes.
//
// A frame that was handed over may wait in the send queue: nobody acknowledges, the bus is full. What waits there still
// goes out later, in its order, and a power distribution unit that has opened by itself meanwhile obeys it. So at most
// two commands wait, the second because an echo may be lost on this machine, unless what they ask for has changed; and
// nothing else of ours is queued behind them. When the bus comes back, the word "open" is a few frames behind. This
// needs a send queue of at least six frames; the kernel's default is ten and more.
//
//   note_sent          a command was handed over        note_echo   it, or an older one, was on the bus
//   note_failed        it was not taken                 forget      the bus was away, and its queue with it
//   note_echoes_lost   received frames were lost on this machine, echoes perhaps among them
#pragma once

#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// How long a command may be on its way before the pack opens. With the 50 ms between two commands this stays below the
/// 200 ms after which the power distribution unit opens by itself. As long as our own loop may be away: an echo that
/// waits to be read is none that is missing.
inline constexpr Duration command_wait_max = 130ms;
/// A command on its way for longer is stuck, and so are two of them from the second one on: nothing is queued behind.
inline constexpr Duration command_wait_usual = 20ms;
inline constexpr std::uint8_t commands_waiting_max = 2;
/// After this long without any echo the next command is sent all the same.
inline constexpr Duration command_wait_given_up = 500ms;

class CommandLink {
 public:
  /// The periodic command, or one that changes what is asked for, should be sent now.
  [[nodiscard]] bool is_due(TimePoint now, bool has_changed) const;
  void note_sent(std::uint8_t counter, TimePoint now);
  void note_echo(std::uint8_t counter);
  void note_failed();
  void note_echoes_lost() { waiting_ = 0; }
  void forget() { *this = {}; }

  /// The last command came back, or is on its way for no longer than usual for a busy bus.
  [[nodiscard]] bool is_on_bus(TimePoint now) const;
  [[nodiscard]] bool is_stuck(TimePoint now) const;

 private:
  bool has_sent_ = false;
  bool has_echoed_ = false;  // ever since the bus came up
  bool has_failed_ = false;
  std::uint8_t waiting_ = 0;  // commands sent since the last echo
  std::uint8_t counter_ = 0;
  TimePoint due_at_{};
  TimePoint sent_at_{};
  TimePoint unconfirmed_since_{};  // zero: nothing is on its way
  BMU_FIELDS(has_sent_, has_echoed_, has_failed_, waiting_, counter_, due_at_, sent_at_, unconfirmed_since_)
};

}  // namespace bmu
