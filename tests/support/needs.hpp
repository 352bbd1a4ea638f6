// Requirements of some tests that a container may not provide. A case with a requirement has its tag; where it is
// missing the case is not run, and the program prints "skipped: ..." with the exit status skipped_status, which ctest
// shows as skipped, by name.
#pragma once

#include <string>
#include <vector>

namespace bmu::test {

/// Exit status of a program that has run none of its selected cases, as ctest's SKIP_RETURN_CODE has it.
constexpr int skipped_status = 77;

struct MissingNeed {
  std::string tag;   // "[pty]"
  std::string text;  // what is missing
};

/// The needs that this machine does not provide, of:
/// [pty]: pseudo-terminals, as /dev/ptmx with /dev/pts;
/// [bus]: room in /dev/shm for the buses between programs of this machine, for as many tests as run in parallel.
[[nodiscard]] std::vector<MissingNeed> missing_needs();

/// The pattern without the cases that have one of these tags; `pattern` is one of Catch2's, "" for every case.
[[nodiscard]] std::string without(const std::string& pattern, const std::vector<MissingNeed>& missing);

}  // namespace bmu::test
