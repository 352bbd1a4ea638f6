// What the counters of the buses do over time: load, and whether something has gone wrong lately. From picture to
// picture, by the daemon's own clock.
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
  /// The next "status". A daemon that has started anew begins a new trend.
  void take(const Reply& status);

  /// Of the last two seconds, by the port's place in "ports"; nothing until there are two pictures.
  [[nodiscard]] std::optional<std::int64_t> bit_per_s(std::size_t port) const;
  /// A counter of trouble has grown within the last ten seconds.
  [[nodiscard]] bool has_grown(std::size_t port, const std::string& counter) const;

  /// A row for each bus: its state, load and what goes wrong on it. `status` is the one taken last.
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
