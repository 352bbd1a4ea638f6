// Queue from the control loop to the recorder's thread: text in chunks, handed over without wait or allocation.
//
// A ring of chunks, of which the strings keep their capacity: the loop swaps a full one for an empty one, and so does
// the thread. The thread holds the mutex for the length of a swap; a loop that finds it locked offers again with its
// next tick.
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/core/core.hpp"
#include "daemon/recording/record_line.hpp"
#include "protocol/fixed_vector.hpp"

namespace bmu {

/// Reason to keep the seconds around it.
struct RecordTrigger {
  TimePoint at;
  std::int64_t unix_time_us = 0;
  Event event;                        // an opening, or a fault that latches
  std::optional<FreezeFrame> freeze;  // of the fault
};

/// Maximum number that waits while nothing can be handed over; further ones are counted.
inline constexpr std::size_t record_triggers_max = 8;

struct RecordChunk {
  std::string text;            // whole lines
  std::unique_ptr<Core> core;  // starts a part: the state before these lines
  std::uint64_t part = 0;      // its number; one is skipped where lines were lost before it
  RecordClock clock;           // at the start of the chunk
  std::int64_t unix_time_us = 0;
  TimePoint from{};
  TimePoint until{};
  FixedVector<RecordTrigger, record_triggers_max> triggers;  // the last of them at the end of the lines, or after it

  [[nodiscard]] bool is_empty() const { return text.empty() && triggers.empty(); }
  void clear();
};

class RecordQueue {
 public:
  static constexpr std::size_t chunks_max = 64;
  static constexpr std::size_t waiting_max_bytes = std::size_t{32} << 20;

  /// At start: reserves this much for each of the first texts, so that the loop need not wait for memory then.
  void make_room(std::size_t text_bytes);
  /// For the loop. Takes the chunk and leaves an empty one; false: there is no room, or the thread holds the mutex.
  [[nodiscard]] bool offer(RecordChunk& chunk);
  /// For the end, when nothing is urgent any more: waits for room, at most `at_most`.
  [[nodiscard]] bool offer(RecordChunk& chunk, Duration at_most);
  /// For the loop. A core to copy the running one into; null while the last one is being written, or the mutex is held.
  [[nodiscard]] std::unique_ptr<Core> spare_core();
  /// For the thread. Waits for a chunk, at most `at_most`; false: there is none. After end() it does not wait.
  [[nodiscard]] bool take(RecordChunk& chunk, Duration at_most);
  /// For the thread, and at start: the core may be used again.
  void give_back(std::unique_ptr<Core> core);
  /// No more chunks come.
  void end();
  [[nodiscard]] bool has_ended() const;

 private:
  [[nodiscard]] bool has_room() const { return count_ < chunks_max && waiting_bytes_ <= waiting_max_bytes; }
  void put(RecordChunk& chunk);

  // Number of texts in use until the thread returns the first one that it has written.
  static constexpr std::size_t rooms_at_start = 2;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::array<RecordChunk, chunks_max> ring_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::size_t waiting_bytes_ = 0;
  std::unique_ptr<Core> spare_;
  bool has_ended_ = false;
};

}  // namespace bmu
