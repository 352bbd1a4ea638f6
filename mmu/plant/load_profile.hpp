// Current demand of a vehicle over time: built-in profiles, repeated as long as they are selected.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/time.hpp"

namespace bmu {

enum class LoadProfile : std::uint8_t { none, drive };
inline constexpr std::array<std::string_view, 2> load_profile_names{"none", "drive"};

struct LoadPoint {
  Duration at{};
  double current_A = 0.0;
};

/// Two starts, cruising in between, braking into the pack: 16 s, 50 A at most, 12 A on average.
inline constexpr LoadPoint drive_points[] = {
    {0ms, 2.0},      {500ms, 2.0},    {2000ms, 48.0},  {3200ms, 50.0},   {4000ms, 22.0}, {6500ms, 14.0},
    {7000ms, -2.0},  {7800ms, -18.0}, {8800ms, -15.0}, {9300ms, 2.0},    {10000ms, 2.0}, {11200ms, 36.0},
    {12500ms, 38.0}, {13200ms, 18.0}, {14800ms, 12.0}, {15400ms, -10.0}, {16000ms, 2.0},
};

[[nodiscard]] constexpr std::span<const LoadPoint> points_of(LoadProfile profile) {
  return profile == LoadProfile::drive ? std::span<const LoadPoint>(drive_points) : std::span<const LoadPoint>{};
}

/// Demand `since` the profile began, linear between the points.
[[nodiscard]] constexpr double load_at(LoadProfile profile, Duration since) {
  const std::span<const LoadPoint> points = points_of(profile);
  if (points.empty()) return 0.0;
  const Duration within = since % points.back().at;
  std::size_t next = 1;
  while (points[next].at <= within) ++next;
  const LoadPoint& from = points[next - 1];
  const LoadPoint& to = points[next];
  const double share = static_cast<double>((within - from.at).count()) / static_cast<double>((to.at - from.at).count());
  return from.current_A + (to.current_A - from.current_A) * share;
}

}  // namespace bmu
