// Counts of what was on a bus, as a whole and for each identifier: how many, how often, the longest gap, what failed
// and why, and how much of the bus it took.
//
// A gap is the time between two frames that passed their check, as those that fail refresh nothing at the daemon
// either. Frames of unknown identifiers are not checked: there every frame counts.
//
// Times are those of the log less what its clock was set by while it was recorded (clock_jumps.hpp), but for those that
// are shown as they stand there: the first and the last time of a bus, and the end of a gap. How long it was between
// the two frames around such a setting is not known: rates and loads leave out the frame behind it, too, as they leave
// out the first.
//
// Bits are those each classic frame takes on the wire (protocol/can_bits.hpp). Memory is bounded: of 29-bit
// identifiers, of which there are half a billion, the first 1,024 are told apart.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "protocol/candump.hpp"
#include "protocol/receive_check.hpp"
#include "tools/bmudump/clock_jumps.hpp"

namespace bmu::dump {

/// The frames that no known time has passed before.
struct Untimed {
  std::uint64_t frames = 0;     // the first of all, and the first behind a setting of the clock
  std::int64_t passed_us = 0;   // before those, since the frame before: less than it was
  std::uint64_t clock_set = 0;  // so often, before the latest frame

  /// The next frame, `since_us` behind the latest before: whether it is one.
  bool note(std::int64_t since_us, std::uint64_t clock_jumps) {
    if (frames > 0 && clock_jumps == clock_set) return false;
    if (frames++ > 0 && since_us > 0) passed_us += since_us;
    clock_set = clock_jumps;
    return true;
  }
};

struct IdStatistics {
  const MessageSpec* message = nullptr;  // of the latest frame that had one; null: all were unknown
  std::uint8_t node = 0;
  std::uint64_t frames = 0;
  std::uint64_t accepted = 0;
  std::int64_t bits = 0;
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;     // the latest; frames may be out of order
  std::int64_t refresh_us = 0;  // when the last gap ended
  std::int64_t gap_max_us = 0;
  std::int64_t gap_end_us = 0;  // of the longest, as in the log
  Untimed untimed;
  std::array<std::uint32_t, reject_reason_count> failed{};  // last: what most frames touch is two cache lines then

  [[nodiscard]] std::uint64_t failed_total() const;
  /// Frames that were not taken for a message.
  [[nodiscard]] std::uint64_t unknown() const { return frames - accepted - failed_total(); }
  /// Frames a second between the first and the last, without the untimed; 0 if there is no time between them.
  [[nodiscard]] double rate_per_s() const;
  /// Until then since its last gap ended, if that is twice its longest gap or more; else 0: it has not fallen silent.
  /// Less than five frames have no period.
  [[nodiscard]] std::int64_t silence_us(std::int64_t until_us) const;
};

class BusStatistics {
 public:
  static constexpr std::size_t extended_ids_max = 1'024;

  /// The row of the frame's identifier; null if it has none: remote, error and FD frames, and identifiers beyond
  /// extended_ids_max. `clock`: how the log's clock was set before this frame.
  IdStatistics* count(const LogLine& line, const CheckedFrame& verdict, const ClockJumps::Sum& clock = {});

  std::uint64_t frames = 0;
  std::uint64_t accepted = 0;
  std::uint64_t failed = 0;
  std::uint64_t unknown = 0;
  std::uint64_t remote = 0;
  std::uint64_t error = 0;
  std::uint64_t fd = 0;
  std::uint64_t lost = 0;         // not received, as live or by DROPCOUNT lines of a log; not part of `frames`
  std::uint64_t without_row = 0;  // unknown 29-bit ones beyond extended_ids_max
  std::int64_t bits = 0;          // of all classic frames
  std::int64_t bits_untimed = 0;  // of the untimed, which were over when their time began
  std::int64_t first_us = 0;      // the earliest, as in the log
  std::int64_t last_us = 0;       // the latest, as in the log
  std::int64_t from_us = 0;       // the same two without what the clock was set by
  std::int64_t until_us = 0;
  Untimed untimed;

  [[nodiscard]] double span_s() const { return static_cast<double>(until_us - from_us) * 1e-6; }
  /// How many frames, and what they took, without the untimed; 0 if no time passed.
  [[nodiscard]] double frames_per_s() const;
  [[nodiscard]] double load_bit_per_s() const;
  [[nodiscard]] const IdStatistics& standard(std::size_t id) const { return standard_[id]; }
  [[nodiscard]] bool has_standard() const { return !standard_.empty(); }
  /// The 29-bit identifiers, sorted.
  [[nodiscard]] std::vector<std::uint32_t> extended_ids() const;
  [[nodiscard]] const IdStatistics& extended(std::uint32_t id) const { return extended_.at(id); }

 private:
  IdStatistics* row_of(const CanFrame& frame);
  bool count_time(std::int64_t time_us, const ClockJumps::Sum& clock);
  [[nodiscard]] double timed_s() const { return span_s() - static_cast<double>(untimed.passed_us) * 1e-6; }

  std::vector<IdStatistics> standard_;  // by identifier, made with the first frame
  std::unordered_map<std::uint32_t, IdStatistics> extended_;
};

}  // namespace bmu::dump
