// The control loop's own system calls fail in a real daemon whose pack is closed, and so do its requests for memory:
// what it cannot do without opens the pack.
#include "tests/support/failing_calls.hpp"

#include "daemon/shell/options.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/preload_word.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {

using test::Bench;
using test::FailingCall;
using test::is_closed;
using test::is_open;
using test::milliseconds;
using test::steady_clock;

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
  void choose(FailingCall call) const { choose_number(static_cast<std::int64_t>(call)); }
  void choose_number(std::int64_t number) const { REQUIRE(test::set_preload_word(calls, number)); }
  [[nodiscard]] bool has_failed() const { return test::read_preload_word(calls) == 0; }
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

/// A sanitizer takes all memory by itself.
bool needs_other_library() {
  if (test::is_sanitized) WARN("memory of a sanitizer: nothing can fail");
  return test::is_sanitized;
}

/// The power distribution unit reports open contactors: it opens by itself where no command comes any more.
bool unit_opens(BusPort& unit) {
  using internal_bus::pdu_status;
  const auto give_up_at = steady_clock::now() + test::hang_max;
  while (steady_clock::now() < give_up_at) {
    ReceivedFrame received;
    if (unit.read(received) == ReadStatus::frame) {
      const CanFrame& frame = received.frame;
      const bool is_any_closed = read_raw<pdu_status, "main_positive_closed">(frame) != 0 ||
                                 read_raw<pdu_status, "main_negative_closed">(frame) != 0 ||
                                 read_raw<pdu_status, "precharge_closed">(frame) != 0;
      if (!is_any_closed) return true;
      continue;
    }
    pollfd wait{.fd = unit.fd(), .events = POLLIN, .revents = 0};
    if (::poll(&wait, 1, static_cast<int>(test::hang_max.count())) <= 0) return false;
  }
  return false;
}

/// How a daemon goes on in which a request for memory fails.
struct Outcome {
  std::optional<int> exit_status;  // of a daemon that has ended
  bool is_decided = false;         // false: it neither ends nor commands
};

/// Queries the status, whose answer takes memory, until the request has failed or the daemon has ended; then waits for
/// its end, or for more commands than are on their way.
Outcome after_failed_request(FailingBench& bench) {
  constexpr int commands_on_their_way = 5;
  const auto give_up_at = steady_clock::now() + test::hang_max;
  for (int commands = 0; commands <= commands_on_their_way && steady_clock::now() < give_up_at;) {
    if (!bench.has_failed()) static_cast<void>(bench.ask({"status"}));
    const bool is_heard = bench.listener.next(milliseconds(100)).has_value();
    if (const int status = bench.daemon->wait(milliseconds(0)); status >= 0) return {status, true};
    if (is_heard && bench.has_failed()) ++commands;
  }
  return {std::nullopt, steady_clock::now() < give_up_at};
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

TEST_CASE("a control loop that gets no memory for one request ends with the pack open, or goes on",
          "[integration][daemon][F66][bus][slow]") {
  if (needs_other_library()) return;
  // Of an answer, of what is logged of a client, and of what a loop takes each second.
  const std::int64_t n = GENERATE(1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233);
  CAPTURE(n);
  FailingBench bench;
  REQUIRE(bench.closes_with_library());
  const auto unit = open_bus(bench.bus, {.receive_ids = {internal_bus::pdu_status.base_id}});
  REQUIRE(unit);
  bench.choose_number(test::memory_request(n));
  const Outcome outcome = after_failed_request(bench);
  const std::string log = read_file(bench.log);
  INFO(log);
  REQUIRE(outcome.is_decided);
  if (!outcome.exit_status) {
    CHECK(bench.ask({"status"}).status == 0);
    return;
  }
  CHECK(unit_opens(**unit));
  // Where memory is needed to give memory back, as in a tree of JSON, the process can only be ended.
  if (*outcome.exit_status == 128 + SIGABRT) return;
  CHECK(*outcome.exit_status == exit_system);
  CHECK(is_open(bench.listener.last()));
  CHECK(log.find("memory for the control loop") != std::string::npos);
}

TEST_CASE("a control loop that gets no memory any more ends with the pack open",
          "[integration][daemon][F66][bus][slow]") {
  if (needs_other_library()) return;
  const std::int64_t n = GENERATE(1, 10, 100);
  CAPTURE(n);
  FailingBench bench;
  REQUIRE(bench.closes_with_library());
  const auto unit = open_bus(bench.bus, {.receive_ids = {internal_bus::pdu_status.base_id}});
  REQUIRE(unit);
  bench.choose_number(test::memory_requests_from(n));
  const Outcome outcome = after_failed_request(bench);
  INFO(read_file(bench.log));
  REQUIRE(outcome.exit_status);
  CHECK(*outcome.exit_status != exit_ok);
  CHECK(unit_opens(**unit));
}

}  // namespace bmu
