// A golden recording of bmud, replayed by a core of this build that starts as the recorded one did.
//
// A recording contains the state at the start of each of its parts, which only a core with the same members can
// restore. A golden log must remain usable after such changes. It covers a whole session, so its first state follows
// from the configuration, the start time of the core and the start value of its counters: with those two, stored beside
// it, a core of any build can process the recorded observations.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/fnv.hpp"
#include "tests/support/proofs.hpp"

namespace bmu::test {

/// Initial conditions of the recorded core.
struct Birth {
  std::int64_t started_at_us = 0;
  std::uint8_t first_counter = 0;
};

[[nodiscard]] std::string to_text(const Birth& birth);
/// From a line written by to_text().
[[nodiscard]] std::optional<Birth> birth_of_text(std::string_view line);
/// From the recording itself, if this build's core has the same members and the recorded session had no restored state.
[[nodiscard]] std::optional<Birth> birth_of_recording(const std::string& text);

struct RerunOutcome {
  std::uint64_t ticks = 0;
  std::uint64_t ticks_as_recorded = 0;
  std::uint64_t parts = 0;
  std::uint64_t fingerprint = fnv_start;  // of all decisions
  std::string told;                       // contactor commands and events, a line each, with the second of that session
};

/// Fails the test if the text is no complete recording. `proof`: its watch observes the run, and checks at the end.
[[nodiscard]] RerunOutcome rerun(const std::string& text, const Birth& birth, const Proof& proof);

}  // namespace bmu::test
