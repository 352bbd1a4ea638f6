// Makes minutes of what a core knows: looks at it after every decision, takes each new measurement once, and leaves out
// what is not valid or too old. No I/O, no clock, no allocation after the construction.
//
// A minute ends at the full minute of the wall clock; where that jumps, or is told for the first time, the one under
// way becomes up to half as short, or half as long again. The order of the minutes and their lengths go by the
// monotonic clock alone.
//
// Cost: about 5 ns a cell and decision, and some 50 ns a cell with the last of a minute (docs/performance.md).
#pragma once

#include <array>

#include "daemon/history/minute.hpp"

namespace bmu {

class MinuteAverager {
 public:
  /// Looks at the core for as long as it lives. `period` above 0.
  MinuteAverager(const Core& core, Duration period);

  /// After each decision. True: a minute is over, and `minute` is that one until a later call returns true.
  [[nodiscard]] bool update(TimePoint at);
  /// At the end: what there is of the minute under way. False: nothing.
  [[nodiscard]] bool finish(TimePoint at);
  [[nodiscard]] const Minute& minute() const { return minute_; }

 private:
  /// Of one quantity, in the minute under way.
  struct Samples {
    TimePoint taken_at{};  // of the last one looked at
    std::int64_t sum = 0;
    std::int32_t min = 0;
    std::int32_t max = 0;
    std::uint32_t count = 0;

    void look(const Measured<std::int32_t>& measured, TimePoint now, Duration age_max);
    [[nodiscard]] SampledValue value() const;
    void begin() { sum = count = 0; }
  };

  void begin(TimePoint at);
  void end(TimePoint at);
  void look(TimePoint at);
  void look_at_modules(TimePoint at, Duration passed);
  void fill_cells();
  void fill_pack(TimePoint at);
  void fill_flow();

  const Core& core_;
  Duration period_;
  Minute minute_;
  std::array<Samples, cells_max> voltage_uV_{};
  std::array<Samples, sensors_max> temperature_dC_{};
  std::array<Duration, cells_max> bled_{};
  Samples current_mA_;
  Samples pack_voltage_mV_;
  Samples link_voltage_mV_;
  bool has_begun_ = false;
  TimePoint began_at_{};
  TimePoint ends_at_{};
  TimePoint looked_at_{};
  Duration closed_{};
  ChargeState charge_at_begin_;
  std::uint16_t modules_answering_min_ = 0;
  std::bitset<fault_count> faults_present_;
  std::bitset<fault_count> warnings_present_;
};

}  // namespace bmu
