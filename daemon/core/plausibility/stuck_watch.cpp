#include "daemon/core/plausibility/stuck_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "daemon/core/cell/ocv_shift.hpp"

namespace bmu {

namespace {

constexpr std::int64_t shows_at_least_uV = 5'000;
/// The voltage between two samples further apart than this is unknown.
constexpr Duration sample_gap_max = 1s;
/// Averaging time of a cell voltage in the module, at any poll rate.
constexpr Duration averaged_over = 100ms;
/// Delay of a poll with its answers and of a current sample: a tick each.
constexpr Duration late_by = 2 * tick_period;
/// Maximum bleed current of a module: up to this, the whole pack current may bypass a cell that is balanced.
constexpr std::int32_t bleed_max_mA = 500;
constexpr std::int64_t nanovolts_per_uV = 1'000;
/// Worn cells have more resistance than in their data sheet, warm ones less and cold ones more: the minimum response to
/// a current step is that of a hot cell, the maximum that of a worn one in the cold.
constexpr double worn_factor = 2.0;
constexpr double hot_C = 60.0;
constexpr double cold_C = -20.0;

}  // namespace

void StuckWatch::init(const CoreConfig& config) {
  const CellModel& cell = config.cell;
  model_ = cell;
  sampled_within_ = std::max(config.poll.period, averaged_over) + late_by;
  const double settled_Ohm = cell.series_resistance_Ohm + cell.rc_resistance_Ohm + cell.slow_rc_resistance_Ohm;
  resistance_uOhm_ =
      std::llround(cell.series_resistance_Ohm * resistance_factor(cell.resistance_activation_K, hot_C) * 1e6);
  resistance_max_uOhm_ =
      std::llround(worn_factor * settled_Ohm * resistance_factor(cell.resistance_activation_K, cold_C) * 1e6);
  flowed_min_uAs_ = charge_for_shift_uAs(cell, shows_at_least_uV);
  forget();
}

void StuckWatch::forget() {
  cells_ = {};
  counted_at_ = {};
}

void StuckWatch::count(const Measured<std::int32_t>& current_mA) {
  constexpr std::int64_t products_per_uAs = 1'000'000;  // of mA and ns
  const Duration since = current_mA.taken_at - counted_at_;
  counted_at_ = current_mA.taken_at;
  if (since > sample_gap_max || std::abs(current_mA.value) <= bleed_max_mA) return;
  charge_uAs_ += current_mA.value * since.count() / products_per_uAs;
}

bool StuckWatch::must_have_moved(const Reference& since, std::int32_t current_mA) const {
  const CurrentRange& then_mA = since.current_mA;
  const std::int64_t up_mA = std::max<std::int64_t>(std::int64_t{current_mA} - then_mA.max_mA, 0);
  const std::int64_t down_mA = std::max<std::int64_t>(std::int64_t{then_mA.min_mA} - current_mA, 0);
  const std::int64_t most_mA =
      std::max(std::int64_t{current_mA} - then_mA.min_mA, std::int64_t{then_mA.max_mA} - current_mA);
  const std::int64_t flowed_uAs = charge_uAs_ - since.charge_uAs;
  const std::int64_t step_least_uV = (up_mA + down_mA) * resistance_uOhm_ / nanovolts_per_uV;
  const bool by_current = step_least_uV >= shows_at_least_uV;
  const bool by_charge = flowed_min_uAs_ > 0 && std::llabs(flowed_uAs) >= flowed_min_uAs_;
  const bool is_due = by_current || by_charge;
  const bool is_same_way = (down_mA > 0) == (flowed_uAs < 0);
  if (!is_due || is_same_way) return is_due;
  const OcvShift by_flow = ocv_shift(model_, std::llabs(flowed_uAs));
  const std::int64_t step_most_uV = most_mA * resistance_max_uOhm_ / nanovolts_per_uV;
  return step_least_uV - std::llround(by_flow.most_uV) >= shows_at_least_uV ||
         std::llround(by_flow.least_uV) - step_most_uV >= shows_at_least_uV;
}

void StuckWatch::take(Cell& cell, const Measured<std::int32_t>& voltage_uV, std::int32_t current_mA,
                      const CurrentWindow& window) const {
  if (voltage_uV.taken_at == cell.taken_at) return;
  if (!voltage_uV.is_valid() || cell.taken_at == TimePoint{} || voltage_uV.value != cell.voltage_uV) {
    cell = {.voltage_uV = voltage_uV.value,
            .first = {{true, current_mA, current_mA}, charge_uAs_},
            .first_at = voltage_uV.taken_at,
            .taken_at = voltage_uV.taken_at};
    return;
  }
  settle_references(cell, voltage_uV.taken_at, current_mA, window);
  const Duration since = voltage_uV.taken_at - cell.taken_at;
  const bool is_due = must_have_moved(cell.first, current_mA) || must_have_moved(cell.steadiest, current_mA);
  if (since <= sample_gap_max && is_due) cell.stuck_for += since;
  cell.taken_at = voltage_uV.taken_at;
}

/// Range of all currents around a sample, including `current_mA`.
CurrentRange StuckWatch::currents_around(TimePoint taken_at, std::int32_t current_mA,
                                         const CurrentWindow& window) const {
  CurrentRange range = window.range(taken_at - sampled_within_, taken_at + sampled_within_);
  range.min_mA = range.is_known ? std::min(range.min_mA, current_mA) : current_mA;
  range.max_mA = range.is_known ? std::max(range.max_mA, current_mA) : current_mA;
  return range;
}

/// With a sample of the same value: the currents after the previous samples are known by now, or with the next sample.
void StuckWatch::settle_references(Cell& cell, TimePoint taken_at, std::int32_t current_mA,
                                   const CurrentWindow& window) const {
  if (!cell.is_first_settled) {
    cell.first.current_mA = currents_around(cell.first_at, cell.first.current_mA.min_mA, window);
    cell.steadiest = cell.first;
    cell.is_first_settled = taken_at - cell.first_at >= sampled_within_;
  }
  if (cell.next_at != TimePoint{} && taken_at - cell.next_at >= sampled_within_) {
    cell.next.current_mA = currents_around(cell.next_at, cell.next.current_mA.min_mA, window);
    if (cell.next.width_mA() < cell.steadiest.width_mA()) cell.steadiest = cell.next;
    cell.next_at = {};
  }
  const bool may_be_steadier = cell.is_first_settled && cell.steadiest.width_mA() > 0;
  if (cell.next_at != TimePoint{} || !may_be_steadier) return;
  cell.next = {{true, current_mA, current_mA}, charge_uAs_};
  cell.next_at = taken_at;
}

void StuckWatch::update(const ModuleTable& modules, const Measured<std::int32_t>& current_mA,
                        const CurrentWindow& window) {
  if (!current_mA.is_valid()) return;
  count(current_mA);
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleRecord& module = modules.modules()[index];
    for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
      take(cells_[index][cell], module.cell_voltage_uV[cell], current_mA.value, window);
    }
  }
}

Reading StuckWatch::longest_ms(const ModuleTable& modules) const {
  Reading longest{.is_known = true};
  std::uint16_t before = 0;
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    const ModuleConfig& module = modules.modules()[index].config;
    for (std::uint8_t cell = 0; cell < module.cell_count; ++cell) {
      const Cell& one = cells_[index][cell];
      if (to_ms(one.stuck_for) <= longest.value) continue;
      longest.value = to_ms(one.stuck_for);
      longest.taken_at = one.taken_at;
      longest.element = {.module_node = module.node,
                         .number = static_cast<std::uint8_t>(cell + 1),
                         .pack_number = static_cast<std::uint16_t>(before + cell + 1)};
    }
    before = static_cast<std::uint16_t>(before + module.cell_count);
  }
  return longest;
}

}  // namespace bmu
