#include "mmu/scenario/scenario_state.hpp"

#include <algorithm>

#include "mmu/devices/mode.hpp"
#include "mmu/scenario/world.hpp"

namespace bmu {

namespace {

constexpr double kelvin_to_tenths = 10.0;

using W = World;
using M = MasterReport;
using P = ScenarioPlace;

const PlantCell& cell_at(const World& world, ScenarioPlace place) {
  return world.plant.cell(world.cell_of(place));
}

/// The largest of `value(cell)` over all cells; negate for the smallest.
template <class Value>
double largest(const World& world, Value value) {
  double most = value(std::size_t{0});
  for (std::size_t cell = 1; cell < world.plant.cell_count(); ++cell) most = std::max(most, value(cell));
  return most;
}

double mean_soc_permille(const World& world) {
  double sum = 0.0;
  for (std::size_t cell = 0; cell < world.plant.cell_count(); ++cell) sum += world.plant.cell(cell).soc;
  return sum / static_cast<double>(world.plant.cell_count()) * 1e3;
}

bool is_closed(const World& world, ScenarioPlace place) {
  return world.plant.is_closed(static_cast<ContactorName>(place.index));
}

constexpr StateSpec states[] = {
    {TargetKind::charger, "current_A", StateKind::number, [](const W& w, const M&, P) { return w.plant.charger_A(); },
     "what it delivers now"},
    {TargetKind::charger, "voltage_V", StateKind::number, [](const W& w, const M&, P) { return w.plant.charger_V(); },
     "at its terminals now, its leads' drop above the link's"},
    {TargetKind::inverter, "current_A", StateKind::number,
     [](const W& w, const M&, P) { return w.inverter.current_A(); }, "what it takes now, positive out of the pack"},
    {TargetKind::inverter, "charge_limit_A", StateKind::number,
     [](const W& w, const M&, P) { return w.inverter.told().charge_limit_mA * 1e-3; }, "what it was told last"},
    {TargetKind::inverter, "discharge_limit_A", StateKind::number,
     [](const W& w, const M&, P) { return w.inverter.told().discharge_limit_mA * 1e-3; }, "likewise"},
    {TargetKind::load, "current_A", StateKind::number, [](const W& w, const M&, P) { return w.plant.load_A(); },
     "what it takes now, positive out of the pack"},
    {TargetKind::pack, "current_A", StateKind::number, [](const W& w, const M&, P) { return w.plant.current_A(); },
     "through the contactors, positive out of the pack"},
    {TargetKind::pack, "voltage_mV", StateKind::number, [](const W& w, const M&, P) { return w.plant.pack_V() * 1e3; },
     "on the cells' side of the contactors"},
    {TargetKind::pack, "soc_permille", StateKind::number, [](const W& w, const M&, P) { return mean_soc_permille(w); },
     "mean of all cells"},
    {TargetKind::pack, "cell_voltage_min_mV", StateKind::number,
     [](const W& w, const M&, P) { return -largest(w, [&w](std::size_t cell) { return -w.sensed_mV(cell); }); },
     "of all cells"},
    {TargetKind::pack, "cell_voltage_max_mV", StateKind::number,
     [](const W& w, const M&, P) { return largest(w, [&w](std::size_t cell) { return w.sensed_mV(cell); }); },
     "of all cells"},
    {TargetKind::pack, "cell_voltage_spread_mV", StateKind::number,
     [](const W& w, const M&, P) {
       return largest(w, [&w](std::size_t cell) { return w.sensed_mV(cell); }) +
              largest(w, [&w](std::size_t cell) { return -w.sensed_mV(cell); });
     },
     "between the highest and the lowest cell"},
    {TargetKind::pack, "temperature_max_dC", StateKind::number,
     [](const W& w, const M&, P) {
       return largest(w, [&w](std::size_t cell) { return w.plant.cell(cell).temperature_C; }) * kelvin_to_tenths;
     },
     "of all cells"},
    {TargetKind::cell, "voltage_mV", StateKind::number,
     [](const W& w, const M&, P p) { return w.sensed_mV(w.cell_of(p)); }, "what its channel says, without noise"},
    {TargetKind::cell, "soc_permille", StateKind::number,
     [](const W& w, const M&, P p) { return cell_at(w, p).soc * 1e3; }, "its charge"},
    {TargetKind::cell, "temperature_dC", StateKind::number,
     [](const W& w, const M&, P p) { return cell_at(w, p).temperature_C * kelvin_to_tenths; }, "its own"},
    {TargetKind::cell, "balancing", StateKind::flag,
     [](const W& w, const M&, P p) { return cell_at(w, p).balancing_siemens > 0.0 ? 1.0 : 0.0; },
     "its resistor is switched on"},
    {TargetKind::module, "mode", StateKind::mode,
     [](const W& w, const M&, P p) { return static_cast<double>(w.module_modes[w.module_of(p)]); },
     "what it is doing; asleep and unpowered it says nothing"},
    {TargetKind::contactor, "closed", StateKind::flag,
     [](const W& w, const M&, P p) { return is_closed(w, p) ? 1.0 : 0.0; }, "its contacts, welded ones too"},
    {TargetKind::contactor, "open", StateKind::flag,
     [](const W& w, const M&, P p) { return is_closed(w, p) ? 0.0 : 1.0; }, "its contacts"},
    {TargetKind::link, "voltage_mV", StateKind::number, [](const W& w, const M&, P) { return w.plant.link_V() * 1e3; },
     "behind the contactors"},
    {TargetKind::master, "phase", StateKind::phase, [](const W&, const M& m, P) -> double { return m.phase; },
     "of its contactor sequence; with `--with-master` only"},
    {TargetKind::master, "opened_by", StateKind::cause, [](const W&, const M& m, P) -> double { return m.opened_by; },
     "a fault, or why else it opened last; none: it has not; with `--with-master` only"},
};

}  // namespace

std::span<const StateSpec> state_table() {
  return states;
}

std::span<const std::string_view> words_of(StateKind kind, const MasterVocabulary& master) {
  switch (kind) {
    case StateKind::flag:
    case StateKind::number: break;
    case StateKind::phase: return master.phases;
    case StateKind::cause: return master.opening_causes;
    case StateKind::mode: return unit_mode_names;
  }
  return {};
}

}  // namespace bmu
