// Runs of many seeds, on several threads, and their results: the number of faults of each kind, the time that each took
// to open, and the seeds that broke a rule.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "tests/simulation/life.hpp"

namespace bmu::test {

struct SeedRange {
  std::uint64_t first = 1;
  std::uint64_t last = 1;
};

struct FailedSeed {
  std::uint64_t seed = 0;
  Violation violation;
  std::vector<std::size_t> least;  // of its faults those that are enough; empty if not minimised
};

struct KindCount {
  std::uint64_t faults = 0;
  std::vector<Duration> reactions;

  [[nodiscard]] Duration worst() const;
};

struct SweepResult {
  std::uint64_t seeds = 0;
  Duration lived{};
  std::uint64_t faults = 0;
  std::uint64_t times_closed = 0;
  std::uint64_t times_opened = 0;
  std::map<std::string_view, KindCount> kinds;
  std::vector<FailedSeed> failed;  // by seed
  std::uint64_t hash = 0;          // of all decisions of all runs
  bool had_guests = true;          // whether guests were drawn
};

struct SweepOptions {
  unsigned threads = 1;
  bool minimises = false;
  bool has_guests = true;
  std::function<void(std::uint64_t done)> progress{};
};

[[nodiscard]] SweepResult sweep(SeedRange seeds, const SweepOptions& options);

/// A command line that repeats it.
[[nodiscard]] std::string reproduction(std::uint64_t seed, const std::vector<std::size_t>& only,
                                       bool has_guests = true);
[[nodiscard]] std::string to_text(const SweepResult& result);
[[nodiscard]] std::string to_json(const SweepResult& result);

}  // namespace bmu::test
