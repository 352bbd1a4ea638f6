// What all scores of bmucell are given in.
#pragma once

#include <optional>

#include <nlohmann/json_fwd.hpp>

namespace bmu::cell {

/// A share times this is in percent.
inline constexpr double percent = 100.0;

/// The band around an estimate in charts, and that in which a score counts it as inside its uncertainty, is this many
/// of the estimate's standard deviations to either side: 95 % of a normal distribution.
inline constexpr double band_sigmas = 2.0;

/// A figure for JSON; null for one that the measurement is too short for.
[[nodiscard]] nlohmann::ordered_json number_or_null(const std::optional<double>& value);

}  // namespace bmu::cell
