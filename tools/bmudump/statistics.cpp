#include "tools/bmudump/statistics.hpp"

#include <algorithm>
#include <numeric>

#include "protocol/can_bits.hpp"

namespace bmu::dump {
namespace {

void count_gap(IdStatistics& row, std::int64_t time_us, std::int64_t left_out_us) {
  const std::int64_t gap_us = time_us - row.refresh_us;
  if (gap_us > row.gap_max_us) {
    row.gap_max_us = gap_us;
    row.gap_end_us = time_us + left_out_us;
  }
}

/// Of unknown identifiers every frame refreshes, of others those that passed. `time_us`: without what the clock was set
/// by.
void count_in_row(IdStatistics& row, std::int64_t time_us, const ClockJumps::Sum& clock, std::int64_t bits,
                  const CheckedFrame& verdict) {
  const bool is_known = verdict.message != nullptr;
  const bool has_refreshed = is_known ? row.accepted > 0 : row.frames > 0;
  if (!is_known || verdict.is_accepted) {
    if (has_refreshed) count_gap(row, time_us, clock.by_us);
    row.refresh_us = time_us;
  }
  if (row.frames == 0) row.first_us = row.last_us = time_us;
  row.untimed.note(time_us - row.last_us, clock.count);
  row.first_us = std::min(row.first_us, time_us);
  row.last_us = std::max(row.last_us, time_us);
  if (is_known) {
    row.message = verdict.message;
    row.node = verdict.node;
  }
  row.bits += bits;
  ++row.frames;
  if (verdict.is_accepted) {
    ++row.accepted;
  } else if (is_known) {
    ++row.failed[static_cast<std::size_t>(verdict.reason)];
  }
}

}  // namespace

std::uint64_t IdStatistics::failed_total() const {
  return std::accumulate(failed.begin(), failed.end(), std::uint64_t{0});
}

double IdStatistics::rate_per_s() const {
  const std::int64_t timed_us = last_us - first_us - untimed.passed_us;
  return timed_us > 0 ? static_cast<double>(frames - untimed.frames) * 1e6 / static_cast<double>(timed_us) : 0.0;
}

double BusStatistics::frames_per_s() const {
  return timed_s() > 0 ? static_cast<double>(frames - untimed.frames) / timed_s() : 0.0;
}

double BusStatistics::load_bit_per_s() const {
  return timed_s() > 0 ? static_cast<double>(bits - bits_untimed) / timed_s() : 0.0;
}

std::int64_t IdStatistics::silence_us(std::int64_t until_us) const {
  constexpr std::int64_t longest_gaps_min = 2;
  constexpr std::uint64_t frames_min = 5;
  const std::int64_t silence_us = until_us - refresh_us;
  const bool has_period = frames >= frames_min && gap_max_us > 0;
  return has_period && silence_us / longest_gaps_min >= gap_max_us ? silence_us : 0;
}

IdStatistics* BusStatistics::count(const LogLine& line, const CheckedFrame& verdict, const ClockJumps::Sum& clock) {
  const CanFrame& frame = line.frame;
  const bool is_untimed = count_time(line.time_us, clock);
  if (line.kind == LogLineKind::fd_frame) return ++fd, nullptr;
  if (frame.is_error) return ++error, nullptr;
  const std::int64_t frame_bits = bits_on_wire(frame);
  bits += frame_bits;
  if (is_untimed) bits_untimed += frame_bits;
  if (frame.is_remote) return ++remote, nullptr;
  const bool is_known = verdict.message != nullptr;
  ++(!is_known ? unknown : verdict.is_accepted ? accepted : failed);
  IdStatistics* const row = row_of(frame);
  if (row == nullptr) return ++without_row, nullptr;
  count_in_row(*row, line.time_us - clock.by_us, clock, frame_bits, verdict);
  return row;
}

/// Whether the frame is untimed.
bool BusStatistics::count_time(std::int64_t time_us, const ClockJumps::Sum& clock) {
  const std::int64_t steady_us = time_us - clock.by_us;
  if (frames++ == 0) {
    first_us = last_us = time_us;
    from_us = until_us = steady_us;
  }
  const bool is_untimed = untimed.note(steady_us - until_us, clock.count);
  first_us = std::min(first_us, time_us);
  last_us = std::max(last_us, time_us);
  from_us = std::min(from_us, steady_us);
  until_us = std::max(until_us, steady_us);
  return is_untimed;
}

IdStatistics* BusStatistics::row_of(const CanFrame& frame) {
  if (!frame.is_extended) {
    if (standard_.empty()) standard_.resize(Catalogue::id_count);
    return &standard_[frame.id];
  }
  const auto known = extended_.find(frame.id);
  if (known != extended_.end()) return &known->second;
  return extended_.size() < extended_ids_max ? &extended_[frame.id] : nullptr;
}

std::vector<std::uint32_t> BusStatistics::extended_ids() const {
  std::vector<std::uint32_t> ids;
  ids.reserve(extended_.size());
  for (const auto& [id, row] : extended_) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace bmu::dump
