// The daemon sleeps until an event occurs. Its processor load is measured elsewhere (docs/performance.md); this test
// only verifies that it never spins on a persistent condition, which would take a whole processor.
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <string>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using test::Bench;

namespace {

/// A few percent are usual, about ten with sanitizers; a spinning process takes all of it, or half beside another such
/// test.
constexpr double most_of_a_processor = 0.3 * (test::is_sanitized ? 2 : 1);
constexpr milliseconds looked_for{2000};

nanoseconds processor_time_of(pid_t process) {
  clockid_t clock{};
  REQUIRE(::clock_getcpuclockid(process, &clock) == 0);
  timespec time{};
  REQUIRE(::clock_gettime(clock, &time) == 0);
  return std::chrono::seconds(time.tv_sec) + nanoseconds(time.tv_nsec);
}

void check_that_it_sleeps(Bench& bench, const std::string& when) {
  const nanoseconds before = processor_time_of(bench.daemon->pid());
  static_cast<void>(bench.listener.count_within(looked_for));
  const nanoseconds taken = processor_time_of(bench.daemon->pid()) - before;
  INFO(when);
  CHECK(static_cast<double>(taken.count()) <
        most_of_a_processor * static_cast<double>(nanoseconds(looked_for).count()));
}

}  // namespace

TEST_CASE("the daemon sleeps until something happens, whatever stays as it is",
          "[integration][daemon][BMS_NF.6][bus]") {
  Bench bench;
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  REQUIRE(bench.closes());
  check_that_it_sleeps(bench, "closed");

  const std::string pictures = bench.folder / "pictures";
  const Process reader({program("bmuctl"), "--socket", bench.socket, "--json", "watch"}, {.out_file = pictures});
  const auto has_read = [&](const ContactorOutputs&) {
    return std::filesystem::exists(pictures) && std::filesystem::file_size(pictures) > 0;
  };
  REQUIRE(bench.listener.hears(has_read, test::hang_max));
  reader.signal(SIGSTOP);
  check_that_it_sleeps(bench, "a client that reads no more");

  bench.emulator.reset();
  check_that_it_sleeps(bench, "nobody on the bus");
}

}  // namespace bmu
