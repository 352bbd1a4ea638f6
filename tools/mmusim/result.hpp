// The result of a run: as text, as JSON, as an exit code for scripts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mmu/scenario/scenario_player.hpp"
#include "tools/mmusim/options.hpp"

namespace bmu::sim {

/// An opening by a master beside the pack, with the cause as its text.
struct Opening {
  double at_s = 0.0;
  std::string text;
};

/// Number of live events during the run.
struct EventCounts {
  std::uint64_t taken = 0;
  std::uint64_t refused = 0;
};

struct RunResult {
  const ScenarioPlayer* script = nullptr;          // concluded
  double ran_s = 0.0;                              // in virtual time
  std::optional<double> took_s{};                  // in real time, if that differs
  std::vector<std::string> lines{};                // further results, a line each
  std::optional<EventCounts> events{};             // if live events were possible
  std::optional<std::vector<Opening>> openings{};  // if there was a master
  std::optional<std::string> ended_by_signal{};    // its name; none: the run was completed
};

/// "SIGINT" or "SIGTERM".
[[nodiscard]] std::string stop_signal_name(int signal);

/// The event, or the result of a condition. The caller prints "12.300 s" before it.
[[nodiscard]] std::string news_text(const ScenarioPlayer& script, const ScenarioNews& news);

/// Prints the summary (or JSON) on standard output, the reason of a failure on standard error. Returns the exit code.
[[nodiscard]] int tell_result(const Options& options, const RunResult& result);

}  // namespace bmu::sim
