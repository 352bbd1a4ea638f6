#include "daemon/core/estimation/pack_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "daemon/core/estimation/soc/rest_anchor.hpp"

namespace bmu {

namespace {

constexpr double ppm = 1e6;
constexpr double mA_per_A = 1e3;
constexpr double uV_per_V = 1e6;
constexpr double uAs_per_As = 1e6;
constexpr double dC_per_C = 10.0;
constexpr double hour_s = 3600.0;

/// Cells sampled with the POLL to all modules have its instant; a module that was polled again singly has another one.
constexpr Duration instant_width = 15ms;
/// Modules of another maker report no time of measurement: the current may have changed by this voltage since then.
constexpr double apart_max_V = 5e-3;
/// The same where the cell's resistance is unknown.
constexpr double apart_max_mA = 500.0;
/// Maximum distance of a current sample from the instant: the sensor's period, and as much for its transmission.
constexpr Duration current_apart_max = 2 * internal_bus::sensor_current.period;
/// Initial uncertainty of a voltage alone, with unknown history of the cell: the filter finds out how accurate it is.
constexpr double begin_sigma = 0.3;
/// Relative uncertainty of the self-discharge between two sessions: it is known to half.
constexpr double lost_doubt = 0.5;
/// A first voltage this many standard deviations off the record is that of another cell, or the cell was charged.
constexpr double contradiction_sigmas = 5.0;
/// After a record of this age the voltages contain no polarisation by the current before it.
constexpr Duration settled_after = 1h;
/// Shares of the absolute limits: under load in the cold a valid cell falls below the lower one.
constexpr double least_share = 0.7;
constexpr double most_share = 1.15;
/// Share of 1C; below it the time until the pack is empty or full is undefined.
constexpr double outlook_least_share = 0.01;
/// A change of a capacity or a resistance by this much is worth a record.
constexpr std::int32_t health_step_ppm = 10'000;

double doubt_of(const CellSocRecord& record, bool is_last, double lost) {
  return std::hypot(record.sigma_ppm / ppm, is_last ? 0.0 : record_step, lost_doubt * lost);
}

/// Initial state with the cell's capacity, as far as that is known.
SocBegin begin_with(const CellHealth& health, const CellDynamics& model) {
  SocBegin from;
  if (!health.is_capacity_known()) return from;
  from.capacity_As = health.capacity_As();
  from.capacity_sigma = std::max(from.capacity_sigma, health.capacity_sigma_As() / model.capacity_As);
  return from;
}

bool has_aged(const CellHealthRecord& before, const CellHealthRecord& now) {
  return std::abs(before.capacity_ppm - now.capacity_ppm) >= health_step_ppm ||
         std::abs(before.resistance_ppm - now.resistance_ppm) >= health_step_ppm;
}

std::int32_t in_ppm(double share) {
  return static_cast<std::int32_t>(std::llround(std::clamp(share, 0.0, 1.0) * ppm));
}

}  // namespace

std::string_view to_text(SocOrigin origin) {
  switch (origin) {
    case SocOrigin::none: return "not known";
    case SocOrigin::former: return "kept from before";
    case SocOrigin::voltage: return "voltage at rest";
  }
  return "?";
}

void PackEstimate::init(const CoreConfig& config) {
  // A cell without a curve cannot be estimated; no pack file has one.
  if (!config.dynamics && config.cell.ocv.size() < 2) return;
  estimates_.init(config.dynamics ? *config.dynamics : dynamics_of(config.cell));
  memo_ = {};
  const CellDynamics& model = estimates_.model();
  method_ = config.soc.method;
  ages_ = config.ages;
  rest_current_mA_ = config.soc.rest_current_mA;
  rest_current_A_ = config.soc.rest_current_mA / mA_per_A;
  capacity_uAs_ = config.cell.capacity_uAs;
  // A pack file always has limits; without them no voltage is out of range.
  const bool has_limits = config.cell.voltage_max_uV > 0;
  voltage_least_V_ = least_share * config.cell.voltage_min_uV / uV_per_V;
  voltage_most_V_ = has_limits ? most_share * config.cell.voltage_max_uV / uV_per_V : measured_most;
  spans_ = CurrentSpanMeter(config.ages.pack_current);
  const double hour_rate_A = model.capacity_As / hour_s;
  sensor_ = {.gain = config.soc.current_gain_error_permille / 1e3,
             .offset_A = config.soc.current_offset_error_mA / mA_per_A,
             .unknown_current_A = hour_rate_A};
  health_.init({.expected = ExpectedResistance(model),
                .plateau = config.charge_plateau,
                .sensor = sensor_,
                .rated_As = model.capacity_As,
                .charge_efficiency = model.charge_efficiency});
  ends_ = charge_ends_of(model);
  has_nameless_modules_ = !are_modules_ours(config);
  sample_age_ = sample_age_max(config.foreign);
  const double resistance_Ohm = config.cell.series_resistance_Ohm;
  swing_max_mA_ = resistance_Ohm > 0.0 ? apart_max_V / resistance_Ohm * mA_per_A : apart_max_mA;
  cell_count_ = 0;
  module_count_ = 0;
  for (const ModuleConfig& module : config.modules) {
    modules_[module_count_] = {
        .node = module.node, .cell_count = module.cell_count, .first_cell = static_cast<std::uint16_t>(cell_count_)};
    for (std::uint8_t number = 1; number <= module.cell_count; ++number, ++cell_count_) {
      cells_[cell_count_].module = static_cast<std::uint8_t>(module_count_);
      cells_[cell_count_].element = {
          .module_node = module.node, .number = number, .pack_number = static_cast<std::uint16_t>(cell_count_ + 1)};
    }
    ++module_count_;
  }
}

void PackEstimate::forget_module(std::size_t index) {
  const Module& module = modules_[index];
  for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
    estimates_[module.first_cell + cell].forget();
    health_[module.first_cell + cell].forget();
  }
  serial_numbers_[index] = 0;
  former_.modules[module.node] = {};
}

