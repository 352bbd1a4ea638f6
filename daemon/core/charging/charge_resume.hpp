// Resumption of a charge after a power cut: a charger that fell silent while it charged, and is received again, counts
// as newly plugged in. Within 24 h, ten times at most until it is unplugged, and only if nothing else happened in
// between (is_hands_off, cancel): a person may be working on the pack. A charge that continues without this, as the
// pack stayed closed for it, is not resumed when it is over.
//
// Cost: some comparisons a tick.
#pragma once

#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct ChargeResumeInputs {
  TimePoint now{};
  bool is_silent = false;     // a unit that was charging is not received
  bool has_fault = false;     // charger_silent is present
  bool is_charging = false;   // still requested, in this tick
  bool is_hands_off = false;  // inputs healthy, no other fault above a warning, no shutdown
  bool all_talk = false;      // every unit is received
  bool is_wanted = false;     // the charger's close request is present
};

class ChargeResume {
 public:
  /// Time for which all units must have been received again.
  static constexpr Duration steady = 5s;
  static constexpr Duration forgotten_after = 24h;
  static constexpr std::uint8_t times_max = 10;

  /// Once a tick. True: the charger now counts as newly plugged in.
  [[nodiscard]] bool step(const ChargeResumeInputs& in) {
    // While it still counts as charging: the fault, and the opening, end that.
    if (in.is_silent && in.is_charging) {
      is_pending_ = times_ < times_max;
      interrupted_at_ = in.now;
    }
    // While the fault is present, the charge is about to end with it.
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
  /// An operator attends to the pack: it closes only on a new request.
  void cancel() { is_pending_ = false; }
  /// Nothing is plugged in: the previous charge is over.
  void start_over() {
    is_pending_ = false;
    times_ = 0;
  }
  [[nodiscard]] bool is_pending() const { return is_pending_; }

 private:
  bool is_pending_ = false;
  TimePoint interrupted_at_{};
  TimePoint talks_since_{};  // zero: not all of them are received
  std::uint8_t times_ = 0;
  BMU_FIELDS(is_pending_, interrupted_at_, talks_since_, times_)
};

}  // namespace bmu
