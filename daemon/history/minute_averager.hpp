// Averages the values of a core over minutes: reads it after every decision, uses each new measurement once, and omits
// invalid and stale ones. No I/O, no clock, no allocation after the construction.
//
// A minute ends at the full minute of the wall clock; after that jumps, or becomes known, the next minute lasts from
// half a period to one and a half. The order of the minutes and their lengths depend on the monotonic clock alone.
//
// Cost: about 5 ns a cell and decision, and some 50 ns a cell at the end of a minute (docs/performance.md).
#pragma once

#include <array>

#include "daemon/history/minute.hpp"

namespace bmu {

class MinuteAverager {
 public:
  /// Reads the core during its whole lifetime. `period` above 0.
  MinuteAverager(const Core& core, Duration period);

  /// Call after each decision. True: a minute has ended, and `minute` is that one until a later call returns true.
  [[nodiscard]] bool update(TimePoint at);
  /// At the end: completes the minute in progress. False: it is empty.
  [[nodiscard]] bool finish(TimePoint at);
  [[nodiscard]] const Minute& minute() const { return minute_; }

 private:
  /// Samples of one quantity, in the minute in progress.
  struct Samples {
    TimePoint taken_at{};  // of the last measurement that was read
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
