#include "tools/report/sample_means.hpp"

#include <algorithm>

namespace bmu::report {

namespace {

constexpr double uV_per_V = 1e6;
constexpr double milli = 1e3;
constexpr double dC_per_C = 10.0;
constexpr double percent = 100.0;

std::string cause_text(const CurrentLimit& limit, const CoreConfig& config) {
  std::string text(to_text(limit.cause));
  if (limit.cause == LimitCause::component && limit.part < config.component_limits.size()) {
    const auto& name = config.component_limits[limit.part].name;
    const std::string_view padded(name.data(), name.size());
    return text + ": " + std::string(padded.substr(0, padded.find_last_not_of(' ') + 1));
  }
  const std::string place = to_text(limit.element);
  return place.empty() ? text : text + ": " + place;
}

}  // namespace

void Mean::take(double value) {
  low_ = count_ == 0 ? value : std::min(low_, value);
  high_ = count_ == 0 ? value : std::max(high_, value);
  sum_ += value;
  ++count_;
}

void Mean::move_to(Series& series) {
  if (count_ == 0) {
    series.add(not_known);
  } else {
    series.add(static_cast<float>(low_), static_cast<float>(sum_ / count_), static_cast<float>(high_));
  }
  *this = {};
}

void SampleMeans::resize(std::size_t cells, std::size_t sensors) {
  cells_.resize(cells);
  sensors_.resize(sensors);
}

void SampleMeans::look_at_modules(const Core& core, TimePoint now) {
  const AgeConfig& ages = core.config().ages;
  std::size_t cell = 0;
  std::size_t sensor = 0;
  for (const ModuleRecord& module : core.modules().modules()) {
    for (unsigned i = 0; i < module.config.cell_count; ++i) {
      cells_[cell++].take(module.cell_voltage_uV[i], now, ages.cell_voltage, uV_per_V);
    }
    for (unsigned i = 0; i < module.config.temperature_sensor_count; ++i) {
      sensors_[sensor++].take(module.cell_temperature_dC[i], now, ages.temperature, dC_per_C);
    }
  }
}

void SampleMeans::look(const Core& core, TimePoint now) {
  look_at_modules(core, now);
  const AgeConfig& ages = core.config().ages;
  const SensorTable& table = core.sensors();
  pack_V_.take(table.pack_voltage_mV, now, ages.pack_voltage, milli);
  link_V_.take(table.link_voltage_mV, now, ages.pack_voltage, milli);
  current_A_.take(table.current_mA, now, ages.pack_current, milli);
  const CurrentLimits& limits = core.limits();
  discharge_A_.take(limits.discharge.limit_mA / milli);
  charge_A_.take(limits.charge.limit_mA / milli);
  if (!has_tick_) {
    discharge_cause_ = cause_text(limits.discharge, core.config());
    charge_cause_ = cause_text(limits.charge, core.config());
  }
  const PackEstimate& estimate = core.estimate();
  if (estimate.pack().is_known) {
    soc_.take(percent * estimate.told_soc());
    soc_doubt_.take(percent * sigmas_told * estimate.pack().sigma);
  }
  has_tick_ = true;
}

void SampleMeans::move_to(ReportData& data, std::int64_t sample_begin_us) {
  data.times_us.push_back(sample_begin_us);
  for (std::size_t i = 0; i < cells_.size(); ++i) cells_[i].move_to(data.cells[i].voltage_V);
  for (std::size_t i = 0; i < sensors_.size(); ++i) sensors_[i].move_to(data.sensors[i].temperature_C);
  pack_V_.move_to(data.pack_voltage_V);
  link_V_.move_to(data.link_voltage_V);
  current_A_.move_to(data.current_A);
  discharge_A_.move_to(data.discharge_limit_A);
  charge_A_.move_to(data.charge_limit_A);
  soc_.move_to(data.soc_percent);
  soc_doubt_.move_to(data.soc_doubt_percent);
  data.discharge_cause.add(discharge_cause_);
  data.charge_cause.add(charge_cause_);
  has_tick_ = false;
}

}  // namespace bmu::report
