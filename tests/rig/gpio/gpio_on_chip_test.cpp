// GpioLines and bmud --open-gpio on a chip of the kernel, in the emulated machine. Started by tests/rig/gpio_guest.sh.
#include <algorithm>
#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/gpio/gpio_lines.hpp"
#include "tests/rig/gpio/chip.hpp"
#include "tests/support/process.hpp"

namespace bmu {

using namespace test;

namespace {

constexpr ContactorOutputs all_open{};
constexpr ContactorOutputs driving{.main_positive = true, .main_negative = true};

void require_open(GpioLines& lines) {
  const auto opened = lines.open();
  INFO((opened ? "" : to_text(opened.error())));
  REQUIRE(opened);
}

bool is_readable(const GpioLines& lines, int within_ms) {
  pollfd entry{.fd = lines.fd(), .events = POLLIN, .revents = 0};
  return ::poll(&entry, 1, within_ms) == 1;
}

GpioLevel level_of(GpioLines& lines, std::string_view name) {
  const auto levels = lines.read();
  INFO((levels ? "" : to_text(levels.error())));
  REQUIRE(levels);
  const auto found =
      std::find_if(levels->begin(), levels->end(), [&](const auto& level) { return level.name == name; });
  REQUIRE(found != levels->end());
  return *found;
}

/// Another process that holds the lines, and drives them once for every byte it receives.
class Owner {
 public:
  explicit Owner(const GpioConfig& config) {
    REQUIRE(::pipe(ticks_) == 0);
    REQUIRE(::pipe(done_) == 0);
    pid_ = ::fork();
    REQUIRE(pid_ >= 0);
    if (pid_ == 0) live(config);
  }
  Owner(const Owner&) = delete;
  Owner& operator=(const Owner&) = delete;
  ~Owner() {
    if (pid_ > 0) end(SIGKILL);
    for (const int fd : {ticks_[0], ticks_[1], done_[0], done_[1]}) ::close(fd);
  }

  /// The first tick commands all open, the others a closed pack.
  void tick() {
    send_tick();
    pollfd answer{.fd = done_[0], .events = POLLIN, .revents = 0};
    REQUIRE(::poll(&answer, 1, patience_ms) == 1);
    char byte = 0;
    REQUIRE(::read(done_[0], &byte, 1) == 1);
    REQUIRE(byte == 'd');
  }
  void send_tick() const { REQUIRE(::write(ticks_[1], "t", 1) == 1); }
  void stop() const {
    REQUIRE(::kill(pid_, SIGSTOP) == 0);
    int status = 0;
    REQUIRE(::waitpid(pid_, &status, WUNTRACED) == pid_);
    REQUIRE(WIFSTOPPED(status));
  }
  void end(int signal) {
    REQUIRE(::kill(pid_, signal) == 0);
    REQUIRE(::waitpid(std::exchange(pid_, -1), nullptr, 0) >= 0);
  }

 private:
  [[noreturn]] void live(const GpioConfig& config) {
    GpioLines lines(config);
    bool works = lines.open().has_value();
    char byte = 0;
    for (bool is_first = true; ::read(ticks_[0], &byte, 1) == 1; is_first = false) {
      works = works && lines.drive(is_first ? all_open : driving).has_value();
      if (::write(done_[1], works ? "d" : "f", 1) != 1) break;
    }
    ::_exit(1);
  }

