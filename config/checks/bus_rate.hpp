// Check of the actual bit rate of the internal bus's interface against the one in the pack file.
//
// Pure. Cycles, ages and load are checked again with the rate that was found (bus_checks.hpp): at a lower rate than
// configured the answers may not fit between two polls, and a closed pack would open for answers that are merely late.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/types/pack.hpp"

namespace bmu {

enum class RateVerdict : std::uint8_t {
  unknown,    // no interface with a bit rate: vcan, unix:NAME, or not present yet
  as_wanted,  // within half a percent: a controller divides its clock and only approximates the rate
  differs,    // but all checks pass
  too_slow,   // answers do not fit between two polls, or a maximum age does not allow for a lost one
};

[[nodiscard]] std::string_view to_text(RateVerdict verdict);

struct RateFinding {
  RateVerdict verdict = RateVerdict::unknown;
  std::int64_t found_bit_per_s = 0;
  std::int64_t wanted_bit_per_s = 0;
  std::string text;  // for the log: bus, found, expected, and the consequence; empty if unknown
};

/// Precondition: the pack was read, with the `buses` that are in use. `found_bit_per_s` is 0 if it is unknown.
[[nodiscard]] RateFinding judge_rate(const PackConfig& pack, std::string_view file_name, std::int64_t found_bit_per_s);

/// The pack with that bit rate and the defaults that follow from it. Precondition: at least 1 kbit/s.
[[nodiscard]] PackConfig at_rate(const PackConfig& pack, std::int64_t bit_per_s);

}  // namespace bmu
