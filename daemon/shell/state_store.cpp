#include "daemon/shell/state_store.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include <sys/stat.h>

#include "daemon/history/helper_thread.hpp"
#include "daemon/shell/state_text.hpp"
#include "protocol/assert.hpp"

namespace bmu {

namespace {

using std::chrono::steady_clock;

/// What a destructor may wait for a write that is under way.
constexpr Duration end_max = 500ms;

}  // namespace

struct StateStore::Shared {
  explicit Shared(StateStoreOptions the_options) : options(std::move(the_options)), file(options.path) {}

  const StateStoreOptions options;
  StateFile file;  // the thread's alone, once it runs

  std::mutex mutex;
  std::condition_variable changed;
  std::optional<PersistentState> waiting;
  std::string last_error;
  bool is_busy = false;  // a write is under way
  bool has_to_end = false;
  bool is_running = false;

  std::atomic<bool> write_failed = false;
  std::atomic<bool> disk_low = false;
  std::atomic<bool> memory_low = false;
  std::atomic<std::uint64_t> writes = 0;

  void run();
  void look();
  void write_waiting(std::unique_lock<std::mutex>& lock);
};

void StateStore::Shared::run() {
  auto look_at = steady_clock::now();
  auto write_at = look_at;
  std::unique_lock lock(mutex);
  while (true) {
    if (has_to_end) break;
    const auto now = steady_clock::now();
    if (now >= look_at) {
      lock.unlock();
      look();
      lock.lock();
      look_at = now + options.look_every;
    } else if (waiting && (!write_failed || now >= write_at)) {
      write_waiting(lock);
      write_at = steady_clock::now() + options.retry;
    } else {
      changed.wait_until(lock, waiting ? std::min(look_at, write_at) : look_at);
    }
  }
  is_running = false;
  changed.notify_all();
}

void StateStore::Shared::look() {
  if (!options.path.empty()) {
    const auto disk = disk_space(file.folder());
    disk_low = disk && is_low(*disk, options.limits);
  }
  const auto resident = resident_bytes();
  memory_low = resident && *resident > options.limits.memory_max_bytes;
}

/// Called and left with the lock; without it in between.
void StateStore::Shared::write_waiting(std::unique_lock<std::mutex>& lock) {
  const PersistentState state = *std::exchange(waiting, std::nullopt);
  is_busy = true;
  lock.unlock();
  const Result<void, OsError> written = file.write(state_text(state));
  lock.lock();
  is_busy = false;
  write_failed = !written;
  if (written) {
    ++writes;
    last_error.clear();
  } else {
    last_error = to_text(written.error());
    if (!waiting) waiting = state;
  }
  changed.notify_all();
}

StateStore::StateStore(const StateStoreOptions& options)
    : path_(options.path), shared_(std::make_shared<Shared>(options)) {}

Result<std::unique_ptr<StateStore>, OsError> StateStore::open(const StateStoreOptions& options) {
  std::unique_ptr<StateStore> store(new StateStore(options));
  if (options.path.empty()) return store;
  const std::string folder = store->shared_->file.folder();
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) {
    const int code = S_ISDIR(status.st_mode) || status.st_mode == 0 ? errno : ENOTDIR;
    return failure(OsError{.code = code,
                           .what = "state file " + options.path + ": wanted the existing directory " + folder +
                                   " (make it, or name another place with --state)"});
  }
  store->read();
  return store;
}

void StateStore::read() {
  found_.found = shared_->file.read([this](std::string_view text) { return take(text); }, found_.problems);
}

Result<void, std::string> StateStore::take(std::string_view text) {
  auto read = parse_state(text);
  if (!read) return failure(read.error());
  found_.state = read->state;
  found_.unknown_names = read->unknown_names;
  found_.charges_problem = read->charges_problem;
  found_.soc_problem = read->soc_problem;
  return {};
}

void StateStore::carry_over(const PersistentState& state) {
  found_ = {.found = FileFound::newest};
  const auto taken = take(state_text(state));
  BMU_ASSERT(taken.has_value());  // our own text
  if (path_.empty()) return;
  const std::lock_guard lock(shared_->mutex);  // which the thread holds for moments only
  shared_->waiting = state;
  shared_->changed.notify_all();
}

Result<void, OsError> StateStore::start() {
  const auto started = start_helper(thread_, "bmud-state", shared_);
  if (started) return {};
  return failure(OsError{.code = started.error(), .what = "start the thread that writes the state file"});
}

StateStore::~StateStore() {
  end_or_leave(thread_, *shared_, end_max);
}

bool StateStore::offer(const PersistentState& state) {
  if (path_.empty()) return true;
  const std::unique_lock lock(shared_->mutex, std::try_to_lock);
  if (!lock.owns_lock()) return false;
  shared_->waiting = state;
  shared_->changed.notify_all();
  return true;
}

OwnHealth StateStore::health() const {
  return {
      .store_write_failed = shared_->write_failed, .memory_low = shared_->memory_low, .disk_low = shared_->disk_low};
}

bool StateStore::flush(Duration at_most) {
  std::unique_lock lock(shared_->mutex);
  return shared_->changed.wait_for(lock, at_most, [this] { return !shared_->waiting && !shared_->is_busy; });
}

std::uint64_t StateStore::writes() const {
  return shared_->writes;
}

std::string StateStore::last_error() const {
  const std::unique_lock lock(shared_->mutex, std::try_to_lock);
  if (lock.owns_lock()) last_error_ = shared_->last_error;
  return last_error_;
}

}  // namespace bmu
