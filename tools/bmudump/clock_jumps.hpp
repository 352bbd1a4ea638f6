// Where the clock of the computer that recorded a log was set while it recorded: there the time between two frames is
// none that passed on the bus. Rates, gaps, loads and durations are reckoned without it.
//
//   back      a frame is earlier than the one before it on the same bus, of which two at least were in their order. Of
//             several buses the frames may be out of order.
//   forward   from before the year 2000 to a later time, as the clock of a computer without a battery is set first; or
//             no frame on any bus for ten seconds, and for 20 times as long as ever before. The latter may as well be
//             a battery that was switched off: a log does not show which.
//
// Cost: a few nanoseconds a frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace bmu::dump {

struct ClockJump {
  std::int64_t by_us = 0;  // above 0: forward
  bool is_certain = true;  // else it may be a silence

  [[nodiscard]] bool is_found() const { return by_us != 0; }
};

class ClockJumps {
 public:
  /// What all jumps so far come to: a time of the log less `by_us` goes on without jumps.
  struct Sum {
    std::int64_t by_us = 0;
    std::uint64_t count = 0;
  };

  static constexpr std::size_t bus_count_max = 16;
  static constexpr std::int64_t forward_min_us = 10'000'000;
  static constexpr std::int64_t forward_min_longest = 20;  // times as long as between any two frames before
  static constexpr std::uint64_t forward_min_frames = 20;  // fewer show no spacing
  static constexpr std::int64_t back_min_us = 5'000;       // less may be an adapter that stamps frames out of order
  static constexpr unsigned back_min_frames = 2;           // of the bus before: one has no order

  /// The next frame in the order of the log, of the bus with this index, below bus_count_max: whether the clock was set
  /// between it and the frame before.
  ClockJump take(std::size_t bus, std::int64_t time_us) {
    const std::int64_t step_us = time_us - left_out_us_ - latest_us_;
    const bool is_usual = step_us >= 0 && step_us < forward_min_us;
    if (!is_usual) return take_unusual(bus, time_us);
    note(bus, latest_us_ + step_us);
    return {};
  }
  [[nodiscard]] Sum sum() const { return {.by_us = left_out_us_, .count = count_}; }
  [[nodiscard]] std::int64_t left_out_us() const { return left_out_us_; }
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  struct Bus {
    unsigned frames = 0;  // counted to back_min_frames
    std::int64_t latest_us = 0;
  };

  ClockJump take_unusual(std::size_t bus, std::int64_t time_us);
  [[nodiscard]] ClockJump jump_before(std::size_t bus, std::int64_t time_us) const;

  void note(std::size_t bus, std::int64_t steady_us) {
    if (frames_ > 0 && steady_us - latest_us_ > longest_us_) longest_us_ = steady_us - latest_us_;
    ++frames_;
    latest_us_ = steady_us;
    Bus& own = buses_[bus];
    own.frames += own.frames < back_min_frames ? 1U : 0U;
    own.latest_us = steady_us;
  }

  std::uint64_t frames_ = 0;
  std::uint64_t count_ = 0;
  std::int64_t left_out_us_ = 0;
  std::int64_t latest_us_ = 0;   // of the frame before, without jumps
  std::int64_t longest_us_ = 0;  // between two frames
  std::array<Bus, bus_count_max> buses_{};
};

}  // namespace bmu::dump
