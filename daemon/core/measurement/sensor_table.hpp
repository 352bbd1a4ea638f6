// Latest values of the current sensor and the power distribution unit. Same rules as the module table.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/measurement/current_window.hpp"
#include "daemon/core/measurement/insulation_table.hpp"
#include "daemon/core/measurement/refused_values.hpp"
#include "daemon/core/types/contactor_id.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/line_image.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/message.hpp"

namespace bmu {

struct PduState {
  // Auxiliary contacts: the actual state.
  bool main_positive_closed = false;
  bool main_negative_closed = false;
  bool precharge_closed = false;
  bool charge_closed = false;
  bool opened_by_timeout = false;
  bool alarm_loop_open = false;  // alarm outputs of the modules; also false for a PDU without such a loop
  // Inputs, true = healthy or present.
  bool vehicle_on = false;
  bool charger_connected = false;
  bool estop_1_released = false;
  bool estop_2_released = false;
  bool interlock_closed = false;
  bool insulation_monitor_ok = false;
  bool resume_button = false;
  bool supply_ok = true;  // not in PDU_STATUS; possibly from a GPIO line of this host
  // Further inputs, on GPIO lines of this host: bits in the order of the pack file.
  std::uint16_t estops_pressed = 0;
  std::uint16_t interlocks_open = 0;
  InsulationState insulation_state = InsulationState::no_signal;
  SignalValue insulation_resistance_Ohm;
  SignalValue throttle_permille;

  /// All inputs that can withdraw permission are healthy.
  [[nodiscard]] constexpr bool is_healthy() const {
    return estop_1_released && estop_2_released && estops_pressed == 0 && interlock_closed && interlocks_open == 0 &&
           insulation_monitor_ok && !opened_by_timeout && !alarm_loop_open;
  }
  [[nodiscard]] constexpr bool any_contactor_closed() const {
    return main_positive_closed || main_negative_closed || precharge_closed || charge_closed;
  }
  friend bool operator==(const PduState&, const PduState&) = default;
};

/// The monitor measures, and has reported a resistance, or one above its range.
[[nodiscard]] constexpr bool knows_insulation(const PduState& pdu) {
  const bool measures =
      pdu.insulation_state == InsulationState::normal || pdu.insulation_state == InsulationState::undervoltage;
  const Validity validity = pdu.insulation_resistance_Ohm.validity;
  return measures && (validity == Validity::valid || validity == Validity::above_range);
}

/// Merges the two sources of contacts and inputs. A permission needs both sources, a request only one; a contact counts
/// as closed if either source reports it closed.
[[nodiscard]] Measured<PduState> merge_inputs(const Measured<PduState>& unit, const Measured<LineImage>& lines,
                                              const CoreConfig& config);

struct SensorTable {
  Measured<std::int32_t> current_mA;    // positive out of the pack, whatever the mounting direction
  Measured<std::int32_t> current_2_mA;  // of the second sensor, if there is one
  Measured<std::int32_t> pack_voltage_mV;
  Measured<std::int32_t> pack_voltage_before_mV;  // the previous result
  Measured<std::int32_t> link_voltage_mV;
  // Contacts and inputs from all sources of the pack: PDU_STATUS, the GPIO lines of this host, or both merged. As old
  // as the older of its sources; unknown while one of them is.
  Measured<PduState> pdu;
  Temperature_dC intake_air_dC;  // from PDU or file, as the pack file selects
  RefusedResults refused;        // of all channels together
  RefusedPulses refused_pulses;
  CurrentWindow current_window;
  TimePoint insulation_known_at{};  // last reported resistance; before the first: possible start of the monitor
  bool insulation_told = false;     // a resistance has been reported
  InsulationWord insulation;        // of a monitor that the daemon reads directly, if there is one

  // The two sources separately.
  Measured<PduState> pdu_word;
  Measured<LineImage> lines;

  /// Handles a checked frame of the sensor or the PDU. An invalid result counts like a missing frame: the last value
  /// becomes stale, and the channel with it, but a single invalid result does not open a pack.
  void observe(const MessageSpec& message, const CanFrame& frame, TimePoint at, const CoreConfig& config);
  /// Handles the current of a sensor with frames of its own, as received.
  void observe_current(const SignalValue& told_mA, bool is_first, TimePoint at, const CoreConfig& config);
  /// After an interruption of the core (stall, bus down, sleep) previously received values are invalid; counters are
  /// kept.
  void forget_values(TimePoint at) {
    *this = {.refused = refused, .refused_pulses = refused_pulses, .insulation_known_at = at};
  }
  /// Stores the present state of a monitor that the daemon reads directly, if there is one.
  void take_insulation(const InsulationWord& word, const CoreConfig& config);
  /// Handles the temperature of the intake air from a sensor of this host, if the pack file selects it.
  void observe_intake_air(std::int32_t temperature_dC, TimePoint at, const CoreConfig& config);
  /// Handles the state of the GPIO lines.
  void observe(const LineImage& image, TimePoint at, const CoreConfig& config);

 private:
  void merge(const CoreConfig& config);
  void take_current(const Measured<std::int32_t>& sample, bool is_first, const SensorConfig& config);
};

}  // namespace bmu
