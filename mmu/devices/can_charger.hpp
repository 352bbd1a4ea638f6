// Emulated chargers that are driven over a bus, in whatever protocol: what they are told, what they give together, and
// what they say of it.
//
// Each unit takes its orders for as long as its protocol says and then stops by itself. What they give follows what
// they are told as a real one does, not at once; towards the voltage that they are told it fades. A unit without mains
// gives nothing and says nothing.
//
// A trouble that stops a unit is latched where its protocol has it so: it stays when its cause is gone, until a command
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
  /// A second from nothing to this, and half of one back.
  static constexpr double rise_A_per_s = 10.0;
  static constexpr double fall_A_per_s = 20.0;

  /// `driver` null: there is none.
  CanChargers(const ChargerDriver* driver, std::uint8_t unit_count, TimePoint started_at)
      : live_count(unit_count), driver_(driver), unit_count_(unit_count), report_at_(started_at) {
    for (Unit& unit : units_) unit.live_at = started_at;
  }

  [[nodiscard]] bool is_there() const { return driver_ != nullptr; }
  /// Null if there is none.
  [[nodiscard]] const ChargerDriver* driver() const { return driver_; }
  [[nodiscard]] std::uint8_t unit_count() const { return unit_count_; }
  /// Any frame on their bus.
  void observe(const CanFrame& frame, TimePoint now);
  /// One step that ends at `now`: what they give together, of `rating_A` at the most. `obeys` off: whatever they are
  /// told.
  /// `ever_less` off: what they give once they go on with.
  [[nodiscard]] double step(TimePoint now, double rating_A, double link_V, bool obeys, bool ever_less);
  /// The reports that are due, if any; of one unit at a time. None without mains. What flows is what `step` came to as
  /// far as somebody takes it: into open contactors nothing does.
  [[nodiscard]] ChargerFrames report(TimePoint now, double link_V, double flows_A);

  /// The wall's socket.
  bool has_mains = true;
  /// It is a charging post's: live only while one of them asks for it. They go on talking without.
  bool is_post = false;
  /// So many of them, the first ones, are plugged into it.
  std::uint8_t live_count;
  /// What is wrong with each of them, as a script has it. With `no_command` they are deaf.
  std::uint16_t troubles = 0;

 private:
  struct Unit {
    ChargerOrder order;
    TimePoint told_at{};  // zero: never since it has mains
    TimePoint live_at{};  // it has mains since then
    TimePoint slow_at{};  // when its slow frames are due
    std::uint16_t latched = 0;
  };
  [[nodiscard]] bool is_live(std::size_t unit) const { return has_mains && unit < live_count; }
  /// What is wrong with it now, latched or not.
  [[nodiscard]] std::uint16_t causes(const Unit& unit, TimePoint now) const;
  void follow_mains(std::size_t unit, TimePoint now);
  [[nodiscard]] double ordered_A(TimePoint now, double link_V) const;
  /// Mains at their inlet.
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
