// Runs a recording through a core and compares every decision with what was recorded.
//
//   Replay replay({.other = nullptr});
//   for each line: if (!replay.take(line)) break;        // replay.problem() says why: a damaged line, another layout
//   replay.end();
//   replay.differences(), replay.counts()
//
// A recording brings its configuration and the state that it begins with (record_writer.hpp). With `other` the core has
// that configuration instead, and the differences are what would have gone otherwise. The world does not follow: what
// the recording says of currents and contacts is what happened then.
//
// What is compared of each tick: frames, outputs, events, when to wake and whether all is over, first by their
// fingerprint. Where that differs the lines of both are told.
//
// Allocates, but neither reads nor writes anything. Cost: that of the core, and 0.1 us a line (docs/performance.md).
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
#include "daemon/recording/record_line.hpp"

namespace bmu {

struct ReplayOptions {
  const CoreConfig* other = nullptr;  // instead of the recording's
  std::size_t differences_max = 1;    // so many are kept, and then only counted
};

/// A tick that went otherwise.
struct ReplayDifference {
  std::size_t line = 0;  // of the tick, from 1
  TimePoint at;
  std::int64_t log_us = 0;              // the same on the recording's wall clock
  std::vector<std::string> recorded{};  // lines "> can0 040#...", "= main_negative", "! fault: ..."
  std::vector<std::string> replayed{};  //
};

struct ReplayProblem {
  std::size_t line = 0;  // from 1
  std::string text;      // "found ..., wanted ..."
};

struct ReplayCounts {
  std::uint64_t lines = 0;
  std::uint64_t observations = 0;
  std::uint64_t ticks = 0;
  std::uint64_t ticks_different = 0;
  std::uint64_t begun = 0;  // parts, each with its state
  TimePoint first{};        // of all ticks
  TimePoint last{};
  Duration covered{};  // from first to last tick, of all parts
};

class Replay {
 public:
  explicit Replay(const ReplayOptions& options) : options_(options) {}

  /// The next line, without its line feed. False: it cannot go on; problem() says why.
  [[nodiscard]] bool take(std::string_view line);
  /// After the last line: a tick whose lines are missing is compared no more.
  void end();

  [[nodiscard]] const ReplayCounts& counts() const { return counts_; }
  [[nodiscard]] const std::vector<ReplayDifference>& differences() const { return differences_; }
  [[nodiscard]] const std::optional<ReplayProblem>& problem() const { return problem_; }
  /// As the recording says; once its head has been taken.
  [[nodiscard]] const std::optional<PackConfig>& pack() const { return pack_; }
  [[nodiscard]] const std::string& version() const { return head_.version; }
  /// Nothing before the head is whole.
  [[nodiscard]] const Core* core() const { return core_.get(); }

 private:
  struct Head {
    std::string version;
    RecordBuses buses;
    PackSources sources;
    std::string hash;
    std::int32_t internal_kbit_per_s = 0;
    std::uint64_t layout = 0;
    std::size_t image_size = 0;
    std::vector<std::uint8_t> image;
  };
  struct Tick {
    std::size_t line = 0;
    RecordTick recorded;
    std::vector<std::string> recorded_lines;
    std::vector<std::string> replayed_lines;
    std::uint64_t fingerprint = 0;
  };

  bool fail(std::string text);
  bool take_note(const RecordNote& note);
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
  std::vector<ReplayDifference> differences_;
  std::optional<ReplayProblem> problem_;
};

}  // namespace bmu
