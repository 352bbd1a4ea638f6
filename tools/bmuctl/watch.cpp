#include "tools/bmuctl/watch.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "tools/bmuctl/client.hpp"
#include "tools/bmuctl/picture.hpp"
#include "tools/common/terminal.hpp"

namespace bmu {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds period_on_terminal{250};
constexpr milliseconds period_elsewhere{1000};
constexpr milliseconds silence_noticed{1500};  // behind the period: then the picture says that it is old
constexpr milliseconds silence_max{5000};      // then the daemon counts as gone
constexpr milliseconds reconnect_period{500};
// Rows of the last picture where there is no window that limits it.
constexpr int rows_of_last_picture = 60;

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options),
        is_terminal_(::isatty(STDOUT_FILENO) != 0 && !options.json),
        period_(options.period.value_or(is_terminal_ ? period_on_terminal : period_elsewhere)),
        glyphs_(glyphs_for_locale()),
        began_(steady_clock::now()),
        heard_(began_) {}

  int run();

 private:
  enum class End : std::uint8_t { none, wanted, daemon_gone };

  bool connect();
  void open_signals();
  void wait();
  void read_signals();
  void read_keys();
  void read_daemon();
  void take(const std::string& line);
  void check_times();
  void lose(std::string why);
  void suspend();
  void draw();
  void show_last_picture() const;
  [[nodiscard]] bool has_picture() const { return picture_.is_object(); }

  WatchOptions options_;
  bool is_terminal_;
  milliseconds period_;
  const Glyphs& glyphs_;
  steady_clock::time_point began_;
  steady_clock::time_point heard_;
  std::optional<Client> client_;
  OwnedFd signals_;
  std::unique_ptr<FullScreen> screen_;
  nlohmann::json picture_;
  std::string notice_;
  std::string failure_;
  End end_ = End::none;
};

bool Watch::connect() {
  auto client = Client::connect(options_.socket);
  if (!client) {
    failure_ = client.error();
    return false;
  }
  const std::string request = nlohmann::json{{"cmd", "watch"}, {"period_ms", period_.count()}}.dump();
  if (auto sent = client->send_line(request); !sent) {
    failure_ = sent.error();
    return false;
  }
  client_ = std::move(*client);
  heard_ = steady_clock::now();
  notice_.clear();
  return true;
}

void Watch::open_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaddset(&set, signal);
  if (is_terminal_) {
    for (const int signal : {SIGWINCH, SIGTSTP}) sigaddset(&set, signal);
  }
  sigprocmask(SIG_BLOCK, &set, nullptr);
  signals_ = OwnedFd(::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK));
}

int Watch::run() {
  open_signals();
  if (!connect() && !options_.reconnect) {
    std::fprintf(stderr, "bmuctl: %s\n", failure_.c_str());
    return 1;
  }
  if (is_terminal_) screen_ = std::make_unique<FullScreen>();
  if (!client_) lose(failure_);
  draw();
  while (end_ == End::none) {
    wait();
    check_times();
  }
  screen_.reset();
  if (!options_.json) show_last_picture();
  if (end_ == End::wanted) return 0;
  std::fprintf(stderr, "bmuctl: %s\n", failure_.c_str());
  return 1;
}

void Watch::wait() {
  const int daemon_fd = client_ ? client_->fd() : -1;
  const bool has_keys = screen_ != nullptr && ::isatty(STDIN_FILENO) != 0 && ::tcgetpgrp(STDIN_FILENO) == ::getpgrp();
  std::array<pollfd, 3> polls{{{.fd = signals_.get(), .events = POLLIN, .revents = 0},
                               {.fd = daemon_fd, .events = POLLIN, .revents = 0},
                               {.fd = has_keys ? STDIN_FILENO : -1, .events = POLLIN, .revents = 0}}};
  constexpr milliseconds wait_max{100};
  if (::poll(polls.data(), polls.size(), static_cast<int>(wait_max.count())) <= 0) return;
  if (polls[0].revents != 0) read_signals();
  if (polls[1].revents != 0) read_daemon();
  if (polls[2].revents != 0) read_keys();
}

void Watch::read_signals() {
  signalfd_siginfo info{};
  while (::read(signals_.get(), &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
    if (info.ssi_signo == SIGWINCH) {
      draw();
    } else if (info.ssi_signo == SIGTSTP) {
      suspend();
    } else {
      end_ = End::wanted;
    }
  }
}

/// Ctrl-Z: the shell gets its screen back, and we ours when we go on.
void Watch::suspend() {
  screen_->leave();
  ::raise(SIGSTOP);
  screen_->enter();
  draw();
}

void Watch::read_keys() {
  char key = 0;
  if (::read(STDIN_FILENO, &key, 1) == 1 && (key == 'q' || key == 'Q')) end_ = End::wanted;
}

void Watch::read_daemon() {
  const bool is_there = client_->take_in();
  std::string latest;
  while (auto line = client_->next_line()) latest = std::move(*line);
  if (!latest.empty()) take(latest);
  if (!is_there) lose("the daemon has gone");
}

void Watch::take(const std::string& line) {
  heard_ = steady_clock::now();
  notice_.clear();
  if (options_.json) return write_out(line + "\n");
  nlohmann::json reply = nlohmann::json::parse(line, nullptr, false);
  if (!Reply(reply)["ok"].is_true()) {
    failure_ = "the daemon refuses: " + Reply(reply)["error"]["message"].text();
    end_ = End::daemon_gone;
    return;
  }
  picture_ = std::move(reply);
  if (is_terminal_) return draw();
  write_out(compact_line(Reply(picture_)) + "\n");
}

void Watch::lose(std::string why) {
  client_.reset();
  failure_ = std::move(why);
  notice_ = failure_ + (options_.reconnect ? "; waiting for it" : "");
  heard_ = steady_clock::now();
  if (!options_.reconnect) end_ = End::daemon_gone;
  if (is_terminal_) draw();
}

void Watch::check_times() {
  const auto now = steady_clock::now();
  if (options_.duration && now - began_ >= *options_.duration) end_ = std::max(end_, End::wanted);
  if (end_ != End::none) return;
  if (!client_) {
    if (now - heard_ < reconnect_period) return;
    heard_ = now;
    if (connect()) draw();
    return;
  }
  if (now - heard_ > period_ + silence_max) return lose("the daemon does not answer");
  if (now - heard_ > period_ + silence_noticed && notice_.empty()) {
    notice_ = "the daemon is silent: this picture is old";
    draw();
  }
}

void Watch::draw() {
  if (!screen_) return;
  const WindowSize size = window_size();
  Canvas canvas(size.width, size.height, glyphs_.cut);
  draw_picture(Reply(picture_), notice_, glyphs_, canvas);
  // Line by line over the old picture: nothing flickers.
  std::string text = "\033[H";
  for (int row = 0; row < canvas.height(); ++row) {
    text += canvas.row_text(row, options_.with_colour) + "\033[K" + (row + 1 < canvas.height() ? "\r\n" : "");
  }
  write_out(text);
}

void Watch::show_last_picture() const {
  if (!has_picture()) return;
  const WindowSize size = window_size();
  Canvas canvas(size.width, is_terminal_ ? size.height : rows_of_last_picture, glyphs_.cut);
  draw_picture(Reply(picture_), notice_, glyphs_, canvas);
  write_out(canvas.text(options_.with_colour));
}

}  // namespace

int watch(const WatchOptions& options) {
  return Watch(options).run();
}

}  // namespace bmu
