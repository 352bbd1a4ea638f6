// The section `intake_air` of the pack file: the source of the temperature of the intake air, byte 1 of 627h.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/core/types/core_config.hpp"

namespace bmu {

struct IntakeAirKeys {
  AirSource source = AirSource::none;
  std::uint8_t module = 0;  // node; 0: none
  std::uint8_t sensor = 1;  // of its board sensors, from 1
  std::string file;         // "/sys/bus/iio/devices/iio:device0/in_temp_input"
  Duration age_max = 10s;

  [[nodiscard]] IntakeAirConfig core() const {
    return {.source = source, .node = module, .sensor = sensor, .age_max = age_max};
  }
};

}  // namespace bmu
