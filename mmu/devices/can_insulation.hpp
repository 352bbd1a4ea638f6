// Emulated insulation monitor on a bus, in any protocol: a periodic report of the values of the script and the plant.
// Switched off it sends nothing; a self-test takes as long as the script keeps it running.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "devices/insulation_monitor.hpp"
#include "mmu/devices/pdu.hpp"
#include "mmu/devices/periodic.hpp"

namespace bmu {

/// In the order of the script's words.
enum class SelfTest : std::uint8_t { done, pending, running };

class CanInsulation {
 public:
  /// `driver` null: no monitor. `threshold_kOhm`: below it the monitor reports low insulation.
  CanInsulation(const InsulationDriver* driver, double threshold_kOhm, TimePoint started_at)
      : driver_(driver),
        threshold_kOhm_(threshold_kOhm),
        due_(started_at + period(), driver != nullptr ? period() : Duration{1}) {}

  [[nodiscard]] const InsulationDriver* driver() const { return driver_; }
  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  /// The report that is due, if any.
  [[nodiscard]] std::optional<CanFrame> tick(TimePoint now, double resistance_kOhm) {
    const bool is_due = is_there() && due_.take(now);
    if (!is_due || state == InsulationMonitor::no_signal) return std::nullopt;
    MonitorReport report{.is_low = resistance_kOhm < threshold_kOhm_,
                         .is_earth_lost = state == InsulationMonitor::earth_fault,
                         .is_faulty = state == InsulationMonitor::device_error,
                         .is_testing = self_test == SelfTest::running || state == InsulationMonitor::speed_start,
                         .is_test_pending = self_test == SelfTest::pending};
    if (!report.is_testing) report.resistance_Ohm = known(std::llround(resistance_kOhm) * 1'000);
    return driver_->report(report);
  }

  InsulationMonitor state = InsulationMonitor::normal;
  SelfTest self_test = SelfTest::done;

 private:
  [[nodiscard]] Duration period() const { return driver_ != nullptr ? driver_->report_period : Duration{}; }

  const InsulationDriver* driver_;
  double threshold_kOhm_;
  Periodic due_;
};

}  // namespace bmu
