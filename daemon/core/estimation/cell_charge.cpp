#include "daemon/core/estimation/cell_charge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "daemon/core/types/bleed_current.hpp"

namespace bmu {

namespace {

constexpr double all_permille = 1'000.0;
/// Uncertainty of bled charge, one part in this many: the tolerance of the resistor, and of the voltage while it was
/// on.
constexpr std::int64_t bled_share = 20;
/// The polarisation of an earlier load is by then an eighth of itself, and most of that is the same in all cells.
constexpr double time_constants = 2.0;
constexpr double seconds_per_month = 30.0 * 86'400.0;
/// Ratio of a worn cell's resistance to that of its file.
constexpr double worn_factor = 2.0;
/// A record with more than this many capacities is invalid.
constexpr std::int64_t capacities_max = 2;

/// Voltage that remains of this resistance's polarisation after a time, in uV.
double left_uV(double resistance_Ohm, double time_constant_s, double current_mA, double after_s) {
  constexpr double uV_per_mV = 1e3;
  const double part = time_constant_s > 0.0 ? std::exp(-after_s / time_constant_s) : 0.0;
  return resistance_Ohm * current_mA * uV_per_mV * part;
}

}  // namespace

std::string_view to_text(FormerBook former) {
  switch (former) {
    case FormerBook::none: return "none";
    case FormerBook::foreign: return "from another pack or other modules, discarded";
    case FormerBook::waiting: return "pending validation (clock, modules, voltages)";
    case FormerBook::in_use: return "in use";
    case FormerBook::refused: return "contradicted by the cell voltages, discarded";
    case FormerBook::taken_over: return "superseded by a measurement at rest";
  }
  return "?";
}

double charge_at_uAs(const CellModel& cell, double ocv_uV) {
  const auto& table = cell.ocv;
  const auto capacity_uAs = static_cast<double>(cell.capacity_uAs);
  if (ocv_uV <= table[0].ocv_uV) return 0.0;
  for (std::size_t index = 1; index < table.size(); ++index) {
    const OcvPoint& low = table[index - 1];
    const OcvPoint& high = table[index];
    if (ocv_uV >= high.ocv_uV) continue;
    const double share = (ocv_uV - low.ocv_uV) / (high.ocv_uV - low.ocv_uV);
    const double soc_permille = low.soc_permille + share * (high.soc_permille - low.soc_permille);
    return soc_permille / all_permille * capacity_uAs;
  }
  return capacity_uAs;
}

void CellChargeBook::init(const CoreConfig& config) {
  *this = {};
  cell_ = config.cell;
  rest_current_mA_ = config.soc.rest_current_mA;
  current_max_mA_ = std::max(config.current.discharge_continuous_mA, config.current.charge_continuous_mA);
  const bool is_slow = cell_.slow_rc_resistance_Ohm > 0.0;
  const double relaxed_s = time_constants * (is_slow ? cell_.slow_rc_time_constant_s : cell_.rc_time_constant_s);
  rest_ = std::max(config.soc.rest, std::chrono::duration_cast<Duration>(std::chrono::duration<double>(relaxed_s)));
  hysteresis_.init(cell_);
  const auto capacity_uAs = static_cast<double>(cell_.capacity_uAs);
  capacity_tolerance_uAs_ = capacity_uAs * config.balancing.capacity_tolerance_permille / all_permille;
  capacities_.fill({.uAs = capacity_uAs, .error_uAs = capacity_tolerance_uAs_});
  const std::int64_t bled_uAs = bleed_uA(cell_.voltage_max_uV, config.balancing) * (record_every / 1s);
  unrecorded_uAs_ = bled_uAs + std::llround(static_cast<double>(cell_.capacity_uAs) * record_step_permille / 1e3);
  for (const ModuleConfig& module : config.modules) {
    modules_[module_count_++] = {
        .node = module.node, .cell_count = module.cell_count, .first_cell = static_cast<std::uint16_t>(cell_count_)};
    cell_count_ += module.cell_count;
  }
}

// --- restored charges -----------------------------------------------------------------------------------------------

bool CellChargeBook::is_of_this_pack(const CellChargeRecords& records) const {
  if (records.capacity_uAs != cell_.capacity_uAs) return false;
  const auto is_sane = [this](const CellChargeRecord& cell) {
    return std::abs(cell.missing_uAs) <= capacities_max * cell_.capacity_uAs && cell.uncertainty_uAs >= 0 &&
           cell.uncertainty_uAs <= cell_.capacity_uAs;
  };
  std::size_t recorded_cells = 0;
  for (const ModuleChargeRecord& module : records.modules) recorded_cells += module.cell_count;
  const auto modules = std::span(modules_).first(module_count_);
  return recorded_cells == cell_count_ && std::all_of(modules.begin(), modules.end(), [&](const Module& module) {
           const ModuleChargeRecord& record = records.modules[module.node];
           return record.cell_count == module.cell_count &&
                  std::all_of(record.cells.begin(), record.cells.begin() + record.cell_count, is_sane);
         });
}

/// The charge bled after the last record is unknown: between zero and `unrecorded_uAs_`.
void CellChargeBook::restore(const CellChargeRecords& records) {
  if (records.unix_time_ms == 0) return;
  if (!is_of_this_pack(records)) return drop(FormerBook::foreign);
  former_ = FormerBook::waiting;
  former_unix_time_ms_ = records.unix_time_ms;
  for (Module& module : std::span(modules_).first(module_count_)) {
    const ModuleChargeRecord& record = records.modules[module.node];
    module.former_serial_number = record.serial_number;
    for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
      lines_[module.first_cell + cell] = {.is_known = true,
                                          .missing_uAs = record.cells[cell].missing_uAs + unrecorded_uAs_ / 2,
                                          .uncertainty_uAs = record.cells[cell].uncertainty_uAs + unrecorded_uAs_ / 2};
    }
  }
  known_cells_ = cell_count_;
}