bool PackEstimate::update(const PackEstimateInputs& in) {
  if (sampled_at_ == TimePoint{}) {
    sampled_at_ = in.now;
    spans_.begin(in.now, *in.charge);
  }
  for (std::size_t index = 0; index < module_count_; ++index) {
    const Measured<ModuleIdentity>& identity = in.modules->modules()[index].identity;
    if (identity.is_valid()) serial_numbers_[index] = identity.value.serial_number;
    if (has_nameless_modules_) serial_numbers_[index] = modules_[index].node;
  }
  follow_rest(in);
  const TimePoint instant = in.modules->completed_at();
  // The current sample after the instant determines the current at the instant as much as the one before it does.
  const bool is_picture =
      instant != TimePoint{} && instant != pictured_at_ && in.sensors->current_mA.taken_at >= instant;
  if (!is_picture && in.now - sampled_at_ < estimate_gap_max) return false;
  if (is_picture) pictured_at_ = instant;
  sampled_at_ = in.now;
  const bool was_known = pack_.is_known;
  const Moment moment = moment_of(in, is_picture && is_dated(in, instant) ? instant : TimePoint{});
  read_temperatures(in);
  sample_cells(in, moment);
  if (is_picture && may_begin(in)) begin(in, moment);
  sum_up(moment, in.now);
  judge(in.now);
  return pack_.is_known && !was_known;
}

/// True if the current at the instant is that of the voltages, too, whenever they were measured.
bool PackEstimate::is_dated(const PackEstimateInputs& in, TimePoint instant) const {
  if (sample_age_ == Duration{}) return true;
  return static_cast<double>(in.sensors->current_window.swing_mA(instant - sample_age_)) <= swing_max_mA_;
}

void PackEstimate::follow_rest(const PackEstimateInputs& in) {
  const Measured<std::int32_t>& current_mA = in.pack->current_mA;
  const bool is_resting = in.is_open && current_mA.is_valid() && std::abs(current_mA.value) <= rest_current_mA_;
  if (!is_resting) {
    resting_since_ = {};
    is_rest_used_ = false;
    return;
  }
  if (resting_since_ == TimePoint{}) resting_since_ = in.now;
}

