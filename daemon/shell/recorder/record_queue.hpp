// From the control loop to the recorder's thread: text in chunks, handed over without waiting and without allocation.
//
// A ring of chunks whose strings keep their room: the loop swaps a full one for an empty one, the thread likewise. The
// thread holds the lock for the length of a swap; should the loop meet it there, it offers again with its next tick.
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

/// Why the seconds around it are worth keeping.
struct RecordTrigger {
  TimePoint at;
  std::int64_t unix_time_us = 0;
  Event event;                        // an opening, or a fault that latches
  std::optional<FreezeFrame> freeze;  // of the fault
};

/// As many as wait while nothing can be handed over; what comes beyond is counted.
inline constexpr std::size_t record_triggers_max = 8;

struct RecordChunk {
  std::string text;            // whole lines
  std::unique_ptr<Core> core;  // begins a part: all that the core knew before these lines
  std::uint64_t part = 0;      // its number; one is left out where lines were lost before it
  RecordClock clock;           // as it was at the beginning
  std::int64_t unix_time_us = 0;
  TimePoint from{};
  TimePoint until{};
  FixedVector<RecordTrigger, record_triggers_max> triggers;  // the last of them at the lines' end, or after it

  [[nodiscard]] bool is_empty() const { return text.empty() && triggers.empty(); }
  void clear();
};

class RecordQueue {
 public:
  static constexpr std::size_t chunks_max = 64;
  static constexpr std::size_t waiting_max_bytes = std::size_t{32} << 20;

  /// At start: so much for each of the first texts, so that the loop need not wait for memory then.
  void make_room(std::size_t text_bytes);
  /// The loop's. Takes the chunk and leaves an empty one; false: there is no room, or the thread is just there.
  [[nodiscard]] bool offer(RecordChunk& chunk);
  /// At the end, when nobody has to hurry any more: waits for room, at most so long.
  [[nodiscard]] bool offer(RecordChunk& chunk, Duration at_most);
  /// The loop's. A core to copy ours into; none while the last one is still being written, or the thread is just there.
  [[nodiscard]] std::unique_ptr<Core> spare_core();
  /// The thread's. Waits for a chunk, at most so long; false: there is none. Once end() was called it does not wait.
  [[nodiscard]] bool take(RecordChunk& chunk, Duration at_most);
  /// The thread's, and at start: the core may be used again.
  void give_back(std::unique_ptr<Core> core);
  /// No more chunks come.
  void end();
  [[nodiscard]] bool has_ended() const;

 private:
  [[nodiscard]] bool has_room() const { return count_ < chunks_max && waiting_bytes_ <= waiting_max_bytes; }
  void put(RecordChunk& chunk);

  // As many as there are until the first that the thread has written comes back.
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
