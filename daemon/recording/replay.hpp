// Runs a recording through a core and compares every decision with the recorded one.
//
//   Replay replay({.differs = [](const ReplayDifference& difference) { ... }});
//   for each line: if (!replay.take(line)) break;        // replay.problem(): a damaged line, another version
//   replay.end();
//   replay.counts()
//
// Each part of a recording contains its configuration and the state at its start (record_writer.hpp), so that parts can
// be run in parallel; the checksums show whether one ended in the state with which the next begins.
//
// Each tick is compared in its frames, outputs, events, wake-up time and end of the shutdown, first by their
// fingerprint. Where that differs the lines of both are reported.
//
// Allocates, but neither reads nor writes anything. Cost: that of the core, and 0.1 us a line (docs/performance.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/recording/record_reader.hpp"

namespace bmu {

/// A tick with a different decision.
struct ReplayDifference {
  std::uint64_t line = 0;  // of the tick, from 1
  TimePoint at;
  std::int64_t log_us = 0;              // the same on the recording's wall clock
  std::vector<std::string> recorded{};  // lines "# > can0 040#...", "# = main_negative", "# ! fault: ..."
  std::vector<std::string> replayed{};  //
};

struct ReplayOptions {
  std::function<void(const ReplayDifference& difference)> differs{};
  /// Lines before a tick were modified after writing; the replay continues nevertheless.
  std::function<void(const RecordProblem& alteration)> altered{};
};

struct ReplayCounts {
  std::uint64_t lines = 0;
  std::uint64_t observations = 0;
  std::uint64_t ticks = 0;
  std::uint64_t ticks_different = 0;
  std::uint64_t begun = 0;        // parts, each with its state
  std::int64_t first_log_us = 0;  // of the first tick
  TimePoint last{};               // of the last one
  Duration covered{};             // from first to last tick, of all parts
};

class Replay {
 public:
  explicit Replay(ReplayOptions options) : options_(std::move(options)) {}

  /// Handles the next line, without its line feed. False: it cannot continue; problem() gives the reason.
  [[nodiscard]] bool take(std::string_view line);
  /// After the last line: compares the last tick, even if lines of it are missing.
  void end();

  [[nodiscard]] const ReplayCounts& counts() const { return counts_; }
  [[nodiscard]] const std::optional<RecordProblem>& problem() const { return problem_; }
  /// Recorded configuration; once the head has been parsed.
  [[nodiscard]] const std::optional<PackConfig>& pack() const { return reader_.pack(); }
  [[nodiscard]] const RecordReader& reader() const { return reader_; }
  /// Null before the head is complete.
  [[nodiscard]] const Core* core() const { return core_.get(); }
  /// Checksum of the core at present, to be compared with the next part's. Some milliseconds; 0 before the first part.
  [[nodiscard]] std::uint64_t checksum() const;

 private:
  struct Tick {
    std::uint64_t line = 0;
    RecordTick recorded;
    std::vector<std::string> recorded_lines;
    std::vector<std::string> replayed_lines;
    std::uint64_t fingerprint = 0;
  };

  [[nodiscard]] bool begin_part();
  void decide(const RecordTick& tick);
  void compare();

  ReplayOptions options_;
  RecordReader reader_;
  std::unique_ptr<Core> core_;
  ContactorOutputs outputs_;
  std::optional<Tick> tick_;
  ReplayCounts counts_;
  std::optional<RecordProblem> problem_;
};

/// Counts a tick, and the time that it covers.
void count_tick(ReplayCounts& counts, TimePoint at, const RecordClock& clock);

}  // namespace bmu
