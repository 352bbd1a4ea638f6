// State of health of a cell, in two values that age for different reasons: the charge that it can hold, and how well it
// can deliver it.
//
//   by capacity    Cmax / Crated (FS_5): 1000 at that of its cell file, more for a cell that holds more
//   by resistance  remaining part of the way from new to worn out: 1000 at the cell file's resistance or below, 0 at
//                  `end_of_life_factor` times that, and beyond
//
// In permille, each with its standard deviation. An unknown value is marked as unknown, and is never 1000. Cost: some
// divisions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "daemon/core/estimation/soc/soc_estimate.hpp"

namespace bmu {

/// Unless `is_known` the other members are not valid.
struct HealthFigure {
  bool is_known = false;
  std::int32_t permille = 0;
  std::int32_t sigma_permille = 0;
};

struct StateOfHealth {
  HealthFigure by_capacity;
  HealthFigure by_resistance;
};

/// A cell with this multiple of its resistance is worn out, unless it is configured otherwise.
inline constexpr double end_of_life_resistance_factor = 2.0;
/// No cell holds more, as a multiple of its rated capacity; a value beyond is an error.
inline constexpr double health_most = 1.5;

namespace detail {

inline HealthFigure health_figure(double share, double sigma) {
  constexpr double permille = 1000.0;
  constexpr double sigma_most = 1.0;
  if (!std::isfinite(share) || !(sigma >= 0.0)) return {};
  return {.is_known = true,
          .permille = static_cast<std::int32_t>(std::lround(share * permille)),
          .sigma_permille = static_cast<std::int32_t>(std::lround(std::min(sigma, sigma_most) * permille))};
}

}  // namespace detail

/// Unknown if the capacity or the rated one is not above 0, or the capacity beyond `health_most` of that.
[[nodiscard]] inline HealthFigure health_by_capacity(double capacity_As, double sigma_As, double rated_As) {
  if (!(rated_As > 0.0) || !std::isfinite(rated_As) || !(capacity_As > 0.0) || !(capacity_As <= health_most * rated_As))
    return {};
  return detail::health_figure(capacity_As / rated_As, sigma_As / rated_As);
}

/// `rise_share`: relative increase of the resistance above that of the cell file, 0.4 is 40 % more, at the same
/// temperature and state of charge; `end_of_life_factor` above 1. Unknown if either is invalid, or the resistance below
/// 0.
[[nodiscard]] inline HealthFigure health_by_resistance(double rise_share, double sigma_share,
                                                       double end_of_life_factor = end_of_life_resistance_factor) {
  if (!(end_of_life_factor > 1.0) || !std::isfinite(end_of_life_factor) || !(rise_share >= -1.0)) return {};
  const double way = end_of_life_factor - 1.0;
  const double left = is_measured(rise_share) ? std::clamp(1.0 - rise_share / way, 0.0, 1.0) : not_measured;
  return detail::health_figure(left, sigma_share / way);
}

}  // namespace bmu
