// Runs a recording through a core and compares every decision with what was recorded.
//
//   Replay replay({.differs = [](const ReplayDifference& difference) { ... }});
//   for each line: if (!replay.take(line)) break;        // replay.problem() says why: a damaged line, another layout
//   replay.end();
//   replay.counts()
//
// A recording brings its configuration and the state that it begins with (record_writer.hpp), each of its parts anew,
// so that parts can be run beside each other; whether one ended in the state that the next begins with, the checksums
// of both tell.
//
// With `other` the core has that configuration instead, and the differences are what would have gone otherwise. It then
// goes on from part to part as it is, and takes the recorded state only at the start and after a hole. The world does
// not follow: what the recording says of currents and contacts is what happened then.
//
// What is compared of each tick: frames, outputs, events, when to wake and whether all is over, first by their
// fingerprint. Where that differs the lines of both are told.
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
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/core/core.hpp"
#include "daemon/recording/record_line.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// A tick that went otherwise.
struct ReplayDifference {
  std::size_t line = 0;  // of the tick, from 1
  TimePoint at;
  std::int64_t log_us = 0;              // the same on the recording's wall clock
  std::vector<std::string> recorded{};  // lines "> can0 040#...", "= main_negative", "! fault: ..."
  std::vector<std::string> replayed{};  //
};

struct ReplayOptions {
  /// The configuration to decide with instead of the recording's, or why it cannot be that.
  std::function<Result<CoreConfig, std::string>(const PackConfig& recorded)> other{};
  std::function<void(const ReplayDifference& difference)> differs{};
};

enum class ReplayProblemKind : std::uint8_t {
  damaged,        // what it is is known, but not this part of it
  no_recording,   // or one without its beginning
  other_version,  // of the format, or of the core
  other_pack,     // which cannot take over the recorded state
};

struct ReplayProblem {
  ReplayProblemKind kind = ReplayProblemKind::damaged;
  std::size_t line = 0;  // from 1
  std::string text;      // "found ..., wanted ..."
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
  explicit Replay(const ReplayOptions& options) : options_(options) {}

  /// The next line, without its line feed. False: it cannot go on; problem() says why.
  [[nodiscard]] bool take(std::string_view line);
  /// After the last line: a tick whose lines are missing is compared no more.
  void end();

  [[nodiscard]] const ReplayCounts& counts() const { return counts_; }
  [[nodiscard]] const std::optional<ReplayProblem>& problem() const { return problem_; }
  /// As the recording says; once its head has been taken.
  [[nodiscard]] const std::optional<PackConfig>& pack() const { return pack_; }
  [[nodiscard]] const PackSources& sources() const { return head_.origin.sources; }
  [[nodiscard]] const std::string& version() const { return head_.version; }
  /// The state that the last part began with; 0 before the first.
  [[nodiscard]] std::uint64_t checksum_at_begin() const { return checksum_at_begin_; }
  /// Nothing was lost between the part before it and that one.
  [[nodiscard]] bool continues() const { return head_.continues; }
  /// Of the core as it is now, to be held against the next part's. Some milliseconds; 0 before the first part.
  [[nodiscard]] std::uint64_t checksum() const;
  /// Nothing before the head is whole.
  [[nodiscard]] const Core* core() const { return core_.get(); }

 private:
  /// All that the configuration follows from.
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
    bool continues = false;
    std::vector<std::uint8_t> image;
  };
  struct Tick {
    std::size_t line = 0;
    RecordTick recorded;
    std::vector<std::string> recorded_lines;
    std::vector<std::string> replayed_lines;
    std::uint64_t fingerprint = 0;
  };

  bool fail(std::string text, ReplayProblemKind kind = ReplayProblemKind::damaged);
  bool fail_without_head();
  bool take_note(const RecordNote& note);
  bool take_head(std::string_view word, std::string_view rest);
  bool begin_core(std::string_view checksum);
  bool read_pack();
  void decide(const RecordTick& tick);
  void compare();

  ReplayOptions options_;
  Head head_;
  RecordClock clock_;
  std::optional<PackConfig> pack_;
  std::unique_ptr<Core> core_;
  ContactorOutputs outputs_;
  std::optional<Tick> tick_;
  ReplayCounts counts_;
  Origin origin_of_pack_;
  std::uint64_t checksum_at_begin_ = 0;
  bool is_in_head_ = false;
  std::optional<ReplayProblem> problem_;
};

}  // namespace bmu
