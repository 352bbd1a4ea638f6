// What differs between two courses of decisions, told so that a person sees what it comes to: each event and each
// command of the contactors that only one of them has, and of the frames how many of each kind, and the first.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/replay.hpp"

namespace bmu::replay {

struct Change {
  std::int64_t log_us = 0;
  bool is_recorded = false;  // only the recording has it; else only the other course
  std::string text;          // "fault: ...", "contactors main_negative main_positive"
};

struct FrameChanges {
  std::uint64_t count = 0;
  std::int64_t first_log_us = 0;
  std::int64_t last_log_us = 0;
  std::string recorded;  // of the first; "" where there was none
  std::string replayed;
};

class DecisionChanges {
 public:
  static constexpr std::size_t changes_max = 1000;

  void take(const ReplayDifference& difference);
  /// What `later` saw comes after all of this.
  void append(const DecisionChanges& later);

  /// The first `changes_max` of them.
  [[nodiscard]] const std::vector<Change>& changes() const { return changes_; }
  [[nodiscard]] std::uint64_t changes_left_out() const { return left_out_; }
  /// By "BUS ID", as frames are written in a recording.
  [[nodiscard]] const std::map<std::string, FrameChanges>& frames() const { return frames_; }
  [[nodiscard]] bool is_empty() const { return changes_.empty() && frames_.empty(); }

 private:
  void add(Change change);
  void compare_frames(const ReplayDifference& difference);

  std::vector<Change> changes_;
  std::uint64_t left_out_ = 0;
  std::map<std::string, FrameChanges> frames_;
};

}  // namespace bmu::replay
