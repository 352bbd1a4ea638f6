// At which bit rate a bus runs, and whether each device that the pack file names on it can have that rate.
//
// A device of another maker has the bit rates of its row (devices/device.hpp). A bus at another rate would be silent to
// it, or disturbed by it. Pure.
#pragma once

#include <cstdint>

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// The rate that the interface of a bus is set to, and by which its load is calculated: that of the pack file. For the
/// chargers' bus, where the file has none, the first rate that every device there can have; 0 if no device is there.
[[nodiscard]] std::int32_t bit_rate_kbit_per_s(const PackConfig& pack, Port bus);

/// Refuses a bit rate of the file that a device on that bus cannot have. `place` is the root of the pack file; values
/// that were already refused are not judged, and nor is a bus without a bit rate in the file.
void check_device_rates(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
