// Thread of the history: callers never wait for it, whatever the disk does, and it reports rows that it could not
// write.
#include "daemon/history/history_store.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/history/bounded_queue.hpp"
#include "daemon/history/history_tap.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/faulty_vfs.hpp"
#include "tests/support/history_rows.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {

using std::chrono::steady_clock;
using test::count;
using test::FaultyDisk;
using test::life_of;
using test::read_all;

namespace {

// Offering copies about 50 kB. A caller that waits for a hanging disk would wait until the test releases it; no busy
// host delays a caller for as long as this.
constexpr auto offer_max = std::chrono::seconds(30);
constexpr Duration long_enough = 60s;

std::unique_ptr<Minute> minute_of(std::int64_t number) {
  auto minute = std::make_unique<Minute>();
  minute->uptime = number * 60s;
  minute->span = 60s;
  minute->unix_time_ms = test::history_begin_ms + number * test::minute_ms;
  minute->cell_count = 12;
  minute->sensor_count = 8;
  minute->cells[0].voltage_uV = {.average = 3'300'000, .min = 3'300'000, .max = 3'300'000, .samples = 600};
  return minute;
}

struct Stored {
  explicit Stored(const std::string& vfs = "", std::size_t waiting_max = 16)
      : store({.file = {.path = path, .vfs = vfs},
               .write_every = 5ms,
               .retry = 10ms,
               .minutes_waiting_max = waiting_max,
               .events_waiting_max = 64},
              life_of(1)) {}

  void offer(std::int64_t number) {
    const auto begin = steady_clock::now();
    store.offer(*minute_of(number));
    store.offer(TimedEvent{
        .event = {.id = EventId::port_up}, .number = static_cast<std::uint64_t>(number), .uptime = number * 60s});
    static_cast<void>(store.health());
    longest = std::max(longest, steady_clock::now() - begin);
  }
  /// Polls until the condition is met; the thread runs in its own time.
  [[nodiscard]] bool becomes(const std::function<bool(const HistoryHealth&)>& is_so) const {
    const auto deadline = steady_clock::now() + long_enough;
    while (steady_clock::now() < deadline) {
      if (is_so(store.health())) return true;
      std::this_thread::yield();
    }
    return false;
  }
  [[nodiscard]] bool becomes(HistoryState state) const {
    return becomes([state](const HistoryHealth& health) { return health.state == state; });
  }

  TemporaryFolder folder;
  std::string path = folder / "history.sqlite";
  HistoryStore store;
  steady_clock::duration longest{};
};

}  // namespace

TEST_CASE("what is offered is written in its order", "[unit][history][BMS_F.5]") {
  Stored stored;
  stored.store.start();
  for (std::int64_t number = 1; number <= 10; ++number) stored.offer(number);
  REQUIRE(stored.store.flush(long_enough));
  const auto all = read_all(stored.path);
  CHECK(all.minutes() == count(1, 10));
  REQUIRE(all.events.size() == 10);
  CHECK(all.events[0].text == to_text(Event{.id = EventId::port_up}));
  CHECK(all.events[0].severity == "info");
  CHECK(all.rows[0].cells[0].voltage_average_uV == 3'300'000);
  const HistoryHealth health = stored.store.health();
  CHECK(health.rows_written == 10);
  CHECK(health.events_written == 10);
  CHECK(health.rows_lost == 0);
  CHECK(health.size_bytes > 0);
  CHECK(stored.becomes(HistoryState::writing));
}

TEST_CASE("a disk that hangs holds nobody up, and what does not fit is counted", "[unit][history][BMS_F.5]") {
  FaultyDisk& disk = FaultyDisk::well();
  Stored stored(FaultyDisk::name, 4);
  stored.store.start();
  REQUIRE(stored.becomes(HistoryState::writing));
  disk.hang();
  for (std::int64_t number = 1; number <= 7; ++number) stored.offer(number);
  CHECK(stored.longest < offer_max);
  CHECK(stored.store.health().rows_lost == 3);
  CHECK(stored.store.health().rows_waiting == 4);
  CHECK_FALSE(stored.store.flush(1ms));
  disk.let_go();
  REQUIRE(stored.store.flush(long_enough));
  CHECK(read_all(stored.path).minutes() == count(1, 4));
}

