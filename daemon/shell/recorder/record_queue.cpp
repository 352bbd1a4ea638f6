#include "daemon/shell/recorder/record_queue.hpp"

#include <utility>

namespace bmu {

void RecordChunk::clear() {
  text.clear();
  core.reset();
  triggers.clear();
}

bool RecordQueue::offer(RecordChunk& chunk) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock.owns_lock() || !has_room()) return false;
  put(chunk);
  return true;
}

bool RecordQueue::offer(RecordChunk& chunk, Duration at_most) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, at_most, [this] { return has_room(); })) return false;
  put(chunk);
  return true;
}

void RecordQueue::put(RecordChunk& chunk) {
  waiting_bytes_ += chunk.text.size();
  std::swap(ring_[(first_ + count_) % chunks_max], chunk);
  ++count_;
  changed_.notify_all();
}

std::unique_ptr<Core> RecordQueue::spare_core() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock.owns_lock() ? std::move(spare_) : nullptr;
}

void RecordQueue::make_room(std::size_t text_bytes) {
  for (std::size_t i = 0; i < rooms_at_start; ++i) ring_[i].text.reserve(text_bytes);
}

bool RecordQueue::take(RecordChunk& chunk, Duration at_most) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, at_most, [this] { return count_ > 0 || has_ended_; });
  if (count_ == 0) return false;
  chunk.clear();
  std::swap(ring_[first_], chunk);
  // The next chunk gets the previous buffer of the thread. So the same few buffers circulate, and the loop does not
  // allocate one for each place of the ring.
  std::string& next = ring_[(first_ + count_) % chunks_max].text;
  if (ring_[first_].text.capacity() > next.capacity()) ring_[first_].text.swap(next);
  first_ = (first_ + 1) % chunks_max;
  --count_;
  waiting_bytes_ -= chunk.text.size();
  changed_.notify_all();  // for a producer that waits for room
  return true;
}

void RecordQueue::give_back(std::unique_ptr<Core> core) {
  const std::lock_guard lock(mutex_);
  spare_ = std::move(core);
}

void RecordQueue::end() {
  const std::lock_guard lock(mutex_);
  has_ended_ = true;
  changed_.notify_all();
}

bool RecordQueue::has_ended() const {
  const std::lock_guard lock(mutex_);
  return has_ended_ && count_ == 0;
}

}  // namespace bmu
