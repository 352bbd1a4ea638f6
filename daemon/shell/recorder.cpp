#include "daemon/shell/recorder.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <new>
#include <system_error>
#include <utility>

#include <time.h>

#include "daemon/history/helper_thread.hpp"
#include "daemon/shell/black_box_head.hpp"
#include "daemon/shell/bus_port.hpp"
#include "daemon/shell/zstd_frame.hpp"

namespace bmu {

namespace {

constexpr Duration look_every = 1s;

/// What the wall clock would have said at a time of the core's, had nobody set it since.
std::int64_t unix_time_us(TimePoint at) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const auto ago = std::chrono::duration_cast<std::chrono::microseconds>(monotonic_now() - at);
  return std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000 - ago.count();
}

}  // namespace

Result<void, OsError> make_record_folder(const std::string& folder) {
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) return failure(OsError{.code = error.value(), .what = "make folder " + folder});
  return {};
}

struct Recorder::Shared {
  explicit Shared(const RecorderOptions& the_options)
      : options(the_options), files(options.files), black_box(options.black_box) {}

  const RecorderOptions options;
  RecordQueue queue;

  // The thread's alone.
  RecordFiles files;
  BlackBox black_box;
  ZstdFrames zstd;
  TimePoint tried_at{};
  std::uint64_t chunks_lost = 0;
  std::uint64_t triggers_lost = 0;
  std::int64_t life_us = unix_time_us(monotonic_now());  // so that nobody takes parts of another life for the next ones
  bool is_in_hole = false;                               // lines are missing: nothing can be run before the next part

  std::mutex mutex;
  std::condition_variable changed;
  RecorderStatus status;
  bool is_running = false;
  bool has_lost_at_end = false;
  std::chrono::steady_clock::time_point end_by{};  // from end() on

  void run();
  void take(RecordChunk& chunk);
  void take_lines(RecordChunk& chunk);
  void trigger(const RecordTrigger& trigger);
  void write_black_boxes(TimePoint now);
  void finish();
  [[nodiscard]] bool waits_to_try_again();
  void add(const RecordFrame& frame);
  void tell();
  [[nodiscard]] RecordFrame head_frame(RecordChunk& chunk);
  [[nodiscard]] RecordFrame text_frame(const RecordChunk& chunk);
};

void Recorder::Shared::run() {
  RecordChunk chunk;
  while (!queue.has_ended()) {
    try {
      if (queue.take(chunk, black_box.is_waiting() ? options.retry : look_every)) {
        take(chunk);
      } else if (black_box.is_waiting()) {
        black_box.write();
      }
      tell();
    } catch (const std::bad_alloc&) {  // of a disk that was tried: it is tried again
    }
  }
  const std::uint64_t lost_before = black_box.files_lost();
  try {
    finish();
    tell();
  } catch (const std::bad_alloc&) {
    black_box.give_up();
  }
  const std::lock_guard lock(mutex);
  status.black_boxes_lost = black_box.files_lost() + triggers_lost;
  has_lost_at_end = black_box.files_lost() != lost_before || !files.last_error().empty();
  is_running = false;
  changed.notify_all();
}

/// What a disk does not take is tried until there is no time left.
void Recorder::Shared::finish() {
  files.write();
  black_box.end();
  while ((files.is_waiting() || black_box.is_waiting()) && waits_to_try_again()) {
    files.write();
    black_box.write();
  }
  files.end();
  black_box.give_up();
}

/// False: there is no time left.
bool Recorder::Shared::waits_to_try_again() {
  constexpr auto retry_at_end = std::chrono::milliseconds(20);
  tell();
  std::unique_lock lock(mutex);
  const auto now = std::chrono::steady_clock::now();
  if (now >= end_by) return false;
  changed.wait_until(lock, std::min(end_by, now + retry_at_end));
  return true;
}

RecordFrame Recorder::Shared::head_frame(RecordChunk& chunk) {
  std::string text;
  RecordHead head = options.head;
  head.life = life_us;
  head.part = chunk.part;
  append_record_head(head, *chunk.core, chunk.clock, text);
  queue.give_back(std::move(chunk.core));
  return {.bytes = std::make_shared<const std::string>(zstd.compress(text)),
          .begins_part = true,
          .from = chunk.from,
          .until = chunk.from,
          .unix_time_us = chunk.unix_time_us};
}

RecordFrame Recorder::Shared::text_frame(const RecordChunk& chunk) {
  return {.bytes = std::make_shared<const std::string>(zstd.compress(chunk.text)),
          .begins_part = false,
          .from = chunk.from,
          .until = chunk.until,
          .unix_time_us = chunk.unix_time_us};
}

