#include "daemon/core/plausibility/link_rise.hpp"

#include <algorithm>
#include <cmath>

namespace bmu {

namespace {

constexpr Duration span_min = 200ms;
/// Minimum rise, as a share of the voltage that is missing at first; a smaller one may be an error of the sensor.
constexpr std::int64_t rise_min_permille = 20;
/// Minimum ratio of the rate from half to last to the rate from first to half.
constexpr double steady_min = 0.7;
/// Minimum share of the missing voltage by which a DC link has risen that counts as rising.
constexpr std::int64_t on_its_way_min_permille = 50;
/// A voltage closer to the pack voltage than this cannot be distinguished from it.
constexpr std::int32_t resolved_permille = 5;
constexpr double margin = 1.5;
constexpr double energy_margin = 1.2;

using Seconds = std::chrono::duration<double>;

Seconds seconds(Duration span) {
  return span;
}

std::int32_t less_mV(std::int32_t pack_mV, std::int32_t link_mV) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(std::int64_t{pack_mV} - link_mV, INT32_MIN, INT32_MAX));
}

std::int32_t resolved_mV(std::int32_t pack_mV) {
  return std::max(pack_mV / 1'000 * resolved_permille, 1);
}

}  // namespace

void LinkRise::update(const SequenceState& state, const SequenceInputs& in, const ContactorConfig& config) {
  if (state.phase != Phase::precharge) return;
  if (state.entered_at != began_at_) *this = {};
  began_at_ = state.entered_at;
  is_resistor_hot_ = in.resistor_is_hot;
  const Sample sample{in.link_at - began_at_, less_mV(in.pack_mV, in.link_mV)};
  const bool is_new = in.is_measured && in.pack_at > began_at_ && sample.since > last_.since;
  if (!is_new || in.pack_mV <= 0) return;
  pack_mV_ = in.pack_mV;
  apart_max_mV_ = static_cast<std::int32_t>(link_apart_max_mV(in.pack_mV, config));
  missing_at_start_mV_ = less_mV(in.pack_mV, state.link_at_start_mV);
  const bool follows = link_follows(in.pack_mV, in.link_mV, config);
  if (follows && followed_.since == Duration{}) followed_ = sample;
  if (!follows) before_ = sample;
  if (sample.since >= config.settle) take_rise(sample);
  last_ = sample;
}

void LinkRise::take_rise(const Sample& sample) {
  if (first_.since == Duration{}) first_ = half_ = next_half_ = sample;
  if (sample.since - first_.since < 2 * (next_half_.since - first_.since)) return;
  half_ = next_half_;
  next_half_ = sample;
}

std::optional<SlowRise> LinkRise::slow_rise() const {
  const Duration span = last_.since - first_.since;
  const bool is_long_enough =
      first_.since != Duration{} && half_.since > first_.since && last_.since > half_.since && span >= span_min;
  if (!is_long_enough || followed_.since != Duration{} || last_.missing_mV <= 0 || pack_mV_ == 0) return std::nullopt;
  const std::int64_t risen_mV = std::int64_t{first_.missing_mV} - last_.missing_mV;
  if (risen_mV * 1'000 < first_.missing_mV * rise_min_permille || half_.missing_mV <= 0) return std::nullopt;
  const auto per_second = [](const Sample& from, const Sample& to) {
    return std::log(static_cast<double>(from.missing_mV) / to.missing_mV) / seconds(to.since - from.since).count();
  };
  if (per_second(half_, last_) < steady_min * per_second(first_, half_)) return std::nullopt;
  const Seconds time_constant{1.0 / per_second(first_, last_)};
  return SlowRise{.time_constant = std::chrono::duration_cast<Duration>(time_constant),
                  .began_after = first_.since,
                  .pack_mV = pack_mV_,
                  .is_ended_by_heat = is_resistor_hot_};
}

/// Interpolated between the two voltages around the instant at which the missing voltage falls to the tolerance.
std::optional<Duration> LinkRise::followed_after() const {
  const std::int64_t risen_mV = std::int64_t{missing_at_start_mV_} - before_.missing_mV;
  const bool is_on_its_way =
      risen_mV * 1'000 >= missing_at_start_mV_ * on_its_way_min_permille && before_.missing_mV > 0;
  if (before_.since == Duration{} || followed_.since <= before_.since || !is_on_its_way) return std::nullopt;
  const double before_mV = before_.missing_mV;
  const double follows_mV = std::max(apart_max_mV_, resolved_mV(pack_mV_));
  const double followed_mV =
      std::max<double>(std::abs(static_cast<double>(followed_.missing_mV)), resolved_mV(pack_mV_));
  const double share =
      followed_mV < before_mV ? std::log(before_mV / follows_mV) / std::log(before_mV / followed_mV) : 1;
  const Seconds after = seconds(before_.since) + seconds(followed_.since - before_.since) * std::clamp(share, 0.0, 1.0);
  return std::chrono::duration_cast<Duration>(after);
}

Duration precharge_min_that_would_do(Duration followed_after) {
  constexpr Duration step = 10ms;
  const Duration would_do = followed_after * 2 / 3 / step * step;
  return followed_after >= precharge_min_least * 11 / 10 ? std::max<Duration>(would_do, precharge_min_least) : would_do;
}

Duration precharge_timeout_that_would_do(const SlowRise& rise, const ContactorConfig& config) {
  std::int64_t left_mV = std::max<std::int64_t>(link_apart_max_mV(rise.pack_mV, config), resolved_mV(rise.pack_mV));
  if (config.precharge_resistance_Ohm > 0) {
    left_mV = std::min(left_mV, std::int64_t{config.precharge_current_max_mA} * config.precharge_resistance_Ohm);
  }
  const double ratio = static_cast<double>(rise.pack_mV) / static_cast<double>(left_mV);
  const Seconds takes = seconds(rise.began_after) + seconds(rise.time_constant) * std::max(std::log(ratio), 0.0);
  constexpr Duration step = 100ms;
  return step * static_cast<std::int64_t>(std::ceil(takes * margin / seconds(step)));
}

std::int32_t precharge_energy_that_would_do_J(const SlowRise& rise, const ContactorConfig& config) {
  if (config.precharge_resistance_Ohm <= 0) return 0;
  const double pack_V = rise.pack_mV / 1e3;
  const double energy_J = pack_V * pack_V / config.precharge_resistance_Ohm * seconds(rise.time_constant).count() / 2;
  constexpr double step_J = 10.0;
  constexpr double most_J = 1e9;
  return static_cast<std::int32_t>(std::ceil(std::min(energy_J * energy_margin, most_J) / step_J) * step_J);
}

}  // namespace bmu