  int ticks_[2]{};
  int done_[2]{};
  pid_t pid_ = -1;
};

// --- outputs --------------------------------------------------------------------------------------------------------

TEST_CASE("outputs begin open: each wire is driven once, to its inactive level") {
  const PackFile pack;
  const Log log;
  GpioLines lines(pack.lines());
  require_open(lines);
  std::vector<Driven> driven = log.news();
  std::sort(driven.begin(), driven.end(), [](const Driven& a, const Driven& b) { return a.line < b.line; });
  CHECK(driven == std::vector<Driven>{{watchdog_line, 0}, {positive_line, 1}, {negative_line, 0}, {precharge_line, 0}});
}

TEST_CASE("outputs are driven with their polarity, and open again when the lines are given back") {
  const PackFile pack;
  {
    GpioLines lines(pack.lines());
    require_open(lines);
    REQUIRE(lines.drive(driving));
    CHECK_FALSE(is_closed());  // held open until all have been commanded open
    REQUIRE(lines.drive(all_open));
    REQUIRE(lines.drive({.main_negative = true, .precharge = true}));
    CHECK(is_high(positive_line));
    CHECK(is_high(negative_line));
    CHECK(is_high(precharge_line));
    REQUIRE(lines.drive(driving));
    CHECK_FALSE(is_high(positive_line));
    CHECK(is_high(negative_line));
    CHECK_FALSE(is_high(precharge_line));
  }
  CHECK_FALSE(is_closed());
}

TEST_CASE("the watchdog's wire changes with every drive") {
  const PackFile pack;
  GpioLines lines(pack.lines());
  require_open(lines);
  const Log log;
  for (int i = 0; i < 6; ++i) REQUIRE(lines.drive(all_open));
  CHECK(log.levels_of(watchdog_line) == std::vector<int>{1, 0, 1, 0, 1, 0});
}

// --- inputs ---------------------------------------------------------------------------------------------------------

TEST_CASE("levels are those of the wires, and an edge wakes whoever waits") {
  const PackFile pack;
  set_wire(estop_line, true);
  set_wire(key_line, false);
  GpioLines lines(pack.lines());
  require_open(lines);
  CHECK(level_of(lines, "cockpit").is_active);
  CHECK_FALSE(level_of(lines, "key").is_active);
  CHECK_FALSE(is_readable(lines, 0));
  set_wire(estop_line, false);
  REQUIRE(is_readable(lines, patience_ms));
  CHECK_FALSE(level_of(lines, "cockpit").is_active);
  CHECK_FALSE(is_readable(lines, 0));
}

TEST_CASE("a stop that was let go before anybody read is told by its edge") {
  const PackFile pack;
  set_wire(estop_line, true);
  GpioLines lines(pack.lines());
  require_open(lines);
  CHECK_FALSE(level_of(lines, "cockpit").was_inactive);
  // The kernel reads an edge's level when its thread runs: one edge after the other, as that may be late here.
  set_wire(estop_line, false);
  REQUIRE(is_readable(lines, patience_ms));
  set_wire(estop_line, true);
  GpioLevel stop = level_of(lines, "cockpit");
  CHECK(stop.is_active);
  CHECK(stop.was_inactive);
}

TEST_CASE("feedback follows its contact once that has stopped bouncing, with its polarity") {
  constexpr int debounce_ms = 1'000;  // longer than this machine ever stalls between two writes
  const PackFile pack;
  GpioConfig config = pack.lines();
  config.feedback.at(static_cast<std::size_t>(GpioOutput::main_positive))->debounce =
      std::chrono::milliseconds(debounce_ms);
  set_wire(positive_contact_line, true);
  GpioLines lines(config);
  require_open(lines);
  CHECK_FALSE(level_of(lines, "main_positive").is_active);

  for (int i = 0; i < 4; ++i) set_wire(positive_contact_line, i % 2 == 1);  // and it is back where it was
  CHECK_FALSE(level_of(lines, "main_positive").is_active);
  // The absence of an edge takes time to be observed.
  CHECK_FALSE(is_readable(lines, debounce_ms + debounce_ms / 2));

  const TimePoint closed_at = monotonic_now();
  set_wire(positive_contact_line, false);
  CHECK_FALSE(level_of(lines, "main_positive").is_active);
  REQUIRE(is_readable(lines, patience_ms));
  CHECK(monotonic_now() - closed_at >= std::chrono::milliseconds(debounce_ms));
  CHECK(level_of(lines, "main_positive").is_active);
}

// --- failures --------------------------------------------------------------------------------------------------------

TEST_CASE("lines that are another's are refused by name") {
  const PackFile pack;
  GpioLines first(pack.lines());
  require_open(first);
  GpioLines second(pack.lines());
  const auto opened = second.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().code == EBUSY);
  CHECK(to_text(opened.error()).find("/dev/bmud-gpio line 3 (main_positive): in use by \"bmud\"") == 0);
}

TEST_CASE("a line that the chip does not have is refused by name") {
  const PackFile pack;
  GpioConfig config = pack.lines();
  config.inputs.back().at.line = 32;
  GpioLines lines(config);
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  CHECK(to_text(opened.error()) ==
        "/dev/bmud-gpio line 32 (key): chip has 32 lines, rig_gpio, expected a chip with this line");
}

TEST_CASE("a chip that vanishes is told by the next call, and taken again when it is back") {
  const PackFile pack;
  for (const bool by_read : {true, false}) {
    CAPTURE(by_read);
    GpioLines lines(pack.lines());
    require_open(lines);
    REQUIRE(lines.drive(all_open));
    REQUIRE(lines.drive(driving));
    write_file(driver_folder + "unbind", "rig_gpio");
    const OsError error = by_read ? lines.read().error() : lines.drive(driving).error();
    INFO(to_text(error));
    CHECK(error.code == ENODEV);
    CHECK(lines.state() == GpioState::failed);
    lines.maintain();
    CHECK(lines.state() == GpioState::failed);
    write_file(driver_folder + "bind", "rig_gpio");
    name_chip();
    lines.maintain();
    INFO(lines.last_error());
    REQUIRE(lines.state() == GpioState::held_open);
    CHECK_FALSE(is_closed());
    CHECK(lines.read());
    CHECK(lines.drive(all_open));
  }
}

// --- a process that ends or hangs -----------------------------------------------------------------------------------

TEST_CASE("a stopped process keeps its levels, its watchdog stands still, and its lines are not to be had") {
  const PackFile pack;
  Owner owner(pack.lines());
  const Log log;
  for (int i = 0; i < 5; ++i) owner.tick();
  CHECK(log.levels_of(watchdog_line).size() >= 5);
  CHECK(is_closed());
  owner.stop();
  const Log later;
  for (int i = 0; i < 5; ++i) owner.send_tick();
  CHECK(later.news().empty());
  CHECK(is_closed());

  const Finished refused = run_program({program("bmud"), "--open-gpio", "--config", pack.path()});
  CHECK(refused.status == 71);
  for (const char* line : {"3 (main_positive)", "4 (main_negative)", "5 (precharge)", "2 (watchdog)"}) {
    CHECK(refused.err.find(std::string("line ") + line + ": in use by \"bmud\"") != std::string::npos);
  }
  CHECK(is_closed());
}

TEST_CASE("a killed process leaves its levels behind, until bmud --open-gpio opens them") {
  const PackFile pack;
  Owner owner(pack.lines());
  for (int i = 0; i < 5; ++i) owner.tick();
  REQUIRE(is_closed());
  const Log log;
  owner.end(SIGKILL);
  CHECK(log.news().empty());
  // The reason for the watchdog line and the stop hook.
  CHECK(is_closed());

  const Finished opened = run_program({program("bmud"), "--open-gpio", "--config", pack.path()});
  INFO(opened.err);
  CHECK(opened.status == 0);
  CHECK(opened.out == "/dev/bmud-gpio: all outputs open\n");
  CHECK_FALSE(is_closed());
}

}  // namespace
}  // namespace bmu
