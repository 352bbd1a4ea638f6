// The recording tap in the control loop: turns observations and decisions of the core into the lines of a recording,
// detects the triggers of a black box, and hands both to the recorder's thread about once a second.
//
// A recording consists of parts, each of which begins with the complete state of the core and can be replayed without
// the others. A part begins at start, then every 30 s, and where lines were lost because the thread was held up for
// long. Triggers are not lost with them: they wait, and are handed over with the remaining lines.
//
// Cost for the loop: some 0.1 us a frame, 0.3 us a tick, and once a part the copy of a core, 50 us
// (docs/performance.md). It neither waits nor, once its strings have grown, allocates.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "daemon/core/core_tap.hpp"
#include "daemon/recording/record_writer.hpp"
#include "daemon/shell/recorder/record_queue.hpp"

namespace bmu {

struct RecordFeedOptions {
  RecordBuses buses;
  Duration part_length = 30s;
  Duration chunk_length = 1s;
  std::size_t chunk_max_bytes = std::size_t{1} << 20;  // more is lost while the thread takes nothing
  /// A fault that recurs within this time is no trigger. An opening always is one.
  Duration again_after = 600s;
  /// Microseconds since 1970 at a time of the core, which may be in the past.
  std::function<std::int64_t(TimePoint)> wall_clock;
};

class RecordFeed : public CoreTap {
 public:
  /// Core and queue must outlive this object. begin() precedes the first observation to be recorded.
  RecordFeed(RecordFeedOptions options, const Core& core, RecordQueue& queue);

  void begin(TimePoint now);
  void observed(const Observation& observation) override;
  void decided(TimePoint at, const Decisions& decisions) override;
  /// At the end of the loop: hands over the remaining lines, within `at_most`. False: they are lost, and counted.
  [[nodiscard]] bool end(Duration at_most);

  /// Observations and decisions that are in no recording, since start.
  [[nodiscard]] std::uint64_t pieces_lost() const { return pieces_lost_; }
  /// Openings and latched faults that are in no black box.
  [[nodiscard]] std::uint64_t triggers_lost() const { return triggers_lost_; }

 private:
  [[nodiscard]] bool begin_part(TimePoint now);
  [[nodiscard]] bool hand_over();
  void follow_wall_clock(TimePoint at, const WallClockSeen& seen);
  [[nodiscard]] bool is_worth_keeping(const Event& event) const;
  void keep(const Event& event, TimePoint at);
  void look_for_trigger(TimePoint at, const Decisions& decisions);

  RecordFeedOptions options_;
  const Core& core_;
  RecordQueue& queue_;
  RecordLines lines_;
  RecordChunk chunk_;
  std::unique_ptr<Core> spare_;  // for the next part
  std::array<TimePoint, fault_count> shown_at_{};
  TimePoint part_began_at_{};
  std::uint64_t part_ = 0;  // a number is skipped where lines were lost
  bool is_part_due_ = true;
  bool has_lost_ = true;              // nothing is recorded before a part has started
  std::uint64_t pieces_waiting_ = 0;  // count in the chunk
  std::atomic<std::uint64_t> pieces_lost_ = 0;
  std::atomic<std::uint64_t> triggers_lost_ = 0;
};

}  // namespace bmu
