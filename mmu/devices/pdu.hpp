// Power distribution unit (PDU): drives the contactors as commanded, and opens them by itself when the commands stop.
//
//   observe(frame, now)       a CONTACTOR_COMMAND that passes every check drives the outputs at once and is valid for
//                             200 ms; one that fails any check, or repeats a counter, changes nothing and extends
//                             nothing.
//   tick(now, measurements)   every 1 ms or so: opens outputs with an expired command, and returns PDU_STATUS every
//                             50 ms, and at once when a contact, an output, an input or the insulation monitor's state
//                             has changed. A PDU with a sensor in the intake air sends PDU_TEMPERATURE once a second.
//                             Insulation resistance and throttle alone wait for their period: they change continuously.
//
// The insulation monitor's status line is an input like the others; its pulse-width signal is read by protocol/ir155.
// PDU_STATUS has one code for speed start, good or bad, and none for an undefined signal, which is sent as no signal.
//
// The alarm outputs of the modules (alarm.hpp) are in the enable loop of the contactors: while that is open, the PDU
// drives neither contactors nor motor controller nor heater, regardless of the command, and drives none of them again
// before it receives a command without any contactor while the loop is closed. The fan follows the command. PDU_STATUS
// carries the loop in `alarm_loop_open`, and `opened_by_timeout` as for every opening by the PDU itself, until the
// command is to open.
//
// Because the PDU opens everything by itself, the pack opens if the daemon is dead. Pure, like the MMU.
#pragma once

#include <cstdint>

#include "mmu/devices/contactor.hpp"
#include "mmu/devices/periodic.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/ir155.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

struct PduOutputs {
  ContactorFlags contactors{};
  bool auxiliary = false;
  bool fan = false;
  bool heater = false;

  [[nodiscard]] constexpr bool any() const {
    for (const bool is_driven : contactors) {
      if (is_driven) return true;
    }
    return auxiliary || fan || heater;
  }
  friend constexpr bool operator==(const PduOutputs&, const PduOutputs&) = default;
};

struct PduInputs {
  bool vehicle_on = false;
  bool charger_connected = false;
  bool estop_1_released = true;
  bool estop_2_released = true;
  bool interlock_closed = true;
  bool insulation_monitor_ok = true;
  bool resume_button = false;

  friend constexpr bool operator==(const PduInputs&, const PduInputs&) = default;
};

/// State of the monitor as sent in PDU_STATUS.
enum class InsulationMonitor : std::uint8_t { no_signal, normal, undervoltage, speed_start, device_error, earth_fault };
[[nodiscard]] InsulationMonitor told_state(ir155::State state);

struct PduMeasurements {
  ContactorFlags feedback{};  // auxiliary contacts
  PduInputs inputs{};
  ir155::Pwm insulation{};
  SignalValue throttle_permille{};
  // Not fitted: the PDU has no sensor in the intake air, and sends no PDU_TEMPERATURE.
  SignalValue intake_air_dC{.validity = Validity::not_fitted};
  bool alarm_loop_open = false;  // also false without such a loop
};

struct PduCounts {
  std::uint64_t commands = 0;  // accepted
  std::uint64_t timeouts = 0;  // something was driven and the commands stopped
  std::uint64_t alarms = 0;    // a contactor was driven and the alarm loop opened
};

using PduFrames = FixedVector<CanFrame, 2>;

class Pdu {
 public:
  static constexpr Duration status_period = 50ms;
  static constexpr Duration temperature_period = 1s;

  explicit Pdu(TimePoint powered_at)
      : periodic_(powered_at, status_period), temperatures_(powered_at, temperature_period) {}

  void observe(const CanFrame& frame, TimePoint now);
  [[nodiscard]] PduFrames tick(TimePoint now, const PduMeasurements& measured);

  [[nodiscard]] const PduOutputs& outputs() const { return outputs_; }
  [[nodiscard]] const PduCounts& counts() const { return counts_; }
  [[nodiscard]] const ReceiveCounts& receive_counts() const { return check_.counts(); }

 private:
  /// Values that are sent at once when they change.
  struct Told {
    ContactorFlags feedback{};
    PduOutputs outputs;
    PduInputs inputs;
    InsulationMonitor insulation_monitor = InsulationMonitor::no_signal;
    bool opened_by_timeout = false;
    bool alarm_loop_open = false;

    friend bool operator==(const Told&, const Told&) = default;
  };

  void open_if_expired(TimePoint now);
  [[nodiscard]] CanFrame make_temperature(const SignalValue& intake_air_dC);
  void open_if_alarmed(bool is_loop_open);
  void disable_outputs();
  [[nodiscard]] CanFrame make_status(const PduMeasurements& measured, const ir155::Reading& insulation);

  ReceiveCheck check_{internal_bus::catalogue, ReceiveCheck::Role::listener};
  Periodic periodic_;
  Periodic temperatures_;
  PduOutputs outputs_;
  TimePoint expires_at_{};
  bool opened_by_timeout_ = false;  // until the next command
  bool is_loop_open_ = false;
  bool is_disabled_ = false;  // by the alarm loop, until a command to open
  Told told_;
  std::uint8_t counter_ = 0;
  std::uint8_t temperature_counter_ = 0;
  PduCounts counts_;
};

}  // namespace bmu
