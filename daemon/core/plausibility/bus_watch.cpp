#include "daemon/core/plausibility/bus_watch.hpp"

namespace bmu {

void BusWatch::note_bus_off(TimePoint at) {
  bus_off_at_[head_] = at;
  head_ = (head_ + 1) % bus_off_at_.size();
}

bool BusWatch::is_storm(TimePoint now) const {
  const TimePoint oldest = bus_off_at_[head_];  // of the last three: the next to be overwritten
  return oldest != TimePoint{} && now - oldest <= storm_span;
}

void BusWatch::note_unknown_module(std::uint8_t node, TimePoint at) {
  const bool is_again = node == unknown_node_ && at > unknown_at_ && at - unknown_at_ <= stranger_memory;
  if (is_again) unknown_confirmed_at_ = at;
  unknown_node_ = node;
  unknown_at_ = at;
}

void BusWatch::forget_unknown_module(std::uint8_t node) {
  if (node != unknown_node_) return;
  unknown_node_ = 0;
  unknown_at_ = unknown_confirmed_at_ = {};
}

std::uint8_t BusWatch::unknown_module(TimePoint now) const {
  const bool is_there = unknown_confirmed_at_ != TimePoint{} && now - unknown_confirmed_at_ <= stranger_memory;
  return is_there ? unknown_node_ : std::uint8_t{0};
}

bool BusWatch::has_foreign_report(TimePoint now) const {
  return foreign_report_at_ != TimePoint{} && now - foreign_report_at_ <= reporter_memory;
}

bool BusWatch::has_misplaced_frames(TimePoint now) const {
  return misplaced_at_ != TimePoint{} && now - misplaced_at_ <= misplaced_memory;
}

}  // namespace bmu
