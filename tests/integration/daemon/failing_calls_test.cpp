// The control loop's own system calls fail in a real daemon with a closed pack, and so do its memory allocations: a
// failure of an indispensable one opens the pack. A refused thread ends a start and rejects a reload.
#include "tests/support/failing_calls.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/shell/options.hpp"
#include "tests/support/ask_as.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/preload_word.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {

using test::Bench;
using test::FailingCall;
using test::is_closed;
using test::is_open;
using test::milliseconds;
using test::NotifySocket;
using test::steady_clock;

namespace {

/// A bench whose daemon runs with failing_calls.cpp.
struct FailingBench : Bench {
  std::string calls = folder / "calls";

  [[nodiscard]] bool closes_with_library(std::vector<std::string> environment = {}) {
    choose(FailingCall::none);
    start_emulator("");
    environment.push_back("LD_PRELOAD=" + test::in_build("lib/libfailing_calls.so"));
    environment.push_back("BMUD_TEST_FAILING_CALLS=" + calls);
    start_daemon({.environment = environment});
    REQUIRE(listener.next(test::hang_max));
    return closes();
  }
  void choose(FailingCall call) const { choose_number(static_cast<std::int64_t>(call)); }
  void choose_number(std::int64_t number) const { REQUIRE(test::set_preload_word(calls, number)); }
  [[nodiscard]] bool has_failed() const { return test::read_preload_word(calls) == 0; }
  /// True if the control loop is held in its wait for events; its commands are read meanwhile.
  [[nodiscard]] bool gets_held() {
    choose(FailingCall::wait_hangs);
    const auto give_up_at = steady_clock::now() + test::hang_max;
    constexpr auto held = static_cast<std::int64_t>(FailingCall::wait_is_held);
    while (test::read_preload_word(calls) != held) {
      if (steady_clock::now() > give_up_at) return false;
      static_cast<void>(listener.next(milliseconds(10)));
    }
    return true;
  }
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

/// A sanitizer allocates all memory by itself.
bool needs_other_library() {
  if (test::is_sanitized) WARN("memory of a sanitizer: nothing can fail");
  return test::is_sanitized;
}

enum class OpenedBy : std::uint8_t { anything, timeout };

/// Waits until the power distribution unit reports open contactors: it opens by itself after its command timeout.
bool unit_opens(BusPort& unit, OpenedBy opened_by = OpenedBy::anything) {
  using internal_bus::pdu_status;
  const auto give_up_at = steady_clock::now() + test::hang_max;
  while (steady_clock::now() < give_up_at) {
    ReceivedFrame received;
    if (unit.read(received) == ReadStatus::frame) {
      const CanFrame& frame = received.frame;
      const bool is_any_closed = read_raw<pdu_status, "main_positive_closed">(frame) != 0 ||
                                 read_raw<pdu_status, "main_negative_closed">(frame) != 0 ||
                                 read_raw<pdu_status, "precharge_closed">(frame) != 0;
      const bool is_by_timeout = read_raw<pdu_status, "opened_by_timeout">(frame) != 0;
      if (!is_any_closed) return opened_by == OpenedBy::anything || is_by_timeout;
      continue;
    }
    pollfd wait{.fd = unit.fd(), .events = POLLIN, .revents = 0};
    if (::poll(&wait, 1, static_cast<int>(test::hang_max.count())) <= 0) return false;
  }
  return false;
}

/// Behaviour of a daemon after a failed memory allocation.
struct Outcome {
  std::optional<int> exit_status;  // of a daemon that has ended
  bool is_decided = false;         // false: it neither ends nor commands
};

/// Queries the status, which allocates memory for its answer, until the allocation has failed or the daemon has ended;
/// then waits for its end, or for more commands than may be in transit.
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

namespace {

/// The daemon's threads, including the control loop.
std::ptrdiff_t thread_count(pid_t pid) {
  const std::filesystem::directory_iterator tasks("/proc/" + std::to_string(pid) + "/task");
  return std::distance(begin(tasks), end(tasks));
}

}  // namespace

TEST_CASE("a control loop that hangs feeds no watchdog, though the daemon's other threads run, and the unit opens",
          "[integration][daemon][F61][bus]") {
  const auto drive = [](FailingBench& made) {
    NotifySocket notify(made.folder / "notify");
    REQUIRE(made.closes_with_library({"NOTIFY_SOCKET=" + (made.folder / "notify"), "WATCHDOG_USEC=300000"}));
    const auto unit = open_bus(made.bus, {.receive_ids = {internal_bus::pdu_status.base_id}});
    REQUIRE(unit);
    notify.drain();
    CHECK(notify.hears("WATCHDOG=1", test::hang_max));
    REQUIRE(thread_count(made.daemon->pid()) > 1);

    REQUIRE(made.gets_held());
    const bool was_closed = is_closed(made.listener.last());
    notify.drain();
    // Longer than the watchdog timeout: the service manager would have ended the daemon.
    CHECK_FALSE(notify.next(milliseconds(400)));
    CHECK(made.listener.count_within(milliseconds(0)) == 0);
    const bool is_by_timeout = unit_opens(**unit, OpenedBy::timeout);

    // Its previous decision is 400 ms old.
    made.choose(FailingCall::none);
    const auto first = made.listener.next(test::hang_max);
    REQUIRE(first);
    CHECK(is_open(*first));
    CHECK(notify.hears("WATCHDOG=1", test::hang_max));
    CHECK(made.becomes([&] { return made.starved_count() > 0; }));
    return was_closed && is_by_timeout;
  };
  bool is_opened = false;
  static_cast<void>(test::driven<FailingBench>([&](FailingBench& made) { return is_opened = drive(made); }));
  CHECK(is_opened);
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
  // Allocations for an answer, for log lines of a client, and for the periodic work of a loop each second.
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
  // If freeing memory needs memory, as with a tree of JSON, the process can only abort.
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

namespace {

/// With a daemon that starts every thread it can have without a CAN interface: for the log, the state file, recordings,
/// the history, the serial console and the intake air.
struct ThreadBench : FailingBench {
  static constexpr int threads_at_start = 6;
  static constexpr int threads_of_reload = 5;  // those of log and state file go on, and one reads the pack file

  ThreadBench() {
    pack = folder / "pack.json";
    put_pack(100);
    std::ofstream(folder / "air") << "21000\n";
    more_options = {"--state",     folder / "state.json", "--history", folder / "history.sqlite",
                    "--black-box", folder / "black-box"};
  }
  void put_pack(int period_ms) const {
    nlohmann::json content = nlohmann::json::parse(read_file(test::pack_file), nullptr, true, true);
    content["cell"] = test::in_source("config/cells/") +
                      std::filesystem::path(content.at("cell").get<std::string>()).filename().string();
    content["poll"]["period_ms"] = period_ms;
    content["serial"] = {{"device", "/dev/bmud-test-no-such-terminal"}};
    content["intake_air"] = {{"source", "file"}, {"file", folder / "air"}, {"age_max_ms", 2'000}};
    std::ofstream(pack) << content;
  }
  void start() {
    start_daemon({.environment = {"LD_PRELOAD=" + test::in_build("lib/libfailing_calls.so"),
                                  "BMUD_TEST_FAILING_CALLS=" + calls}});
  }
  [[nodiscard]] std::string hash() const { return ask_json("status").at("pack").at("config_hash"); }
};

constexpr const char* thread_refused = ": Resource temporarily unavailable";

}  // namespace

TEST_CASE("a daemon that is refused a thread at its start ends, and names the thread",
          "[integration][daemon][F71][bus]") {
  for (int n = 1; n <= ThreadBench::threads_at_start; ++n) {
    CAPTURE(n);
    ThreadBench bench;
    bench.choose_number(test::thread_start(n));
    bench.start();
    CHECK(bench.daemon->wait(test::hang_max) == exit_system);
    const std::string log = read_file(bench.log);
    INFO(log);
    CHECK(log.find("start the thread ") != std::string::npos);
    CHECK(log.find(thread_refused) != std::string::npos);
    CHECK(bench.has_failed());
  }
  ThreadBench bench;
  bench.choose_number(test::thread_start(ThreadBench::threads_at_start + 1));
  bench.start();
  REQUIRE(bench.listener.next(test::hang_max));
  CHECK_FALSE(bench.has_failed());  // there is no thread more
}

TEST_CASE("a reload that is refused a thread leaves the configuration as it was",
          "[integration][daemon][reload][bus]") {
  ThreadBench bench;
  bench.choose(FailingCall::none);
  bench.start_emulator("");
  bench.start();
  REQUIRE(bench.listener.next(test::hang_max));
  const std::string before = bench.hash();
  const auto reload = [&bench] { return test::ask_as(std::nullopt, bench.socket, R"({"cmd":"reload"})"); };
  bench.put_pack(90);
  for (int n = 1; n <= ThreadBench::threads_of_reload; ++n) {
    CAPTURE(n);
    bench.choose_number(test::thread_start(n));
    const nlohmann::json reply = reload();
    INFO(reply << read_file(bench.log));
    CHECK(reply.at("ok") == false);
    CHECK(reply.dump().find("start the thread ") != std::string::npos);
    CHECK(reply.dump().find(thread_refused) != std::string::npos);
    CHECK(bench.has_failed());
    CHECK(bench.hash() == before);
    CHECK(bench.becomes([&] { return bench.ask_json("status").at("modules_answering") == 4; }));
  }
  bench.choose_number(test::thread_start(ThreadBench::threads_of_reload + 1));
  CHECK(reload().at("ok") == true);
  CHECK_FALSE(bench.has_failed());  // there is no thread more
  CHECK(bench.hash() != before);
}

}  // namespace bmu
