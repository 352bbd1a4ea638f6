// The contents of one sample of a report: the mean and the extremes of the known values of each quantity during it,
// read from the core at every decision. The causes of limits are those of its first decision.
//
// Cost: a read of every cell and sensor of the pack per decision.
#pragma once

#include <string>
#include <vector>

#include "daemon/core/core.hpp"
#include "tools/report/data.hpp"

namespace bmu::report {

/// Minimum, mean and maximum of the known values.
class Mean {
 public:
  void take(double value);
  /// Takes the value only if it is usable.
  void take(const Measured<std::int32_t>& value, TimePoint now, Duration age_max, double divisor) {
    if (value.is_usable(now, age_max)) take(value.value / divisor);
  }
  /// `not_known` if no value was taken since the last call.
  void move_to(Series& series);

 private:
  double low_ = 0;
  double high_ = 0;
  double sum_ = 0;
  int count_ = 0;
};

class SampleMeans {
 public:
  /// Sets the number of cells and sensors of the pack; before the first look().
  void resize(std::size_t cells, std::size_t sensors);
  void look(const Core& core, TimePoint now);
  [[nodiscard]] bool is_empty() const { return !has_tick_; }
  /// Appends a sample to the report, which has as many cells and sensors; the following values belong to the next
  /// sample.
  void move_to(ReportData& data, std::int64_t sample_begin_us);

 private:
  void look_at_modules(const Core& core, TimePoint now);

  std::vector<Mean> cells_;
  std::vector<Mean> sensors_;
  Mean pack_V_;
  Mean link_V_;
  Mean current_A_;
  Mean discharge_A_;
  Mean charge_A_;
  Mean soc_;
  Mean soc_doubt_;
  std::string discharge_cause_;
  std::string charge_cause_;
  bool has_tick_ = false;
};

}  // namespace bmu::report