void CellChargeBook::drop(FormerBook reason) {
  former_ = reason;
  known_cells_ = 0;
  lines_.fill({});
}

/// The age of the restored charges only grows, however the wall clock is set.
void CellChargeBook::follow_clock(std::int64_t unix_time_ms) {
  unix_time_ms_ = unix_time_ms;
  if (!is_former() || unix_time_ms < former_unix_time_ms_) return;
  const TimePoint written_at = now_ - std::chrono::milliseconds{unix_time_ms - former_unix_time_ms_};
  if (!former_since_ || written_at < *former_since_) former_since_ = written_at;
}

void CellChargeBook::follow_identities(const ModuleTable& modules) {
  for (std::size_t index = 0; index < module_count_; ++index) {
    Module& module = modules_[index];
    const Measured<ModuleIdentity>& identity = modules.modules()[index].identity;
    if (!identity.is_valid()) continue;
    const std::uint32_t serial_number = identity.value.serial_number;
    if (is_former() && serial_number != module.former_serial_number) drop(FormerBook::foreign);
    if (module.is_identified && serial_number != module.serial_number) forget_module(index);
    module.is_identified = true;
    module.serial_number = serial_number;
  }
}

void CellChargeBook::forget_module(std::size_t index) {
  if (is_former()) drop(FormerBook::foreign);
  const Module& module = modules_[index];
  for (std::size_t cell = module.first_cell; cell < std::size_t{module.first_cell} + module.cell_count; ++cell) {
    known_cells_ -= lines_[cell].is_known ? 1U : 0U;
    lines_[cell] = {};
    capacities_[cell] = {.uAs = static_cast<double>(cell_.capacity_uAs), .error_uAs = capacity_tolerance_uAs_};
  }
  knows_all_capacities_ = false;
}

bool CellChargeBook::are_all_identified() const {
  const auto modules = std::span(modules_).first(module_count_);
  return std::all_of(modules.begin(), modules.end(), [](const Module& module) { return module.is_identified; });
}

