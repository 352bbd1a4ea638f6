// Insulation monitor connected to the PDU: an IR155 with its two outputs, the pulse-width signal and the status line,
// as the PDU's inputs see them.
//
//   power-on         at the start, and when it was off ("no signal"): 2 s of speed start, good or bad, without a value;
//                    then the present value. A real one needs up to 17.5 s to its first value and up to 20 s to
//                    follow a change.
//   status line      high while the insulation is at or above the response value, in normal measurement and in a good
//                    speed start; low in every other state. No document defines its level in the first 2 s for certain.
//   signal lost      the PDU's input keeps the last period and the time since its last edge.
//
// Plain data that a script sets, and one step each millisecond.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "mmu/devices/pdu.hpp"
#include "protocol/ir155.hpp"

namespace bmu {

enum class SignalWire : std::uint8_t { closed, open, shorted };  // open reads low, shorted (to supply) high

class InsulationUnit {
 public:
  InsulationUnit(TimePoint powered_at, double response_kOhm)
      : powered_at_(powered_at), response_kOhm_(response_kOhm), edge_at_(powered_at) {}

  double resistance_kOhm = 1200.0;
  std::optional<double> frequency_Hz;  // of the signal instead of the monitor's own
  std::optional<double> duty_permille;
  SignalWire wire = SignalWire::closed;

  ir155::Pwm pwm;  // at the PDU's input
  bool is_status_ok = false;

  void set_state(InsulationMonitor state, TimePoint now) {
    if (state_ == InsulationMonitor::no_signal) powered_at_ = now;
    state_ = state;
  }
  void step(TimePoint now) {
    const ir155::State real = state_at(now);
    is_status_ok = is_good() && (real == ir155::State::normal || real == ir155::State::speed_start_good);
    ir155::Pwm sent = ir155::encode({real, known(std::lround(resistance_kOhm * 1e3))});
    if (frequency_Hz) sent.frequency_mHz = static_cast<std::int32_t>(std::lround(*frequency_Hz * 1e3));
    if (duty_permille) sent.duty_permille = static_cast<std::int32_t>(std::lround(*duty_permille));
    const bool has_pulses = sent.frequency_mHz > 0 && sent.duty_permille > 0 && sent.duty_permille < 1000;
    if (wire == SignalWire::closed && has_pulses) {
      pwm = sent;
      edge_at_ = now;
    } else {
      pwm.is_high = wire == SignalWire::shorted || (wire == SignalWire::closed && sent.duty_permille >= 1000);
      pwm.since_edge = now - edge_at_;
    }
  }

 private:
  [[nodiscard]] bool is_good() const { return resistance_kOhm >= response_kOhm_; }
  [[nodiscard]] ir155::State state_at(TimePoint now) const {
    const bool is_starting = now - powered_at_ < ir155::speed_start_time;
    switch (state_) {
      case InsulationMonitor::no_signal: return ir155::State::no_signal_low;
      case InsulationMonitor::normal:
        if (!is_starting) return ir155::State::normal;
        [[fallthrough]];
      case InsulationMonitor::speed_start:
        return is_good() ? ir155::State::speed_start_good : ir155::State::speed_start_bad;
      case InsulationMonitor::undervoltage: return ir155::State::undervoltage;
      case InsulationMonitor::device_error: return ir155::State::device_error;
      case InsulationMonitor::earth_fault: return ir155::State::earth_fault;
    }
    return ir155::State::undefined;
  }

  InsulationMonitor state_ = InsulationMonitor::normal;  // normal once its speed start is over
  TimePoint powered_at_;
  double response_kOhm_;
  TimePoint edge_at_;
};

}  // namespace bmu