void Recorder::Shared::add(const RecordFrame& frame) {
  if (is_in_hole && !frame.begins_part) {
    ++chunks_lost;
    return;
  }
  is_in_hole = false;
  if (!options.files.folder.empty()) files.add(frame);
  if (!options.black_box.folder.empty()) black_box.add(frame);
}

void Recorder::Shared::take(RecordChunk& chunk) {
  take_lines(chunk);
  if (options.black_box.folder.empty()) return;
  for (const RecordTrigger& one : chunk.triggers) trigger(one);
  write_black_boxes(chunk.until);
}

void Recorder::Shared::take_lines(RecordChunk& chunk) {
  try {
    if (chunk.core != nullptr) add(head_frame(chunk));
    if (!chunk.text.empty()) add(text_frame(chunk));
  } catch (const std::bad_alloc&) {
    // Memory is scarce; a recording with a hole is no reason to end a daemon that holds a pack closed.
    if (chunk.core != nullptr) queue.give_back(std::move(chunk.core));
    ++chunks_lost;
    ++life_us;  // no part goes on from the one before the hole
    is_in_hole = true;
  }
}

void Recorder::Shared::trigger(const RecordTrigger& trigger) {
  try {
    black_box.trigger({.at = trigger.at,
                       .unix_time_us = trigger.unix_time_us,
                       .word = black_box_word(trigger),
                       .is_routine = is_routine(trigger),
                       .head = std::make_shared<const std::string>(zstd.compress(black_box_head(trigger)))});
  } catch (const std::bad_alloc&) {
    ++triggers_lost;
  }
}

void Recorder::Shared::write_black_boxes(TimePoint now) {
  // After an error not with every chunk: a full disk is not emptied by trying.
  const bool must_wait = !black_box.last_error().empty() && now - tried_at < options.retry;
  if (!black_box.is_waiting() || must_wait) return;
  tried_at = now;
  black_box.write();
}

void Recorder::Shared::tell() {
  RecorderStatus now{.record_path = files.path(),
                     .recorded_bytes = files.bytes_written(),
                     .frames_lost = files.frames_lost() + chunks_lost,
                     .record_error = files.last_error(),
                     .black_boxes = black_box.files_written(),
                     .black_boxes_lost = black_box.files_lost() + triggers_lost,
                     .black_box_tries_failed = black_box.tries_failed(),
                     .black_box_path = black_box.last_path(),
                     .black_box_error = black_box.last_error(),
                     .memory_bytes = black_box.memory_bytes(),
                     .memory_length = black_box.memory_length()};
  const std::lock_guard lock(mutex);
  status = std::move(now);
}

Recorder::Recorder(const RecorderOptions& options, const Core& core, std::shared_ptr<Shared> shared)
    : shared_(std::move(shared)),
      feed_({.buses = options.head.buses, .part_length = options.part_length, .wall_clock = unix_time_us}, core,
            shared_->queue) {
  shared_->queue.give_back(std::make_unique<Core>(core));
}

Result<std::unique_ptr<Recorder>, OsError> Recorder::open(const RecorderOptions& options, const Core& core) {
  for (const std::string& folder : {options.files.folder, options.black_box.folder}) {
    if (auto made = make_record_folder(folder); !made) return failure(made.error());
  }
  return std::unique_ptr<Recorder>(new Recorder(options, core, std::make_shared<Shared>(options)));
}

Result<void, OsError> Recorder::start() {
  const auto started = start_helper(thread_, "bmud-record", shared_);
  if (started) return {};
  return failure(OsError{.code = started.error(), .what = "start the thread that writes recordings"});
}

RecorderEnd Recorder::end(Duration at_most) {
  if (!thread_.joinable()) return RecorderEnd::all_written;
  const auto end_by = std::chrono::steady_clock::now() + at_most;
  const bool is_handed_over = feed_.end(at_most);
  std::unique_lock lock(shared_->mutex);
  // What is tried last has to come to its end, too.
  shared_->end_by = end_by - std::min<Duration>(at_most / 5, 100ms);
  lock.unlock();
  shared_->queue.end();
  lock.lock();
  const bool has_ended = shared_->changed.wait_until(lock, end_by, [this] { return !shared_->is_running; });
  const bool has_lost = shared_->has_lost_at_end || !is_handed_over;
  lock.unlock();
  join_or_leave(thread_, has_ended);
  if (!has_ended) return RecorderEnd::still_writing;
  return has_lost ? RecorderEnd::some_lost : RecorderEnd::all_written;
}

Recorder::~Recorder() {
  static_cast<void>(end(Duration{}));
}

RecorderStatus Recorder::status() const {
  const std::unique_lock lock(shared_->mutex, std::try_to_lock);
  if (lock.owns_lock()) status_ = shared_->status;
  RecorderStatus now = status_;
  now.black_boxes_lost += feed_.triggers_lost();
  return now;
}

}  // namespace bmu
