#include "tools/common/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include "tools/common/standard_output.hpp"

namespace bmu {

namespace {

// A terminal without an alternate screen is left empty, with the cursor at its top.
constexpr const char* enter_code = "\033[?1049h\033[?25l\033[?7l\033[2J";
constexpr const char* leave_code = "\033[0m\033[2J\033[H\033[?7h\033[?25h\033[?1049l";

/// A background job that changes the terminal's settings would be stopped.
bool is_foreground() {
  return ::isatty(STDIN_FILENO) != 0 && ::tcgetpgrp(STDIN_FILENO) == ::getpgrp();
}

}  // namespace

WindowSize window_size() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {.width = size.ws_col, .height = size.ws_row};
}

void FullScreen::enter() {
  if (is_entered_) return;
  is_entered_ = true;
  if (is_foreground() && ::tcgetattr(STDIN_FILENO, &input_settings_) == 0) {
    termios quiet = input_settings_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO | ICANON);
    has_input_settings_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &quiet) == 0;
  }
  write_out(enter_code);
}

void FullScreen::leave() {
  if (!is_entered_) return;
  is_entered_ = false;
  write_out(leave_code);
  if (has_input_settings_ && is_foreground()) ::tcsetattr(STDIN_FILENO, TCSANOW, &input_settings_);
  has_input_settings_ = false;
}

}  // namespace bmu