bool PackEstimate::may_begin(const PackEstimateInputs& in) const {
  const bool has_rested = resting_since_ != TimePoint{} && in.now - resting_since_ >= begin_after;
  if (!has_rested || !in.pack->cell_voltage_uV.is_complete()) return false;
  if (!former_.is_kept) return true;
  return std::all_of(serial_numbers_.begin(), serial_numbers_.begin() + static_cast<std::ptrdiff_t>(module_count_),
                     [](std::uint32_t serial_number) { return serial_number != 0; });
}

void PackEstimate::begin(const PackEstimateInputs& in, const Moment& moment) {
  for (std::size_t number = 0; number < cell_count_; ++number) {
    Cell& cell = cells_[number];
    if (estimates_[number].is_begun()) continue;
    const double voltage = voltage_V(cell, *in.modules, moment.instant);
    if (!is_measured(voltage)) continue;
    begin_cell(number, voltage, in.unix_time_ms);
    cell.bled_uAs = in.bled_uAs[number];
  }
}

const CellSocRecord* PackEstimate::former_of(const Cell& cell) const {
  const Module& module = modules_[cell.module];
  const ModuleSocRecord& former = former_.modules[module.node];
  const std::uint32_t serial_number = serial_numbers_[cell.module];
  const bool is_same = former_.is_kept && former_.capacity_uAs == capacity_uAs_ &&
                       former.cell_count == module.cell_count && serial_number != 0 &&
                       former.serial_number == serial_number;
  return is_same ? &former.cells[cell.element.number - 1U] : nullptr;
}

std::optional<Duration> PackEstimate::age_of_former(std::int64_t unix_time_ms) const {
  const bool is_known = former_.unix_time_ms != 0 && unix_time_ms >= former_.unix_time_ms;
  if (!is_known) return std::nullopt;
  return std::chrono::milliseconds{unix_time_ms - former_.unix_time_ms};
}

/// Only once: a cell that starts again because its voltage contradicts its record keeps its health.
void PackEstimate::begin_health(std::size_t number, const CellHealthRecord& former) {
  if (!health_[number].is_begun()) health_[number].begin(health_.model(), former);
}

void PackEstimate::begin_cell(std::size_t number, double voltage_V, std::int64_t unix_time_ms) {
  Cell& cell = cells_[number];
  const CellDynamics& model = estimates_.model();
  const double temperature_C = modules_[cell.module].temperature_C;
  const double known_C = is_measured(temperature_C) ? temperature_C : 25.0;
  const CellSocRecord* former = former_of(cell);
  cell.is_on_trial = former != nullptr;
  begin_health(number, former != nullptr ? former->health : CellHealthRecord{});
  SocBegin from = begin_with(health_[number], model);
  if (former == nullptr) {
    from.soc = soc_from_ocv(model, voltage_V, known_C, 0.0);
    from.sigma = begin_sigma;
    from.is_rested = false;
    estimates_[number].begin(model, sensor_, from, temperature_C);
    origin_ = SocOrigin::voltage;
    return;
  }
  const std::optional<Duration> age = age_of_former(unix_time_ms);
  const double lost = self_discharge_A(model, known_C) * to_s(age.value_or(Duration{})) / model.capacity_As;
  from.soc = former->soc_ppm / ppm - lost;
  from.sigma = doubt_of(*former, former_.is_last, lost);
  from.has_followed = true;
  if (age) from.age_s = to_s(*age);
  from.is_rested = age.value_or(Duration{}) >= settled_after;
  from.hysteresis = former->hysteresis_permille / 1e3;
  estimates_[number].begin(model, sensor_, from, temperature_C);
  if (origin_ == SocOrigin::none) origin_ = SocOrigin::former;
  record_age_ = age;
}

