#include "daemon/core/estimation/health/current_ramp_monitor.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

namespace bmu {

namespace {

constexpr Duration calm_min = 2s;
constexpr Duration calm_at_zero_min = 1s;
/// Maximum standby consumption in a calm at zero: in a wider one that starts at the end of a precharge, its current
/// drifts.
constexpr std::int64_t zero_max_mA = 1'000;
constexpr Duration ring_step = 2s;
/// Share of the latest sample set in the mean of a calm: one part in this many.
constexpr int mean_parts = 4;
/// Minimum change of the current: this, and this many halves of the calm.
constexpr std::int64_t change_min_mA = 5'000;
constexpr std::int64_t change_min_half_calms = 5;
/// Minimum ratio of the change to the current that flowed to the other side before.
constexpr std::int64_t other_side_share = 5;
/// A smaller expected movement of a cell is noise.
constexpr std::int64_t answer_min_uV = 1'000;
constexpr std::int64_t noise_uV = 1'000;
/// A drift is extrapolated for this multiple of the time of its observation, and for `compare_max` at most.
constexpr int drift_factor_max = 4;
constexpr Duration compare_max = 60s;
/// Bound of a cell's polarisation, as a multiple of its immediate resistance by the current. Of the shipped cells
/// a123-26650 has the most, 3.2.
constexpr std::int64_t polarisation_max = 4;
constexpr Duration lately_fades_in = 400s;
/// Faster than the build-up of the polarisation that outlasts a calm: of the shipped cells the fastest, a123-26650, has
/// a tenth of R by the current for each second, and this makes it four tenths. A precharge leaves next to nothing
/// behind.
constexpr Duration lately_rises_in = 10s;
constexpr Duration side_rises_in = 2s;

/// Mean of the last seconds of a current that is at `towards_uA` now; it rises, and does not fall.
std::int64_t risen_mean_uA(std::int64_t from_uA, std::int64_t towards_uA, Duration since) {
  if (towards_uA <= from_uA) return from_uA;
  return from_uA +
         (towards_uA - from_uA) / 1'000 * (std::min<Duration>(since, side_rises_in) / 1ms) / (side_rises_in / 1s);
}

bool is_within(const CurrentRange& range, std::int32_t centre_mA, std::int64_t calm_mA) {
  return std::int64_t{range.max_mA} - centre_mA <= calm_mA && std::int64_t{centre_mA} - range.min_mA <= calm_mA;
}

std::int32_t middle_mA(const CurrentRange& range) {
  return static_cast<std::int32_t>((std::int64_t{range.min_mA} + range.max_mA) / 2);
}

/// Minimum change from `from_mA` that the whole range shows.
std::int64_t least_change_mA(const CurrentRange& range, std::int32_t from_mA) {
  return std::int64_t{std::max(range.min_mA, std::min(from_mA, range.max_mA))} - from_mA;
}

/// Time after a calm of this length for which voltages are compared with those of the calm.
Duration comparable_for(Duration watched) {
  return drift_factor_max * std::min<Duration>(watched, compare_max / drift_factor_max);
}

/// Drift of all cells together in the time from `last` to `now` if it continues as from `first` to `last`. Unknown if
/// that was too short, as where there was no calm.
template <class Calm>
std::optional<std::int64_t> drift_uV(const Calm& first, const Calm& last, TimePoint now) {
  const Duration watched = last.taken_at - first.taken_at;
  const Duration since = now - last.taken_at;
  if (watched < 1ms || since > comparable_for(watched)) return std::nullopt;
  return std::llabs(last.sum_uV - first.sum_uV) * (since / 1ms) / (watched / 1ms);
}

Reading verdict(bool is_implausible, TimePoint at) {
  return {.is_known = true, .value = is_implausible ? 1 : 0, .taken_at = at};
}

}  // namespace

bool is_move_of_pack(std::int64_t cells_moved_uV, const Measured<std::int32_t>& before_mV,
                     const Measured<std::int32_t>& now_mV) {
  if (!now_mV.is_valid() || !before_mV.is_valid()) return true;
  const std::int64_t pack_moved_mV = std::int64_t{now_mV.value} - before_mV.value;
  return (pack_moved_mV > 0) == (cells_moved_uV > 0) && std::llabs(pack_moved_mV) * 2'000 >= std::llabs(cells_moved_uV);
}

void CurrentRampMonitor::follow_current(const Measured<std::int32_t>& current_mA) {
  if (!current_mA.is_valid() || current_mA.taken_at <= lately_at_) return;
  const std::int64_t beyond_uA = std::llabs(current_mA.value) * 1'000 - lately_uA_;
  const bool rises = beyond_uA > 0;
  const Duration moves_in = rises ? lately_rises_in : lately_fades_in;
  const Duration since = std::min<Duration>(current_mA.taken_at - lately_at_, moves_in);
  const std::int64_t from_uA = rises ? beyond_uA : -lately_uA_;
  lately_uA_ += from_uA / 1'000 * (since / 1ms) / (moves_in / 1s);
  lately_at_ = current_mA.taken_at;
}

void CurrentRampMonitor::forget() {
  ring_ = {};
  head_ = 0;
  latest_ = {};
  waiting_ = {};
  reference_ = {};
  at_zero_ = {};
  implausible_current_ = {};
  is_against_current_ = false;
}

void CurrentRampMonitor::take(const PackPicture& now, const Cells& cells) {
  implausible_current_ = {};
  if (!now.since_last.is_known) forget();
  follow_calm(now, cells);
  check_direction(reference_, now, cells);
  check_direction(at_zero_, now, cells);
  if (!implausible_current_.is_known) check_frozen(now, cells);
}

/// The ring is filled from its start, and only entries in use have a time.
const CurrentRampMonitor::Calm& CurrentRampMonitor::oldest() const {
  const Calm& behind_head = ring_[(head_ + 1) % ring_.size()];
  return behind_head.taken_at != TimePoint{} ? behind_head : ring_.front();
}

/// A sample set is part of a calm once the next one is calm, too: the cells may have been sampled after a step that the
/// sensor shows only in its next sample.
void CurrentRampMonitor::follow_calm(const PackPicture& now, const Cells& cells) {
  const Calm first = ring_.front().taken_at != TimePoint{} ? oldest() : waiting_;
  const CurrentRange& range = now.since_last.is_known ? now.since_last : now.current;
  const bool is_calm = first.taken_at != TimePoint{} && is_within(range, first.current_mA, cells.calm_mA);
  if (is_calm) {
    keep_calm();
  } else {
    end_calm(first, cells);
  }
  const Duration since = waiting_.taken_at != TimePoint{} ? now.taken_at - waiting_.taken_at : Duration{};
  waiting_ = {.taken_at = now.taken_at,
              .current_mA = middle_mA(now.current),
              .lately_mA = lately_uA_ / 1'000,
              .sum_uV = now.sum_uV,
              .lowest_uV = now.lowest_uV,
              .highest_uV = now.highest_uV,
              .pack_mV = now.pack_mV};
  follow_sides(reference_, range, since);
  follow_sides(at_zero_, range, since);
}

/// A change is compared with a calm that was long enough. Of two at zero the older one may be comparable for longer:
/// that of an open pack, if the closed one was calm only briefly.
void CurrentRampMonitor::end_calm(const Calm& first, const Cells& cells) {
  const Duration lasted = waiting_.taken_at - first.taken_at;
  const auto comparable_until = [](const Calm& from, const Calm& to) {
    return to.taken_at + comparable_for(to.taken_at - from.taken_at);
  };
  const std::int64_t zero_mA = std::min(zero_max_mA, cells.calm_mA);
  const bool is_at_zero = std::max(std::abs(first.current_mA), std::abs(latest_.current_mA)) <= zero_mA;
  const bool does_longer = comparable_until(first, latest_) >= comparable_until(at_zero_.first, at_zero_.last);
  if (lasted >= calm_min) reference_ = {.first = first, .last = latest_};
  if (lasted >= calm_at_zero_min && is_at_zero && does_longer) at_zero_ = {.first = first, .last = latest_};
  ring_ = {};
  head_ = 0;
  latest_ = {};
}

void CurrentRampMonitor::follow_sides(Reference& reference, const CurrentRange& range, Duration since) {
  if (reference.last.taken_at == TimePoint{}) return;
  const std::int64_t from_mA = reference.last.current_mA;
  reference.risen_uA = risen_mean_uA(reference.risen_uA, (range.max_mA - from_mA) * 1'000, since);
  reference.fallen_uA = risen_mean_uA(reference.fallen_uA, (from_mA - range.min_mA) * 1'000, since);
}

/// Adds the waiting sample set to the calm.
void CurrentRampMonitor::keep_calm() {
  const auto towards = [](std::int64_t from, std::int64_t to) { return from + (to - from) / mean_parts; };
  const bool is_first = ring_.front().taken_at == TimePoint{};
  const Calm before = latest_;
  latest_ = waiting_;
  if (!is_first) {
    latest_.taken_at = before.taken_at + (waiting_.taken_at - before.taken_at) / mean_parts;
    latest_.current_mA = static_cast<std::int32_t>(towards(before.current_mA, waiting_.current_mA));
    latest_.sum_uV = towards(before.sum_uV, waiting_.sum_uV);
    if (latest_.taken_at - ring_[head_].taken_at < ring_step) return;
    head_ = (head_ + 1) % ring_.size();
  }
  ring_[head_] = latest_;
}

std::int64_t CurrentRampMonitor::bound_uV(std::int64_t drift_uV, const Calm& last, const Cells& cells) {
  const std::int64_t left_behind_uV = polarisation_max * last.lately_mA * cells.resistance_uOhm / 1'000;
  return drift_uV + (noise_uV + left_behind_uV) * cells.count;
}

bool CurrentRampMonitor::has_moved(const PackPicture& now, const Calm& last, std::int64_t least_uV,
                                   const Cells& cells) {
  const std::int64_t seen_uV = now.sum_uV - last.sum_uV;
  const std::int64_t sign = seen_uV > 0 ? 1 : -1;
  const std::int64_t lowest_uV = sign * (std::int64_t{now.lowest_uV} - last.lowest_uV);
  const std::int64_t highest_uV = sign * (std::int64_t{now.highest_uV} - last.highest_uV);
  return sign * seen_uV >= least_uV && 2 * std::min(lowest_uV, highest_uV) * cells.count >= least_uV;
}

void CurrentRampMonitor::check_direction(const Reference& reference, const PackPicture& now, const Cells& cells) {
  const Calm& last = reference.last;
  const std::int64_t change_mA = least_change_mA(now.current, last.current_mA);
  const std::int64_t to_other_side_uA = change_mA > 0 ? reference.fallen_uA : reference.risen_uA;
  if (to_other_side_uA / 1'000 * other_side_share > std::llabs(change_mA)) return;
  const std::int64_t expected_uV = -change_mA * cells.resistance_uOhm / 1'000 * cells.count;
  const bool is_large =
      std::llabs(change_mA) >= change_min_mA && 2 * std::llabs(change_mA) >= change_min_half_calms * cells.calm_mA;
  if (!is_large || std::llabs(expected_uV) < answer_min_uV * cells.count) return;
  const std::optional<std::int64_t> drift = drift_uV(reference.first, last, now.taken_at);
  if (!drift) return;
  const std::int64_t moved_uAs = std::llabs(last.current_mA) * ((now.taken_at - last.taken_at) / 1ms);
  const std::int64_t permille_of_capacity_uAs = std::int64_t{cells.capacity_As} * 1'000;
  if (moved_uAs > permille_of_capacity_uAs) return;
  const std::int64_t seen_uV = now.sum_uV - last.sum_uV;
  const std::int64_t least_uV = std::llabs(expected_uV) / 2 + bound_uV(*drift, last, cells);
  const bool is_seen = has_moved(now, last, least_uV, cells) && is_move_of_pack(seen_uV, last.pack_mV, now.pack_mV);
  const bool is_bad_already = implausible_current_.value != 0;
  if (!is_seen || is_bad_already) return;
  is_against_current_ = (seen_uV > 0) != (expected_uV > 0);
  implausible_current_ = verdict(is_against_current_, now.taken_at);
}

void CurrentRampMonitor::check_frozen(const PackPicture& now, const Cells& cells) {
  const Calm& first = oldest();
  const bool is_zero = is_within(now.current, 0, cells.calm_mA) && std::llabs(first.current_mA) <= cells.calm_mA;
  if (!is_zero || !now.pack_mV.is_valid()) return;
  for (const Calm& last : ring_) {
    const std::optional<std::int64_t> drift = drift_uV(first, last, now.taken_at);
    if (!last.pack_mV.is_valid() || !drift) continue;
    const std::int64_t told_mA = std::llabs(std::int64_t{middle_mA(now.current)} - last.current_mA);
    const std::int64_t told_uV = polarisation_max * told_mA * cells.resistance_uOhm / 1'000;
    const std::int64_t least_uV = (cells.unseen_uV + told_uV) * cells.count + bound_uV(*drift, last, cells);
    if (!has_moved(now, last, least_uV, cells)) continue;
    if (!is_move_of_pack(now.sum_uV - last.sum_uV, last.pack_mV, now.pack_mV)) continue;
    implausible_current_ = verdict(true, now.taken_at);
    is_against_current_ = false;
    return;
  }
}

}  // namespace bmu
