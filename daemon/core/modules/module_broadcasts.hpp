// COMMANDs to all modules, which nobody answers: what is said once may have been heard by nobody.
//
// A module takes no COMMAND whose counter it took last, and after a restart of the daemon no master knows which that
// was; and any frame may be lost. So each is said twice, with different counters: one of them at least is news.
//
//   stop balancing, clear faults   twice, `broadcast_spacing` apart
//   sleep                          by what comes back: said, a POLL behind it, and again while anybody answers that,
//                                  `sleep_rounds` times. Who sleeps is woken by the POLL and says nothing; it is told
//                                  once more, since not every module sleeps again without having been told.
//
// Cost: a compare a tick.
#pragma once

#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Longer than a burst of disturbances; shorter than anybody would want to wait.
inline constexpr Duration broadcast_spacing = 30ms;
/// A module is awake enough to hear 50 ms after it was woken, and its answer has then had its time.
inline constexpr Duration sleep_spacing = 100ms;
inline constexpr std::uint8_t sleep_rounds = 10;

class ModuleBroadcasts {
 public:
  struct Step {
    bool says_stop = false;
    bool says_clear = false;
    bool says_sleep = false;
    bool asks = false;         // who is awake: a POLL for STATUS
    bool stays_awake = false;  // somebody, after all rounds; told once
  };
  /// To be said from the next step on.
  void stop() { stop_.left = twice; }
  void clear() { clear_.left = twice; }
  void sleep();
  /// Awake again, for whatever reason: nobody is to sleep any more.
  void end_sleep() { rounds_left_ = 0; }
  /// A STATUS has come. What a module says when it is woken, its IDENT, is no answer.
  void note_answer() { is_answered_ = true; }
  /// A COMMAND can be sent now.
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
  bool is_asked_ = false;     // by the POLL behind the last word
  bool is_answered_ = false;  // since that POLL
  TimePoint slept_at_{};      // the last word or POLL; zero: none yet
  BMU_FIELDS(stop_, clear_, rounds_left_, is_asked_, is_answered_, slept_at_)
};

}  // namespace bmu
