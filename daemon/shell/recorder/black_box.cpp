#include "daemon/shell/recorder/black_box.hpp"

#include <algorithm>

namespace bmu {

namespace {

/// In the names of the files that are removed first.
constexpr std::string_view routine_word = "-routine-";

std::uint64_t size_of(const std::vector<std::shared_ptr<const std::string>>& pieces) {
  std::uint64_t size = 0;
  for (const auto& piece : pieces) size += piece->size();
  return size;
}

}  // namespace

void BlackBox::add(const RecordFrame& frame) {
  memory_.push_back(frame);
  memory_bytes_ += frame.bytes->size();
  forget_old();
  if (open_.empty() || open_.back().is_whole) return;
  File& file = open_.back();
  file.pieces.push_back(frame.bytes);
  file.is_whole = frame.until >= file.until;
}

/// Drops whole parts only: the remaining memory has to start with one.
void BlackBox::forget_old() {
  const auto begins = [](const RecordFrame& frame) { return frame.begins_part; };
  while (true) {
    const auto second = std::find_if(memory_.begin() + (memory_.empty() ? 0 : 1), memory_.end(), begins);
    if (second == memory_.end()) return;
    const bool reaches_back = memory_.back().until - second->from >= options_.before;
    if (!reaches_back && memory_bytes_ <= options_.memory_max_bytes) return;
    for (auto at = memory_.begin(); at != second; ++at) memory_bytes_ -= at->bytes->size();
    memory_.erase(memory_.begin(), second);
  }
}

void BlackBox::trigger(BlackBoxCause cause) {
  if (!open_.empty() && !open_.back().is_whole) {
    File& file = open_.back();
    // A cause that is not routine gets a file of its own, which is not among the first to be removed.
    const bool has_to_end = (file.cause.is_routine && !cause.is_routine) || cause.at - file.cause.at > options_.longest;
    if (!has_to_end) {
      file.until = cause.at + options_.after;
      file.pieces.push_back(std::move(cause.head));
      return;
    }
    file.is_whole = true;
  }
  if (open_.size() == waiting_max) {
    open_.pop_front();
    ++files_lost_;
  }
  File file{.cause = std::move(cause)};
  file.until = file.cause.at + options_.after;
  file.pieces.push_back(file.cause.head);
  for (const RecordFrame& frame : memory_) file.pieces.push_back(frame.bytes);
  open_.push_back(std::move(file));
}

Result<void, OsError> BlackBox::write(File& file) {
  if (!file.file) {
    if (auto room = files_.make_room(options_.limits, size_of(file.pieces), routine_word); !room) return room;
    const std::string word = (file.cause.is_routine ? "routine-" : "") + file.cause.word;
    auto created = files_.create(file.cause.unix_time_us, word);
    if (!created) return failure(created.error());
    file.file = std::move(*created);
    last_path_ = file.file->path();
  }
  for (; file.written < file.pieces.size(); ++file.written) {
    if (auto written = file.file->append(*file.pieces[file.written]); !written) return written;
    file.pieces[file.written].reset();
    file.is_synced = false;
  }
  if (file.is_synced) return {};
  auto synced = file.file->sync();
  file.is_synced = synced.has_value();
  return synced;
}

void BlackBox::write() {
  while (!open_.empty()) {
    File& file = open_.front();
    const auto written = write(file);
    last_error_ = written ? "" : to_text(written.error());
    if (!written) ++tries_failed_;
    if (!written || !file.is_whole) return;
    ++files_written_;
    open_.pop_front();
  }
}

void BlackBox::end() {
  if (!open_.empty()) open_.back().is_whole = true;
  write();
}

void BlackBox::give_up() {
  files_lost_ += open_.size();
  open_.clear();
}

bool BlackBox::is_waiting() const {
  return std::any_of(open_.begin(), open_.end(),
                     [](const File& file) { return file.written < file.pieces.size() || !file.is_synced; });
}

Duration BlackBox::memory_length() const {
  return memory_.empty() ? Duration{} : memory_.back().until - memory_.front().from;
}

}  // namespace bmu
