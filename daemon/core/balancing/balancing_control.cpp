#include "daemon/core/balancing/balancing_control.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

using internal_bus::CommandResult;
using internal_bus::Operation;

/// Maximum swing of the current while cells are compared: with more, differences of their resistances count.
std::int32_t swing_max_mA(const CoreConfig& config) {
  constexpr std::int32_t least_mA = 200;
  constexpr std::int32_t share = 20;
  return std::max(least_mA, config.current.charge_continuous_mA / share);
}

}  // namespace

std::string_view to_text(BalancingState state) {
  switch (state) {
    case BalancingState::idle: return "idle";
    case BalancingState::measuring: return "measuring";
    case BalancingState::bleeding: return "bleeding";
  }
  return "?";
}

std::string_view to_text(OrderStage stage) {
  switch (stage) {
    case OrderStage::none: return "nothing to do";
    case OrderStage::needed: return "to be told";
    case OrderStage::asked: return "told, no answer yet";
    case OrderStage::done: return "done";
    case OrderStage::refused: return "refused";
    case OrderStage::unanswered: return "no answer";
  }
  return "?";
}

CanFrame balancing_frame(const BalancingOrder& order, std::uint8_t node, std::uint8_t counter) {
  using internal_bus::command;
  constexpr std::size_t first = signal_index(command, "balancing_time_1_s");
  constexpr std::int64_t seconds_per_minute = 60;
  CanFrame frame = make_frame(command, node);
  const Operation operation = order.is_stop ? Operation::stop_balancing : Operation::balance;
  write<command, "operation">(frame, static_cast<std::int64_t>(operation));
  for (std::size_t cell = 0; cell < order.minutes.size() && !order.is_stop; ++cell) {
    encode_signal(command.signals[first + cell], known(order.minutes[cell] * seconds_per_minute), frame.data);
  }
  seal(command, counter, frame);
  return frame;
}

void BalancingControl::init(const CoreConfig& config) {
  config_ = config;
  cell_count_ = cell_count(config);
  polarisation_.init(config.cell,
                     std::max(config.current.discharge_continuous_mA, config.current.charge_continuous_mA));
}

void BalancingControl::forget(TimePoint now) {
  for (Slot& slot : slots_) slot = {};
  enter(BalancingState::idle, now);
}

void BalancingControl::enter(BalancingState state, TimePoint now) {
  state_ = state;
  since_ = now;
  if (state == BalancingState::measuring) begin_window(now);
}

BalancingStep BalancingControl::step(const BalancingInputs& in, BalancingSwitches& switches) {
  BalancingStep out;
  blockers_ = in.blockers;
  polarisation_.update(in.now, in.pack->current_mA);
  if (blockers_ != 0) {
    hold(in, switches, out);
  } else if (state_ == BalancingState::idle) {
    enter(BalancingState::measuring, in.now);
  } else if (state_ == BalancingState::measuring) {
    measure(in, switches, out);
  } else if (!are_modules_ours(config_)) {
    bleed_by_target(in.now, switches);
  } else {
    bleed(in, switches, out);
  }
  if (are_modules_ours(config_)) stop_unwanted(in, switches, out);
  return out;
}

/// All modules are commanded at once, whatever they were commanded before or may still receive.
void BalancingControl::hold(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out) {
  if (state_ == BalancingState::bleeding) {
    if (are_modules_ours(config_)) out.orders.push_back({});
    out.was_stopped = true;
    switches.note_all_stopped();
    for (Slot& slot : slots_) slot = {.has_failed = slot.has_failed, .stopped_at = in.now};
  }
  if (state_ != BalancingState::idle) enter(BalancingState::idle, in.now);
}

// --- measuring ------------------------------------------------------------------------------------------------------

void BalancingControl::begin_window(TimePoint now) {
  window_began_at_ = now;
  sampled_at_ = {};
  samples_ = 0;
  has_current_ = false;
  current_sum_mA_ = 0;
  voltage_sum_uV_.fill(0);
}

