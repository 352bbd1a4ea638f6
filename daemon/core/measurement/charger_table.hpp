// What the chargers last said, each value with its time; and what they are told, in the language that they speak.
//
// A report counts only as a whole. A value out of its documented range, or one that the charger says it does not know,
// is not valid, and counted by why. Voltage and current are as old as the frame that told them: older than
// `silence_max()` they are no measurement, and the unit is silent. So is one whose voltage or current has been no
// number for so long, and one that has not reported its troubles in their own time: without them nobody knows that
// there are none. Nobody charges with a silent unit; what it still reports counts against it all the same. Current is
// positive into the pack, as chargers tell it.
//
// Nobody but we may command a charger: such a frame from somebody else is noted, by its identifier, whatever its
// length.
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
  TimePoint numbers_at{};      // of the last of these whose values were both numbers
  TimePoint troubles_at{};     // where they have frames of their own
  TimePoint temperature_at{};  // likewise
  TimePoint talks_since{};     // without a silence
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

  /// A frame of the charger's bus. False: it is none of a charger's.
  bool observe(const CanFrame& frame, TimePoint at);
  void forget_values();

  [[nodiscard]] const ChargerUnit& unit(std::size_t index) const { return units_[index]; }
  /// Two and a half of its reports, and never less than what its bus may be late.
  [[nodiscard]] Duration silence_max() const;
  /// It can be charged with.
  [[nodiscard]] bool is_talking(std::size_t index, TimePoint now) const;
  /// Not known once it is older than its frames may be.
  [[nodiscard]] SignalValue temperature_dC(std::size_t index, TimePoint now) const;
  [[nodiscard]] std::size_t talking_count(TimePoint now) const;
  /// Of all units whose reports are recent, silent or not; not known while one of these does not tell it.
  [[nodiscard]] Measured<std::int32_t> current_mA(TimePoint now) const;
  /// The highest of those.
  [[nodiscard]] Measured<std::int32_t> voltage_mV(TimePoint now) const;
  /// Of the first unit that has any; bits by ChargerTrouble. Where nothing is asked some are none (troubles_among).
  struct Troubles {
    std::uint16_t bits = 0;
    std::uint8_t unit = 0;  // from 1; 0: none
  };
  [[nodiscard]] Troubles troubles(TimePoint now, bool is_asked) const;
  /// Somebody else commanded one of our units last then; zero: nobody.
  [[nodiscard]] TimePoint foreign_command_at() const { return foreign_command_at_; }

 private:
  [[nodiscard]] bool has_recent_values(std::size_t index, TimePoint now) const;

  ChargerConfig config_;
  std::array<ChargerUnit, charger_units_max> units_{};
  TimePoint foreign_command_at_{};
  BMU_FIELDS(skipped(config_), units_, foreign_command_at_)
};

}  // namespace bmu
