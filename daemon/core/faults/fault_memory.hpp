// State of every fault: its status, since when, and the reading at which it was confirmed.
//
//   good --over threshold--> suspected --evidence and two samples--> active --cause gone for `clear`--> good
//                                |                                      |                            (or latched,
//                                +--evidence used up--> good            +--- while it lasts           until cleared)
//
// `evidence` is the debounce time: it grows while the value is beyond the threshold, shrinks half as fast while it is
// not, and is held while the value is unknown. The fault is confirmed when it reaches the confirm time. A lasting fault
// therefore takes exactly that time, a single bad sample is discarded after twice its duration, and a value that
// recurs, or is hidden by missing ones, is eventually confirmed if it is beyond the threshold for more than a third of
// the time. A recurring cause of a latched fault takes the same debounce time to count as another occurrence.
//
// A warning is raised by the first sample beyond its threshold or, in rows with `confirms_warning`, after debouncing
// for the fault's confirm time. It ends with the first good sample.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/faults/fault_evaluate.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/types/observation.hpp"
#include "protocol/fields.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

enum class FaultStage : std::uint8_t {
  good,
  suspected,  // pending: beyond the threshold, not yet for the confirm time
  active,     // confirmed, and the cause is present
  latched,    // the cause is gone, the fault stays until it is cleared
};

[[nodiscard]] std::string_view to_text(FaultStage stage);

struct FaultState {
  FaultStage stage = FaultStage::good;
  bool is_warning = false;  // the warning threshold was exceeded; ends with a good sample
  TimePoint warning_since{};
  Reading warning;                            // worst reading of the warning
  Duration warning_evidence{};                // debounce time of a warning that is debounced
  Verdict warning_judged = Verdict::unknown;  // result of the last update, against the warning threshold
  TimePoint suspected_since{};
  TimePoint returning_since{};        // while latched: recurrence pending since; zero: none pending
  Duration evidence{};                // debounce time while pending or recurring
  Verdict judged = Verdict::unknown;  // result of the last update, valid until the next
  TimePoint judged_at{};
  TimePoint confirmed_at{};  // of the present or last occurrence
  TimePoint first_at{};
  TimePoint last_at{};
  TimePoint good_since{};      // while active: since when the cause is gone; zero: it is not
  Reading confirmed;           // reading at confirmation
  Reading latest;              // reading of the last update
  std::int64_t threshold = 0;  // at confirmation
  bool is_restored = false;    // confirmed in a previous session: `confirmed` has no time, and is unknown if not saved
  std::uint32_t count = 0;     // confirmations since start
  std::uint32_t samples = 0;   // distinct samples beyond the threshold while pending
  TimePoint sample_taken_at{};
  Element sample_element;

  [[nodiscard]] constexpr bool is_present() const {
    return stage == FaultStage::active || stage == FaultStage::latched;
  }
  /// Pending or recurring: beyond the threshold, but not yet for long enough to be confirmed, or confirmed again.
  [[nodiscard]] constexpr bool is_doubtful() const {
    return stage == FaultStage::suspected || returning_since != TimePoint{};
  }
};

struct FaultChange {
  enum class Kind : std::uint8_t { warned, warning_over, confirmed, cause_gone, cleared };
  FaultId id{};
  Kind kind = Kind::confirmed;
};

using FaultChanges = FixedVector<FaultChange, fault_count * 2>;

class FaultMemory {
 public:
  /// Tests every row once; called once per tick. Returns the changes.
  FaultChanges update(const FaultInputs& inputs);
  /// Tests one row with a reading made by the caller.
  void judge(const FaultRow& row, const Reading& reading, const LimitsConfig& limits, TimePoint now,
             FaultChanges& changes);
  /// Clears every latched fault that has a cause known to be gone and that this authority may clear; the others stay.
  FaultChanges clear_latched(Authority authority);

  /// Restores a latch of a previous session: the fault is latched until its cause is known to be gone and an authority
  /// that may clear it does so. `confirmed` is the reading at its confirmation, unknown if that was not saved.
  void restore_lock(FaultId id, const Reading& confirmed, std::int64_t threshold, TimePoint at);

  [[nodiscard]] const FaultState& state(FaultId id) const { return states_[static_cast<std::size_t>(id)]; }
  [[nodiscard]] const std::array<FaultState, fault_count>& states() const { return states_; }

 private:
  std::array<FaultState, fault_count> states_{};
  BMU_FIELDS(states_)
};

}  // namespace bmu