bool BalancingControl::is_steady(std::int32_t current_mA) {
  current_min_mA_ = has_current_ ? std::min(current_min_mA_, current_mA) : current_mA;
  current_max_mA_ = has_current_ ? std::max(current_max_mA_, current_mA) : current_mA;
  has_current_ = true;
  return current_max_mA_ - current_min_mA_ <= swing_max_mA(config_);
}

void BalancingControl::measure(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out) {
  // The charge method does not use voltages.
  const bool compares_voltages = config_.balancing.method != BalancingMethod::charge;
  const bool is_quiet = !switches.is_any_on() && (!compares_voltages || is_steady(in.pack->current_mA.value));
  if (!is_quiet) return begin_window(in.now);
  const TimePoint cycle = in.modules->completed_at();
  const bool is_new = cycle != sampled_at_ && cycle - window_began_at_ >= config_.balancing.settle;
  if (!is_new) return;
  sampled_at_ = cycle;
  add_sample(in);
  if (samples_ < balancing_samples || !switches.are_all_off(window_began_at_)) return;
  plan(in, switches, out);
}

void BalancingControl::add_sample(const BalancingInputs& in) {
  std::size_t cell = 0;
  for (const ModuleRecord& module : in.modules->modules()) {
    for (std::size_t index = 0; index < module.config.cell_count; ++index) {
      voltage_sum_uV_[cell++] += module.cell_voltage_uV[index].value;
    }
  }
  current_sum_mA_ += in.pack->current_mA.value;
  ++samples_;
}

void BalancingControl::plan(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out) {
  for (std::size_t cell = 0; cell < cell_count_; ++cell) {
    cells_[cell] = {.voltage_uV = static_cast<std::int32_t>(divide_to_nearest(voltage_sum_uV_[cell], samples_)),
                    .resistance_uOhm = in.steps->cell_resistance_uOhm(cell),
                    .charge = in.charges->cell(cell)};
    bled_at_plan_uAs_[cell] = switches.bled_uAs(cell);
  }
  const Spread& temperature_dC = in.pack->cell_temperature_dC;
  const std::int32_t worst_dC = config_.cell.temperature_min_dC;
  const BalancingView view{.cells = std::span(cells_).first(cell_count_),
                           .current_mA = static_cast<std::int32_t>(divide_to_nearest(current_sum_mA_, samples_)),
                           .late_uV = polarisation_.most_uV(),
                           .coldest_dC = temperature_dC.is_known() ? temperature_dC.min : worst_dC,
                           .warmest_dC = temperature_dC.is_known() ? temperature_dC.max : worst_dC};
  verdict_ = plan_balancing(view, config_, std::span(remove_uAs_).first(cell_count_));
  planned_at_ = in.now;
  cells_told_ = share_out(*in.modules);
  if (cells_told_ == 0) return begin_window(in.now);
  out.has_begun = true;
  if (!are_modules_ours(config_)) switches.note_free();
  enter(BalancingState::bleeding, in.now);
}

/// Returns the number of cells that get minutes.
std::uint16_t BalancingControl::share_out(const ModuleTable& modules) {
  std::uint16_t cells = 0;
  std::size_t cell = 0;
  for (std::size_t index = 0; index < modules.modules().size(); ++index) {
    Slot& slot = slots_[index];
    slot = {.has_failed = slot.has_failed, .stopped_at = slot.stopped_at};
    for (std::size_t number = 0; number < modules.modules()[index].config.cell_count; ++number, ++cell) {
      slot.minutes[number] = balancing_minutes(remove_uAs_[cell], cells_[cell].voltage_uV, config_.balancing);
      if (slot.minutes[number] == 0) continue;
      if (are_modules_ours(config_)) slot.stage = OrderStage::needed;
      ++cells;
    }
  }
  return cells;
}

// --- bleeding -------------------------------------------------------------------------------------------------------

