// An emulated inverter that is told of its battery over a bus, in whatever protocol: what it is told, what it takes and
// gives, and what it says of it.
//
// What it is told holds for as long as its protocol says; then, and before the first word, nothing may flow. It follows
// what it is told as a real one does, not at once, and fades towards the voltages that it is told. One that stops at an
// alarm does so while one is raised. It has a supply of its own: it talks, whether or not the pack is closed.
#pragma once

#include "devices/inverter.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

class CanInverter {
 public:
  /// From nothing to all in seconds; less is allowed and it follows faster.
  static constexpr double rise_A_per_s = 20.0;
  static constexpr double fall_A_per_s = 200.0;

  /// `driver` null: there is none.
  CanInverter(const InverterDriver* driver, TimePoint started_at) : driver_(driver), word_at_(started_at) {}

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  /// Null if there is none.
  [[nodiscard]] const InverterDriver* driver() const { return driver_; }
  /// Any frame on its bus.
  void observe(const CanFrame& frame, TimePoint now);
  /// One step that ends at `now`: what it takes, positive out of the pack.
  [[nodiscard]] double step(TimePoint now, double link_V);
  /// What it has to say now, if anything.
  [[nodiscard]] InverterFrames words(TimePoint now, double link_V);
  [[nodiscard]] double current_A() const { return current_A_; }
  /// What it was told last, whether or not that still holds.
  [[nodiscard]] const BatteryReport& told() const { return told_; }

  // What a script does to it.
  double demand_A = 0.0;  // positive out of the pack
  bool obeys = true;
  bool is_silent = false;  // and goes on working
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
