// What some tests need of a machine and a container may not give. A case that needs it has the tag; where it is missing
// the case is not run, and the program says so: "skipped: ..." with the exit status skipped_status, which ctest shows
// as skipped, by name.
#pragma once

#include <string>
#include <vector>

namespace bmu::test {

/// Exit status of a program none of whose chosen cases was run, as ctest's SKIP_RETURN_CODE has it.
constexpr int skipped_status = 77;

struct MissingNeed {
  std::string tag;   // "[pty]"
  std::string text;  // what is missing
};

/// Of what tags stand for, what this machine does not give:
/// [pty]: pseudo-terminals, as /dev/ptmx with /dev/pts;
/// [bus]: room in /dev/shm for the buses between programs of this machine, for as many tests as run beside each other.
[[nodiscard]] std::vector<MissingNeed> missing_needs();

/// The pattern of cases that leaves out what has one of these tags; `pattern` is one of Catch2's, "" for every case.
[[nodiscard]] std::string without(const std::string& pattern, const std::vector<MissingNeed>& missing);

}  // namespace bmu::test
