// The control loop's own system calls fail in a real daemon whose pack is closed: what it cannot do without opens the
// pack.
#include "tests/support/failing_calls.hpp"

#include "daemon/shell/options.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/preload_word.hpp"

namespace bmu {

using test::Bench;
using test::FailingCall;
using test::is_closed;
using test::is_open;

namespace {

/// A bench whose daemon runs with failing_calls.cpp.
struct FailingBench : Bench {
  std::string calls = folder / "calls";

  [[nodiscard]] bool closes_with_library() {
    choose(FailingCall::none);
    start_emulator("");
    start_daemon({.environment = {"LD_PRELOAD=" + test::in_build("lib/libfailing_calls.so"),
                                  "BMUD_TEST_FAILING_CALLS=" + calls}});
    REQUIRE(listener.next(test::hang_max));
    return closes();
  }
  void choose(FailingCall call) const { REQUIRE(test::set_preload_word(calls, static_cast<std::int64_t>(call))); }
};

void expect_end(FailingCall call, const std::string& name) {
  FailingBench bench;
  REQUIRE(bench.closes_with_library());
  bench.choose(call);
  CHECK(bench.daemon->wait(test::hang_max) == exit_system);
  CHECK(is_open(bench.listener.last()));
  const std::string log = read_file(bench.log);
  INFO(log);
  CHECK(log.find(name) != std::string::npos);
}

}  // namespace

TEST_CASE("a control loop that cannot wait for events opens the pack and ends with an error",
          "[integration][daemon][F71][bus]") {
  expect_end(FailingCall::wait, "epoll_wait");
}

TEST_CASE("a control loop that cannot set its timer opens the pack and ends with an error",
          "[integration][daemon][F71][bus]") {
  expect_end(FailingCall::timer, "timerfd_settime");
}

TEST_CASE("a control loop that is woken without an event, again and again, decides as before",
          "[integration][daemon][F71][bus]") {
  bool stays_closed = false;
  static_cast<void>(test::driven<FailingBench>([&stays_closed](FailingBench& made) {
    REQUIRE(made.closes_with_library());
    made.choose(FailingCall::wait_returns_at_once);
    stays_closed = true;
    for (int command = 0; command < 20 && stays_closed; ++command) {
      const auto outputs = made.listener.next(test::hang_max);
      REQUIRE(outputs);
      stays_closed = is_closed(*outputs);
    }
    return stays_closed;
  }));
  CHECK(stays_closed);
}

}  // namespace bmu
