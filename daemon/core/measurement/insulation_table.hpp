// State of an insulation monitor that the daemon reads directly, instead of the state that the power distribution unit
// reports of its monitor.
//
// On a bus (docs/sensors.md):
//   never received      starting: no value, closing is inhibited, and after 20 s the monitor is lost (fault_readers)
//   receive timeout     after `silence_max()`: no signal, and lost after `lost_confirm_max` more: within 2 s of its
//                       last report, before the second missing one is due. A bus repeats a frame that was not
//                       received, so no report of a healthy device is missing; the timeout does not wait for two
//   earth, faulty, off  immediately, as reported
//   test pending        no self-test since it was switched on. For `test_wait` from its first report on this counts as
//                       starting; then its value is used, with a warning: a test that never runs must not keep a pack
//                       from closing. After a receive timeout its next report is a first one again: it may have been
//                       off. Only for a monitor without a previous timeout the wait is not a loss; otherwise a monitor
//                       that fails intermittently would be waited for without end
//   testing, outdated   its last value is used for `held_max`, since a test takes seconds without a measurement; the
//                       low-resistance flag is evaluated throughout. It reports a failed test as `faulty`; a test that
//                       does not end cannot be detected sooner
//
// By its pulses on a GPIO line of this host (protocol/ir155.hpp): each complete period is a report of the state that it
// encodes, and no value is held. Never received, or older than ir155::edge_silence_max: no signal.
//
// Cost: some comparisons a tick.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "devices/insulation_monitor.hpp"
#include "protocol/fields.hpp"
#include "protocol/ir155.hpp"

namespace bmu {

enum class InsulationState : std::uint8_t {
  no_signal,
  normal,
  undervoltage,
  speed_start,
  device_error,
  earth_fault,
  undefined,  // a number that the protocol does not define
};

[[nodiscard]] std::string_view to_text(InsulationState state);

/// In the terms of PDU_STATUS.
struct InsulationWord {
  InsulationState state = InsulationState::no_signal;
  SignalValue resistance_Ohm;
  bool is_ok = true;               // false: reported as low
  TimePoint taken_at{};            // of the resistance; zero: none
  bool awaits_first_test = false;  // monitor on a bus, since its first report: neither ready nor lost
};

class InsulationTable {
 public:
  static constexpr Duration test_wait = 20s;
  static constexpr Duration held_max = 10s;
  /// Of a monitor on a bus: maximum debounce time of its receive timeout and of the faults that it reports.
  static constexpr Duration lost_confirm_max = 500ms;

  void init(const InsulationConfig& config) { config_ = config; }
  [[nodiscard]] bool is_there() const { return config_.is_heard_itself(); }
  /// Name of its protocol. Precondition: there is a monitor.
  [[nodiscard]] std::string_view protocol() const { return is_on_bus() ? driver().name : "ir155"; }
  /// A frame of the monitor's bus. False: not a frame of the monitor.
  bool observe(const CanFrame& frame, TimePoint at);
  /// Its pulses.
  void observe(const ir155::Pwm& pwm, TimePoint at);
  /// Invalidates the values received over a bus that was down. Pulses carry their age, and their line is not a bus.
  void forget_values();

  /// Of a monitor on a bus: one report period, and two fifths of it for its clock and its bus.
  [[nodiscard]] Duration silence_max() const { return driver().report_period * 7 / 5; }
  [[nodiscard]] bool is_talking(TimePoint now) const;
  [[nodiscard]] InsulationWord word(TimePoint now) const;
  /// Its values are used although it has not run a self-test.
  [[nodiscard]] bool is_untested(TimePoint now) const;
  [[nodiscard]] const MonitorReport& report() const { return report_; }
  /// Its pulses with their present age.
  [[nodiscard]] ir155::Pwm pulses(TimePoint now) const;
  [[nodiscard]] TimePoint heard_at() const { return heard_at_; }
  [[nodiscard]] std::uint64_t frames_refused() const { return frames_refused_; }

 private:
  [[nodiscard]] bool is_on_bus() const { return config_.driver != nullptr; }
  [[nodiscard]] const InsulationDriver& driver() const { return *config_.driver; }
  [[nodiscard]] bool waits_for_test(TimePoint now) const;
  [[nodiscard]] InsulationWord word_of_reports(TimePoint now) const;
  [[nodiscard]] InsulationWord word_of_pulses(TimePoint now) const;

  InsulationConfig config_;
  MonitorReport report_;
  TimePoint first_heard_at_{};  // zero: never
  TimePoint heard_since_{};     // the first report since the last state without signal
  TimePoint heard_at_{};
  SignalValue resistance_Ohm_;  // the last valid one
  TimePoint measured_at_{};
  std::uint64_t frames_refused_ = 0;
  ir155::Pwm pwm_;
  TimePoint pulsed_at_{};  // when they were reported
  BMU_FIELDS(skipped(config_), report_, first_heard_at_, heard_since_, heard_at_, resistance_Ohm_, measured_at_,
             frames_refused_, pwm_, pulsed_at_)
};

}  // namespace bmu
