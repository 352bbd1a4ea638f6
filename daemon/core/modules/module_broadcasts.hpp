// COMMANDs to all modules, which no module confirms: a command that is sent once may have been received by none.
//
// A module ignores a COMMAND with the counter of the last one that it accepted, and after a restart of the daemon the
// master does not know that counter; and any frame may be lost. So each command is sent twice, with different counters:
// at least one of them is accepted as new.
//
//   stop balancing, clear faults   twice, `broadcast_spacing` apart
//   sleep                          by the answers: the command, then a POLL, and both again while any module answers
//                                  it, `sleep_rounds` times. A sleeping module is woken by the POLL and does not
//                                  answer; the command is then sent again, since not every module returns to sleep
//                                  without one.
//
// Cost: a compare a tick.
#pragma once

#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Longer than a burst of disturbances, and short for an operator.
inline constexpr Duration broadcast_spacing = 30ms;
/// A module is ready to receive 50 ms after it was woken, and its answer has then had its time.
inline constexpr Duration sleep_spacing = 100ms;
inline constexpr std::uint8_t sleep_rounds = 10;

class ModuleBroadcasts {
 public:
  struct Step {
    bool says_stop = false;
    bool says_clear = false;
    bool says_sleep = false;
    bool asks = false;         // a POLL for STATUS to all, to find modules that are awake
    bool stays_awake = false;  // a module still answers after all rounds; reported once
  };
  /// Sent from the next step on.
  void stop() { stop_.left = twice; }
  void clear() { clear_.left = twice; }
  void sleep();
  /// Awake again, for any reason: ends the sleep command.
  void end_sleep() { rounds_left_ = 0; }
  /// A STATUS was received. The IDENT that a module sends when it is woken is not an answer.
  void note_answer() { is_answered_ = true; }
  /// Precondition: a COMMAND can be sent now.
  [[nodiscard]] Step step(TimePoint now);

 private:
  static constexpr std::uint8_t twice = 2;
  struct Repeated {
    std::uint8_t left = 0;
    TimePoint said_at{};
    [[nodiscard]] bool is_due(TimePoint now);
  };

  void step_sleep(TimePoint now, Step& step);

  Repeated stop_;
  Repeated clear_;
  std::uint8_t rounds_left_ = 0;
  bool is_asked_ = false;     // by the POLL after the last command
  bool is_answered_ = false;  // since that POLL
  TimePoint slept_at_{};      // the last command or POLL; zero: none yet
  BMU_FIELDS(stop_, clear_, rounds_left_, is_asked_, is_answered_, slept_at_)
};

}  // namespace bmu
