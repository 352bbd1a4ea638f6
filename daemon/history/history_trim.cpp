#include "daemon/history/history_trim.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include <sqlite3.h>

#include "daemon/history/history_schema.hpp"

namespace bmu {

namespace {

constexpr std::int64_t rows_at_once = 60;
constexpr std::int64_t rows_by_age_at_once = 10;
constexpr std::int64_t events_at_once = 500;
constexpr std::int64_t pages_at_once = 64;
constexpr std::int64_t trust_after_s = 3'600;
constexpr std::int64_t clock_slack_ms = 120'000;
// The log is longer only during a long read; removing rows would make it longer still.
constexpr std::int64_t log_bytes_max = 4'000'000;
// Share of the size that stays free, for the log beside the database and the next rows.
constexpr std::int64_t size_reserve_permille = 20;

/// Times of one row, if they are known.
struct RowTimes {
  std::int64_t life = 0;
  std::int64_t unix_time_ms = 0;
  std::int64_t uptime_ms = 0;
  bool is_known = false;
};

DatabaseResult<RowTimes> times_of(const Database& database, std::int64_t sequence) {
  auto statement = database.prepare("SELECT life, unix_time_ms, uptime_ms FROM minute WHERE sequence = ?");
  if (!statement) return failure(statement.error());
  statement->bind(1, sequence);
  const auto has_row = statement->step();
  if (!has_row) return failure(has_row.error());
  if (!*has_row) return RowTimes{};
  RowTimes times{.life = statement->number(0).value_or(0),
                 .unix_time_ms = statement->number(1).value_or(-1),
                 .uptime_ms = statement->number(2).value_or(-1)};
  const auto is_time = [](std::int64_t ms) { return ms >= 0 && ms <= history_number_max; };
  times.is_known = is_time(times.unix_time_ms) && is_time(times.uptime_ms);
  return times;
}

/// The wall clock has matched the daemon's monotonic clock for an hour, within one session.
bool may_be_trusted(const RowTimes& before, const RowTimes& newest) {
  if (!before.is_known || !newest.is_known || before.life != newest.life) return false;
  const std::int64_t passed_ms = newest.uptime_ms - before.uptime_ms;
  return std::abs(newest.unix_time_ms - before.unix_time_ms - passed_ms) <= clock_slack_ms;
}

class Trim {
 public:
  Trim(const Database& database, const TrimOptions& options) : database_(database), options_(options) {}

  DatabaseResult<bool> run() {
    if (auto looked = look(); !looked) return failure(looked.error());
    if (first_ > 0) {
      if (auto aged = age(); !aged) return failure(aged.error());
      by_number();
      by_size();
      if (auto removed = remove(); !removed) return failure(removed.error());
    }
    return give_room_back();
  }

 private:
  DatabaseResult<void> look() {
    for (const auto& [to, sql] :
         {std::pair{&first_, "SELECT min(sequence) FROM minute"}, std::pair{&last_, "SELECT max(sequence) FROM minute"},
          std::pair{&first_event_, "SELECT min(sequence) FROM event"},
          std::pair{&last_event_, "SELECT max(sequence) FROM event"}, std::pair{&pages_, "PRAGMA page_count"},
          std::pair{&pages_free_, "PRAGMA freelist_count"}, std::pair{&page_bytes_, "PRAGMA page_size"}}) {
      const auto answer = database_.number(sql);
      if (!answer) return failure(answer.error());
      *to = answer->value_or(0);
      if (*to < 0 || *to > history_number_max) {
        return failure(DatabaseError{.code = SQLITE_CORRUPT, .what = "its rows are counted wrongly"});
      }
    }
    return {};
  }

