#include "daemon/core/plausibility/link_decay.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr Duration span_min = 1s;
/// The slowest DC link that a pack file can describe falls to less than half in that time (link_decay_max).
constexpr Duration span_max = 10min;
constexpr std::int64_t fall_min_permille = 2;
constexpr double margin = 1.5;
/// Maximum usable precharge_done: a DC link that has to fall by less than the remaining 1 % cannot be distinguished
/// from one that does not discharge.
constexpr std::int32_t done_max_permille = 990;

std::chrono::duration<double> seconds(Duration span) {
  return std::chrono::duration<double>(span);
}

}  // namespace

void LinkDecay::update(TimePoint open_since, const Measured<std::int32_t>& link_mV, Duration settle) {
  if (open_since == TimePoint{}) {
    *this = {};
    return;
  }
  if (!link_mV.is_valid() || link_mV.taken_at < open_since + settle) return;
  if (!first_mV_.is_valid()) first_mV_ = link_mV;
  const bool has_halved = 2 * std::int64_t{link_mV.value} < first_mV_.value;
  if (has_halved || link_mV.taken_at - first_mV_.taken_at > span_max) return;
  last_mV_ = link_mV;
}

std::optional<Duration> LinkDecay::time_constant() const {
  if (!first_mV_.is_valid() || last_mV_.value <= 0) return std::nullopt;
  const Duration span = last_mV_.taken_at - first_mV_.taken_at;
  const std::int64_t fallen_mV = std::int64_t{first_mV_.value} - last_mV_.value;
  if (span < span_min || fallen_mV * 1'000 <= first_mV_.value * fall_min_permille) return std::nullopt;
  const double ratio = static_cast<double>(first_mV_.value) / last_mV_.value;
  return std::chrono::duration_cast<Duration>(seconds(span) / std::log(ratio));
}

Duration link_decay_that_would_do(Duration time_constant, const ContactorConfig& config) {
  const double share = std::min(config.precharge_done_permille, done_max_permille) / 1e3;
  const auto leaves_after = seconds(time_constant) * std::log(1.0 / share);
  return std::chrono::seconds{static_cast<std::int64_t>(std::ceil((leaves_after * margin).count()))};
}

}  // namespace bmu
