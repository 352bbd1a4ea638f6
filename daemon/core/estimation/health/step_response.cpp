#include "daemon/core/estimation/health/step_response.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// Time before and after the instant for which the current must be constant.
constexpr Duration steady_around = 15ms;
constexpr Duration neighbours_max = 600ms;
/// Maximum distance of a current sample from the instant: the sensor's period, and as much for its transmission.
constexpr Duration current_apart_max = 2 * internal_bus::sensor_current.period;
constexpr std::int32_t step_floor_mA = 1'000;
/// A change of more than one part in this many of the continuous current is a step.
constexpr std::int32_t step_share = 10;
/// A smaller expected movement of a cell is noise.
constexpr std::int64_t answer_min_uV = 5'000;
/// The same for a text, which has no effect on decisions.
constexpr std::int64_t text_answer_min_uV = 3'000;
/// A step of the voltages proves a frozen current if the current has been constant for this time; the step must be that
/// of this many of the smallest current steps, and this much a cell.
constexpr Duration still_min = 3s;
constexpr std::int64_t steps_unseen_min = 2;
constexpr std::int64_t unseen_min_uV = 10'000;

/// True if every cell was sampled with the POLL to all modules. A module that was polled again singly has another
/// instant.
bool is_of_one_instant(const ModuleTable& modules, TimePoint instant, Duration width) {
  return std::all_of(modules.modules().begin(), modules.modules().end(), [=](const ModuleRecord& module) {
    const auto cells = static_cast<std::ptrdiff_t>(module.config.cell_count);
    return std::all_of(module.cell_voltage_uV.begin(), module.cell_voltage_uV.begin() + cells,
                       [=](const Measured<std::int32_t>& voltage) {
                         return voltage.taken_at <= instant && instant - voltage.taken_at <= width;
                       });
  });
}

}  // namespace

void StepResponse::init(const CoreConfig& config) {
  *this = {};
  cell_count_ = cell_count(config);
  capacity_As_ = config.cell.capacity_uAs / 1'000'000;
  series_resistance_Ohm_ = config.cell.series_resistance_Ohm;
  sample_age_ = sample_age_max(config.foreign);
  resistance_activation_K_ = config.cell.resistance_activation_K;
  step_min_mA_ = std::max(step_floor_mA, config.current.discharge_continuous_mA / step_share);
  std::size_t cell = 0;
  for (const ModuleConfig& module : config.modules) {
    for (std::uint8_t number = 1; number <= module.cell_count; ++number, ++cell) {
      elements_[cell] = {
          .module_node = module.node, .number = number, .pack_number = static_cast<std::uint16_t>(cell + 1)};
    }
  }
}

void StepResponse::forget() {
  kept_.instant = {};
  last_steady_ = {};
  pictures_ = {};
  ramp_.forget();
  contradiction_ = {};
  taken_at_ = {};
  still_since_ = {};
}

void StepResponse::forget_module(std::uint8_t node) {
  forget();
  worst_cell_permille_ = {};
  average_permille_ = {};
  average_uOhm_ = 0;
  for (std::size_t cell = 0; cell < cell_count_; ++cell) {
    if (elements_[cell].module_node == node) cells_[cell] = {};
  }
}

void StepResponse::update(const ModuleTable& modules, const SensorTable& sensors, const PackState& pack) {
  ramp_.follow_current(sensors.current_mA);
  keep_cycle(modules, pack);
  // The current sample after that time determines the current at the instant as much as the one before it does.
  if (kept_.instant == TimePoint{} || sensors.current_mA.taken_at < kept_.instant + steady_around) return;
  model_uOhm_ = model_at(pack.cell_temperature_dC);
  if (model_uOhm_ != 0) judge_cycle(modules, sensors);
  kept_.instant = {};
}

