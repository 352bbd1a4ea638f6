// Writer of the text of a recording (record_line.hpp), from the observations and decisions of a core.
//
//   RecordWriter writer({.version = BMUD_VERSION, .buses = {...}, .sources = pack.sources, .hash = pack.core.hash});
//   writer.begin(core, now, wall_clock);         // head, configuration, state of the core
//   ... writer.observed(...), writer.decided(...)
//   file << writer.text(); writer.clear();
//
// A recording may start at any time of a core's session, and restart in the middle, e.g. where lines were lost: begin()
// writes all that is needed to continue from there.
//
//   # bmud-recording 1
//   # version 0.1.0
//   # bus internal can0
//   # bus vehicle can1
//   # ahead_us 1699987654321098             the log's clock less the core's (RecordClock)
//   # part 1700000000123456 7             the next of this session, 8, begins where this one ends
//   # internal_kbit_per_s 500             if it differs from the pack file's
//   # configuration 1afe0c83d739c982        the hash of both texts
//   # pack-file demo-48s.json
//   # pack | {                              a line of it; + a part that the next line continues
//   # cell-file lg-hg2.json
//   # cell | ...
//   # core 3f1c...(layout) 2069328          and its number of bytes, in `image` and `zeros` lines (image_lines.hpp)
//   # image ...
//   # core-end 8f1d... 77ab...              their checksum, and that of all other lines of the head (line_sum.hpp)
//
// Not for the control loop's thread: text allocates.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "daemon/core/core.hpp"
#include "daemon/core/core_tap.hpp"
#include "daemon/recording/record_lines.hpp"

namespace bmu {

inline constexpr int record_format = 1;

struct RecordHead {
  std::string version;
  RecordBuses buses;
  PackSources sources;
  std::uint64_t hash = 0;
  /// Bit rate of the internal bus, as it was found: poll rates follow from it. 0: as in the pack file.
  std::int32_t internal_kbit_per_s = 0;
  /// Session, and number of its part: the next part of the same session continues where this one ends. Session 0: none.
  std::int64_t life = 0;
  std::uint64_t part = 0;
};

/// Appends all that a part starts with: configuration, and state of the core. Takes some milliseconds.
void append_record_head(const RecordHead& head, const Core& core, const RecordClock& clock, std::string& to);

/// Appends any text as lines "# WORD | a line", long ones in pieces ("# WORD + a piece").
void append_record_text(std::string_view word, std::string_view text, std::string& to);

class RecordWriter : public CoreTap {
 public:
  explicit RecordWriter(RecordHead head) : head_(std::move(head)), lines_(head_.buses) {}

  /// `unix_time_us`: the wall clock at `now`. `continues`: nothing was lost since the part before.
  void begin(const Core& core, TimePoint now, std::int64_t unix_time_us, bool continues = false);
  void observed(const Observation& observation) override;
  void decided(TimePoint at, const Decisions& decisions) override;
  /// The wall clock has jumped: the log's times follow it from here on.
  void set_wall_clock(TimePoint now, std::int64_t unix_time_us);

  [[nodiscard]] const std::string& text() const { return text_; }
  void clear() { text_.clear(); }

 private:
  RecordHead head_;
  RecordLines lines_;
  std::string text_;
};

}  // namespace bmu
