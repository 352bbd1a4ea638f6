#include "daemon/shell/record_files.hpp"

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

Result<void, OsError> RecordFiles::take(const RecordFrame& frame) {
  const bool is_full = file_ && file_->size_bytes() >= options_.file_bytes;
  if (frame.begins_part && (!file_ || is_full)) {
    if (auto begun = begin_file(frame); !begun) return begun;
  }
  if (!file_) {
    ++frames_lost_;  // why, the last error says
    return {};
  }
  if (auto written = file_->append(*frame.bytes); !written) return written;
  bytes_written_ += frame.bytes->size();
  last_error_.clear();
  if (frame.until - synced_at_ < options_.sync_every) return {};
  synced_at_ = frame.until;
  return file_->sync();
}

void RecordFiles::add(const RecordFrame& frame) {
  if (auto taken = take(frame); !taken) {
    last_error_ = to_text(taken.error());
    if (file_ && file_->size_bytes() == 0) ::unlink(file_->path().c_str());
    file_.reset();
    ++frames_lost_;
  }
}

void RecordFiles::end() {
  if (!file_) return;
  if (auto synced = file_->sync(); !synced) last_error_ = to_text(synced.error());
  file_.reset();
}

}  // namespace bmu