void StepResponse::keep_cycle(const ModuleTable& modules, const PackState& pack) {
  const TimePoint instant = modules.completed_at();
  const bool is_new = instant != TimePoint{} && instant != taken_at_;
  if (!is_new || kept_.instant != TimePoint{} || !pack.cell_voltage_uV.is_complete()) return;
  kept_.instant = instant;
  kept_.is_of_one_instant = is_of_one_instant(modules, instant, steady_around + sample_age_);
  kept_.sum_uV = std::int64_t{pack.cell_voltage_sum_mV.value} * 1'000;
  kept_.lowest_uV = pack.cell_voltage_uV.min;
  kept_.highest_uV = pack.cell_voltage_uV.max;
  kept_.pack_mV = pack.pack_voltage_mV;
  std::size_t cell = 0;
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleRecord& module = modules.modules()[index];
    kept_.balancing_cells[index] = module.balancing_cells;
    for (std::size_t number = 0; number < module.config.cell_count; ++number, ++cell) {
      kept_.cell_voltage_uV[cell] = module.cell_voltage_uV[number].value;
    }
  }
}

void StepResponse::judge_cycle(const ModuleTable& modules, const SensorTable& sensors) {
  const Picture now = picture_of(sensors);
  const bool is_still = still_since_ != TimePoint{} && sensors.current_window.swing_mA(taken_at_) < step_min_mA_ / 10;
  if (!is_still) still_since_ = now.taken_at;
  const TimePoint before = taken_at_;
  taken_at_ = now.taken_at;
  contradiction_ = {};
  const bool has_switched = take_switches();
  if (has_switched) {
    pictures_ = {};
    ramp_.forget();
  } else {
    judge_ramp(sensors, before);
  }
  if (!has_switched && kept_.is_of_one_instant) note_answer(now, sensors.current_window);
  if (!now.is_steady) return;
  compare_cells(modules, now);
  if (has_switched) return;
  judge_direction(now);
  judge_stillness(now);
  pictures_[head_] = now;
  head_ = (head_ + 1) % pictures_.size();
}

/// True if a cell of some module started or stopped bleeding with this poll cycle.
bool StepResponse::take_switches() {
  const bool has_switched = kept_.balancing_cells != bleeding_;
  bleeding_ = kept_.balancing_cells;
  return has_switched;
}

std::int64_t StepResponse::model_at(const Spread& temperature_dC) const {
  constexpr double tenths = 10.0;
  if (resistance_activation_K_ == 0.0) return std::llround(series_resistance_Ohm_ * 1e6);
  if (!temperature_dC.is_complete()) return 0;
  return std::llround(series_resistance_Ohm_ *
                      resistance_factor(resistance_activation_K_, temperature_dC.average / tenths) * 1e6);
}

StepResponse::Picture StepResponse::picture_of(const SensorTable& sensors) const {
  Picture picture{.taken_at = kept_.instant, .sum_uV = kept_.sum_uV, .pack_mV = kept_.pack_mV};
  const CurrentRange range =
      sensors.current_window.span(picture.taken_at - steady_around - sample_age_, picture.taken_at + steady_around);
  const std::optional<std::int32_t> current_mA = sensors.current_window.at(picture.taken_at, current_apart_max);
  picture.is_steady = range.is_known && range.max_mA - range.min_mA < step_min_mA_ / 10 && current_mA.has_value() &&
                      kept_.is_of_one_instant;
  picture.current_mA = current_mA.value_or(0);
  return picture;
}

void StepResponse::compare_cells(const ModuleTable& modules, const Picture& now) {
  const std::int64_t step_mA = std::int64_t{now.current_mA} - last_steady_.current_mA;
  const bool is_step = last_steady_.is_steady && std::llabs(step_mA) >= step_min_mA_ &&
                       now.taken_at - last_steady_.taken_at <= neighbours_max;
  std::size_t index = 0;
  for (std::size_t place = 0; place < modules.modules().size(); ++place) {
    const std::size_t count = modules.modules()[place].config.cell_count;
    for (std::size_t number = 0; number < count; ++number, ++index) {
      Cell& cell = cells_[index];
      const std::int32_t voltage_uV = kept_.cell_voltage_uV[index];
      const std::int64_t drop_uV = std::int64_t{cell.voltage_uV} - voltage_uV;
      cell.voltage_uV = voltage_uV;
      const bool is_bleeding = (kept_.balancing_cells[place] >> number & 1U) != 0;
      const bool is_comparable = is_bleeding == cell.is_bleeding && !cell.has_just_switched;
      cell.has_just_switched = is_bleeding != cell.is_bleeding;
      cell.is_bleeding = is_bleeding;
      if (is_step && is_comparable) cell.average.take(drop_uV, step_mA, model_uOhm_);
    }
  }
  last_steady_ = now;
  if (is_step) refresh(now.taken_at);
}

