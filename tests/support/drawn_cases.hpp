// Random cases of a property, by rapidcheck: a failing case is made as small as possible while it still fails, and
// reported with the drawn values, the seed, and the command that runs that case again.
//
// The body draws with `*generator` and states the requirements with RC_ASSERT and RC_FAIL of <rapidcheck.h>, not with
// CHECK and REQUIRE: Catch2 would count each smaller case that fails. Cases are full-sized from the first one on where
// the generator ignores its size argument, as those of tests/property do; rapidcheck begins with size 0.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace bmu::test {

struct DrawnCases {
  bool is_held = false;
  /// One case of an earlier run, and not all of them: it permits no conclusion about the number of cases with an
  /// effect.
  bool is_repeat = false;
  /// Of a property that does not hold.
  std::string report{};
};

/// `name` of the test, for the command. `repeat`: as the report gives it for RC_PARAMS; empty: all cases. Throws
/// std::exception for a damaged one.
[[nodiscard]] DrawnCases draw_cases(const std::string& name, int cases, std::uint64_t seed, const std::string& repeat,
                                    const std::function<void()>& property);

/// The same in the running test case, which fails where the property does not hold; the report is on stderr. The seed
/// is 1, so that each run has the same cases, or BMUD_SEED; RC_PARAMS repeats a case. Returns whether all cases were
/// run.
bool holds_for_all(int cases, const std::function<void()>& property);

}  // namespace bmu::test
