// A terminal with a full-screen view: alternate screen, no cursor, no echo; restored in every case.
#pragma once

#include <termios.h>

namespace bmu {

struct WindowSize {
  int width = 100;
  int height = 30;
};

/// Of the terminal of standard output; the default if it is none.
[[nodiscard]] WindowSize window_size();

class FullScreen {
 public:
  FullScreen() { enter(); }
  FullScreen(const FullScreen&) = delete;
  FullScreen& operator=(const FullScreen&) = delete;
  ~FullScreen() { leave(); }

  void enter();
  void leave();

 private:
  bool is_entered_ = false;
  bool has_input_settings_ = false;
  termios input_settings_{};
};

}  // namespace bmu
