// What the current sensor and the power distribution unit last said. Same rules as the module table.
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
  // Auxiliary contacts: what really is closed.
  bool main_positive_closed = false;
  bool main_negative_closed = false;
  bool precharge_closed = false;
  bool charge_closed = false;
  bool opened_by_timeout = false;
  bool alarm_loop_open = false;  // the modules' alarm outputs; false, too, of a unit without such a loop
  // Inputs, true = healthy or present.
  bool vehicle_on = false;
  bool charger_connected = false;
  bool estop_1_released = false;
  bool estop_2_released = false;
  bool interlock_closed = false;
  bool insulation_monitor_ok = false;
  bool resume_button = false;
  bool supply_ok = true;  // the unit has no word for it; a line of this machine may have
  // Further ones, of this machine: bit by their order in the pack file.
  std::uint16_t estops_pressed = 0;
  std::uint16_t interlocks_open = 0;
  InsulationState insulation_state = InsulationState::no_signal;
  SignalValue insulation_resistance_Ohm;
  SignalValue throttle_permille;

  /// No input that can withdraw permission says no.
  [[nodiscard]] constexpr bool is_healthy() const {
    return estop_1_released && estop_2_released && estops_pressed == 0 && interlock_closed && interlocks_open == 0 &&
           insulation_monitor_ok && !opened_by_timeout && !alarm_loop_open;
  }
  [[nodiscard]] constexpr bool any_contactor_closed() const {
    return main_positive_closed || main_negative_closed || precharge_closed || charge_closed;
  }
  friend bool operator==(const PduState&, const PduState&) = default;
};

/// The monitor measures, and has told a resistance or that there is more of it than it can tell.
[[nodiscard]] constexpr bool knows_insulation(const PduState& pdu) {
  const bool measures =
      pdu.insulation_state == InsulationState::normal || pdu.insulation_state == InsulationState::undervoltage;
  const Validity validity = pdu.insulation_resistance_Ohm.validity;
  return measures && (validity == Validity::valid || validity == Validity::above_range);
}

/// The two sources of contacts and inputs as one. A "no" of either holds; a wish of either counts; a contact counts as
/// closed if either says so.
[[nodiscard]] Measured<PduState> merge_inputs(const Measured<PduState>& unit, const Measured<LineImage>& lines,
                                              const CoreConfig& config);

struct SensorTable {
  Measured<std::int32_t> current_mA;    // positive out of the pack, whatever way round the sensor sits
  Measured<std::int32_t> current_2_mA;  // of the second sensor, where there is one
  Measured<std::int32_t> pack_voltage_mV;
  Measured<std::int32_t> pack_voltage_before_mV;  // the result before that one
  Measured<std::int32_t> link_voltage_mV;
  // Contacts and inputs from wherever the pack has them: the unit's word, the lines of this machine, or both together.
  // As old as the older of its sources; unknown while one of them is.
  Measured<PduState> pdu;
  Temperature_dC intake_air_dC;  // of PDU or file, whichever the pack file names
  RefusedResults refused;        // of all channels together
  RefusedPulses refused_pulses;
  CurrentWindow current_window;
  TimePoint insulation_known_at{};  // when the monitor last told a resistance; before, when it could begin to
  bool insulation_told = false;     // it has told one
  InsulationWord insulation;        // of a monitor that is heard itself, where there is one

  // The two sources by themselves.
  Measured<PduState> pdu_word;
  Measured<LineImage> lines;

  /// Takes over a checked frame of the sensor or the PDU. A result that is none counts like a frame that did not come:
  /// the last one grows old, and with it goes the channel, but a single one does not open a pack.
  void observe(const MessageSpec& message, const CanFrame& frame, TimePoint at, const CoreConfig& config);
  /// Takes over the current of a sensor that has frames of its own, as it told it.
  void observe_current(const SignalValue& told_mA, bool is_first, TimePoint at, const CoreConfig& config);
  /// After a gap in our own life nothing heard before may count; what was counted goes on.
  void forget_values(TimePoint at) {
    *this = {.refused = refused, .refused_pulses = refused_pulses, .insulation_known_at = at};
  }
  /// Takes over what follows now from the word of a monitor that is heard itself, where there is one.
  void take_insulation(const InsulationWord& word, const CoreConfig& config);
  /// Takes over the temperature of the intake air from a sensor of this machine, where the pack file names that one.
  void observe_intake_air(std::int32_t temperature_dC, TimePoint at, const CoreConfig& config);
  /// Takes over what the lines say.
  void observe(const LineImage& image, TimePoint at, const CoreConfig& config);

 private:
  void merge(const CoreConfig& config);
  void take_current(const Measured<std::int32_t>& sample, bool is_first, const SensorConfig& config);
};

}  // namespace bmu
