#include "daemon/core/plausibility/balancing_switches.hpp"

#include <algorithm>
#include <bit>
#include <span>

#include "daemon/core/types/bleed_current.hpp"

namespace bmu {

namespace {

constexpr Duration gap_max = 1s;
/// Tolerance for a module's clock, and for the one-second mark at which it switches. A switch that is on for longer is
/// commanded off.
constexpr int clock_error_percent = 2;
constexpr Duration begins_within = 1s;
/// A switch that was on for one `done_share`th of its time has finished: no clock is so wrong that it would end
/// earlier.
constexpr int done_share = 2;

std::uint16_t bit_of(std::size_t cell) {
  return static_cast<std::uint16_t>(1U << cell);
}
void set(std::uint16_t& mask, std::size_t cell, bool is_set) {
  mask = static_cast<std::uint16_t>(is_set ? mask | bit_of(cell) : mask & ~bit_of(cell));
}

}  // namespace

void BalancingSwitches::init(const CoreConfig& config) {
  *this = {};
  resistance_Ohm_ = config.balancing.bleed_resistance_Ohm;
  std::uint16_t before = 0;
  for (const ModuleConfig& module : config.modules) {
    Slot& slot = slots_[module_count_++];
    slot.node = module.node;
    slot.cell_count = module.cell_count;
    slot.first_cell = before;
    before = static_cast<std::uint16_t>(before + module.cell_count);
  }
}

void BalancingSwitches::forget() {
  are_free_ = false;
  for (Slot& slot : slots_) {
    slot.read_at = {};
    slot.on = slot.told = slot.ending = slot.came_on = 0;
    slot.obeys = false;
    slot.wrong_since.fill({});
  }
}

void BalancingSwitches::update(const ModuleTable& modules) {
  for (std::size_t index = 0; index < module_count_; ++index) {
    const ModuleRecord& module = modules.modules()[index];
    const TimePoint told_at = module.switches_read_at;
    const bool is_new = told_at != TimePoint{} && told_at != slots_[index].read_at;
    if (is_new) take(slots_[index], module);
  }
}

void BalancingSwitches::take(Slot& slot, const ModuleRecord& module) {
  const TimePoint at = module.switches_read_at;
  count(slot, module, at);
  const ModuleStatus& said = module.status.value;
  slot.read_at = at;
  slot.on = module.balancing_cells;
  slot.came_on = static_cast<std::uint16_t>(slot.came_on | slot.on);
  slot.obeys = module.status.is_valid() && said.mode == internal_bus::Mode::normal && !said.on_module_supply;
  if (!are_free_) follow_time(slot, at);
  judge(slot, at, said.board_too_hot);
}

/// A switch that was on at the previous read counts as on until this one.
void BalancingSwitches::count(const Slot& slot, const ModuleRecord& module, TimePoint at) {
  constexpr std::int64_t products_per_uAs = 1'000'000'000;  // of uA and ns
  const Duration since = at - slot.read_at;
  if (slot.on == 0 || slot.read_at == TimePoint{} || since > gap_max) return;
  for (std::size_t cell = 0; cell < slot.cell_count; ++cell) {
    const Measured<std::int32_t>& voltage_uV = module.cell_voltage_uV[cell];
    if ((slot.on & bit_of(cell)) == 0 || !voltage_uV.is_valid()) continue;
    const std::int64_t current_uA = voltage_uV.value / resistance_Ohm_;
    std::int32_t& rest = rests_[slot.first_cell + cell];
    const std::int64_t products = rest + current_uA * since.count();
    bled_uAs_[slot.first_cell + cell] += products / products_per_uAs;
    rest = static_cast<std::int32_t>(products % products_per_uAs);
  }
}

void BalancingSwitches::follow_time(Slot& slot, TimePoint at) {
  for (std::size_t cell = 0; cell < slot.cell_count; ++cell) {
    if (((slot.told | slot.ending) & bit_of(cell)) == 0) continue;
    const Duration time = std::chrono::minutes{slot.minutes[cell]};
    const Duration error = time * clock_error_percent / 100;
    const Duration passed = at - slot.told_at;
    const bool is_ending = passed >= time - error && passed <= time + error + begins_within;
    set(slot.told, cell, passed < time - error);
    set(slot.ending, cell, is_ending && (slot.on & bit_of(cell)) != 0);
  }
}

/// A cell that is missing has time to come back, or to have ended early; an uncommanded one, to switch off.
void BalancingSwitches::judge(Slot& slot, TimePoint at, bool is_hot) {
  const auto missing = static_cast<std::uint16_t>(is_hot || !slot.obeys ? 0 : slot.told & ~slot.on);
  const auto wrong = static_cast<std::uint16_t>(missing | slot.unwanted());
  slot.dead = static_cast<std::uint16_t>(slot.dead & ~slot.on);
  for (std::size_t cell = 0; cell < slot.wrong_since.size(); ++cell) {
    TimePoint& since = slot.wrong_since[cell];
    const bool is_wrong = (wrong & bit_of(cell)) != 0;
    if (!is_wrong) since = {};
    if (is_wrong && since == TimePoint{}) since = at;
    const bool stays_off = (missing & bit_of(cell)) != 0 && at - since >= obey_max;
    if (!stays_off) continue;
    const bool was_on_long = since - slot.told_at >= std::chrono::minutes{slot.minutes[cell]} / done_share;
    const bool is_done = (slot.came_on & bit_of(cell)) != 0 && was_on_long;
    set(is_done ? slot.told : slot.dead, cell, !is_done);
  }
}

void BalancingSwitches::note_told(std::size_t module_index, const BalancingMinutes& minutes, TimePoint now) {
  Slot& slot = slots_[module_index];
  slot.minutes = minutes;
  slot.told_at = now;
  slot.ending = slot.came_on = 0;
  slot.wrong_since.fill({});
  for (std::size_t cell = 0; cell < slot.cell_count; ++cell) set(slot.told, cell, minutes[cell] > 0);
}

void BalancingSwitches::note_free() {
  are_free_ = true;
  for (std::size_t index = 0; index < module_count_; ++index) {
    slots_[index].ending = static_cast<std::uint16_t>((1U << slots_[index].cell_count) - 1U);
  }
}

void BalancingSwitches::note_stopped(std::size_t module_index) {
  slots_[module_index].told = slots_[module_index].ending = 0;
}

void BalancingSwitches::note_all_stopped() {
  are_free_ = false;
  for (std::size_t index = 0; index < module_count_; ++index) note_stopped(index);
}

bool BalancingSwitches::are_all_off(TimePoint since) const {
  const auto slots = std::span(slots_).first(module_count_);
  return std::all_of(slots.begin(), slots.end(),
                     [since](const Slot& slot) { return slot.on == 0 && slot.read_at > since; });
}

bool BalancingSwitches::is_any_on() const {
  const auto slots = std::span(slots_).first(module_count_);
  return std::any_of(slots.begin(), slots.end(), [](const Slot& slot) { return slot.on != 0; });
}

bool BalancingSwitches::is_any_told() const {
  const auto slots = std::span(slots_).first(module_count_);
  return std::any_of(slots.begin(), slots.end(), [](const Slot& slot) { return (slot.told | slot.ending) != 0; });
}

std::uint8_t BalancingSwitches::minutes_told(std::size_t module_index, std::size_t cell) const {
  const Slot& slot = slots_[module_index];
  return ((slot.told | slot.ending) & bit_of(cell)) != 0 ? slot.minutes[cell] : std::uint8_t{0};
}

Element BalancingSwitches::element_of(std::size_t module_index, std::size_t cell) const {
  const Slot& slot = slots_[module_index];
  const bool is_there = cell < slot.cell_count;
  return {.module_node = slot.node,
          .number = static_cast<std::uint8_t>(cell + 1),
          .pack_number = static_cast<std::uint16_t>(is_there ? slot.first_cell + cell + 1 : 0)};
}

template <class Cells>
Reading BalancingSwitches::first_cell_of(Cells cells) const {
  TimePoint read_at{};
  for (std::size_t index = 0; index < module_count_; ++index) {
    const Slot& slot = slots_[index];
    read_at = std::max(read_at, slot.read_at);
    const std::uint16_t mask = cells(slot);
    if (mask == 0) continue;
    const auto cell = static_cast<std::size_t>(std::countr_zero(mask));
    return {.is_known = true, .value = 1, .element = element_of(index, cell), .taken_at = slot.read_at};
  }
  return {.is_known = read_at != TimePoint{}, .taken_at = read_at};
}

Reading BalancingSwitches::stays_on() const {
  return first_cell_of([](const Slot& slot) {
    const std::uint16_t unwanted = slot.unwanted();
    std::uint16_t cells = 0;
    for (std::size_t cell = 0; cell < slot.wrong_since.size(); ++cell) {
      const TimePoint since = slot.wrong_since[cell];
      set(cells, cell, (unwanted & bit_of(cell)) != 0 && since != TimePoint{} && slot.read_at - since >= obey_max);
    }
    return cells;
  });
}

Reading BalancingSwitches::stays_off() const {
  return first_cell_of([](const Slot& slot) { return slot.dead; });
}

}  // namespace bmu
