#include "daemon/shell/recorder/record_files.hpp"

#include <unistd.h>

namespace bmu {

Result<void, OsError> RecordFiles::begin_file(const RecordFrame& frame) {
  if (file_) {
    if (auto synced = file_->sync(); !synced) return synced;
    file_.reset();
  }
  const KeptFilesLimits limits{.total_bytes = options_.total_bytes};
  if (auto room = files_.make_room(limits, options_.file_bytes); !room) return room;
  auto created = files_.create(frame.unix_time_us);
  if (!created) return failure(created.error());
  file_ = std::move(*created);
  synced_at_ = frame.from;
  return {};
}

Result<void, OsError> RecordFiles::append(const RecordFrame& frame) {
  const bool is_full = file_ && file_->size_bytes() >= options_.file_bytes;
  if (frame.begins_part && (!file_ || is_full)) {
    if (auto begun = begin_file(frame); !begun) return begun;
  }
  if (auto written = file_->append(*frame.bytes); !written) return written;
  bytes_written_ += frame.bytes->size();
  return {};
}

Result<void, OsError> RecordFiles::sync(const RecordFrame& frame) {
  if (frame.until - synced_at_ < options_.sync_every) return {};
  synced_at_ = frame.until;
  return file_->sync();
}

void RecordFiles::add(const RecordFrame& frame) {
  waiting_.push_back(frame);
  waiting_bytes_ += frame.bytes->size();
  forget_old();
  const bool must_wait = !last_error_.empty() && frame.until - tried_at_ < options_.retry;
  if (must_wait) return;
  tried_at_ = frame.until;
  write();
}

void RecordFiles::write() {
  while (!waiting_.empty()) {
    const RecordFrame frame = waiting_.front();
    if (!file_ && !frame.begins_part) {  // cannot be replayed
      lose_first();
      continue;
    }
    if (auto appended = append(frame); !appended) {
      last_error_ = to_text(appended.error());
      return;
    }
    waiting_bytes_ -= frame.bytes->size();
    waiting_.pop_front();
    last_error_.clear();
    if (auto synced = sync(frame); !synced) {
      // It is unknown how much of the file is on the disk; the following frames may get there.
      last_error_ = to_text(synced.error());
      ++frames_lost_;
      close_file();
      return;
    }
  }
}

void RecordFiles::close_file() {
  if (file_ && file_->size_bytes() == 0) ::unlink(file_->path().c_str());
  file_.reset();
}

void RecordFiles::lose_first() {
  ++frames_lost_;
  waiting_bytes_ -= waiting_.front().bytes->size();
  waiting_.pop_front();
}

/// Up to the start of the next part, from which the remaining frames can be replayed.
void RecordFiles::forget_old() {
  const auto is_too_much = [this] {
    return waiting_.back().until - waiting_.front().from > options_.wait_max ||
           waiting_bytes_ > options_.wait_max_bytes;
  };
  while (waiting_.size() > 1 && is_too_much()) {
    close_file();
    do lose_first();
    while (!waiting_.empty() && !waiting_.front().begins_part);
    if (waiting_.empty()) return;
  }
}

void RecordFiles::end() {
  write();
  while (!waiting_.empty()) lose_first();
  if (!file_) return;
  if (auto synced = file_->sync(); !synced) last_error_ = to_text(synced.error());
  close_file();
}

}  // namespace bmu
