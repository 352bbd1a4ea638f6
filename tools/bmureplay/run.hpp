// Runs the parts of a recording, several beside each other, and holds the end of each against the beginning of the
// next.
//
// With another configuration the parts are run one after another, by one core that goes on (replay.hpp).
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
  Duration since_begin{};  // of the recording, without what its clock was set by
  std::vector<std::string> recorded;
  std::vector<std::string> replayed;
  std::uint64_t altered_line = 0;  // the last lines of its part before it, or its own, that are not as written; 0: none
};

/// What a black box says of itself at its head.
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
  std::uint64_t states_compared = 0;  // ends of parts with beginnings of the next
  std::uint64_t states_different = 0;
  std::vector<Difference> differences;  // the first ones
  DecisionChanges changes;              // with another configuration
  std::vector<Damage> damages;
  std::vector<Join> joins;  // where a part does not go on from the one before
  bool has_unreadable_file = false;
  std::vector<std::string> not_replayable;  // reasons: no recording, another version
  std::string misfit;  // of the other configuration: "does not fit drive.log: ..."; empty: it fits, or there is none
  Duration took{};
};

struct RunOptions {
  std::size_t differences_max = 10;
  unsigned threads = 1;
  /// Instead of the recording's; must fit its modules.
  std::optional<PackConfig> other{};
  /// Now and then, with how much of the recording has been run.
  std::function<void(Duration covered)> progress{};
};

[[nodiscard]] Outcome run(PartReader& reader, const RunOptions& options);

}  // namespace bmu::replay
