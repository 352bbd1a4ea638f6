// Trend of the bus counters: load, and whether an error counter has increased recently. Computed from successive watch
// updates, by the daemon's clock.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "tools/bmuctl/reply.hpp"
#include "tools/common/page.hpp"

namespace bmu {

class BusTrend {
 public:
  /// Adds the next "status". A restart of the daemon starts a new trend.
  void take(const Reply& status);

  /// Over the last two seconds, by the port's index in "ports"; nothing until there are two samples.
  [[nodiscard]] std::optional<std::int64_t> bit_per_s(std::size_t port) const;
  /// True if an error counter has increased within the last ten seconds.
  [[nodiscard]] bool has_grown(std::size_t port, const std::string& counter) const;

  /// A row for each bus: its state, load and error counters. `status` is the one passed to take() last.
  [[nodiscard]] std::vector<Line> lines(const Reply& status) const;

 private:
  struct Port {
    std::int64_t bits = 0;
    std::vector<std::int64_t> troubles;  // in the order of trouble_table
  };
  struct Sample {
    std::int64_t uptime_ms = 0;
    std::vector<Port> ports;
  };

  std::deque<Sample> samples_;
};

}  // namespace bmu
