// What an insulation monitor that is heard itself last said, and what follows from it; instead of the power
// distribution unit's word on its monitor.
//
// On a bus (docs/sensors.md):
//   never heard           starting: no value, nothing closes, and after 20 s the monitor is lost (fault_readers)
//   silent                for `silence_max()`: no signal, and lost after `lost_confirm_max` more: within 2 s of its
//                         last word, before the second one that is due. A bus repeats what was not received, so of a
//                         device that is well none is missing; two are not waited for
//   earth, faulty, off    at once, as it says
//   test pending          it has not tested itself since it was switched on. For `test_wait` from its first word on
//                         that counts as starting; then its value counts, and a warning says so: a test that never
//                         comes must not keep a pack from closing. After a silence that was no signal its next word is
//                         a first one again: it may have been off. The wait is no loss only for a monitor that has not
//                         been silent yet, or one that comes and goes would be waited for without end
//   testing, outdated     its last value counts for `held_max`, since a test takes seconds in which it measures
//                         nothing; that it is low counts all the while. That a test has failed it reports by itself, as
//                         faulty; one that does not end cannot be known sooner
//
// By its pulses on a line of this machine (protocol/ir155.hpp): each whole period is a word, of the state it has, and
// none is held. Never told, or older than ir155::edge_silence_max: no signal.
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
  undefined,  // a number the protocol does not know
};

[[nodiscard]] std::string_view to_text(InsulationState state);

/// In the words of the power distribution unit.
struct InsulationWord {
  InsulationState state = InsulationState::no_signal;
  SignalValue resistance_Ohm;
  bool is_ok = true;               // the monitor does not say that it is low
  TimePoint taken_at{};            // of the resistance; zero: there is none
  bool awaits_first_test = false;  // of a monitor on a bus, since it was first heard: neither there yet nor lost
};

class InsulationTable {
 public:
  static constexpr Duration test_wait = 20s;
  static constexpr Duration held_max = 10s;
  /// Of one on a bus: longer than this its silence, and what it says of itself, is not waited for.
  static constexpr Duration lost_confirm_max = 500ms;

  void init(const InsulationConfig& config) { config_ = config; }
  [[nodiscard]] bool is_there() const { return config_.is_heard_itself(); }
  /// What it speaks; only where there is one.
  [[nodiscard]] std::string_view protocol() const { return is_on_bus() ? driver().name : "ir155"; }
  /// A frame of the monitor's bus. False: it is none of the monitor's.
  bool observe(const CanFrame& frame, TimePoint at);
  /// Its pulses.
  void observe(const ir155::Pwm& pwm, TimePoint at);
  /// What came over a bus that was away. Pulses say how old they are, and their line is no bus.
  void forget_values();

  /// Of one on a bus: one of its reports, and two fifths of the time to the next for its clock and its bus.
  [[nodiscard]] Duration silence_max() const { return driver().report_period * 7 / 5; }
  [[nodiscard]] bool is_talking(TimePoint now) const;
  [[nodiscard]] InsulationWord word(TimePoint now) const;
  /// Its values count although it has not tested itself.
  [[nodiscard]] bool is_untested(TimePoint now) const;
  [[nodiscard]] const MonitorReport& report() const { return report_; }
  /// Its pulses as old as they are now.
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
  TimePoint heard_since_{};     // the first word since it was last without signal
  TimePoint heard_at_{};
  SignalValue resistance_Ohm_;  // the last that was one
  TimePoint measured_at_{};
  std::uint64_t frames_refused_ = 0;
  ir155::Pwm pwm_;
  TimePoint pulsed_at_{};  // when it was told
  BMU_FIELDS(skipped(config_), report_, first_heard_at_, heard_since_, heard_at_, resistance_Ohm_, measured_at_,
             frames_refused_, pwm_, pulsed_at_)
};

}  // namespace bmu
