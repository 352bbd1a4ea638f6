#include "daemon/core/temperature_trend.hpp"

namespace bmu {

namespace {

constexpr Duration spacing = 250ms;
constexpr Duration span_min = 1s;
/// For as long as a temperature counts as fresh by default, at the slowest pace (poll_pace.hpp, ages_at()): an answer
/// that is lost does not begin the trend anew. How a temperature rose in a longer gap is not known.
constexpr Duration gap_max = 1'050ms;

}  // namespace

void TemperatureTrend::Track::add(const Measured<std::int32_t>& temperature_dC) {
  // A doubtful one may still be true: what was before it is kept to be compared with.
  if (temperature_dC.taken_at == newest.taken_at || temperature_dC.validity == Validity::doubtful) return;
  if (!temperature_dC.is_valid()) {
    *this = {};
    newest.taken_at = temperature_dC.taken_at;
    return;
  }
  if (temperature_dC.taken_at - newest.taken_at > gap_max) *this = {};
  // The samples of an empty ring are of the beginning of time.
  const bool is_due = temperature_dC.taken_at - older[(head + samples_max - 1) % samples_max].taken_at >= spacing;
  newest = {temperature_dC.value, temperature_dC.taken_at};
  if (!is_due) return;
  older[head] = newest;
  head = static_cast<std::uint8_t>((head + 1) % samples_max);
  if (count < samples_max) ++count;
}

const TemperatureTrend::Sample& TemperatureTrend::Track::oldest() const {
  return older[(head + samples_max - count) % samples_max];
}

void TemperatureTrend::update(const ModuleTable& modules) {
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleRecord& module = modules.modules()[index];
    for (std::size_t sensor = 0; sensor < module.config.temperature_sensor_count; ++sensor) {
      tracks_[index][sensor].add(module.cell_temperature_dC[sensor]);
    }
  }
}

Reading TemperatureTrend::fastest_mK_per_s(const ModuleTable& modules) const {
  constexpr std::int64_t mK_per_dC = 100;
  Reading fastest;
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleConfig& module = modules.modules()[index].config;
    for (std::uint8_t sensor = 0; sensor < module.temperature_sensor_count; ++sensor) {
      const Track& track = tracks_[index][sensor];
      if (track.count == 0) continue;
      const std::int64_t span_ms = to_ms(track.newest.taken_at - track.oldest().taken_at);
      if (span_ms < to_ms(span_min)) continue;
      const std::int64_t rise_mK = (track.newest.temperature_dC - track.oldest().temperature_dC) * mK_per_dC;
      const std::int64_t rate_mK_per_s = rise_mK * 1'000 / span_ms;
      if (fastest.is_known && rate_mK_per_s <= fastest.value) continue;
      fastest = {
          true,
          rate_mK_per_s,
          {.module_node = module.node, .number = static_cast<std::uint8_t>(sensor + 1), .is_temperature_sensor = true},
          track.newest.taken_at};
    }
  }
  return fastest;
}

}  // namespace bmu