CellForecastInput PackEstimate::forecast_input(std::size_t number) const {
  const Cell& cell = cells_[number];
  const SocFilter& filter = estimates_[number].filter();
  CellForecastInput input{.voltage_V = cell.voltage_V,
                          .current_A = pictured_current_A_,
                          .temperature_C = modules_[cell.module].temperature_C,
                          .soc = cell_soc(number)};
  if (!estimates_[number].is_begun()) return input;
  input.hysteresis = filter.hysteresis();
  input.pair_V = filter.pair_V();
  input.resistance_share = filter.resistance_share();
  input.resistance_sigma = filter.resistance_sigma();
  return input;
}

PackEstimate::Moment PackEstimate::moment_of(const PackEstimateInputs& in, TimePoint instant) {
  Moment moment{.instant = instant, .spans = spans_.next(in.now, *in.charge)};
  const bool has_rested = resting_since_ != TimePoint{} && in.now - resting_since_ >= anchor_rest;
  if (instant != TimePoint{} && has_rested && in.now - anchored_by_rest_at_ >= anchor_every) {
    moment.anchors = true;
    anchored_by_rest_at_ = in.now;
  }
  // While everything is open, at most the current of a pack at rest flows uncounted.
  moment.unseen_current_A = in.is_open ? rest_current_A_ : sensor_.unknown_current_A;
  if (instant == TimePoint{}) return moment;
  const std::optional<std::int32_t> current_mA = in.sensors->current_window.at(instant, current_apart_max);
  if (current_mA) moment.current_A = *current_mA / mA_per_A;
  pictured_current_A_ = moment.current_A;
  return moment;
}

/// The distance of a module's cells from its sensors is unknown, so all have the mean temperature.
void PackEstimate::read_temperatures(const PackEstimateInputs& in) {
  const Spread& all = in.pack->cell_temperature_dC;
  const double average_C = all.is_known() ? all.average / dC_per_C : not_measured;
  for (std::size_t index = 0; index < module_count_; ++index) {
    const ModuleRecord& record = in.modules->modules()[index];
    double sum_dC = 0.0;
    int count = 0;
    for (std::size_t sensor = 0; sensor < record.config.temperature_sensor_count; ++sensor) {
      const Measured<std::int32_t>& one = record.cell_temperature_dC[sensor];
      if (!one.is_usable(in.now, ages_.temperature)) continue;
      sum_dC += one.value;
      ++count;
    }
    modules_[index].temperature_C = count > 0 ? sum_dC / count / dC_per_C : average_C;
  }
}

double PackEstimate::voltage_V(const Cell& cell, const ModuleTable& modules, TimePoint instant) const {
  if (instant == TimePoint{}) return not_measured;
  const ModuleRecord& record = modules.modules()[cell.module];
  const Measured<std::int32_t>& voltage_uV = record.cell_voltage_uV[cell.element.number - 1U];
  const bool is_of_instant = voltage_uV.is_valid() && voltage_uV.taken_at <= instant + instant_width &&
                             instant - voltage_uV.taken_at <= instant_width + sample_age_;
  const double voltage_V = voltage_uV.value / uV_per_V;
  return is_of_instant && voltage_V >= voltage_least_V_ && voltage_V <= voltage_most_V_ ? voltage_V : not_measured;
}

void PackEstimate::sample_cells(const PackEstimateInputs& in, const Moment& moment) {
  for (std::size_t number = 0; number < cell_count_; ++number) {
    if (estimates_[number].is_begun()) sample_cell(number, in, moment);
  }
}

