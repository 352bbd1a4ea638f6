// Charging on after a power cut: a charger that fell silent while it charged, and is heard again, is taken for one that
// was plugged in anew. Within 24 h, ten times at the most until it is unplugged, and only if nobody and nothing else
// has had a say in between: somebody may have his hands in the pack. A charge that goes on without this, as the pack
// stayed closed for it, is not resumed when it is over.
//
// Cost: some comparisons a tick.
#pragma once

#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct ChargeResumeInputs {
  TimePoint now{};
  bool is_silent = false;     // a unit that was charging is not heard
  bool has_fault = false;     // for that
  bool is_charging = false;   // still asked to, in this tick
  bool is_hands_off = false;  // nothing else is wrong, and nobody wants anything else
  bool all_talk = false;      // every unit
  bool is_wanted = false;     // a charger's wish for a closed pack is there
};

class ChargeResume {
 public:
  /// So long all units have been heard again.
  static constexpr Duration steady = 5s;
  static constexpr Duration forgotten_after = 24h;
  static constexpr std::uint8_t times_max = 10;

  /// Once a tick. True: now it is as if it had been plugged in anew.
  [[nodiscard]] bool step(const ChargeResumeInputs& in) {
    // While it still counts as charging: with the fault, and the opening, that is over.
    if (in.is_silent && in.is_charging) {
      is_pending_ = times_ < times_max;
      interrupted_at_ = in.now;
    }
    // As long as the fault stands, the charge is about to end with it.
    const bool goes_on_by_itself = in.is_charging && !in.is_silent && !in.has_fault;
    if (goes_on_by_itself) is_pending_ = false;
    if (!in.is_hands_off || in.now - interrupted_at_ > forgotten_after) is_pending_ = false;
    if (!in.all_talk) talks_since_ = {};
    if (in.all_talk && talks_since_ == TimePoint{}) talks_since_ = in.now;
    const bool is_back = in.all_talk && in.now - talks_since_ >= steady && !in.is_silent && !in.has_fault;
    if (!is_pending_ || !is_back || in.is_wanted) return false;
    is_pending_ = false;
    ++times_;
    return true;
  }
  /// Somebody looks after the pack: it closes for who asks anew.
  void cancel() { is_pending_ = false; }
  /// Nothing is plugged in: what was before is over.
  void start_over() {
    is_pending_ = false;
    times_ = 0;
  }
  [[nodiscard]] bool is_pending() const { return is_pending_; }

 private:
  bool is_pending_ = false;
  TimePoint interrupted_at_{};
  TimePoint talks_since_{};  // zero: not all of them
  std::uint8_t times_ = 0;
  BMU_FIELDS(is_pending_, interrupted_at_, talks_since_, times_)
};

}  // namespace bmu
