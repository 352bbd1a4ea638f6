// Parser of a recording, line by line: heads with their state, observations, ticks and their details.
//
//   RecordReader reader;
//   switch (reader.take(line)) {
//     case RecordReader::Took::part: core = reader.make_core(reader.pack()->core); ...
//     case RecordReader::Took::observation: core->observe(reader.observation()); ...
//     case RecordReader::Took::tick: core->decide(reader.tick().at); ...
//     case RecordReader::Took::problem: reader.problem() ...
//   }
//
// Each tick gives the checksum of the lines since the one before, which detects modified lines. Times that are passed
// on never go back within a part, whatever the file contains: an earlier one is a problem, and so is every line that
// does not belong to a recording. After a problem no line is accepted before the next head.
//
// Allocates, but neither reads nor writes anything. Cost: 0.1 us a line, some milliseconds a head.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/core/core.hpp"
#include "daemon/recording/line_sum.hpp"
#include "daemon/recording/record_line.hpp"
#include "protocol/result.hpp"

namespace bmu {

enum class RecordProblemKind : std::uint8_t {
  damaged,        // a recording, with an invalid part
  no_recording,   // or one without its beginning
  other_version,  // of the format, or of the core
  other_pack,     // which cannot take over the recorded state
};

struct RecordProblem {
  RecordProblemKind kind = RecordProblemKind::damaged;
  std::uint64_t line = 0;  // from 1
  std::string text;        // "found ..., wanted ..."
};

/// Parts of one session are numbered; where lines were lost a number is omitted.
struct RecordPartId {
  std::int64_t life = 0;  // 0: not numbered
  std::uint64_t part = 0;

  [[nodiscard]] bool follows(const RecordPartId& other) const {
    return life != 0 && life == other.life && part == other.part + 1;
  }
};

class RecordReader {
 public:
  enum class Took : std::uint8_t {
    nothing,      // a line of a head, or one without a meaning here
    part,         // a head is complete: make_core()
    observation,  // observation()
    tick,         // tick()
    of_tick,      // a frame, the outputs or an event of the tick before: line()
    problem,      // problem()
  };

  /// Parses the next line, without its line feed.
  [[nodiscard]] Took take(std::string_view line);

  [[nodiscard]] const Observation& observation() const { return observation_; }
  [[nodiscard]] const RecordTick& tick() const { return tick_; }
  /// RecordSent, RecordOutputs or RecordEvent; the text of an event points into the line that was parsed.
  [[nodiscard]] const RecordLine& line() const { return line_; }
  [[nodiscard]] const std::optional<RecordProblem>& problem() const { return problem_; }
  /// For the tick that was parsed last: lines before it that were modified after writing. It is run nevertheless.
  [[nodiscard]] const std::optional<RecordProblem>& alteration() const { return alteration_; }
  [[nodiscard]] std::uint64_t lines() const { return lines_; }

  /// Makes a core with the state at the start of the part; right after `part`. `config`: the recorded one, or another
  /// one for the same modules. other_version: its core has other members; its observations can be read nevertheless.
  [[nodiscard]] Result<std::unique_ptr<Core>, RecordProblem> make_core(const CoreConfig& config);

  // Of the head that was parsed last.
  [[nodiscard]] const std::optional<PackConfig>& pack() const { return pack_; }
  [[nodiscard]] const PackSources& sources() const { return head_.origin.sources; }
  [[nodiscard]] const std::string& version() const { return head_.version; }
  [[nodiscard]] const RecordBuses& buses() const { return head_.buses; }
  [[nodiscard]] const RecordClock& clock() const { return clock_; }
  /// It begins where the part before it ended, if that was run to its end.
  [[nodiscard]] bool continues() const { return head_.id.follows(before_); }
  [[nodiscard]] const RecordPartId& part_id() const { return head_.id; }
  /// The first and the latest time of the part on the recording's wall clock; 0 while it has none.
  [[nodiscard]] std::int64_t part_from_log_us() const { return part_from_log_us_; }
  [[nodiscard]] std::int64_t part_until_log_us() const {
    return part_from_log_us_ == 0 ? 0 : clock_.to_log_us(latest_);
  }
  /// The same two on the core's clock, which never jumps; zero while it has none.
  [[nodiscard]] TimePoint part_from() const { return part_from_; }
  [[nodiscard]] TimePoint part_until() const { return part_from_log_us_ == 0 ? TimePoint{} : latest_; }
  /// Checksum of the state in the head (image_lines.hpp); 0 before the first.
  [[nodiscard]] std::uint64_t checksum() const { return checksum_; }

 private:
  /// All from which the configuration is derived.
  struct Origin {
    PackSources sources;
    std::string hash;
    std::int32_t internal_kbit_per_s = 0;

    friend bool operator==(const Origin&, const Origin&) = default;
  };
  struct Head {
    std::string version;
    RecordBuses buses;
    Origin origin;
    std::uint64_t layout = 0;
    std::size_t image_size = 0;
    RecordPartId id;
    std::vector<std::uint8_t> image;
    LineSum sum;
  };
  enum class Place : std::uint8_t { before, in_head, in_part, after_problem };

  Took fail(std::string text, RecordProblemKind kind = RecordProblemKind::damaged);
  Took fail_without_head();
  Took take_parsed(const RecordLine& parsed);
  Took take_tick(const RecordTick& tick);
  void add_to_sum(const RecordLine& parsed, std::string_view line);
  Took take_note(const RecordNote& note);
  Took take_head(std::string_view word, std::string_view rest);
  Took take_state(std::string_view word, std::string_view rest);
  Took end_head(std::string_view checksums);
  Took take_time(TimePoint at, Took took);
  [[nodiscard]] bool read_pack();

  Place place_ = Place::before;
  std::uint64_t lines_ = 0;
  Head head_;
  RecordPartId before_;
  RecordClock clock_;
  std::optional<PackConfig> pack_;
  Origin origin_of_pack_;
  std::uint64_t checksum_ = 0;
  TimePoint latest_{};
  std::int64_t part_from_log_us_ = 0;
  TimePoint part_from_{};
  Observation observation_{};
  RecordTick tick_;
  RecordLine line_;
  bool has_tick_ = false;
  LineSum sum_;  // of the lines from the latest tick on
  std::uint64_t sum_from_line_ = 0;
  std::optional<RecordProblem> alteration_;
  std::optional<RecordProblem> problem_;
};

}  // namespace bmu
