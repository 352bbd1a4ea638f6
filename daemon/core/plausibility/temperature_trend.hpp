// Temperature gradient of each cell sensor: its newest value compared with the one about two seconds before. A runaway
// cell warms by kelvins per second; load and weather by kelvins per hour.
//
// A sensor that was not measured, or not received for a second, restarts, and has no gradient before its values cover a
// second. Cost: a comparison a module without new values.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class TemperatureTrend {
 public:
  /// Handles the values received since the last call.
  void update(const ModuleTable& modules);
  void forget() { tracks_ = {}; }

  /// The fastest rise, in mK/s; unknown while no sensor has a history.
  [[nodiscard]] Reading fastest_mK_per_s(const ModuleTable& modules) const;

 private:
  struct Sample {
    std::int32_t temperature_dC = 0;
    TimePoint taken_at{};
  };
  static constexpr std::size_t samples_max = 9;

  struct Track {
    Sample newest;
    std::array<Sample, samples_max> older{};  // a ring, at least `spacing` apart
    std::uint8_t count = 0;
    std::uint8_t head = 0;  // index of the next to be written

    void add(const Measured<std::int32_t>& temperature_dC);
    [[nodiscard]] const Sample& oldest() const;
    [[nodiscard]] bool are_fields_possible() const { return count <= samples_max && head < samples_max; }
  };
  using ModuleTracks = std::array<Track, cell_sensors_max>;

  std::array<ModuleTracks, modules_max> tracks_{};
  BMU_FIELDS(tracks_)
};

}  // namespace bmu