/// Maximum deviation of a voltage from that of a rest, if any current may have flowed before.
double CellChargeBook::unrested_error_uV(const Measured<std::int32_t>& current_mA) const {
  const double now_mA = current_mA.is_valid() ? std::abs(current_mA.value) : current_max_mA_;
  const bool is_resting = resting_since_ != TimePoint{};
  const double rested_s = is_resting ? to_s(now_ - resting_since_) : 0.0;
  const double before_mA = std::max<double>(now_mA, current_max_mA_);
  return voltage_error_uV +
         worn_factor * (left_uV(cell_.series_resistance_Ohm, 1.0, now_mA, 0.0) +
                        left_uV(cell_.rc_resistance_Ohm, cell_.rc_time_constant_s, before_mA, rested_s) +
                        left_uV(cell_.slow_rc_resistance_Ohm, cell_.slow_rc_time_constant_s, before_mA, rested_s));
}

/// Range of a common offset of all entries with which each cell can have its voltage; least above most: there is none.
CellChargeBook::Range CellChargeBook::offset(const ModuleTable& modules, double error_uV) const {
  constexpr double no_bound = std::numeric_limits<double>::infinity();
  const auto capacity_uAs = static_cast<double>(cell_.capacity_uAs);
  Range offset{-no_bound, no_bound};
  for (std::size_t index = 0; index < module_count_; ++index) {
    const ModuleRecord& module = modules.modules()[index];
    for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
      const CellCharge line = this->cell(modules_[index].first_cell + cell);
      const Range charge = held(module.cell_voltage_uV[cell].value, error_uV);
      const Missing seen = missing(modules_[index].first_cell + cell, charge);
      const double off_uAs = seen.uAs - static_cast<double>(line.missing_uAs);
      const double either_way_uAs = seen.uncertainty_uAs + static_cast<double>(line.uncertainty_uAs);
      if (charge.most_uAs < capacity_uAs) offset.least_uAs = std::max(offset.least_uAs, off_uAs - either_way_uAs);
      if (charge.least_uAs > 0.0) offset.most_uAs = std::min(offset.most_uAs, off_uAs + either_way_uAs);
    }
  }
  return offset;
}

void CellChargeBook::judge_former(const CellChargeInputs& in) {
  const bool is_dated = unix_time_ms_ != 0 && former_since_.has_value();
  const bool is_new = in.modules->completed_at() != TimePoint{} && in.pack->cell_voltage_uV.is_complete();
  if (!is_dated || !is_new || !are_all_identified()) return;
  const Range range = offset(*in.modules, unrested_error_uV(in.pack->current_mA));
  if (range.least_uAs > range.most_uAs) return drop(FormerBook::refused);
  former_ = FormerBook::in_use;
}

/// Better entries cannot be mixed with entries of unknown common offset: all of them are replaced, or none.
void CellChargeBook::take_over_former(const ModuleTable& modules) {
  const Range range = offset(modules, voltage_error_uV);
  if (range.least_uAs > range.most_uAs) return drop(FormerBook::refused);
  const double half_uAs = (range.most_uAs - range.least_uAs) / 2.0;
  if (half_uAs <= static_cast<double>(cell_.capacity_uAs) * align_max_permille / all_permille) {
    former_ = FormerBook::taken_over;
    for (Line& line : std::span(lines_).first(cell_count_)) {
      line.missing_uAs += std::llround((range.least_uAs + range.most_uAs) / 2.0);
      line.uncertainty_uAs += std::llround(half_uAs);
      line.learned_at = *former_since_;
      line.counted_at = youngest_at_ = now_;
      line.moved_uAs = youngest_moved_uAs_ = moved_uAs_;
    }
  } else if (is_better_anew(modules)) {
    drop(FormerBook::taken_over);
  }
}

/// True if every cell can be learned, and the largest uncertainty is then not above the largest present one.
bool CellChargeBook::is_better_anew(const ModuleTable& modules) const {
  double worst_anew_uAs = 0.0;
  std::int64_t worst_known_uAs = 0;
  for (std::size_t index = 0; index < module_count_; ++index) {
    const ModuleRecord& module = modules.modules()[index];
    for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
      const Range charge = held(module.cell_voltage_uV[cell].value, voltage_error_uV);
      if (!is_learnable(charge)) return false;
      const std::size_t number = modules_[index].first_cell + cell;
      worst_anew_uAs = std::max(worst_anew_uAs, missing(number, charge).uncertainty_uAs);
      worst_known_uAs = std::max(worst_known_uAs, uncertainty_uAs(number));
    }
  }
  return worst_anew_uAs <= static_cast<double>(worst_known_uAs);
}