void PackEstimate::sample_cell(std::size_t number, const PackEstimateInputs& in, const Moment& moment) {
  Cell& cell = cells_[number];
  const CurrentSpans& spans = moment.spans;
  const double all_s = spans.counted_s + spans.uncounted_s;
  const double bled_As = static_cast<double>(in.bled_uAs[number] - cell.bled_uAs) / uAs_per_As;
  cell.bled_uAs = in.bled_uAs[number];
  const bool is_bleeding = bled_As > 0.0;
  if (is_bleeding != cell.is_bleeding) health_[number].restart_resistance();
  cell.is_bleeding = is_bleeding;
  CellSample sample{.passed_s = spans.counted_s,
                    .mean_current_A = spans.mean_current_A + (all_s > 0.0 ? bled_As / all_s : 0.0),
                    .temperature_C = modules_[cell.module].temperature_C,
                    .unseen_current_A = moment.unseen_current_A};
  const double voltage = voltage_V(cell, *in.modules, moment.instant);
  if (moment.instant != TimePoint{}) cell.voltage_V = voltage;
  const bool has_silence = spans.uncounted_s > 0.0;
  if (has_silence && spans.counted_s > 0.0) {
    follow_health(number, sample, estimates_[number].update(sample, ends_, memo_), {});
  }
  if (has_silence) sample.passed_s = spans.uncounted_s;
  if (has_silence) sample.mean_current_A = not_measured;
  sample.current_A = moment.current_A;
  sample.voltage_V = voltage;
  const std::optional<ChargeAnchor> end = estimates_[number].update(sample, ends_, memo_);
  if (end) anchored_at_ = in.now;
  follow_health(number, sample, end, moment);
  if (cell.is_on_trial && is_measured(voltage)) judge_record(number, voltage);
}

void PackEstimate::follow_health(std::size_t number, const CellSample& sample, std::optional<ChargeAnchor> end,
                                 const Moment& moment) {
  if (!end && moment.anchors) {
    const SocFilter& filter = estimates_[number].filter();
    const auto pairs_V = filter.pair_V();
    const double held_back_V = (1.0 + filter.resistance_share()) * std::accumulate(pairs_V.begin(), pairs_V.end(), 0.0);
    end = rest_anchor(estimates_.model(), sample.voltage_V, sample.temperature_C, filter.hysteresis(), held_back_V);
  }
  health_[number].take(sample, end);
}

/// Checks a record by the first voltage after it: if that contradicts the record, the record is discarded.
void PackEstimate::judge_record(std::size_t number, double voltage_V) {
  Cell& cell = cells_[number];
  cell.is_on_trial = false;
  const SocFilter& filter = estimates_[number].filter();
  const double allowed_V = contradiction_sigmas * std::sqrt(filter.innovation_variance_V2());
  if (std::abs(filter.innovation_V()) <= allowed_V) return;
  former_.modules[modules_[cell.module].node].cell_count = 0;
  begin_cell(number, voltage_V, 0);
}

void PackEstimate::sum_up(const Moment& moment, TimePoint now) {
  std::array<CellSoc, cells_max> cells;
  for (std::size_t number = 0; number < cell_count_; ++number) {
    cells[number] = {.estimate = cell_soc(number), .capacity_As = health_[number].capacity_As()};
  }
  follow_outlook(moment.spans);
  const bool was_known = pack_.is_known;
  pack_ = pack_soc({cells.data(), cell_count_});
  if (!pack_.is_known) return;
  const bool has_rested_long = resting_since_ != TimePoint{} && now - resting_since_ >= long_rest && !is_rest_used_;
  if (!was_known) {
    told_.begin(origin_ == SocOrigin::former ? former_.told_ppm / ppm : pack_.soc);
  } else if (has_rested_long) {
    is_rest_used_ = true;
    told_.begin(pack_.soc);
  }
  const CurrentSpans& spans = moment.spans;
  const double all_As = pack_.capacity_As();
  const double flowed = all_As > 0.0 ? spans.mean_current_A * spans.counted_s / all_As : 0.0;
  told_.update(spans.counted_s + spans.uncounted_s, was_known ? flowed : 0.0, pack_.soc);
}

void PackEstimate::follow_outlook(const CurrentSpans& spans) {
  // Uncounted charge may have been anything; and a pack at rest has no load.
  if (spans.uncounted_s > 0.0 || resting_since_ != TimePoint{}) outlook_current_A_ = 0.0;
  if (!(spans.counted_s > 0.0)) return;
  const double weight = -std::expm1(-spans.counted_s / outlook_time_s);
  outlook_current_A_ += (spans.mean_current_A - outlook_current_A_) * weight;
}