/// Updates the results of the steps so far; no effect until every cell has had enough of them.
void StepResponse::refresh(TimePoint at) {
  const auto cells = static_cast<std::ptrdiff_t>(cell_count_);
  const bool knows_all = cells > 0 && std::all_of(cells_.begin(), cells_.begin() + cells,
                                                  [](const Cell& cell) { return cell.average.is_known(); });
  if (!knows_all) return;
  std::int64_t sum_uOhm = 0;
  std::size_t worst = 0;
  for (std::size_t cell = 0; cell < cell_count_; ++cell) {
    sum_uOhm += cells_[cell].average.resistance_uOhm;
    if (cells_[cell].average.resistance_uOhm > cells_[worst].average.resistance_uOhm) worst = cell;
  }
  average_uOhm_ = static_cast<std::int32_t>(divide_to_nearest(sum_uOhm, cells));
  worst_cell_permille_ = {.is_known = true,
                          .value = std::int64_t{cells_[worst].average.resistance_uOhm} * 1'000 / average_uOhm_,
                          .element = elements_[worst],
                          .taken_at = at};
  average_permille_ = {.is_known = true, .value = average_uOhm_ * std::int64_t{1'000} / model_uOhm_, .taken_at = at};
}

void StepResponse::judge_direction(const Picture& now) {
  const auto cells = static_cast<std::int64_t>(cell_count_);
  for (const Picture& before : pictures_) {
    const std::int64_t step_mA = std::int64_t{now.current_mA} - before.current_mA;
    const std::int64_t expected_uV = -step_mA * model_uOhm_ / 1'000 * cells;
    const bool is_step = before.is_steady && std::llabs(step_mA) >= step_min_mA_ &&
                         now.taken_at - before.taken_at <= neighbours_max &&
                         std::llabs(expected_uV) >= answer_min_uV * cells;
    if (!is_step) continue;
    const std::int64_t seen_uV = now.sum_uV - before.sum_uV;
    const bool is_against = (seen_uV > 0) != (expected_uV > 0) && 2 * std::llabs(seen_uV) >= std::llabs(expected_uV);
    take_verdict({.is_known = true, .value = is_against ? 1 : 0, .taken_at = now.taken_at}, Contradiction::against);
  }
}

/// Since a steady sample set before, the current must have changed to one side only, and the cells must have moved by
/// half or more of the expected movement. So there is a response even of a pack that opens a few samples after the
/// current came.
void StepResponse::note_answer(const Picture& now, const CurrentWindow& window) {
  const auto cells = static_cast<std::int64_t>(cell_count_);
  for (const Picture& before : pictures_) {
    if (!before.is_steady || now.taken_at - before.taken_at > neighbours_max) continue;
    const CurrentRange range = window.span(before.taken_at, now.taken_at + steady_around);
    const std::int64_t risen_mA = std::int64_t{range.max_mA} - before.current_mA;
    const std::int64_t fallen_mA = std::int64_t{before.current_mA} - range.min_mA;
    const std::int64_t step_mA = risen_mA > fallen_mA ? risen_mA : -fallen_mA;
    const bool is_one_sided = 5 * std::min(risen_mA, fallen_mA) <= std::llabs(step_mA);
    const std::int64_t expected_uV = -step_mA * model_uOhm_ / 1'000 * cells;
    const std::int64_t seen_uV = now.sum_uV - before.sum_uV;
    const bool is_step = range.is_known && is_one_sided &&
                         std::llabs(step_mA) >= std::max<std::int64_t>(step_floor_mA, step_min_mA_ / 5) &&
                         std::llabs(expected_uV) >= text_answer_min_uV * cells;
    if (!is_step || 2 * std::llabs(seen_uV) < std::llabs(expected_uV)) continue;
    latest_answer_ = (seen_uV > 0) == (expected_uV > 0) ? StepAnswer::with : StepAnswer::against;
  }
}

/// Detects a current that is reported as constant while all voltages step, and stay: the sensor repeats its value. The
/// reference is the oldest sample set, so that a brief deviation in between has no effect.
void StepResponse::judge_stillness(const Picture& now) {
  if (now.taken_at - still_since_ < still_min || !now.pack_mV.is_valid()) return;
  const Picture* before = nullptr;
  for (const Picture& one : pictures_) {
    const bool is_near = one.is_steady && one.pack_mV.is_valid() && now.taken_at - one.taken_at <= neighbours_max;
    if (is_near && (before == nullptr || one.taken_at < before->taken_at)) before = &one;
  }
  if (before == nullptr) return;
  const auto cells = static_cast<std::int64_t>(cell_count_);
  const std::int64_t least_uV = unseen_uV() * cells;
  const std::int64_t seen_uV = now.sum_uV - before->sum_uV;
  const bool is_unseen = std::llabs(seen_uV) >= least_uV && is_move_of_pack(seen_uV, before->pack_mV, now.pack_mV);
  take_verdict({.is_known = true, .value = is_unseen ? 1 : 0, .taken_at = now.taken_at}, Contradiction::without);
}

/// Minimum movement of a cell's voltage while the reported current is constant.
std::int64_t StepResponse::unseen_uV() const {
  return std::max(unseen_min_uV, steps_unseen_min * step_min_mA_ * model_uOhm_ / 1'000);
}

/// Of several verdicts about one sample set the first bad one counts. `contradiction`: its kind.
void StepResponse::take_verdict(const Reading& verdict, Contradiction contradiction) {
  if (!verdict.is_known) return;
  if (verdict.value != 0) note_contradiction(contradiction);
  const bool is_bad_already = contradiction_.is_known && contradiction_.value != 0;
  if (!is_bad_already) contradiction_ = verdict;
}

/// Voltages that stepped while the current was constant are displaced from those of an earlier current, as if they
/// moved against it. While the current stays constant, they give no information about its direction.
void StepResponse::note_contradiction(Contradiction contradiction) {
  const bool stands_still = latest_contradiction_ == Contradiction::without && taken_at_ - still_since_ >= still_min;
  if (contradiction == Contradiction::without || !stands_still) latest_contradiction_ = contradiction;
}

/// `before`: the instant of the previous sample set.
void StepResponse::judge_ramp(const SensorTable& sensors, TimePoint before) {
  const CurrentWindow& window = sensors.current_window;
  const TimePoint from = kept_.instant - steady_around - sample_age_;
  const TimePoint until = kept_.instant + steady_around;
  const PackPicture picture{.taken_at = kept_.instant,
                            .current = window.span(from, until),
                            .since_last = before != TimePoint{} ? window.span(before, until) : CurrentRange{},
                            .sum_uV = kept_.sum_uV,
                            .lowest_uV = kept_.lowest_uV,
                            .highest_uV = kept_.highest_uV,
                            .pack_mV = kept_.pack_mV};
  const bool is_sampled = picture.current.is_known && window.at(kept_.instant, current_apart_max).has_value();
  if (!is_sampled || !kept_.is_of_one_instant) {
    ramp_.forget();
    return;
  }
  ramp_.take(picture, {.count = static_cast<std::int64_t>(cell_count_),
                       .resistance_uOhm = model_uOhm_,
                       .unseen_uV = unseen_uV(),
                       .capacity_As = capacity_As_,
                       .calm_mA = std::max<std::int64_t>(step_floor_mA, step_min_mA_ / 10)});
  take_verdict(ramp_.implausible_current(),
               ramp_.is_against_current() ? Contradiction::against : Contradiction::without);
}

std::int32_t StepResponse::cell_resistance_uOhm(std::size_t cell) const {
  return cells_[cell].average.is_known() ? cells_[cell].average.resistance_uOhm : 0;
}

}  // namespace bmu