// --- this session ---------------------------------------------------------------------------------------------------

void CellChargeBook::update(const CellChargeInputs& in) {
  now_ = in.now;
  count(in);
  follow_clock(in.unix_time_ms);
  follow_identities(*in.modules);
  follow_rest(in);
  if (former_ == FormerBook::waiting) judge_former(in);
  const TimePoint cycle = in.modules->completed_at();
  if (resting_since_ == TimePoint{} || cycle < resting_since_ || cycle == learned_from_) return;
  learned_from_ = cycle;
  const bool has_rested = now_ - resting_since_ >= rest_;
  if (former_ == FormerBook::in_use && !has_rested) judge_former(in);
  if (former_ == FormerBook::in_use && has_rested) take_over_former(*in.modules);
  if (has_rested && !is_former()) learn_all(*in.modules);
}

void CellChargeBook::count(const CellChargeInputs& in) {
  const std::int64_t flowed_uAs = in.charge->flowed_uAs - flowed_uAs_;
  flowed_uAs_ = in.charge->flowed_uAs;
  moved_uAs_ += static_cast<double>(std::abs(flowed_uAs));
  std::int64_t bled_most_uAs = 0;
  for (std::size_t cell = 0; cell < cell_count_; ++cell) {
    bled_most_uAs = std::max(bled_most_uAs, in.bled_uAs[cell] - bled_uAs_[cell]);
    bled_uAs_[cell] = in.bled_uAs[cell];
  }
  if (!in.pack->current_mA.is_valid()) return hysteresis_.forget();
  hysteresis_.flow(flowed_uAs, flowed_uAs + bled_most_uAs);
}

void CellChargeBook::follow_rest(const CellChargeInputs& in) {
  const Measured<std::int32_t>& current_mA = in.pack->current_mA;
  const bool is_resting = in.is_open && !in.is_bleeding && current_mA.is_valid() &&
                          std::abs(current_mA.value) <= rest_current_mA_ && in.pack->cell_voltage_uV.is_complete();
  if (!is_resting) resting_since_ = {};
  if (is_resting && resting_since_ == TimePoint{}) resting_since_ = now_;
}

void CellChargeBook::learn_all(const ModuleTable& modules) {
  known_cells_ = 0;
  for (std::size_t index = 0; index < module_count_; ++index) {
    const ModuleRecord& module = modules.modules()[index];
    for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
      const std::size_t number = modules_[index].first_cell + cell;
      learn(number, module.cell_voltage_uV[cell].value);
      if (lines_[number].is_known) ++known_cells_;
    }
  }
  const auto capacities = std::span(capacities_).first(cell_count_);
  knows_all_capacities_ =
      std::all_of(capacities.begin(), capacities.end(), [](const Capacity& one) { return one.is_learned; });
}

/// Minimum and maximum charge that a cell with this voltage can hold.
CellChargeBook::Range CellChargeBook::held(std::int32_t voltage_uV, double error_uV) const {
  return {.least_uAs = charge_at_uAs(cell_, voltage_uV - error_uV - hysteresis_.most_uV()),
          .most_uAs = charge_at_uAs(cell_, voltage_uV + error_uV - hysteresis_.least_uV())};
}

bool CellChargeBook::is_learnable(const Range& held) const {
  const auto capacity_uAs = static_cast<double>(cell_.capacity_uAs);
  const bool is_beyond_curve = held.most_uAs <= 0.0 || held.least_uAs >= capacity_uAs;
  const double uncertainty_uAs = (held.most_uAs - held.least_uAs) / 2.0;
  return !is_beyond_curve && uncertainty_uAs <= capacity_uAs * learn_max_permille / all_permille;
}

/// The uncertainty is half of the range between minimum and maximum, of a share of a capacity that is uncertain itself.
CellChargeBook::Missing CellChargeBook::missing(std::size_t number, const Range& held) const {
  const auto capacity_uAs = static_cast<double>(cell_.capacity_uAs);
  const Capacity& capacity = capacities_[number];
  const double share = 1.0 - (held.least_uAs + held.most_uAs) / 2.0 / capacity_uAs;
  const double error = (held.most_uAs - held.least_uAs) / 2.0 / capacity_uAs;
  const double capacity_error_uAs = this->capacity_error_uAs(capacity);
  return {.uAs = share * capacity.uAs,
          .uncertainty_uAs = error * (capacity.uAs + capacity_error_uAs) + share * capacity_error_uAs};
}

