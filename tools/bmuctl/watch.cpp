#include "tools/bmuctl/watch.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "tools/bmuctl/client.hpp"
#include "tools/bmuctl/keys.hpp"
#include "tools/bmuctl/picture.hpp"
#include "tools/common/standard_output.hpp"
#include "tools/common/terminal.hpp"

namespace bmu {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds period_on_terminal{250};
constexpr milliseconds period_elsewhere{1000};
constexpr milliseconds silence_noticed{1500};  // added to the period: then the live view is marked as old
constexpr milliseconds silence_max{5000};      // then the daemon counts as gone
constexpr milliseconds reconnect_period{500};
// Rows of the last live view if no window limits it.
constexpr int rows_of_last_picture = 60;

/// True for a terminal with cursor positioning; any other output gets a line periodically.
bool is_full_terminal() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  const char* const terminal = std::getenv("TERM");
  return ::isatty(STDOUT_FILENO) != 0 && terminal != nullptr && *terminal != '\0' &&
         std::string_view(terminal) != "dumb";
}

struct LetterRow {
  char letter;
  PictureTopic topic;
};
constexpr std::array topic_keys{
    LetterRow{'o', PictureTopic::overview}, LetterRow{'f', PictureTopic::faults}, LetterRow{'l', PictureTopic::limits},
    LetterRow{'u', PictureTopic::buses},    LetterRow{'?', PictureTopic::help},   LetterRow{'h', PictureTopic::help},
};
/// The pages in the order of the Tab key.
constexpr std::array topic_order{PictureTopic::overview, PictureTopic::faults, PictureTopic::limits,
                                 PictureTopic::buses};

PictureTopic topic_after(PictureTopic topic) {
  const auto* const at = std::find(topic_order.begin(), topic_order.end(), topic);
  return at == topic_order.end() || at + 1 == topic_order.end() ? topic_order.front() : *(at + 1);
}

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options),
        is_terminal_(is_full_terminal() && !options.json),
        period_(options.period.value_or(is_terminal_ ? period_on_terminal : period_elsewhere)),
        glyphs_(glyphs_for_locale()),
        began_(steady_clock::now()),
        heard_(began_),
        looked_(began_) {}

  int run();

 private:
  enum class End : std::uint8_t { none, wanted, daemon_gone };

  bool connect();
  void open_signals();
  void wait();
  void read_signals();
  void read_keys();
  void obey(const Key& key);
  void obey_letter(char letter);
  void show(PictureTopic topic);
  void scroll(int lines);
  void read_daemon();
  void take(const std::string& line);
  void check_times();
  void lose(std::string why);
  void suspend();
  void draw();
  void redraw();
  void show_last_picture() const;
  [[nodiscard]] bool has_picture() const { return picture_.is_object(); }

  WatchOptions options_;
  bool is_terminal_;
  milliseconds period_;
  const Glyphs& glyphs_;
  steady_clock::time_point began_;
  steady_clock::time_point heard_;
  // Last time without pending input: input that arrives while this program writes or is stopped is still to be read.
  steady_clock::time_point looked_;
  std::optional<Client> client_;
  OwnedFd signals_;
  std::unique_ptr<FullScreen> screen_;
  nlohmann::json picture_;
  BusTrend trend_;
  KeyReader keys_;
  PictureView view_;
  PictureExtent extent_;
  std::vector<std::string> rows_drawn_;
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
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT}) sigaddset(&set, signal);
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
  while (end_ == End::none && !has_output_failed()) {
    wait();
    check_times();
  }
  screen_.reset();
  if (!options_.json) show_last_picture();
  if (end_ != End::daemon_gone) return 0;
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
  const steady_clock::time_point looked = steady_clock::now();
  const int count = ::poll(polls.data(), polls.size(), static_cast<int>(wait_max.count()));
  if (count >= 0 && polls[1].revents == 0) looked_ = looked;
  if (polls[2].revents == 0) {
    for (const Key& key : keys_.pause()) obey(key);
  }
  if (count <= 0) return;
  if (polls[0].revents != 0) read_signals();
  if (polls[1].revents != 0) read_daemon();
  if (polls[2].revents != 0) read_keys();
}

