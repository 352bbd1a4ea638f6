// Differences between the recorded and the simulated decisions, in a form that shows their consequences: each event and
// each contactor command that only one of both has, and for each kind of report the count and the first one.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "daemon/recording/what_if.hpp"

namespace bmu::replay {

struct ReportChanges {
  std::uint64_t count = 0;
  std::int64_t last_log_us = 0;
  WhatIfReport first;
};

class DecisionChanges {
 public:
  static constexpr std::size_t moves_max = 1000;

  void take(const WhatIfMove& move);
  void take(const WhatIfReport& report);

  /// The first `moves_max` of them.
  [[nodiscard]] const std::vector<WhatIfMove>& moves() const { return moves_; }
  [[nodiscard]] std::uint64_t moves_left_out() const { return left_out_; }
  /// By identifier.
  [[nodiscard]] const std::map<std::uint32_t, ReportChanges>& reports() const { return reports_; }
  [[nodiscard]] bool is_empty() const { return moves_.empty() && reports_.empty(); }

 private:
  std::vector<WhatIfMove> moves_;
  std::uint64_t left_out_ = 0;
  std::map<std::uint32_t, ReportChanges> reports_;
};

}  // namespace bmu::replay
