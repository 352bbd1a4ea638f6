#include "daemon/core/cell/derating.hpp"

#include <algorithm>

namespace bmu {

namespace {
constexpr std::int32_t all_permille = 1'000;
}  // namespace

std::int32_t share_permille(const DeratingTable& table, std::int32_t at) {
  if (!table.is_given()) return all_permille;
  const auto& points = table.points;
  if (at <= points[0].at) return points[0].share_permille;
  if (at >= points.back().at) return points.back().share_permille;
  std::size_t next = 1;
  while (points[next].at <= at) ++next;
  const DeratingPoint& from = points[next - 1];
  const DeratingPoint& to = points[next];
  const std::int64_t gone = std::int64_t{at} - from.at;
  const std::int64_t whole = std::int64_t{to.at} - from.at;
  return static_cast<std::int32_t>((from.share_permille * (whole - gone) + to.share_permille * gone) / whole);
}

std::int32_t smallest_share_permille(const DeratingTable& table) {
  std::int32_t least = all_permille;
  if (!table.is_given()) return least;
  for (const DeratingPoint& point : table.points) least = std::min(least, point.share_permille);
  return least;
}

}  // namespace bmu