TEST_CASE("a thread that hangs in the disk is given up at the end", "[unit][history]") {
  FaultyDisk& disk = FaultyDisk::well();
  const TemporaryFolder folder;
  const auto began_at = steady_clock::now();
  {
    HistoryStore store({.file = {.path = folder / "history.sqlite", .vfs = FaultyDisk::name}}, life_of(1));
    disk.hang();
    store.start();
    store.offer(*minute_of(1));
  }
  CHECK(steady_clock::now() - began_at < long_enough);  // the disk hangs permanently
  disk.let_go();
  // Once released, it writes the pending minute before it ends by itself.
  const std::string path = folder / "history.sqlite";
  const auto has_written = [&path] {
    auto reader = HistoryReader::open(path);
    return reader && read_all(*reader).minutes() == count(1, 1);
  };
  const auto deadline = steady_clock::now() + std::chrono::seconds(60);
  while (!has_written() && steady_clock::now() < deadline) std::this_thread::yield();
  CHECK(has_written());
}

TEST_CASE("a full disk is told, loses nothing that waits, and is forgotten when there is room",
          "[unit][history][BMS_F.5]") {
  FaultyDisk& disk = FaultyDisk::well();
  Stored stored(FaultyDisk::name);
  stored.store.start();
  stored.offer(1);
  REQUIRE(stored.store.flush(long_enough));
  disk.fail_writes(1, SQLITE_FULL);
  stored.offer(2);
  REQUIRE(stored.becomes(HistoryState::failing));
  CHECK(stored.store.is_failing());
  CHECK(
      stored.becomes([](const HistoryHealth& health) { return health.last_error.find("full") != std::string::npos; }));
  stored.offer(3);
  disk.heal();
  REQUIRE(stored.becomes([](const HistoryHealth& health) { return health.rows_written == 3; }));
  REQUIRE(stored.becomes(HistoryState::writing));
  CHECK(stored.becomes([](const HistoryHealth& health) { return health.last_error.empty(); }));
  CHECK(stored.longest < offer_max);
  CHECK(read_all(stored.path).minutes() == count(1, 3));
}