  /// A row with a future or an unknown time blocks nothing: it is removed together with older rows after it.
  DatabaseResult<void> age() {
    const std::int64_t hour = std::max<std::int64_t>(1, trust_after_s / options_.period_s);
    const auto newest = times_of(database_, last_);
    if (!newest) return failure(newest.error());
    const auto before = times_of(database_, last_ - hour);
    if (!before) return failure(before.error());
    if (!may_be_trusted(*before, *newest)) return {};
    auto statement = database_.prepare(
        "SELECT max(sequence) FROM (SELECT sequence, unix_time_ms FROM minute ORDER BY sequence LIMIT ?) "
        "WHERE unix_time_ms < ?");
    if (!statement) return failure(statement.error());
    statement->bind(1, rows_by_age_at_once);
    statement->bind(2, newest->unix_time_ms - options_.keep_ms);
    const auto has_row = statement->step();
    if (!has_row) return failure(has_row.error());
    until_ = statement->number(0).value_or(0);
    return {};
  }

  void by_number() { take(last_ - options_.rows_max); }

  void by_size() {
    const std::int64_t used = (pages_ - pages_free_) * page_bytes_ + std::min(options_.log_bytes, log_bytes_max);
    const std::int64_t most = options_.size_max_bytes - options_.size_max_bytes / 1'000 * size_reserve_permille;
    if (used > most) take(last_ - 1);
  }

  /// Marks all rows up to this one for removal, limited to the number that may be removed at once.
  void take(std::int64_t sequence) {
    if (sequence < first_) return;
    const std::int64_t at_once = first_ + rows_at_once - 1;
    is_more_ = is_more_ || sequence > at_once;
    until_ = std::max(until_, std::min(sequence, at_once));
  }

  DatabaseResult<void> remove() {
    const bool has_rows = until_ >= first_;
    const bool has_events = last_event_ - first_event_ >= options_.events_max;
    if (!has_rows && !has_events) return {};
    auto done = database_.run("BEGIN IMMEDIATE; DELETE FROM minute WHERE sequence <= " + std::to_string(until_));
    if (done) done = remove_events(has_events);
    if (done) {
      done = database_.run(
          "DELETE FROM life WHERE id < (SELECT min(life) FROM ("
          "SELECT life FROM (SELECT life FROM minute ORDER BY sequence LIMIT 1) UNION ALL "
          "SELECT life FROM (SELECT life FROM event ORDER BY sequence LIMIT 1))); COMMIT");
    }
    return done;
  }

  /// Removes events from before the oldest row that is left, or the oldest ones if there are too many.
  DatabaseResult<void> remove_events(bool are_too_many) const {
    const std::string oldest = "SELECT sequence FROM event ORDER BY sequence LIMIT " + std::to_string(events_at_once);
    if (are_too_many) return database_.run("DELETE FROM event WHERE sequence IN (" + oldest + ")");
    return database_.run(
        "DELETE FROM event WHERE sequence IN (" + oldest +
        ") AND (life, uptime_ms) < (SELECT life, uptime_ms - span_ms FROM minute ORDER BY sequence LIMIT 1)");
  }

  DatabaseResult<bool> give_room_back() const {
    const auto free = database_.number("PRAGMA freelist_count");
    if (!free) return failure(free.error());
    if (free->value_or(0) <= pages_at_once) return is_more_;
    auto given = database_.run("PRAGMA incremental_vacuum(" + std::to_string(pages_at_once) + ")");
    if (!given) return failure(given.error());
    return true;
  }

  const Database& database_;
  const TrimOptions& options_;
  std::int64_t first_ = 0;  // 0: no rows
  std::int64_t last_ = 0;
  std::int64_t first_event_ = 0;
  std::int64_t last_event_ = 0;
  std::int64_t pages_ = 0;
  std::int64_t pages_free_ = 0;
  std::int64_t page_bytes_ = 0;
  std::int64_t until_ = 0;
  bool is_more_ = false;
};

}  // namespace

DatabaseResult<bool> trim_history(const Database& database, const TrimOptions& options) {
  return Trim(database, options).run();
}

}  // namespace bmu
