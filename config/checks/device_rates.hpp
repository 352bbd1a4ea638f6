// Bit rate of a bus, and check that each device that the pack file names on it supports that rate.
//
// A third-party device supports the bit rates of its row (devices/device.hpp). On a bus at another rate it would
// receive nothing, or be disturbed. Pure.
#pragma once

#include <cstdint>

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// The rate that the interface of a bus is set to, and with which its load is calculated: that of the pack file. For
/// the chargers' bus, if the file has none, the first rate that every device there supports; 0 if no device is there.
[[nodiscard]] std::int32_t bit_rate_kbit_per_s(const PackConfig& pack, Port bus);

/// Rejects a bit rate of the file that a device on that bus does not support. `place` is the root of the pack file;
/// values that were already rejected are not checked, nor is a bus without a bit rate in the file.
void check_device_rates(const PackConfig& pack, const Place& place, ProblemList& problems);

}  // namespace bmu
