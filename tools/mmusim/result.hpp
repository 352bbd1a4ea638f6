// What a run came to: as text for people, as JSON for machines, as an exit code for scripts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mmu/scenario/scenario_player.hpp"
#include "tools/mmusim/options.hpp"

namespace bmu::sim {

/// A moment in which a master beside the pack opened it, in its words.
struct Opening {
  double at_s = 0.0;
  std::string text;
};

/// What people had happen while it ran.
struct EventCounts {
  std::uint64_t taken = 0;
  std::uint64_t refused = 0;
};

struct RunResult {
  const ScenarioPlayer* script = nullptr;          // concluded
  double ran_s = 0.0;                              // in the emulated world
  std::optional<double> took_s{};                  // in the real one, when that is another
  std::vector<std::string> lines{};                // what else there is to say, a line each
  std::optional<EventCounts> events{};             // where there was a way to say something
  std::optional<std::vector<Opening>> openings{};  // when there was a master
  std::optional<std::string> ended_by_signal{};    // its name; none: the run came to its end
};

/// "SIGINT" or "SIGTERM".
[[nodiscard]] std::string stop_signal_name(int signal);

/// "12.300 s" is printed before it by the caller: what happened, or what became of a condition.
[[nodiscard]] std::string news_text(const ScenarioPlayer& script, const ScenarioNews& news);

/// Summary (or JSON) on standard output, the reason of a failure on standard error. The exit code.
[[nodiscard]] int tell_result(const Options& options, const RunResult& result);

}  // namespace bmu::sim
