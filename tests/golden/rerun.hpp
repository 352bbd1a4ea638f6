// A golden recording of bmud, run by a core of this build that begins as the recorded one did.
//
// A recording brings the state that each of its parts begins with, which only a core with the same members can take. A
// golden log has to outlive that. It is of a whole life, so its first state follows from the configuration, from when
// the core began and from where its counters did: those two, written down beside it, make a core of any build that can
// hear what the recorded one heard.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/fnv.hpp"
#include "tests/support/proofs.hpp"

namespace bmu::test {

/// How the core of a recording began.
struct Birth {
  std::int64_t started_at_us = 0;
  std::uint8_t first_counter = 0;
};

[[nodiscard]] std::string to_text(const Birth& birth);
/// Of a line that to_text() has written.
[[nodiscard]] std::optional<Birth> birth_of_text(std::string_view line);
/// Out of the recording itself, if this build's core has the same members and the recording is of a life without memory
/// of any before.
[[nodiscard]] std::optional<Birth> birth_of_recording(const std::string& text);

struct RerunOutcome {
  std::uint64_t ticks = 0;
  std::uint64_t ticks_as_recorded = 0;
  std::uint64_t parts = 0;
  std::uint64_t fingerprint = fnv_start;  // of all that was decided
  std::string told;                       // what was commanded and told, a line each, with its second of that life
};

/// Fails the test where the text is no whole recording. `proof`: its watch looks on, and checks at the end.
[[nodiscard]] RerunOutcome rerun(const std::string& text, const Birth& birth, const Proof& proof);

}  // namespace bmu::test