/// The sensor's gain error counts for a measured capacity as long as those of other cells are not measured.
double CellChargeBook::capacity_error_uAs(const Capacity& capacity) const {
  const bool shares_gain = !capacity.is_learned || knows_all_capacities_;
  return capacity.error_uAs + (shares_gain ? 0.0 : capacity.uAs * current_gain_permille / all_permille);
}

void CellChargeBook::learn_capacity(std::size_t number, const Range& held) {
  const auto capacity_uAs = static_cast<double>(cell_.capacity_uAs);
  Capacity& capacity = capacities_[number];
  const Rest now{.is_known = true,
                 .share = (held.least_uAs + held.most_uAs) / 2.0 / capacity_uAs,
                 .error = (held.most_uAs - held.least_uAs) / 2.0 / capacity_uAs,
                 .left_uAs = flowed_uAs_,
                 .bled_uAs = bled_uAs_[number],
                 .moved_uAs = moved_uAs_,
                 .at = now_};
  constexpr double half = 0.5;
  const Rest& then = now.share < half ? capacity.high : capacity.low;
  const double apart = std::abs(now.share - then.share);
  (now.share < half ? capacity.low : capacity.high) = now;
  if (!then.is_known || apart < capacity_apart_min) return;
  const auto bled_uAs = static_cast<double>(now.bled_uAs - then.bled_uAs);
  const double flowed_uAs = std::abs(static_cast<double>(now.left_uAs - then.left_uAs) + bled_uAs);
  const double moved_for_nothing_uAs = std::max(now.moved_uAs - then.moved_uAs - flowed_uAs, 0.0);
  const double error_uAs = moved_for_nothing_uAs * current_gain_permille / all_permille +
                           current_offset_mA * 1e3 * to_s(now.at - then.at) +
                           bled_uAs / static_cast<double>(bled_share) + lost_uAs(then.at);
  const double found_uAs = flowed_uAs / apart;
  const double found_error_uAs = (found_uAs * (now.error + then.error) + error_uAs) / apart;
  const double off_max_uAs =
      capacity_tolerance_uAs_ + found_error_uAs + found_uAs * current_gain_permille / all_permille;
  if (std::abs(found_uAs - capacity_uAs) > off_max_uAs) {  // implausible: not all charge was counted
    capacity = {.uAs = capacity_uAs, .error_uAs = capacity_tolerance_uAs_};
    (now.share < half ? capacity.low : capacity.high) = now;
    return;
  }
  if (found_error_uAs >= capacity.error_uAs) return;
  capacity.uAs = found_uAs;
  capacity.error_uAs = found_error_uAs;
  capacity.is_learned = true;
}

void CellChargeBook::learn(std::size_t number, std::int32_t voltage_uV) {
  const Range charge = held(voltage_uV, voltage_error_uV);
  if (!is_learnable(charge)) return;
  learn_capacity(number, charge);
  const Missing found = missing(number, charge);
  const std::int64_t found_uAs = std::llround(found.uncertainty_uAs);
  Line& line = lines_[number];
  if (line.is_known) {
    const std::int64_t known_uAs = uncertainty_now_uAs(number);
    const bool contradicts = std::abs(std::llround(found.uAs) - cell(number).missing_uAs) > found_uAs + known_uAs;
    if (found_uAs > known_uAs && !contradicts) return;
  }
  line = {.is_known = true,
          .missing_uAs = std::llround(found.uAs),
          .uncertainty_uAs = found_uAs,
          .flowed_uAs = flowed_uAs_,
          .bled_uAs = bled_uAs_[number],
          .learned_at = now_,
          .counted_at = now_,
          .moved_uAs = moved_uAs_};
  youngest_at_ = now_;
  youngest_moved_uAs_ = moved_uAs_;
}

