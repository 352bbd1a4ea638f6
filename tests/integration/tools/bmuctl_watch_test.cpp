// bmuctl watch as a process beside the real daemon: its output without a terminal, and the end of its wait for the
// daemon.
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/daemon_bench.hpp"

namespace bmu {

using test::Bench;

namespace {

using std::chrono::milliseconds;

/// A named pipe that a program writes into, and that the test reads when it chooses.
class SlowReader {
 public:
  explicit SlowReader(const std::string& path) {
    REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
    pipe_ = OwnedFd(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    REQUIRE(pipe_.is_open());
  }
  /// True if the writer waits for room: a page may remain free that its next piece does not fit into.
  [[nodiscard]] bool is_full() const {
    int waiting = 0;
    REQUIRE(::ioctl(pipe_.get(), FIONREAD, &waiting) == 0);
    return waiting > ::fcntl(pipe_.get(), F_GETPIPE_SZ) - 4096;
  }
  /// Reads `count` line ends, each in time; false if the writer ends before.
  [[nodiscard]] bool reads_lines(std::ptrdiff_t count) {
    std::array<char, 65536> bytes{};
    while (count > 0) {
      pollfd wait{.fd = pipe_.get(), .events = POLLIN, .revents = 0};
      if (::poll(&wait, 1, static_cast<int>(test::hang_max.count())) <= 0) return false;
      const ssize_t taken = ::read(pipe_.get(), bytes.data(), bytes.size());
      if (taken < 0 && errno == EAGAIN) continue;
      if (taken <= 0) return false;
      count -= std::count(bytes.begin(), bytes.begin() + taken, '\n');
    }
    return true;
  }

 private:
  OwnedFd pipe_;
};

}  // namespace

TEST_CASE("watch without a terminal tells lines, and the picture once at the end", "[integration][bmuctl][bus]") {
  Bench bench;
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  CHECK(bench.ask({"watch", "--seconds", "0.2"}).status == 0);
  const std::string path = bench.folder / "out";
  Process watch({program("bmuctl"), "--socket", bench.socket, "watch", "--period", "0.2"}, {.out_file = path});
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  REQUIRE(bench.becomes([&] { return lines(read_file(path)) >= 3; }));
  watch.signal(SIGTERM);
  CHECK(watch.wait(test::hang_max) == 0);
  const std::string watched = read_file(path);
  CHECK(watched.find('\033') == std::string::npos);
  CHECK(lines(watched) > 12);
  CHECK(watched.find("demo 48s") != std::string::npos);
}

TEST_CASE("watch keeps the last picture and fails when the daemon goes away", "[integration][bmuctl][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  Process watch({program("bmuctl"), "--socket", bench.socket, "watch", "--period", "0.1"},
                {.out_file = bench.folder / "out", .err_file = bench.folder / "err"});
  // It is watching once its first line is there.
  REQUIRE(bench.becomes([&] { return !read_file(bench.folder / "out").empty(); }));
  bench.daemon->signal(SIGKILL);
  CHECK(watch.wait(test::hang_max) == 1);
  CHECK(read_file(bench.folder / "out").find("demo 48s") != std::string::npos);
  CHECK(read_file(bench.folder / "err").find("connection lost") != std::string::npos);
}

TEST_CASE("watch ends when the daemon is there and says nothing for longer than it may", "[integration][bmuctl][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  Process watch({program("bmuctl"), "--socket", bench.socket, "watch", "--period", "0.1"},
                {.out_file = bench.folder / "out", .err_file = bench.folder / "err"});
  REQUIRE(bench.becomes([&] { return !read_file(bench.folder / "out").empty(); }));
  bench.daemon->signal(SIGSTOP);
  CHECK(watch.wait(milliseconds{4'000}) == -1);
  CHECK(watch.wait(test::hang_max) == 1);
  CHECK(read_file(bench.folder / "err") == "bmuctl: the daemon does not answer\n");
}

TEST_CASE("watch that was held up for longer than a daemon may be silent goes on with what has come meanwhile",
          "[integration][bmuctl][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  SlowReader reader(bench.folder / "pictures");
  Process watch({program("bmuctl"), "--socket", bench.socket, "--json", "watch", "--period", "0.1"},
                {.out_file = bench.folder / "pictures"});
  REQUIRE(bench.becomes([&] { return reader.is_full(); }));
  // Its timeout for the daemon, and another second.
  CHECK(watch.wait(milliseconds{6'100}) == -1);
  CHECK(reader.reads_lines(10));
  CHECK(watch.wait(milliseconds{0}) == -1);
}

}  // namespace bmu
