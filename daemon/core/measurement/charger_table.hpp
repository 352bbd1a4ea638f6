// Values received from the chargers, each with its time, and the driver of their protocol, which encodes the commands.
//
// A report counts only as a whole. A value outside its documented range, or one that the charger marks as unknown, is
// not valid, and counted by reason. Voltage and current are as old as the frame that contained them: if older than
// `silence_max()` they are no measurement, and the unit is lost. A unit is also lost if its voltage or current has not
// been a number for that time, or if it has not reported its troubles within their own period: without that report it
// is unknown whether there are any. A lost unit is not used for charging; values that it still reports are
// nevertheless checked for faults. Current is positive into the pack, as in the chargers' messages.
//
// Only this node may command a charger: a command from another node is recorded by its identifier, whatever its length.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "devices/charger.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct ChargerUnit {
  ChargerReport report;
  TimePoint values_at{};       // of voltage and current; zero: never
  TimePoint numbers_at{};      // last voltage and current that were both numbers
  TimePoint troubles_at{};     // if they have frames of their own
  TimePoint temperature_at{};  // last frame with a temperature
  TimePoint talks_since{};     // start of reception without a timeout
  std::uint64_t frames_refused = 0;
  std::uint64_t values_out_of_range = 0;
  std::uint64_t values_unknown = 0;
};

class ChargerTable {
 public:
  void init(const ChargerConfig& config) { config_ = config; }
  [[nodiscard]] bool is_there() const { return config_.driver != nullptr; }
  [[nodiscard]] const ChargerDriver& driver() const { return *config_.driver; }
  [[nodiscard]] std::size_t unit_count() const { return is_there() ? config_.unit_count : 0; }

  /// A frame of the charger's bus. False: not a charger's frame.
  bool observe(const CanFrame& frame, TimePoint at);
  void forget_values();

  [[nodiscard]] const ChargerUnit& unit(std::size_t index) const { return units_[index]; }
  /// Two and a half report periods, plus the maximum delay on its bus.
  [[nodiscard]] Duration silence_max() const;
  /// The unit is not lost, and may be used for charging.
  [[nodiscard]] bool is_talking(std::size_t index, TimePoint now) const;
  /// Unknown if older than the maximum age of its frames.
  [[nodiscard]] SignalValue temperature_dC(std::size_t index, TimePoint now) const;
  [[nodiscard]] std::size_t talking_count(TimePoint now) const;
  /// Sum of all units with recent reports, lost or not; unknown while one of these does not report a current.
  [[nodiscard]] Measured<std::int32_t> current_mA(TimePoint now) const;
  /// The highest voltage of those.
  [[nodiscard]] Measured<std::int32_t> voltage_mV(TimePoint now) const;
  /// Troubles of the first unit that has any; bits by ChargerTrouble. Without a charge request some are ignored
  /// (troubles_among).
  struct Troubles {
    std::uint16_t bits = 0;
    std::uint8_t unit = 0;  // from 1; 0: none
  };
  [[nodiscard]] Troubles troubles(TimePoint now, bool is_asked) const;
  /// Last command of another node to a configured unit; zero: none.
  [[nodiscard]] TimePoint foreign_command_at() const { return foreign_command_at_; }

 private:
  [[nodiscard]] bool has_recent_values(std::size_t index, TimePoint now) const;

  ChargerConfig config_;
  std::array<ChargerUnit, charger_units_max> units_{};
  TimePoint foreign_command_at_{};
  BMU_FIELDS(skipped(config_), units_, foreign_command_at_)
};

}  // namespace bmu
