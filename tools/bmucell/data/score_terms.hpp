// Units and bands of all scores of bmucell.
#pragma once

#include <optional>

#include <nlohmann/json_fwd.hpp>

namespace bmu::cell {

/// Factor from a share to percent.
inline constexpr double percent = 100.0;

/// Half width, in standard deviations of the estimate, of the band around an estimate in charts, and of the band in
/// which a score counts it as inside its uncertainty: 95 % of a normal distribution.
inline constexpr double band_sigmas = 2.0;

/// A figure for JSON; null if the measurement is too short for it.
[[nodiscard]] nlohmann::ordered_json number_or_null(const std::optional<double>& value);

}  // namespace bmu::cell
