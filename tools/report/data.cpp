#include "tools/report/data.hpp"

#include <algorithm>
#include <cmath>

namespace bmu::report {

namespace {

/// Assignment of samples to merged ones: samples with times within the same doubled sample are merged.
struct Merge {
  std::vector<std::size_t> firsts;  // of the samples that stay, and the end
};

Series merged(const Series& series, const Merge& merge) {
  Series result;
  if (series.size() == 0) return result;
  for (std::size_t k = 0; k + 1 < merge.firsts.size(); ++k) {
    float low = not_known;
    float high = not_known;
    float sum = 0;
    float count = 0;
    for (std::size_t i = merge.firsts[k]; i < merge.firsts[k + 1]; ++i) {
      low = lower(low, series.low[i]);
      high = higher(high, series.high[i]);
      if (std::isnan(series.mean[i])) continue;
      sum += series.mean[i];
      count += 1;
    }
    result.add(low, count > 0 ? sum / count : not_known, high);
  }
  return result;
}

void merge_causes(CauseReport& causes, const Merge& merge) {
  if (causes.of_sample.empty()) return;
  std::vector<std::uint16_t> result;
  for (std::size_t k = 0; k + 1 < merge.firsts.size(); ++k) result.push_back(causes.of_sample[merge.firsts[k]]);
  causes.of_sample = std::move(result);
}

}  // namespace

void Series::add(float low_value, float mean_value, float high_value) {
  low.push_back(low_value);
  mean.push_back(mean_value);
  high.push_back(high_value);
}

bool Series::is_unknown() const {
  return std::all_of(mean.begin(), mean.end(), [](float value) { return std::isnan(value); });
}

void CauseReport::add(const std::string& text) {
  const auto found = std::find(texts.begin(), texts.end(), text);
  of_sample.push_back(static_cast<std::uint16_t>(found - texts.begin()));
  if (found == texts.end()) texts.push_back(text);
}

bool ReportData::has_gap_before(std::size_t sample) const {
  // Tolerance of half a sample: the last one of a source may be late.
  return sample > 0 && times_us[sample] - times_us[sample - 1] > sample_us + sample_us / 2;
}

void halve(ReportData& data) {
  const std::int64_t doubled_us = 2 * data.sample_us;
  Merge merge;
  std::vector<std::int64_t> times_us;
  for (std::size_t i = 0; i < data.times_us.size(); ++i) {
    const std::int64_t at_us = data.times_us[i] - data.times_us[i] % doubled_us;
    if (!times_us.empty() && times_us.back() == at_us) continue;
    times_us.push_back(at_us);
    merge.firsts.push_back(i);
  }
  merge.firsts.push_back(data.times_us.size());
  for (CellReport& cell : data.cells) cell.voltage_V = merged(cell.voltage_V, merge);
  for (SensorReport& sensor : data.sensors) sensor.temperature_C = merged(sensor.temperature_C, merge);
  for (Series* series : {&data.pack_voltage_V, &data.link_voltage_V, &data.current_A, &data.discharge_limit_A,
                         &data.charge_limit_A, &data.soc_percent, &data.soc_doubt_percent}) {
    *series = merged(*series, merge);
  }
  merge_causes(data.discharge_cause, merge);
  merge_causes(data.charge_cause, merge);
  data.times_us = std::move(times_us);
  data.sample_us = doubled_us;
}

}  // namespace bmu::report
