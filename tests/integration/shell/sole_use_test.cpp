// Two real daemons with the same file or folder: the second does not start, and the first continues.
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <sys/stat.h>

#include "tests/support/daemon_bench.hpp"

namespace bmu {

using test::Bench;
using test::milliseconds;

namespace {

struct TwoDaemons {
  Bench one;
  Bench other;
  std::string shared = one.folder / "shared";

  /// Starts both and returns the log of the second one, which exits with 71; the first one sends before and after it.
  [[nodiscard]] std::string refusal(const std::vector<std::string>& both, const std::vector<std::string>& others = {}) {
    std::filesystem::create_directories(shared);
    one.more_options = both;
    one.start_daemon();
    REQUIRE(one.listener.next(test::hang_max));
    other.more_options = others.empty() ? both : others;
    other.start_daemon();
    CHECK(other.daemon->wait(test::hang_max) == 71);
    CHECK_FALSE(other.listener.next(milliseconds(0)));
    static_cast<void>(one.listener.last());
    CHECK(one.listener.next(test::hang_max));
    return read_file(other.log);
  }
};

bool says(const std::string& log, const std::string& text) {
  return log.find(text) != std::string::npos;
}

std::string in_use(const std::string& path, const std::string& option) {
  return path + " is in use by another bmud; choose another path with " + option;
}

}  // namespace

TEST_CASE("a second daemon does not take the state of the first one, and its successor does",
          "[integration][daemon][state][bus]") {
  TwoDaemons daemons;
  const std::string state = daemons.shared + "/state.json";
  CHECK(says(daemons.refusal({"--state", state, "--history", "none"}), in_use(state, "--state")));
  daemons.one.daemon->signal(SIGKILL);
  REQUIRE(daemons.one.daemon->wait(test::hang_max) == 128 + SIGKILL);
  daemons.other.start_daemon();
  CHECK(daemons.other.listener.next(test::hang_max));
}

TEST_CASE("a second daemon does not take the history of the first one", "[integration][daemon][history][bus]") {
  TwoDaemons daemons;
  const std::string history = daemons.shared + "/history.sqlite";
  CHECK(says(daemons.refusal({"--history", history}), in_use(history, "--history")));
}

TEST_CASE("a second daemon does not record into the folder of the first one, however it is named",
          "[integration][daemon][recorder][bus]") {
  TwoDaemons daemons;
  const std::string link = daemons.one.folder / "link";
  std::filesystem::create_directories(daemons.shared);
  std::filesystem::create_directory_symlink(daemons.shared, link);
  CHECK(says(daemons.refusal({"--record", daemons.shared, "--black-box", daemons.shared}, {"--record", link}),
             in_use(link, "--record")));
}

TEST_CASE("a second daemon does not keep black boxes in the folder of the first one",
          "[integration][daemon][recorder][bus]") {
  TwoDaemons daemons;
  CHECK(says(daemons.refusal({"--black-box", daemons.shared}), in_use(daemons.shared, "--black-box")));
}

TEST_CASE("a link to what the first daemon writes is the same file", "[integration][daemon][history][bus]") {
  TwoDaemons daemons;
  const std::string history = daemons.shared + "/history.sqlite";
  const std::string link = daemons.one.folder / "other.sqlite";
  std::filesystem::create_symlink(history, link);
  CHECK(says(daemons.refusal({"--history", history}, {"--history", link}), in_use(link, "--history")));
}

TEST_CASE("a daemon does not start beside a lock that it may not open, and says which",
          "[integration][daemon][state][bus]") {
  Bench bench;
  const std::string state = bench.folder / "state.json";
  // Even root cannot open a folder as a file.
  std::filesystem::create_directory(state + ".lock");
  bench.more_options = {"--state", state};
  bench.start_daemon();
  CHECK(bench.daemon->wait(test::hang_max) == 71);
  CHECK(says(read_file(bench.log), state + ".lock exists and cannot be opened, expected the lock file of " + state +
                                       "; remove it once no other bmud runs"));
  CHECK_FALSE(std::filesystem::exists(state));
}

TEST_CASE("a daemon starts on a disk that has gone read-only, and there, too, a second one does not",
          "[integration][daemon][state][bus]") {
  if (run_program({"/usr/bin/unshare", "-m", "true"}).status != 0) {
    WARN("skipped: no file system of its own for a process here");
    return;
  }
  TwoDaemons daemons;
  const std::string state = daemons.shared + "/state.json";
  static_cast<void>(daemons.refusal({"--state", state}));
  daemons.one.daemon->signal(SIGKILL);
  REQUIRE(daemons.one.daemon->wait(test::hang_max) == 128 + SIGKILL);
  // A user who may only read could hold it and keep the daemon from starting.
  using std::filesystem::perms;
  const perms of_others = std::filesystem::status(state + ".lock").permissions() & ~perms::owner_all;
  CHECK(of_others == perms::none);

  const auto start_read_only = [&daemons](Bench& bench) {
    std::vector<std::string> words{
        "/usr/bin/unshare", "-m", "sh", "-c", R"(mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@")",
        daemons.shared};
    const std::vector<std::string> command = bench.daemon_command();
    words.insert(words.end(), command.begin(), command.end());
    bench.daemon = std::make_unique<Process>(words, ProcessOptions{.err_file = bench.log});
  };
  static_cast<void>(daemons.one.listener.last());
  start_read_only(daemons.one);
  CHECK(daemons.one.listener.next(test::hang_max));
  start_read_only(daemons.other);
  CHECK(daemons.other.daemon->wait(test::hang_max) == 71);
  CHECK(says(read_file(daemons.other.log), in_use(state, "--state")));
}

TEST_CASE("a pipe where the lock should be keeps nobody waiting", "[integration][daemon][state][bus]") {
  Bench bench;
  const std::string state = bench.folder / "state.json";
  REQUIRE(::mkfifo((state + ".lock").c_str(), 0600) == 0);
  bench.more_options = {"--state", state};
  bench.start_daemon();
  CHECK(bench.listener.next(test::hang_max));
}

TEST_CASE("a second daemon does not write its lines over those of the first one", "[integration][daemon][gpio][bus]") {
  TwoDaemons daemons;
  const std::string lines = daemons.shared + "/driven-lines.json";
  CHECK(says(daemons.refusal({"--driven-lines", lines}), in_use(lines, "--driven-lines")));
}

}  // namespace bmu
