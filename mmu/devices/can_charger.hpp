// Emulated chargers that are controlled over a bus, in any protocol: their commands, their total output, and their
// reports.
//
// Each unit follows a command for the timeout of its protocol and then stops by itself. The output follows the commands
// as that of a real one does, not at once; towards the commanded voltage it fades. A unit without mains has no output
// and sends nothing.
//
// A trouble that stops a unit is latched if its protocol has it so: it stays after its cause is gone, until a command
// that clears errors is followed by one that does not, and some until the unit has been without mains.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "devices/charger.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

class CanChargers {
 public:
  /// Slopes of the total output: from zero to 10 A in a second, and back in half a second.
  static constexpr double rise_A_per_s = 10.0;
  static constexpr double fall_A_per_s = 20.0;

  /// `driver` null: no chargers.
  CanChargers(const ChargerDriver* driver, std::uint8_t unit_count, TimePoint started_at)
      : live_count(unit_count), driver_(driver), unit_count_(unit_count), report_at_(started_at) {
    for (Unit& unit : units_) unit.live_at = started_at;
  }

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  /// Null without chargers.
  [[nodiscard]] const ChargerDriver* driver() const { return driver_; }
  [[nodiscard]] std::uint8_t unit_count() const { return unit_count_; }
  /// Handles any frame on their bus.
  void observe(const CanFrame& frame, TimePoint now);
  /// One step that ends at `now`; returns the total output, at most `rating_A`. `obeys` false: regardless of commands.
  /// `ever_less` false: the output never decreases while there is power.
  [[nodiscard]] double step(TimePoint now, double rating_A, double link_V, bool obeys, bool ever_less);
  /// The reports that are due, if any, of one unit at a time. None without mains. `flows_A` is the result of `step` as
  /// far as it is taken: with open contactors none is.
  [[nodiscard]] ChargerFrames report(TimePoint now, double link_V, double flows_A);

  /// Mains at the socket.
  bool has_mains = true;
  /// The socket is that of a charging post: live only while a unit requests it. The units continue to send without it.
  bool is_post = false;
  /// Number of units, the first ones, that are plugged into it.
  std::uint8_t live_count;
  /// Troubles of each unit, set by a script. With `no_command` they receive no commands.
  std::uint16_t troubles = 0;

 private:
  struct Unit {
    ChargerOrder order;
    TimePoint told_at{};  // zero: none since it has mains
    TimePoint live_at{};  // time since which it has mains
    TimePoint slow_at{};  // when its slow frames are due
    std::uint16_t latched = 0;
  };
  [[nodiscard]] bool is_live(std::size_t unit) const { return has_mains && unit < live_count; }
  /// Present troubles, latched or not.
  [[nodiscard]] std::uint16_t causes(const Unit& unit, TimePoint now) const;
  void follow_mains(std::size_t unit, TimePoint now);
  [[nodiscard]] double ordered_A(TimePoint now, double link_V) const;
  /// Whether there is mains at their inlet.
  [[nodiscard]] bool is_fed(TimePoint now) const;
  [[nodiscard]] bool is_told(const Unit& unit, TimePoint now) const;

  const ChargerDriver* driver_;
  std::uint8_t unit_count_;
  std::array<Unit, charger_units_max> units_{};
  double gives_A_ = 0.0;
  TimePoint stepped_at_{};
  TimePoint report_at_;
  std::uint8_t next_unit_ = 0;
};

}  // namespace bmu
