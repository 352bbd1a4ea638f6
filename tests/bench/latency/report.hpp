// The measured latencies, as a table or as JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/time.hpp"

namespace bmu::latency {

struct Measured {
  std::string condition;  // how the daemons were run, and the load beside them
  std::string pack;
  std::string fault;
  unsigned packs = 0;
  unsigned busy_loops = 0;
  double ran_s = 0.0;
  std::vector<Duration> latencies;
  // Sessions without a measurement.
  std::uint64_t never_closed = 0;
  std::uint64_t opened_by_itself = 0;
  std::uint64_t completed_by_time = 0;  // by a tick, not by a frame (injected_fault.hpp)
  std::uint64_t no_answer = 0;
};

/// The smallest value that `permille` of all do not exceed. Precondition: sorted, not empty.
[[nodiscard]] Duration quantile(const std::vector<Duration>& sorted, unsigned permille);

[[nodiscard]] std::string to_text(const Measured& measured);
[[nodiscard]] std::string to_json(const Measured& measured);

}  // namespace bmu::latency
