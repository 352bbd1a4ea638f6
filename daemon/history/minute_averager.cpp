#include "daemon/history/minute_averager.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/core/estimation/energy_left.hpp"
#include "daemon/core/estimation/pack_health.hpp"
#include "protocol/units.hpp"

namespace bmu {

namespace {

constexpr double permille_per_one = 1e3;
constexpr double uOhm_per_Ohm = 1e6;

/// End of a minute that starts now.
TimePoint end_of_minute(TimePoint at, std::int64_t unix_time_ms, Duration period) {
  if (unix_time_ms <= 0) return at + period;
  const Duration left = period - std::chrono::milliseconds(unix_time_ms) % period;
  return at + (left < period / 2 ? left + period : left);
}

std::optional<std::int32_t> permille_of(const HealthFigure& figure) {
  return figure.is_known ? std::optional(figure.permille) : std::nullopt;
}

bool is_connected(const ContactorOutputs& outputs) {
  return outputs.main_positive && outputs.main_negative;
}

}  // namespace

void MinuteAverager::Samples::look(const Measured<std::int32_t>& measured, TimePoint now, Duration age_max) {
  if (measured.taken_at == taken_at) return;
  taken_at = measured.taken_at;
  if (!measured.is_usable(now, age_max)) return;
  min = count == 0 ? measured.value : std::min(min, measured.value);
  max = count == 0 ? measured.value : std::max(max, measured.value);
  sum += measured.value;
  ++count;
}

SampledValue MinuteAverager::Samples::value() const {
  if (count == 0) return {};
  return {
      .average = static_cast<std::int32_t>(divide_to_nearest(sum, count)), .min = min, .max = max, .samples = count};
}

MinuteAverager::MinuteAverager(const Core& core, Duration period) : core_(core), period_(period) {
  for (const ModuleConfig& module : core.config().modules) {
    minute_.cell_count += module.cell_count;
    minute_.sensor_count += module.temperature_sensor_count + internal_bus::board_temperatures_per_module;
  }
}

bool MinuteAverager::update(TimePoint at) {
  if (!has_begun_) begin(at);
  look(at);
  if (at < ends_at_) return false;
  end(at);
  return true;
}

bool MinuteAverager::finish(TimePoint at) {
  if (!has_begun_ || at <= began_at_) return false;
  end(at);
  return true;
}

void MinuteAverager::begin(TimePoint at) {
  has_begun_ = true;
  began_at_ = looked_at_ = at;
  ends_at_ = end_of_minute(at, core_.unix_time_ms(at), period_);
  for (Samples& samples : voltage_uV_) samples.begin();
  for (Samples& samples : temperature_dC_) samples.begin();
  for (Samples* samples : {&current_mA_, &pack_voltage_mV_, &link_voltage_mV_}) samples->begin();
  bled_.fill({});
  closed_ = {};
  charge_at_begin_ = core_.charge();
  modules_answering_min_ = core_.pack().modules_answering;
  faults_present_.reset();
  warnings_present_.reset();
}

void MinuteAverager::end(TimePoint at) {
  minute_.began_at = began_at_;
  minute_.span = at - began_at_;
  minute_.uptime = at - core_.started_at();
  // By the clock at its end: the time may have been unknown when the minute started.
  const std::int64_t unix_time_ms = core_.unix_time_ms(at);
  minute_.unix_time_ms = unix_time_ms == 0 ? 0 : unix_time_ms - to_ms(minute_.span);
  fill_cells();
  fill_pack(at);
  fill_flow();
  begin(at);
}

void MinuteAverager::look(TimePoint at) {
  const Duration passed = at - looked_at_;
  looked_at_ = at;
  const AgeConfig& ages = core_.config().ages;
  const SensorTable& sensors = core_.sensors();
  current_mA_.look(sensors.current_mA, at, ages.pack_current);
  pack_voltage_mV_.look(sensors.pack_voltage_mV, at, ages.pack_voltage);
  link_voltage_mV_.look(sensors.link_voltage_mV, at, ages.pack_voltage);
  look_at_modules(at, passed);
  if (is_connected(core_.outputs())) closed_ += passed;
  modules_answering_min_ = std::min(modules_answering_min_, core_.pack().modules_answering);
  for (std::size_t index = 0; index < fault_count; ++index) {
    const FaultState& state = core_.faults().states()[index];
    if (state.is_present()) faults_present_.set(index);
    if (state.is_warning) warnings_present_.set(index);
  }
}

void MinuteAverager::look_at_modules(TimePoint at, Duration passed) {
  const AgeConfig& ages = core_.config().ages;
  std::size_t cell = 0;
  std::size_t sensor = 0;
  for (const ModuleRecord& module : core_.modules().modules()) {
    const bool is_bleeding = module.balancing_cells != 0 && module.module_voltage_mV.is_fresh(at, ages.cell_voltage);
    for (std::size_t place = 0; place < module.config.cell_count; ++place, ++cell) {
      voltage_uV_[cell].look(module.cell_voltage_uV[place], at, ages.cell_voltage);
      if (is_bleeding && (module.balancing_cells >> place & 1U) != 0) bled_[cell] += passed;
    }
    for (std::size_t place = 0; place < module.config.temperature_sensor_count; ++place, ++sensor) {
      temperature_dC_[sensor].look(module.cell_temperature_dC[place], at, ages.temperature);
    }
    for (const Measured<std::int32_t>& board_dC : module.board_temperature_dC) {
      temperature_dC_[sensor++].look(board_dC, at, ages.temperature);
    }
  }
}

void MinuteAverager::fill_cells() {
  const PackEstimate& estimate = core_.estimate();
  for (std::size_t number = 0; number < minute_.cell_count; ++number) {
    CellMinute& cell = minute_.cells[number];
    const SocEstimate soc = estimate.cell_soc(number);
    const StateOfHealth health = estimate.cell_health(number).health();
    cell.voltage_uV = voltage_uV_[number].value();
    cell.soc_permille =
        soc.is_known ? std::optional(static_cast<std::int32_t>(std::lround(soc.soc * permille_per_one))) : std::nullopt;
    cell.health_by_capacity_permille = permille_of(health.by_capacity);
    cell.health_by_resistance_permille = permille_of(health.by_resistance);
    cell.bled_permille =
        minute_.span <= Duration::zero() ? 0 : static_cast<std::int32_t>(bled_[number] * 1'000 / minute_.span);
  }
  for (std::size_t number = 0; number < minute_.sensor_count; ++number) {
    minute_.temperature_dC[number] = temperature_dC_[number].value();
  }
}

void MinuteAverager::fill_pack(TimePoint at) {
  const PackEstimate& estimate = core_.estimate();
  const PackHealth health = pack_health(estimate);
  minute_.current_mA = current_mA_.value();
  minute_.pack_voltage_mV = pack_voltage_mV_.value();
  minute_.link_voltage_mV = link_voltage_mV_.value();
  minute_.soc_permille = core_.soc_permille();
  minute_.soc_sigma_permille.reset();
  if (estimate.pack().is_known) {
    minute_.soc_sigma_permille = static_cast<std::int32_t>(std::lround(estimate.pack().sigma * permille_per_one));
  }
  minute_.health_by_capacity_permille = permille_of(health.by_capacity);
  minute_.health_by_resistance_permille = permille_of(health.by_resistance);
  minute_.pack_resistance_uOhm.reset();
  if (health.resistance.is_known) {
    minute_.pack_resistance_uOhm = std::llround(health.resistance.resistance_Ohm * uOhm_per_Ohm);
  }
  const EnergyLeft energy = energy_left(estimate, core_.config());
  minute_.energy_left_mWh.reset();
  minute_.energy_left_sigma_mWh.reset();
  if (energy.is_known) {
    minute_.energy_left_mWh = in_mWh(energy.energy_Wh);
    minute_.energy_left_sigma_mWh = in_mWh(energy.sigma_Wh);
  }
  minute_.limits = core_.limits();
  minute_.powers = core_.power_limits();
  minute_.phase = core_.sequence().phase;
  minute_.mode = core_.mode(at);
  minute_.totals = core_.totals();
}

void MinuteAverager::fill_flow() {
  const ChargeState& now = core_.charge();
  minute_.closed = closed_;
  minute_.charge_out_uAs = now.out_uAs - charge_at_begin_.out_uAs;
  minute_.charge_in_uAs = now.in_uAs - charge_at_begin_.in_uAs;
  minute_.energy_out_mWh = now.energy_out_mWh - charge_at_begin_.energy_out_mWh;
  minute_.energy_in_mWh = now.energy_in_mWh - charge_at_begin_.energy_in_mWh;
  minute_.uncounted = std::max(Duration::zero(), minute_.span - (now.counted - charge_at_begin_.counted));
  minute_.modules_answering_min = modules_answering_min_;
  minute_.faults_present = faults_present_;
  minute_.warnings_present = warnings_present_;
}

}  // namespace bmu