double CellChargeBook::lost_uAs(TimePoint since) const {
  const double lost_per_s = static_cast<double>(cell_.capacity_uAs) * cell_.self_discharge_permille_per_month /
                            all_permille / seconds_per_month;
  return lost_per_s * to_s(now_ - since);
}

std::int64_t CellChargeBook::half_lost_uAs(const Line& line) const {
  return std::llround(lost_uAs(is_former() ? former_since_.value_or(now_) : line.learned_at) / 2.0);
}

double CellChargeBook::miscounted_uAs(const Line& line, double moved_uAs, TimePoint at) const {
  if (is_former()) return 0.0;  // all entries are of one time
  return (moved_uAs - line.moved_uAs) * current_gain_permille / all_permille +
         current_offset_mA * 1e3 * to_s(at - line.counted_at);
}

std::int64_t CellChargeBook::kept_uncertainty_uAs(std::size_t number) const {
  const Line& line = lines_[number];
  return line.uncertainty_uAs + (bled_uAs_[number] - line.bled_uAs) / bled_share + half_lost_uAs(line);
}

std::int64_t CellChargeBook::uncertainty_uAs(std::size_t number) const {
  const double miscounted_uAs = this->miscounted_uAs(lines_[number], youngest_moved_uAs_, youngest_at_);
  return kept_uncertainty_uAs(number) + std::llround(miscounted_uAs);
}

std::int64_t CellChargeBook::uncertainty_now_uAs(std::size_t number) const {
  return kept_uncertainty_uAs(number) + std::llround(miscounted_uAs(lines_[number], moved_uAs_, now_));
}

CellCharge CellChargeBook::cell(std::size_t number) const {
  const Line& line = lines_[number];
  return {.is_known = line.is_known && !is_hidden(),
          .missing_uAs = line.missing_uAs + (flowed_uAs_ - line.flowed_uAs) + (bled_uAs_[number] - line.bled_uAs) +
                         half_lost_uAs(line),
          .uncertainty_uAs = uncertainty_uAs(number),
          .capacity_uAs = std::llround(capacities_[number].uAs)};
}

// --- for the next session -------------------------------------------------------------------------------------------

bool CellChargeBook::record(CellChargeRecords& to) const {
  if (unix_time_ms_ == 0 || known_cells() != cell_count_ || !are_all_identified()) return false;
  to = {.unix_time_ms = unix_time_ms_, .capacity_uAs = cell_.capacity_uAs};
  for (const Module& module : std::span(modules_).first(module_count_)) {
    ModuleChargeRecord& record = to.modules[module.node];
    record.cell_count = module.cell_count;
    record.serial_number = module.serial_number;
    for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
      const CellCharge charge = this->cell(module.first_cell + cell);
      record.cells[cell] = {.missing_uAs = charge.missing_uAs, .uncertainty_uAs = charge.uncertainty_uAs};
    }
  }
  return true;
}

/// A change that is the same for all cells is not worth a record: the next session does not use it.
bool is_worth_recording(const CellChargeRecords& older, const CellChargeRecords& newer) {
  if (older.unix_time_ms == 0 || older.capacity_uAs != newer.capacity_uAs) return true;
  const auto step_uAs = static_cast<std::int64_t>(static_cast<double>(newer.capacity_uAs) * record_step_permille / 1e3);
  bool has_first = false;
  std::int64_t first_uAs = 0;
  for (std::size_t node = 0; node < newer.modules.size(); ++node) {
    const ModuleChargeRecord& before = older.modules[node];
    const ModuleChargeRecord& now = newer.modules[node];
    if (before.cell_count != now.cell_count || before.serial_number != now.serial_number) return true;
    for (std::size_t cell = 0; cell < now.cell_count; ++cell) {
      const std::int64_t change_uAs = now.cells[cell].missing_uAs - before.cells[cell].missing_uAs;
      if (!has_first) first_uAs = change_uAs;
      has_first = true;
      const bool is_other = std::abs(change_uAs - first_uAs) >= step_uAs;
      const bool is_surer = before.cells[cell].uncertainty_uAs - now.cells[cell].uncertainty_uAs >= step_uAs;
      if (is_other || is_surer) return true;
    }
  }
  return false;
}

}  // namespace bmu
