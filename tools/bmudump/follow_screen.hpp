// The table of --follow on a terminal: drawn in place four times a second, scrolled by keys, and the terminal restored
// however the run ends. On other outputs it is silent, and the table is printed at the end.
#pragma once

#include <cstdint>
#include <memory>

#include "tools/bmudump/follow.hpp"
#include "tools/common/terminal.hpp"

namespace bmu::dump {

class FollowScreen {
 public:
  /// `follow` may be null: then no function has an effect. `may_read_keys`: false if standard input is the followed
  /// log.
  FollowScreen(Follow* follow, bool is_coloured, bool may_read_keys);

  /// Draws if it is due, or if the window has changed. `now_us` on the clock of the frames.
  void draw_if_due(std::int64_t now_us);
  /// File descriptor of the keys, for poll(); below 0 if there is none.
  [[nodiscard]] int keys_fd() const;
  /// Handles the pending keys: q ends the run.
  void read_keys();

 private:
  void suspend();
  void draw(std::int64_t now_us);
  void scroll(std::int64_t rows);
  void move_values(std::int64_t steps);

  Follow* follow_;
  bool is_coloured_;
  bool may_read_keys_;
  std::unique_ptr<FullScreen> screen_;
  std::int64_t drawn_at_us_ = 0;  // monotonic
  Follow::Place place_;
  bool is_due_ = true;
};

}  // namespace bmu::dump