std::optional<Duration> PackEstimate::outlook(double charge_As, double current_A) const {
  const double least_A = outlook_least_share * estimates_.model().capacity_As / hour_s;
  if (!pack_.is_known || current_A < least_A) return std::nullopt;
  return std::chrono::seconds{std::llround(charge_As / current_A)};
}

void PackEstimate::judge(TimePoint at) {
  double disagreement = 0.0;
  double misfit = 0.0;
  const Cell* apart = nullptr;
  const Cell* strange = nullptr;
  for (std::size_t number = 0; number < cell_count_; ++number) {
    const CellEstimate& estimate = estimates_[number];
    if (!estimate.is_begun()) continue;
    const double apart_by = estimate.disagreement();
    if (apart == nullptr || apart_by > disagreement) {
      disagreement = apart_by;
      apart = &cells_[number];
    }
    const double strange_by = estimate.filter().misfit();
    if (strange == nullptr || strange_by > misfit) {
      misfit = strange_by;
      strange = &cells_[number];
    }
  }
  const auto reading = [at](const Cell* cell, double share) {
    if (cell == nullptr) return Reading{};
    return Reading{.is_known = true, .value = std::llround(share * 1e3), .element = cell->element, .taken_at = at};
  };
  disagreement_permille_ = reading(apart, disagreement);
  misfit_permille_ = reading(strange, misfit);
}

bool PackEstimate::record(SocRecords& to) const {
  if (!pack_.is_known) return false;
  for (std::size_t index = 0; index < module_count_; ++index) {
    if (serial_numbers_[index] == 0) return false;
  }
  to = {.is_kept = true, .capacity_uAs = capacity_uAs_, .told_ppm = in_ppm(told_.soc())};
  for (std::size_t index = 0; index < module_count_; ++index) {
    const Module& module = modules_[index];
    ModuleSocRecord& kept = to.modules[module.node];
    kept.cell_count = module.cell_count;
    kept.serial_number = serial_numbers_[index];
    for (std::size_t number = 0; number < module.cell_count; ++number) {
      const std::size_t cell = std::size_t{module.first_cell} + number;
      const SocEstimate estimate = cell_soc(cell);
      const double hysteresis = estimates_[cell].filter().hysteresis();
      kept.cells[number] = {
          .soc_ppm = in_ppm(estimate.soc),
          .sigma_ppm = in_ppm(method_ == SocMethod::ekf ? estimates_[cell].filter().model_sigma() : estimate.sigma),
          .hysteresis_permille = static_cast<std::int32_t>(std::llround(hysteresis * 1e3)),
          .health = health_[cell].record()};
    }
  }
  return true;
}

bool is_worth_recording(const SocRecords& older, const SocRecords& newer) {
  constexpr auto step_ppm = static_cast<std::int32_t>(record_step * ppm);
  if (!newer.is_kept) return false;
  const bool is_same_pack = older.is_kept && older.capacity_uAs == newer.capacity_uAs;
  // A record of the end of the previous session is no longer the last state.
  if (!is_same_pack || older.is_last != newer.is_last || std::abs(older.told_ppm - newer.told_ppm) >= step_ppm)
    return true;
  for (std::size_t node = 0; node < newer.modules.size(); ++node) {
    const ModuleSocRecord& before = older.modules[node];
    const ModuleSocRecord& now = newer.modules[node];
    if (before.cell_count != now.cell_count || before.serial_number != now.serial_number) return true;
    for (std::size_t cell = 0; cell < now.cell_count; ++cell) {
      if (std::abs(before.cells[cell].soc_ppm - now.cells[cell].soc_ppm) >= step_ppm) return true;
      if (std::abs(before.cells[cell].sigma_ppm - now.cells[cell].sigma_ppm) >= step_ppm) return true;
      if (has_aged(before.cells[cell].health, now.cells[cell].health)) return true;
    }
  }
  return false;
}

}  // namespace bmu
