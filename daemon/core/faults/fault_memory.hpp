// What is wrong, since when, and what was seen when we came to believe it.
//
//   good --over threshold--> suspected --evidence and two samples--> active --cause gone for `clear`--> good
//                                |                                      |                            (or latched,
//                                +--evidence used up--> good            +--- while it lasts           until cleared)
//
// Evidence is time: it grows while the value is beyond the threshold, shrinks half as fast while it is not, and stands
// still while the value is not known. It confirms at the confirm time. So a lasting fault takes exactly that time, a
// lone bad sample is forgotten after twice its length, and a value that keeps coming back, or hides behind missing
// ones, is believed in the end: anything beyond the threshold for more than a third of the time. A cause that comes
// back to a latched fault takes the same evidence to count as another occurrence.
//
// A warning comes with the first sample beyond its threshold, or, for rows that confirm it (`confirms_warning`), with
// evidence for the fault's confirm time. It ends with the first good sample.
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
  suspected,  // over the threshold, not yet for long enough
  active,     // believed, and the cause is there
  latched,    // the cause is gone, the fault stays until it is cleared
};

[[nodiscard]] std::string_view to_text(FaultStage stage);

struct FaultState {
  FaultStage stage = FaultStage::good;
  bool is_warning = false;  // beyond the warning threshold
  TimePoint warning_since{};
  Reading warning;                            // worst while warning
  Duration warning_evidence{};                // for a warning that is confirmed
  Verdict warning_judged = Verdict::unknown;  // of the last update, against the warning threshold
  TimePoint suspected_since{};
  TimePoint returning_since{};        // while latched: since when the cause seems to be back, zero if it does not
  Duration evidence{};                // while suspected or returning
  Verdict judged = Verdict::unknown;  // of the last update, standing until the next
  TimePoint judged_at{};
  TimePoint confirmed_at{};  // of the present or last occurrence
  TimePoint first_at{};
  TimePoint last_at{};
  TimePoint good_since{};      // while active: since when the cause is gone; zero if it is there
  Reading confirmed;           // what was seen at confirmation
  Reading latest;              // what is seen now
  std::int64_t threshold = 0;  // at confirmation
  bool is_restored = false;  // confirmed in a former life: `confirmed` has no time, and is not known if it was not kept
  std::uint32_t count = 0;   // confirmations since start
  std::uint32_t samples = 0;  // distinct samples beyond the threshold while suspected
  TimePoint sample_taken_at{};
  Element sample_element;

  [[nodiscard]] constexpr bool is_present() const {
    return stage == FaultStage::active || stage == FaultStage::latched;
  }
  /// Beyond the threshold, not yet for long enough to be believed, or believed anew.
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
  /// One tick: every row judged once. Returns what changed.
  FaultChanges update(const FaultInputs& inputs);
  /// One row by itself, with a reading made elsewhere.
  void judge(const FaultRow& row, const Reading& reading, const LimitsConfig& limits, TimePoint now,
             FaultChanges& changes);
  /// Clears what is latched, whose cause is known to be gone, and which this authority may clear; the rest stays.
  FaultChanges clear_latched(Authority authority);

  /// A lock of a former life: latched, until its cause is seen to be gone and who may clears it. `confirmed` is what
  /// was seen then, not known if that was not kept.
  void restore_lock(FaultId id, const Reading& confirmed, std::int64_t threshold, TimePoint at);

  [[nodiscard]] const FaultState& state(FaultId id) const { return states_[static_cast<std::size_t>(id)]; }
  [[nodiscard]] const std::array<FaultState, fault_count>& states() const { return states_; }

 private:
  std::array<FaultState, fault_count> states_{};
  BMU_FIELDS(states_)
};

}  // namespace bmu
