// Emulated inverter that receives the data of its battery over a bus, in any protocol: the received data, its current,
// and its reports.
//
// Received limits are valid for the timeout of the protocol; afterwards, and before the first ones, no current is
// allowed. The current follows the limits as that of a real one does, not at once, and fades towards the voltage
// limits. An inverter that stops at an alarm does so while one is raised. It has a supply of its own: it sends whether
// or not the pack is closed.
#pragma once

#include "devices/inverter.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

class CanInverter {
 public:
  /// From zero to full current in seconds; it follows lower limits faster.
  static constexpr double rise_A_per_s = 20.0;
  static constexpr double fall_A_per_s = 200.0;

  /// `driver` null: no inverter.
  CanInverter(const InverterDriver* driver, TimePoint started_at) : driver_(driver), word_at_(started_at) {}

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  /// Null without inverter.
  [[nodiscard]] const InverterDriver* driver() const { return driver_; }
  /// Handles any frame on its bus.
  void observe(const CanFrame& frame, TimePoint now);
  /// One step that ends at `now`; returns the current, positive out of the pack.
  [[nodiscard]] double step(TimePoint now, double link_V);
  /// The frames that are due, if any.
  [[nodiscard]] InverterFrames words(TimePoint now, double link_V);
  [[nodiscard]] double current_A() const { return current_A_; }
  /// Last received report, whether or not it is still valid.
  [[nodiscard]] const BatteryReport& told() const { return told_; }

  // Set by a script.
  double demand_A = 0.0;  // positive out of the pack
  bool obeys = true;
  bool is_silent = false;  // but continues to work
  bool has_failed = false;

 private:
  [[nodiscard]] double allowed_A(TimePoint now, double link_V) const;

  const InverterDriver* driver_;
  BatteryReport told_;
  TimePoint told_at_{};  // of the limits; zero: never
  double current_A_ = 0.0;
  TimePoint stepped_at_{};
  TimePoint word_at_;
};

}  // namespace bmu
