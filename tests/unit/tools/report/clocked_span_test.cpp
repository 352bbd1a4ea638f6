// Content of a history for a time span if its clock was set while the daemon ran, or never.
#include "tools/report/clocked_span.hpp"

#include <string>
#include <vector>

#include "tests/support/history_rows.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;
using report::ClockedSpan;
using test::history_begin_ms;
using test::history_row;
using test::life_of;
using test::minute_ms;

namespace {

/// Adds ten minutes and their events from 2026-03-01 12:00 UTC and `later` minutes on, with a clock that is correct
/// from minute `set_from` on, and before it shows `ahead_ms` plus the time since the daemon's start.
void add_life(const std::string& path, const std::string& token, std::int64_t later, std::int64_t set_from,
              std::int64_t ahead_ms = 0) {
  const HistoryLife life = life_of(1, token);
  HistoryFile file({.path = path}, life);
  std::vector<HistoryRow> rows;
  std::vector<HistoryEvent> events;
  for (std::int64_t minute = 1; minute <= 10; ++minute) {
    const std::int64_t at_start_ms = minute < set_from ? ahead_ms : history_begin_ms + later * minute_ms;
    rows.push_back(history_row(minute, life));
    rows.back().unix_time_ms = at_start_ms + (minute - 1) * minute_ms;
    events.push_back(test::history_event(minute));
    events.back().unix_time_ms = at_start_ms + minute * minute_ms;
  }
  REQUIRE(file.write(rows, events));
}

HistoryNumber at_minute(std::int64_t minute) {
  return history_begin_ms + minute * minute_ms;
}

struct Read {
  std::vector<std::int64_t> rows;  // minutes after 12:00 UTC
  std::vector<std::int64_t> events;
  std::size_t of_no_time = 0;
};

Read read(const std::string& path, const HistorySpan& span) {
  auto history = HistoryReader::open(path);
  REQUIRE(history);
  ClockedSpan clocked(*history, span);
  Read found{.of_no_time = clocked.rows_of_no_time()};
  clocked.for_each_row([&](const HistoryRow& row) {
    found.rows.push_back((row.unix_time_ms.value_or(0) - history_begin_ms) / minute_ms);
    return true;
  });
  clocked.for_each_event([&](const HistoryEvent& event) {
    found.events.push_back((event.unix_time_ms.value_or(0) - history_begin_ms) / minute_ms);
    return true;
  });
  CHECK(history->problems().empty());
  return found;
}

using Minutes = std::vector<std::int64_t>;

}  // namespace

TEST_CASE("minutes and events from before the clock was set are where they were", "[unit][history][clock]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  // In 1970, hours behind or ahead, always correct.
  const std::int64_t ahead_ms =
      GENERATE(12'000, history_begin_ms - 7'200'000, history_begin_ms + 7'200'000, history_begin_ms);
  add_life(path, "one", 0, 6, ahead_ms);
  const Read all = read(path, {.from_unix_ms = at_minute(0)});
  CHECK(all.rows == Minutes{0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  CHECK(all.events == Minutes{1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  CHECK(all.of_no_time == 0);
  const Read some = read(path, {.from_unix_ms = at_minute(3), .to_unix_ms = at_minute(7)});
  CHECK(some.rows == Minutes{3, 4, 5, 6});
  CHECK(some.events == Minutes{3, 4, 5, 6});
  // The setting is after the span.
  CHECK(read(path, {.from_unix_ms = at_minute(1), .to_unix_ms = at_minute(3)}).rows == Minutes{1, 2});
  CHECK(read(path, {.to_unix_ms = at_minute(2)}).rows == Minutes{0, 1});
  CHECK(read(path, {.from_unix_ms = at_minute(20)}).rows.empty());
}

TEST_CASE("without a span all rows are there, with the times as they were written", "[unit][history][clock]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  add_life(path, "one", 0, 6, 12'000);
  const Read all = read(path, {});
  REQUIRE(all.rows.size() == 10);
  CHECK(all.rows[0] == (12'000 - history_begin_ms) / minute_ms);
  CHECK(all.rows[9] == 9);
  CHECK(all.of_no_time == 0);
}

TEST_CASE("minutes of lives in which the clock was never set are counted where they may belong",
          "[unit][history][clock]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  add_life(path, "one", 0, 1);
  add_life(path, "two", 0, 11, 5'000);
  // No row is later than those without a time.
  CHECK(read(path, {.from_unix_ms = at_minute(5)}).of_no_time == 10);
  CHECK(read(path, {.from_unix_ms = at_minute(500)}).of_no_time == 10);
  CHECK(read(path, {.from_unix_ms = at_minute(0), .to_unix_ms = at_minute(5)}).of_no_time == 0);
  add_life(path, "three", 100, 1);
  CHECK(read(path, {.from_unix_ms = at_minute(5)}).of_no_time == 10);
  CHECK(read(path, {.from_unix_ms = at_minute(5), .to_unix_ms = at_minute(50)}).of_no_time == 10);
  CHECK(read(path, {.from_unix_ms = at_minute(105)}).of_no_time == 0);
  CHECK(read(path, {.from_unix_ms = at_minute(500)}).of_no_time == 0);
  CHECK(read(path, {.from_unix_ms = at_minute(5)}).rows.size() == 5 + 10);
}
