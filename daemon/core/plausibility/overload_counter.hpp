// I2t counter of the current above the continuous rating of the pack: the excess heat, (I^2 - continuous^2) * t.
//
// The count reaches the budget at the peak current in the configured time (50 A for 10 s beside 25 A continuous,
// BMS_NF.7), faster above it and slower below, and falls while the current is below the continuous value. It starts
// empty: heat from before the start of this process has had at least the time of a restart and of a new precharge to
// dissipate.
//
// Of two samples the smaller current counts for the time between them: a single implausible sample adds nothing. A gap
// of more than a second between samples changes nothing.
#pragma once

#include <algorithm>
#include <cstdint>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class OverloadCounter {
 public:
  void init(const CurrentLimitConfig& config);
  /// Every valid sample of the pack current, in the order of their times.
  void observe(const Measured<std::int32_t>& current_mA);

  /// Used share of the budget; 1000 is all of it. 0 without a configured peak.
  [[nodiscard]] std::int64_t discharge_used_permille() const { return discharge_.used_permille(); }
  [[nodiscard]] std::int64_t charge_used_permille() const { return charge_.used_permille(); }
  [[nodiscard]] TimePoint counted_at() const { return last_mA_.taken_at; }

 private:
  /// Squares of centiamperes times microseconds: exact, and 1500 A for two minutes still fit.
  struct Heat {
    std::int64_t continuous_cA2 = 0;
    std::int64_t budget = 0;  // 0: not monitored
    std::uint64_t used = 0;   // up to twice the budget

    void init(std::int32_t continuous_mA, std::int32_t peak_mA, Duration peak_for);
    void count(std::int32_t magnitude_mA, std::int64_t span_us);
    [[nodiscard]] std::int64_t used_permille() const;
    /// The restored count may be from a configuration with a larger budget.
    void after_reading_fields() { used = std::min(used, 2 * static_cast<std::uint64_t>(budget)); }
    BMU_FIELDS(skipped(continuous_cA2), skipped(budget), used)
  };

  Heat discharge_;
  Heat charge_;
  Measured<std::int32_t> last_mA_;
  BMU_FIELDS(discharge_, charge_, last_mA_)
};

}  // namespace bmu