void Watch::read_signals() {
  signalfd_siginfo info{};
  while (::read(signals_.get(), &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
    if (info.ssi_signo == SIGWINCH) {
      redraw();
    } else if (info.ssi_signo == SIGTSTP) {
      suspend();
    } else {
      end_ = End::wanted;
    }
  }
}

/// Ctrl-Z: restores the screen of the shell, and the live view after the program continues.
void Watch::suspend() {
  screen_->leave();
  ::raise(SIGSTOP);
  screen_->enter();
  redraw();
}

void Watch::read_keys() {
  std::array<char, 64> bytes{};
  const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  if (count <= 0) return;
  for (const Key& key : keys_.take({bytes.data(), static_cast<std::size_t>(count)})) obey(key);
}

void Watch::obey(const Key& key) {
  const int page = std::max(extent_.shown - 1, 1);
  switch (key.kind) {
    case KeyKind::letter: return obey_letter(key.letter);
    case KeyKind::up: return scroll(-1);
    case KeyKind::down: return scroll(1);
    case KeyKind::page_up: return scroll(-page);
    case KeyKind::page_down: return scroll(page);
    case KeyKind::home: return scroll(-extent_.total);
    case KeyKind::end: return scroll(extent_.total);
    case KeyKind::escape: return show(PictureTopic::overview);
  }
}

void Watch::obey_letter(char letter) {
  constexpr char ctrl_l = '\f';
  const auto* const topic =
      std::find_if(topic_keys.begin(), topic_keys.end(), [&](const LetterRow& row) { return row.letter == letter; });
  if (topic != topic_keys.end()) return show(topic->topic);
  switch (letter) {
    case 'q':
    case 'Q': end_ = End::wanted; return;
    case 'j': return scroll(1);
    case 'k': return scroll(-1);
    case ' ': return scroll(std::max(extent_.shown - 1, 1));
    case '\t': return show(topic_after(view_.topic));
    case 'a': view_.form = CellsForm::fitting; return show(PictureTopic::overview);
    case 'b': view_.form = CellsForm::bars; return show(PictureTopic::overview);
    case 'n': view_.form = CellsForm::numbers; return show(PictureTopic::overview);
    case 'z': view_.bars_span_cells = !view_.bars_span_cells; return draw();
    case ctrl_l: return redraw();
    default: return;
  }
}

void Watch::show(PictureTopic topic) {
  view_.topic = topic;
  view_.first = 0;
  draw();
}

void Watch::scroll(int lines) {
  view_.first = std::clamp(view_.first + lines, 0, std::max(extent_.total - extent_.shown, 0));
  draw();
}

void Watch::read_daemon() {
  const bool is_there = client_->take_in();
  std::string latest;
  while (auto line = client_->next_line()) latest = std::move(*line);
  if (!latest.empty()) take(latest);
  if (!is_there) lose("connection lost");
}

void Watch::take(const std::string& line) {
  heard_ = steady_clock::now();
  notice_.clear();
  if (options_.json) return write_out(line + "\n");
  nlohmann::json reply = nlohmann::json::parse(line, nullptr, false);
  if (!Reply(reply)["ok"].is_true()) {
    failure_ = "refused: " + Reply(reply)["error"]["message"].text();
    end_ = End::daemon_gone;
    return;
  }
  picture_ = std::move(reply);
  trend_.take(Reply(picture_)["status"]);
  if (is_terminal_) return draw();
  write_out(compact_line(Reply(picture_)) + "\n");
}

void Watch::lose(std::string why) {
  client_.reset();
  failure_ = std::move(why);
  notice_ = failure_ + (options_.reconnect ? "; reconnecting" : "");
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
  const auto silent_for = looked_ - heard_;
  if (silent_for > period_ + silence_max) return lose("the daemon does not answer");
  if (silent_for > period_ + silence_noticed && notice_.empty()) {
    notice_ = "no data from the daemon: display is stale";
    draw();
  }
}

void Watch::draw() {
  if (!screen_) return;
  const WindowSize size = window_size();
  Canvas canvas(size.width, size.height, glyphs_.cut);
  extent_ = draw_picture(Reply(picture_), view_, trend_, notice_, glyphs_, canvas);
  view_.first = std::clamp(view_.first, 0, std::max(extent_.total - extent_.shown, 0));
  // Writes only rows that have changed: the screen does not flicker, and a slow connection carries little. A row is
  // erased before it is written, because the cursor stays on the last column of a full row.
  rows_drawn_.resize(static_cast<std::size_t>(canvas.height()));
  std::string text;
  for (int row = 0; row < canvas.height(); ++row) {
    std::string& drawn = rows_drawn_[static_cast<std::size_t>(row)];
    std::string wanted = canvas.row_text(row, options_.with_colour);
    if (wanted == drawn) continue;
    text += "\033[" + std::to_string(row + 1) + ";1H\033[K" + wanted;
    drawn = std::move(wanted);
  }
  if (!text.empty()) write_out(text);
}

/// Redraws everything, if the content of the terminal is unknown or not from this program.
void Watch::redraw() {
  if (!screen_) return;
  rows_drawn_.clear();
  write_out("\033[0m\033[2J");
  draw();
}

/// The last live view remains readable, without the open page and the keys.
void Watch::show_last_picture() const {
  if (!has_picture()) return;
  const WindowSize size = window_size();
  // It scrolls by: a window that was too small for all modules does not limit it.
  const bool has_all = view_.topic == PictureTopic::overview && extent_.shown == extent_.total;
  Canvas canvas(size.width, is_terminal_ && has_all ? size.height : rows_of_last_picture, glyphs_.cut);
  const PictureView view{.bars_span_cells = view_.bars_span_cells};
  draw_picture(Reply(picture_), view, trend_, notice_, glyphs_, canvas);
  std::string text;
  for (int row = 0; row + 1 < canvas.height(); ++row) text += canvas.row_text(row, options_.with_colour) + "\n";
  text.erase(text.find_last_not_of('\n') + 1);
  write_out(text + "\n");
}

}  // namespace

int watch(const WatchOptions& options) {
  return Watch(options).run();
}

}  // namespace bmu
