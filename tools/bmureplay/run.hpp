// Runs the parts of a recording, several in parallel, and compares the state at the end of each with the start of the
// next.
//
// With another configuration the parts are run one after another, by one core that continues
// (daemon/recording/what_if.hpp).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/recording/replay.hpp"
#include "tools/bmureplay/decision_changes.hpp"
#include "tools/bmureplay/joins.hpp"
#include "tools/bmureplay/part.hpp"

namespace bmu::replay {

struct Difference {
  std::string file;
  std::uint64_t line = 0;  // of the file
  std::int64_t log_us = 0;
  TimePoint at{};          // the same on the core's clock
  Duration since_begin{};  // of the recording, without the changes of its clock
  std::vector<std::string> recorded;
  std::vector<std::string> replayed;
  std::uint64_t altered_line = 0;  // the last modified line of its part before it, or its own; 0: none
};

/// The head of a black box.
struct BlackBoxHead {
  std::string file;
  std::string cause;
};

struct Outcome {
  std::string version;
  std::string pack_name;
  std::vector<BlackBoxHead> black_boxes;
  std::int64_t first_log_us = 0;
  ReplayCounts counts;                // of all parts
  std::uint64_t states_compared = 0;  // ends of parts compared with the starts of the next
  std::uint64_t states_different = 0;
  std::vector<Difference> differences;  // the first ones
  DecisionChanges changes;              // with another configuration only
  std::vector<Damage> damages;
  std::vector<Join> joins;  // parts that do not continue the one before
  bool has_unreadable_file = false;
  std::vector<std::string> not_replayable;  // reasons: no recording, another version
  std::string misfit;  // of the other configuration: "does not fit drive.log: ..."; empty: it fits, or there is none
  Duration took{};
};

struct RunOptions {
  std::size_t differences_max = 10;
  unsigned threads = 1;
  /// Replaces the recording's configuration; must fit its modules.
  std::optional<PackConfig> other{};
  /// Called after each part, with the duration of the recording that has been run.
  std::function<void(Duration covered)> progress{};
};

[[nodiscard]] Outcome run(PartReader& reader, const RunOptions& options);

}  // namespace bmu::replay
