// A machine that sleeps, as its daemon sees it when both are awake again: the real daemon, with a clock that leaps.
#include "tests/support/daemon_bench.hpp"
#include "tests/support/preload_word.hpp"

namespace bmu {

using std::chrono::milliseconds;
using test::Bench;
using test::is_closed;
using test::is_open;

TEST_CASE("a machine that slept has been away: the pack is opened first, and closes only for a new wish",
          "[integration][daemon][F69][bus]") {
  Bench bench;
  const std::string slept = bench.folder / "slept";
  REQUIRE(test::set_preload_word(slept, 0));
  bench.start_emulator("");
  bench.start_daemon(
      {.environment = {"LD_PRELOAD=" + test::in_build("lib/libsleeping_clock.so"), "BMUD_TEST_SLEPT=" + slept}});
  REQUIRE(bench.listener.next(test::hang_max));
  REQUIRE(bench.closes());
  REQUIRE(test::set_preload_word(slept, 60'000));
  REQUIRE(bench.listener.hears(is_open, test::hang_max));
  CHECK_FALSE(bench.listener.hears(is_closed, milliseconds(1500)));
  // Whichever it sees first: that it was away, or that its last command has not been heard on the bus for so long.
  const std::string fault = bench.ask_json("status").at("last_opening").at("fault");
  INFO(fault);
  CHECK((fault == "control_loop_gap" || fault == "command_not_on_bus"));
  // With nobody on the bus only its timer wakes it, which has to be one of the same clock.
  bench.emulator.reset();
  static_cast<void>(bench.listener.last());
  CHECK(bench.listener.hears_commands(10));
}

}  // namespace bmu
