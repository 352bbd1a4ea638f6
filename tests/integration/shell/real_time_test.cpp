// The control loop with a real-time priority and locked memory: the real daemon, verified through the kernel.
#include <set>
#include <string>

#include <sched.h>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {

using std::chrono::milliseconds;
using test::Bench;

namespace {

constexpr int priority = 20;

/// The value of a line of /proc/PID/status, by its name.
std::string status_of(pid_t pid, const std::string& name) {
  std::istringstream lines(read_file("/proc/" + std::to_string(pid) + "/status"));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(name + ":")) return line.substr(name.size() + 1);
  }
  return "";
}

std::vector<pid_t> threads_of(pid_t pid) {
  std::vector<pid_t> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task")) {
    threads.push_back(std::stoi(entry.path().filename()));
  }
  return threads;
}

bool may_have_real_time() {
  const Finished tried = run_program({"/usr/bin/chrt", "-f", std::to_string(priority), "/bin/true"});
  return tried.status == 0 && ::geteuid() == 0;
}

}  // namespace

TEST_CASE("with a real-time priority the loop's thread has it, and no other", "[integration][real_time][bus]") {
  if (!may_have_real_time()) {
    WARN("skipped: not root, or no real-time scheduling here");
    return;
  }
  Bench bench;
  bench.more_options = {"--realtime-priority", std::to_string(priority), "--lock-memory", "--state",
                        bench.folder / "state.json"};
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  const pid_t pid = bench.daemon->pid();
  const std::vector<pid_t> threads = threads_of(pid);
  CHECK(threads.size() > 1);
  for (const pid_t thread : threads) {
    sched_param parameters{};
    REQUIRE(::sched_getparam(thread, &parameters) == 0);
    const int policy = ::sched_getscheduler(thread) & ~SCHED_RESET_ON_FORK;
    INFO("thread " << thread << " of process " << pid);
    CHECK(policy == (thread == pid ? SCHED_FIFO : SCHED_OTHER));
    CHECK(parameters.sched_priority == (thread == pid ? priority : 0));
  }
  if (test::is_sanitized) {
    WARN("skipped: a sanitizer has terabytes of its own: no pages are locked");
    return;
  }
  const auto locked_kB = std::stoll(status_of(pid, "VmLck"));
  const auto size_kB = std::stoll(status_of(pid, "VmSize"));
  CHECK(locked_kB > size_kB / 2);
  // Reserved address space, e.g. of the C library for each thread, is locked without being resident. Stacks are
  // resident.
  CHECK(std::stoll(status_of(pid, "VmRSS")) < 48 * 1024);
}

TEST_CASE("each thread of the daemon has a name that says what it does", "[integration][real_time][bus]") {
  Bench bench;
  bench.more_options = {"--state", bench.folder / "state.json", "--record", bench.folder / "drive"};
  bench.start_daemon();
  const std::set<std::string> expected{"bmud\n", "bmud-history\n", "bmud-log\n", "bmud-record\n", "bmud-state\n"};
  std::set<std::string> names;
  // A thread sets its name once it runs.
  const auto are_named = [&] {
    names.clear();
    const std::string tasks = "/proc/" + std::to_string(bench.daemon->pid()) + "/task/";
    for (const pid_t thread : threads_of(bench.daemon->pid())) {
      names.insert(read_file(tasks + std::to_string(thread) + "/comm"));
    }
    return names == expected;
  };
  const bool are_they = bench.becomes(are_named);
  CAPTURE(names);
  CHECK(are_they);
}

TEST_CASE("a real-time priority or locked memory that is refused is an error at the start, with what it needs",
          "[integration][real_time][bus]") {
  if (::geteuid() != 0) {
    WARN("skipped: not root: rights cannot be taken away from nobody who has none");
    return;
  }
  const Bench bench;
  const auto ends = [&](const std::vector<std::string>& options) {
    std::vector<std::string> words{"/usr/bin/setpriv", "--bounding-set=-sys_nice,-ipc_lock"};
    for (const std::string& word : bench.daemon_command()) words.push_back(word);
    words.insert(words.end(), options.begin(), options.end());
    words.insert(words.begin(), {"/usr/bin/prlimit", "--memlock=65536", "--rtprio=0"});
    return run_program(words);
  };
  const Finished no_priority = ends({"--realtime-priority", "20"});
  CHECK(no_priority.status == 71);
  CHECK(no_priority.err.find("--realtime-priority needs LimitRTPRIO=20 or more") != std::string::npos);
  CHECK(run_program({program("bmud"), "--realtime-priority", "100", bench.pack}).status == 2);
  if (test::is_sanitized) {
    WARN("skipped: a sanitizer has terabytes of its own: no pages are locked");
    return;
  }
  const Finished no_lock = ends({"--lock-memory"});
  CHECK(no_lock.status == 71);
  CHECK(no_lock.err.find("--lock-memory needs LimitMEMLOCK=infinity") != std::string::npos);
}

}  // namespace bmu
