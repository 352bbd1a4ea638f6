// The bit rate that the interface of the internal bus really has, against the one the pack file reckons with.
//
// Pure. Cycles, ages and load are checked once more with the rate that was found (bus_checks.hpp): slower than written,
// all answers may no longer fit between two polls, and then a closed pack would open for answers that are merely late.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/types/pack.hpp"

namespace bmu {

enum class RateVerdict : std::uint8_t {
  unknown,    // no interface with a bit rate: vcan, unix:NAME, or nothing there yet
  as_wanted,  // within half a percent: a controller divides its clock, and comes near
  differs,    // but all that must fit does
  too_slow,   // answers do not fit between two polls at each pace, or an age has no room for a lost one
};

[[nodiscard]] std::string_view to_text(RateVerdict verdict);

struct RateFinding {
  RateVerdict verdict = RateVerdict::unknown;
  std::int64_t found_bit_per_s = 0;
  std::int64_t wanted_bit_per_s = 0;
  std::string text;  // for the log: bus, found, wanted, and what follows; empty if unknown
};

/// Of a pack that was read, whose `buses` are those in use. `found_bit_per_s` is 0 where nobody can tell.
[[nodiscard]] RateFinding judge_rate(const PackConfig& pack, std::string_view file_name, std::int64_t found_bit_per_s);

/// The pack with that bit rate, and what follows from it where the file leaves it out. For a rate of 1 kbit/s and more.
[[nodiscard]] PackConfig at_rate(const PackConfig& pack, std::int64_t bit_per_s);

}  // namespace bmu