void BalancingControl::bleed(const BalancingInputs& in, const BalancingSwitches& switches, BalancingStep& out) {
  bool is_waiting = false;
  for (std::size_t index = 0; index < in.modules->modules().size(); ++index) {
    Slot& slot = slots_[index];
    const bool is_unanswered = slot.stage == OrderStage::asked && in.now - slot.asked_at >= balancing_retry;
    if (is_unanswered && slot.tries >= balancing_tries && out.unanswered_node == 0) {
      slot.stage = OrderStage::unanswered;
      if (!slot.has_failed) out.unanswered_node = in.modules->modules()[index].config.node;
      slot.has_failed = true;
    }
    const bool is_open = slot.stage == OrderStage::needed || slot.stage == OrderStage::asked;
    is_waiting = is_waiting || is_open;
    const bool is_due = slot.stage == OrderStage::needed || (is_unanswered && slot.tries < balancing_tries);
    const BalancingMinutes minutes = slot.has_heard_zero ? slot.minutes : BalancingMinutes{};
    if (!is_due || !out.orders.try_push_back({.module_index = index, .is_stop = false, .minutes = minutes})) continue;
    slot.stage = OrderStage::asked;
    slot.asked_at = in.now;
    ++slot.tries;
  }
  if (!is_waiting && !switches.is_any_told() && !switches.is_any_on()) enter(BalancingState::measuring, in.now);
}

void BalancingControl::bleed_by_target(TimePoint now, BalancingSwitches& switches) {
  const Duration bled_for = now - since_;
  const bool has_nothing = bled_for >= target_patience && !switches.is_any_on();
  if (bled_for < target_bleeding_max && !has_nothing) return;
  switches.note_all_stopped();
  enter(BalancingState::measuring, now);
}

/// Above the lowest cell of now or of the plan, whichever is higher: now the lowest may be one that reads low because
/// it is bled, and a target that followed it down would also bleed the really lowest one.
std::optional<std::int32_t> BalancingControl::bleed_above_uV(const PackState& pack) const {
  const bool is_told = state_ == BalancingState::bleeding && !are_modules_ours(config_);
  if (!is_told || !pack.cell_voltage_uV.is_complete()) return std::nullopt;
  std::int32_t planned_min_uV = config_.cell.voltage_max_uV;
  for (std::size_t cell = 0; cell < cell_count_; ++cell) {
    planned_min_uV = std::min(planned_min_uV, cells_[cell].voltage_uV);
  }
  constexpr std::int32_t whole_mV = 1'000;
  const std::int32_t target_uV =
      std::max(pack.cell_voltage_uV.min, planned_min_uV) + std::max(config_.balancing.dead_band_uV, target_band_min_uV);
  return target_uV / whole_mV * whole_mV;
}

OrderStage BalancingControl::observe_response(std::size_t module_index, const CanFrame& frame, TimePoint at,
                                              BalancingSwitches& switches) {
  Slot& slot = slots_[module_index];
  const bool is_ours = slot.stage == OrderStage::asked && read_raw<internal_bus::response, "operation">(frame) ==
                                                              static_cast<std::int64_t>(Operation::balance);
  if (!is_ours) return slot.stage;
  const bool is_done =
      read_raw<internal_bus::response, "result">(frame) == static_cast<std::int64_t>(CommandResult::done);
  if (is_done && !slot.has_heard_zero) {
    slot.has_heard_zero = true;
    slot.stage = OrderStage::needed;
    slot.tries = 0;
    return slot.stage;
  }
  slot.stage = is_done ? OrderStage::done : OrderStage::refused;
  slot.has_failed = !is_done;
  if (is_done) switches.note_told(module_index, slot.minutes, at);
  return slot.stage;
}

/// A module that may have received its minutes, but with no response received yet, is not among these.
void BalancingControl::stop_unwanted(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out) {
  for (std::size_t index = 0; index < in.modules->modules().size(); ++index) {
    Slot& slot = slots_[index];
    const bool is_due = switches.has_unwanted(index) && slot.stage != OrderStage::asked &&
                        (slot.stopped_at == TimePoint{} || in.now - slot.stopped_at >= stop_retry);
    if (!is_due || !out.orders.try_push_back({.module_index = index})) continue;
    slot.stopped_at = in.now;
    switches.note_stopped(index);
  }
}

std::int64_t BalancingControl::to_go_uAs(std::size_t cell, const BalancingSwitches& switches) const {
  const std::int64_t bled_uAs = switches.bled_uAs(cell) - bled_at_plan_uAs_[cell];
  return std::max<std::int64_t>(remove_uAs_[cell] - bled_uAs, 0);
}

}  // namespace bmu
