#include "tools/bmudump/follow_screen.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <string_view>

#include <unistd.h>

#include "tools/bmudump/dump.hpp"
#include "tools/common/glyphs.hpp"
#include "tools/common/standard_output.hpp"

namespace bmu::dump {
namespace {

constexpr std::int64_t period_us = 250'000;

volatile std::sig_atomic_t window_changed = 0;
volatile std::sig_atomic_t suspend_requested = 0;

std::int64_t monotonic_us() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

void catch_screen_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { window_changed = 1; };
  ::sigaction(SIGWINCH, &action, nullptr);
  action.sa_handler = [](int) { suspend_requested = 1; };
  ::sigaction(SIGTSTP, &action, nullptr);
}

enum class Move : std::uint8_t { rows, pages, values };
struct Key {
  std::string_view code;
  std::int64_t steps;
  Move move;
};
constexpr std::array keys{
    Key{"\033[A", -1, Move::rows},   Key{"\033[B", 1, Move::rows},    Key{"\033OA", -1, Move::rows},
    Key{"\033OB", 1, Move::rows},    Key{"k", -1, Move::rows},        Key{"j", 1, Move::rows},
    Key{"\033[5~", -1, Move::pages}, Key{"\033[6~", 1, Move::pages},  Key{"b", -1, Move::pages},
    Key{" ", 1, Move::pages},        Key{"\033[D", -1, Move::values}, Key{"\033[C", 1, Move::values},
    Key{"\033OD", -1, Move::values}, Key{"\033OC", 1, Move::values},  Key{"h", -1, Move::values},
    Key{"l", 1, Move::values}};

}  // namespace

FollowScreen::FollowScreen(Follow* follow, bool is_coloured, bool may_read_keys)
    : follow_(follow), is_coloured_(is_coloured), may_read_keys_(may_read_keys) {
  if (follow == nullptr || ::isatty(STDOUT_FILENO) == 0) return;
  catch_screen_signals();
  screen_ = std::make_unique<FullScreen>();
}

void FollowScreen::draw_if_due(std::int64_t now_us) {
  if (!screen_) return;
  if (suspend_requested != 0) suspend();
  const std::int64_t at_us = monotonic_us();
  if (window_changed == 0 && !is_due_ && at_us - drawn_at_us_ < period_us) return;
  window_changed = 0;
  is_due_ = false;
  drawn_at_us_ = at_us;
  draw(now_us);
}

/// Ctrl-Z: restores the screen of the shell, and the table after the program continues.
void FollowScreen::suspend() {
  suspend_requested = 0;
  screen_->leave();
  ::raise(SIGSTOP);
  screen_->enter();
  is_due_ = true;
}

void FollowScreen::draw(std::int64_t now_us) {
  const WindowSize size = window_size();
  const std::size_t room = follow_->rows_in(size.height);
  const std::size_t count = follow_->row_count();
  place_.row = std::min(place_.row, count > room ? count - room : 0);
  Canvas canvas(size.width, size.height, glyphs_for_locale().cut);
  follow_->draw(now_us, place_, canvas);
  // Redraws line by line over the old content: the screen does not flicker.
  std::string text = "\033[H";
  for (int row = 0; row < canvas.height(); ++row) {
    // In the last column the cursor stays on the character written there: erasing to the end of the line would delete
    // it.
    const bool is_full = width_of(canvas.row_text(row, false)) >= static_cast<std::size_t>(size.width);
    text += canvas.row_text(row, is_coloured_) + (is_full ? "" : "\033[K") + (row + 1 < canvas.height() ? "\r\n" : "");
  }
  write_out(text);
}

int FollowScreen::keys_fd() const {
  const bool has_keys = screen_ != nullptr && may_read_keys_ && ::isatty(STDIN_FILENO) != 0;
  return has_keys && ::tcgetpgrp(STDIN_FILENO) == ::getpgrp() ? STDIN_FILENO : -1;
}

void FollowScreen::read_keys() {
  std::array<char, 64> typed{};
  const ssize_t count = ::read(STDIN_FILENO, typed.data(), typed.size());
  std::string_view left(typed.data(), count > 0 ? static_cast<std::size_t>(count) : 0);
  while (!left.empty()) {
    const auto key =
        std::find_if(keys.begin(), keys.end(), [left](const Key& one) { return left.starts_with(one.code); });
    if (left.front() == 'q' || left.front() == 'Q') request_stop();
    if (key != keys.end()) {
      const auto page = static_cast<std::int64_t>(follow_->rows_in(window_size().height));
      if (key->move == Move::values) {
        move_values(key->steps);
      } else {
        scroll(key->move == Move::pages ? key->steps * page : key->steps);
      }
    }
    left.remove_prefix(key == keys.end() ? 1 : key->code.size());
  }
}

void FollowScreen::scroll(std::int64_t rows) {
  place_.row = static_cast<std::size_t>(std::max<std::int64_t>(static_cast<std::int64_t>(place_.row) + rows, 0));
  is_due_ = true;
}

/// Moves at most to the position at which the last values are visible, and back if there are fewer values now.
void FollowScreen::move_values(std::int64_t steps) {
  const auto end = static_cast<std::int64_t>(follow_->value_max());
  const std::int64_t from = std::min(static_cast<std::int64_t>(place_.value), end);
  place_.value = static_cast<std::size_t>(std::clamp<std::int64_t>(from + steps, 0, end));
  is_due_ = true;
}

}  // namespace bmu::dump
