// Suspend of the machine, as seen by the daemon after the resume: the real daemon, with a clock that leaps.
#include "tests/support/daemon_bench.hpp"
#include "tests/support/preload_word.hpp"

namespace bmu {

using std::chrono::milliseconds;
using test::Bench;
using test::is_closed;
using test::is_open;

namespace {

struct SleepBench : Bench {
  std::string slept = folder / "slept";

  void start() {
    REQUIRE(test::set_preload_word(slept, 0));
    start_emulator("");
    start_daemon(
        {.environment = {"LD_PRELOAD=" + test::in_build("lib/libsleeping_clock.so"), "BMUD_TEST_SLEPT=" + slept}});
    REQUIRE(listener.next(test::hang_max));
    REQUIRE(closes());
  }
  /// Held up by another cause than the suspend, which is one stall of its loop.
  [[nodiscard]] bool was_held_up() const { return Bench::was_held_up(1); }
};

/// Either cause may be detected first: the stall, or the missing echo of its last command.
bool is_of_sleep(const std::string& fault) {
  return fault == "control_loop_gap" || fault == "command_not_on_bus";
}

}  // namespace

TEST_CASE("a machine that slept has been away: the pack is opened first, and closes only for a new wish",
          "[integration][daemon][F69][bus]") {
  std::string fault;
  const auto bench = test::driven<SleepBench>([&fault](SleepBench& made) {
    made.start();
    REQUIRE(test::set_preload_word(made.slept, 60'000));
    REQUIRE(made.listener.hears(is_open, test::hang_max));
    CHECK_FALSE(made.listener.hears(is_closed, milliseconds(1500)));
    fault = made.ask_json("status").at("last_opening").at("fault");
    return is_of_sleep(fault);
  });
  INFO(fault);
  REQUIRE(is_of_sleep(fault));
  // Without other nodes on the bus only its timer wakes it, which must use the same clock.
  bench->emulator.reset();
  static_cast<void>(bench->listener.last());
  CHECK(bench->listener.hears_commands(10));
}

}  // namespace bmu
