#include "daemon/history/history_store.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

#include "daemon/history/bounded_queue.hpp"
#include "daemon/history/helper_thread.hpp"

namespace bmu {

namespace {

using std::chrono::steady_clock;

/// What a destructor may wait for a write that is under way.
constexpr Duration end_max = 200ms;
// A transaction of more would hold what waits behind it.
constexpr std::size_t events_at_once = 256;

}  // namespace

std::string_view to_text(HistoryState state) {
  switch (state) {
    case HistoryState::off: return "off";
    case HistoryState::starting: return "starting";
    case HistoryState::writing: return "writing";
    case HistoryState::failing: return "failing";
  }
  return "?";
}

struct HistoryStore::Shared {
  Shared(const HistoryStoreOptions& the_options, const HistoryLife& the_life)
      : options(the_options),
        layout(the_life.layout),
        minutes(the_options.minutes_waiting_max),
        events(the_options.events_waiting_max),
        file(the_options.file, the_life) {}

  const HistoryStoreOptions options;
  const HistoryLayout layout;
  BoundedQueue<Minute> minutes;
  BoundedQueue<TimedEvent> events;
  HistoryFile file;  // the thread's alone, once it runs

  std::mutex mutex;
  std::condition_variable changed;
  bool is_wanted_now = false;  // somebody waits for what is in the queues
  bool has_to_end = false;
  bool is_running = false;
  std::uint64_t tries_failed = 0;
  std::string last_error;
  std::string put_aside;

  std::atomic<HistoryState> state = HistoryState::off;
  std::atomic<std::uint64_t> rows_written = 0;
  std::atomic<std::uint64_t> events_written = 0;
  std::atomic<std::uint64_t> rows_lost = 0;
  std::atomic<std::uint64_t> events_lost = 0;
  std::atomic<std::int64_t> size_bytes = 0;

  void run();
  [[nodiscard]] bool has_work() const { return minutes.size() > 0 || events.size() > 0; }
  [[nodiscard]] bool work();
  [[nodiscard]] HistoryResult<void> write();
  [[nodiscard]] HistoryResult<void> trim();
  void note(const HistoryError& error);
  void note_well();
};

void HistoryStore::Shared::run() {
  bool was_good = work();
  auto tried_at = steady_clock::now();
  std::unique_lock lock(mutex);
  while (true) {
    const auto next = tried_at + (was_good ? options.write_every : options.retry);
    changed.wait_until(lock, next, [&] { return has_to_end || (is_wanted_now && has_work()); });
    const bool is_end = has_to_end;
    is_wanted_now = false;
    lock.unlock();
    if (!is_end || has_work()) was_good = work();
    tried_at = steady_clock::now();
    // Before the lock is taken again: closing writes the log out.
    if (is_end) file.close();
    lock.lock();
    if (is_end) break;
    changed.notify_all();
  }
  is_running = false;
  changed.notify_all();
}

/// False: it has to be tried again, later.
bool HistoryStore::Shared::work() {
  auto done = file.open();
  while (done && has_work()) {
    const bool has_row = minutes.size() > 0;
    done = write();
    if (done && has_row) done = trim();
  }
  if (done) {
    note_well();
    return true;
  }
  if (done.error().trouble != HistoryTrouble::damaged) {
    note(done.error());
    return false;
  }
  const auto name = file.put_aside();
  if (!name) {
    note(name.error());
    return false;
  }
  {
    const std::lock_guard lock(mutex);
    put_aside = *name;
  }
  done = file.open();
  if (!done) note(done.error());
  return done.has_value() && (!has_work() || work());
}

HistoryResult<void> HistoryStore::Shared::write() {
  const std::size_t row_count = std::min<std::size_t>(minutes.size(), 1);
  const std::size_t new_count = std::min(events.size(), events_at_once);
  std::vector<HistoryRow> rows;
  std::vector<HistoryEvent> new_events;
  for (std::size_t index = 0; index < row_count; ++index) rows.push_back(row_of(minutes[index], layout));
  for (std::size_t index = 0; index < new_count; ++index) new_events.push_back(event_of(events[index]));
  if (auto written = file.write(rows, new_events); !written) return written;
  minutes.pop(row_count);
  events.pop(new_count);
  rows_written += row_count;
  events_written += new_count;
  return {};
}

/// While there is nothing to write it may take its time; at the end there is none.
HistoryResult<void> HistoryStore::Shared::trim() {
  while (true) {
    const auto is_more = file.trim();
    if (!is_more) return failure(is_more.error());
    size_bytes = file.size_bytes();
    const std::lock_guard lock(mutex);
    if (!*is_more || has_to_end || has_work()) return {};
  }
}

void HistoryStore::Shared::note(const HistoryError& error) {
  state = HistoryState::failing;
  const std::lock_guard lock(mutex);
  last_error = error.what;
  ++tries_failed;
  changed.notify_all();
}

void HistoryStore::Shared::note_well() {
  size_bytes = file.size_bytes();
  const std::lock_guard lock(mutex);
  last_error.clear();
  state = HistoryState::writing;
}

HistoryStore::HistoryStore(const HistoryStoreOptions& options, const HistoryLife& life)
    : path_(options.file.path), shared_(std::make_shared<Shared>(options, life)) {}

Result<void, int> HistoryStore::start() {
  if (path_.empty()) return {};
  shared_->state = HistoryState::starting;
  auto started = start_helper(thread_, "bmud-history", shared_);
  if (!started) shared_->state = HistoryState::off;
  return started;
}

HistoryStore::~HistoryStore() {
  end_or_leave(thread_, *shared_, end_max);
}

void HistoryStore::offer(const Minute& minute) {
  if (!path_.empty() && !shared_->minutes.push(minute)) ++shared_->rows_lost;
}

void HistoryStore::offer(const TimedEvent& event) {
  if (!path_.empty() && !shared_->events.push(event)) ++shared_->events_lost;
}

HistoryHealth HistoryStore::health() const {
  const std::unique_lock lock(shared_->mutex, std::try_to_lock);
  if (lock.owns_lock()) {
    last_error_ = shared_->last_error;
    put_aside_ = shared_->put_aside;
  }
  return {.state = shared_->state,
          .rows_written = shared_->rows_written,
          .rows_lost = shared_->rows_lost,
          .rows_waiting = shared_->minutes.size(),
          .events_written = shared_->events_written,
          .events_lost = shared_->events_lost,
          .size_bytes = shared_->size_bytes,
          .last_error = last_error_,
          .put_aside = put_aside_};
}

bool HistoryStore::is_failing() const {
  return shared_->state == HistoryState::failing;
}

bool HistoryStore::flush(Duration at_most) {
  std::unique_lock lock(shared_->mutex);
  if (!shared_->is_running) return !shared_->has_work();
  const std::uint64_t failed = shared_->tries_failed;
  shared_->is_wanted_now = true;
  shared_->changed.notify_all();
  static_cast<void>(shared_->changed.wait_for(lock, at_most,
                                              [&] { return !shared_->has_work() || shared_->tries_failed != failed; }));
  return !shared_->has_work();
}

}  // namespace bmu
