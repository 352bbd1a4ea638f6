// Counts of the frames of a bus, as a whole and for each identifier: number, rate, longest gap, failures and their
// reasons, and share of the bus load.
//
// A gap is the time between two frames that passed their check, because frames that fail refresh no value in the daemon
// either. Frames of unknown identifiers are not checked: all of them count.
//
// Times are those of the log minus the changes of its clock while it was recorded (clock_jumps.hpp), except for those
// that are shown unchanged: the first and the last time of a bus, and the end of a gap.
//
// Bits are those that each classic frame takes on the wire (protocol/can_bits.hpp). Memory is bounded: of 29-bit
// identifiers, of which there are half a billion, the first 1,024 are counted separately.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "protocol/candump.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::dump {

struct IdStatistics {
  const MessageSpec* message = nullptr;  // of the latest frame with a message; null: all were unknown
  std::uint8_t node = 0;
  std::uint64_t frames = 0;
  std::uint64_t accepted = 0;
  std::int64_t bits = 0;
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;     // the latest; frames may be out of order
  std::int64_t refresh_us = 0;  // end of the last gap
  std::int64_t gap_max_us = 0;
  std::int64_t gap_end_us = 0;                              // end of the longest, as in the log
  std::array<std::uint32_t, reject_reason_count> failed{};  // last: the most used members fill two cache lines

  [[nodiscard]] std::uint64_t failed_total() const;
  /// Frames that did not count as a message.
  [[nodiscard]] std::uint64_t unknown() const { return frames - accepted - failed_total(); }
  /// Frames per second between the first and the last; 0 if no time elapsed between them.
  [[nodiscard]] double rate_per_s() const;
  /// Time from the end of its last gap until `until_us`, if that is at least twice its longest gap; else 0: it is not
  /// silent. Fewer than five frames define no period.
  [[nodiscard]] std::int64_t silence_us(std::int64_t until_us) const;
};

class BusStatistics {
 public:
  static constexpr std::size_t extended_ids_max = 1'024;

  /// The row of the frame's identifier; null if it has none: remote, error and FD frames, and identifiers above
  /// extended_ids_max. `left_out_us`: change of the log's clock before this frame, above 0 forward.
  IdStatistics* count(const LogLine& line, const CheckedFrame& verdict, std::int64_t left_out_us = 0);

  std::uint64_t frames = 0;
  std::uint64_t accepted = 0;
  std::uint64_t failed = 0;
  std::uint64_t unknown = 0;
  std::uint64_t remote = 0;
  std::uint64_t error = 0;
  std::uint64_t fd = 0;
  std::uint64_t lost = 0;          // not received, live or by DROPCOUNT lines of a log; not part of `frames`
  std::uint64_t without_row = 0;   // unknown 29-bit ones above extended_ids_max
  std::int64_t bits = 0;           // of all classic frames
  std::int64_t bits_of_first = 0;  // which ended when the time span started
  std::int64_t first_us = 0;       // the earliest, as in the log
  std::int64_t last_us = 0;        // the latest, as in the log
  std::int64_t from_us = 0;        // the same two without the changes of the clock
  std::int64_t until_us = 0;

  [[nodiscard]] double span_s() const { return static_cast<double>(until_us - from_us) * 1e-6; }
  /// Bit rate of the frames without the first; 0 if no time elapsed.
  [[nodiscard]] double load_bit_per_s() const;
  [[nodiscard]] const IdStatistics& standard(std::size_t id) const { return standard_[id]; }
  [[nodiscard]] bool has_standard() const { return !standard_.empty(); }
  /// The 29-bit identifiers, sorted.
  [[nodiscard]] std::vector<std::uint32_t> extended_ids() const;
  [[nodiscard]] const IdStatistics& extended(std::uint32_t id) const { return extended_.at(id); }

 private:
  IdStatistics* row_of(const CanFrame& frame);
  void count_time(std::int64_t time_us, std::int64_t left_out_us);

  std::vector<IdStatistics> standard_;  // by identifier, allocated with the first frame
  std::unordered_map<std::uint32_t, IdStatistics> extended_;
};

}  // namespace bmu::dump