TEST_CASE("a history that becomes damaged under way is put aside, and the minute in hand begins the new one",
          "[unit][history]") {
  Stored stored;
  stored.store.start();
  stored.offer(1);
  REQUIRE(stored.store.flush(long_enough));
  // Other content under the same name: the thread must open the file again.
  stored.folder.file("other", std::string(30'000, 'x'));
  std::filesystem::rename(stored.folder / "other", stored.path);
  stored.offer(2);
  REQUIRE(stored.becomes([](const HistoryHealth& health) { return !health.put_aside.empty(); }));
  REQUIRE(stored.store.flush(long_enough));
  CHECK(read_all(stored.path).minutes() == count(2, 2));
  const std::string aside = stored.store.health().put_aside;
  CHECK(aside.starts_with(stored.path + ".damaged-"));
  CHECK(std::filesystem::file_size(aside) == 30'000);
}

TEST_CASE("a folder that is not there is told, and written to once it is", "[unit][history]") {
  const TemporaryFolder folder;
  HistoryStore store({.file = {.path = folder / "later/history.sqlite"}, .write_every = 5ms, .retry = 10ms},
                     life_of(1));
  store.start();
  store.offer(*minute_of(1));
  CHECK_FALSE(store.flush(long_enough));  // until the next attempt has failed
  CHECK(store.is_failing());
  std::filesystem::create_directory(folder / "later");
  const auto deadline = steady_clock::now() + std::chrono::seconds(60);
  while (!store.flush(100ms) && steady_clock::now() < deadline) {
  }
  CHECK(read_all(folder / "later/history.sqlite").minutes() == count(1, 1));
}

TEST_CASE("without a path nothing is kept, and nothing is wrong", "[unit][history]") {
  HistoryStore store({}, life_of(1));
  store.start();
  store.offer(*minute_of(1));
  CHECK(store.flush(1ms));
  CHECK(store.health().state == HistoryState::off);
  CHECK(store.health().rows_lost == 0);
}

TEST_CASE("the queue between the threads keeps order and says when it is full", "[unit][history]") {
  BoundedQueue<std::uint32_t> queue(7);
  constexpr std::uint32_t last = 200'000;
  std::thread pusher([&queue] {
    for (std::uint32_t number = 1; number <= last;) {
      if (queue.push(number)) ++number;
    }
  });
  std::uint32_t wanted = 1;
  bool is_in_order = true;
  while (wanted <= last) {
    const std::size_t there = queue.size();
    for (std::size_t index = 0; index < there; ++index) is_in_order = is_in_order && queue[index] == wanted++;
    queue.pop(there);
  }
  pusher.join();
  CHECK(is_in_order);
  for (std::uint32_t number = 0; number < 7; ++number) CHECK(queue.push(number));
  CHECK_FALSE(queue.push(7));
  CHECK(queue.size() == 7);
}

TEST_CASE("the tap keeps minutes and events of a core, and says once what becomes of them", "[unit][history]") {
  const TemporaryFolder folder;
  std::vector<std::string> lines;
  test::CoreBench bench(test::small_pack());
  HistoryLife life = life_of(1);
  life.layout = layout_of(bench.core().config());
  HistoryStore store({.file = {.path = folder / "later/history.sqlite"}, .write_every = 5ms, .retry = 10ms}, life);
  HistoryTap tap(bench.core(), store, 60s, [&](Severity severity, std::string_view line) {
    lines.push_back((severity == Severity::warning ? "warning: " : "") + std::string(line));
  });
  std::size_t told = 0;
  bench.each_ms = [&] {
    Decisions decisions;
    for (; told < bench.events().size() && decisions.events.size() < events_per_tick; ++told) {
      decisions.events.push_back(bench.events()[told]);
    }
    tap.decided(bench.now(), decisions);
  };
  store.start();
  while (!store.is_failing()) std::this_thread::yield();
  bench.run(5s);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].starts_with("warning: history: write failed: "));
  std::filesystem::create_directory(folder / "later");
  while (store.health().state != HistoryState::writing) std::this_thread::yield();
  bench.run(3s);
  REQUIRE(lines.size() == 2);
  CHECK(lines[1].ends_with("history.sqlite: writing resumed"));
  tap.finish();
  REQUIRE(store.flush(long_enough));
  const auto all = read_all(folder / "later/history.sqlite");
  REQUIRE(all.rows.size() == 1);
  CHECK(all.rows[0].cells.size() == 8);
  CHECK(all.problems.empty());
  CHECK_FALSE(all.events.empty());
}

TEST_CASE("rows that were lost are told as rows, however long each was to be", "[unit][history]") {
  const TemporaryFolder folder;
  std::vector<std::string> lines;
  test::CoreBench bench(test::small_pack());
  HistoryLife life = life_of(1);
  life.layout = layout_of(bench.core().config());
  life.period_s = 1;
  HistoryStore store(
      {.file = {.path = folder / "later/history.sqlite"}, .write_every = 5ms, .retry = 10ms, .minutes_waiting_max = 2},
      life);
  HistoryTap tap(bench.core(), store, 1s, [&](Severity, std::string_view line) { lines.emplace_back(line); });
  bench.each_ms = [&] { tap.decided(bench.now(), {}); };
  store.start();
  while (!store.is_failing()) std::this_thread::yield();
  bench.run(10s);
  const std::uint64_t lost = store.health().rows_lost;
  CHECK(lost > 1);
  std::filesystem::create_directory(folder / "later");
  while (store.health().state != HistoryState::writing) std::this_thread::yield();
  bench.run(1100ms);
  REQUIRE(lines.size() == 2);
  CHECK(lines[1].ends_with("history.sqlite: writing resumed; " + std::to_string(lost) + " rows lost"));
}

}  // namespace bmu
