#include "mmu/plant/plant.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "daemon/core/cell/cell_model.hpp"

namespace bmu {

namespace {

constexpr double step_s = 0.001;
// Gain of a charger's voltage loop, relative to the current that one volt more would drive into the pack. Below 1 it
// cannot oscillate between two steps.
constexpr double charger_loop_gain = 0.5;
// Temperature rise of a board per balancing resistor, and the time constant of the board.
constexpr double board_heating_K_per_cell = 4.0;
constexpr double board_time_constant_s = 60.0;
// Cells warm slowly: the resistance of each is updated once in this number of steps, a part of the cells in each step.
constexpr std::size_t temperature_groups = 64;
constexpr double self_discharge_doubles_every_K = 10.0;
constexpr double self_discharge_known_to_C = 150.0;
// Bounds at which the state of a cell stops that is abused permanently.
constexpr double soc_beyond_max = 0.5;
constexpr double temperature_min_C = -100.0;
constexpr double temperature_max_C = 1'000.0;

}  // namespace

Plant::Plant(const PlantConfig& config)
    : config_(config),
      contactors_{Contactor(config.contactor), Contactor(config.contactor), Contactor(config.contactor),
                  Contactor(config.contactor)},
      turns_over_per_soc_(1.0 / config.cell.hysteresis_charge),
      kelvin_per_W_(step_s / config.cell.heat_capacity_J_per_K),
      link_capacitance_F_(config.link_capacitance_F),
      link_bleed_Ohm_(config.link_bleed_Ohm),
      precharge_resistance_Ohm_(config.precharge_resistance_Ohm),
      ambient_C_(config.ambient_C) {
  for (std::size_t pair = 0; pair < rc_pairs; ++pair) {
    const RcPair& one = config.cell.rc[pair];
    rc_fraction_[pair] = -std::expm1(-step_s / one.time_constant_s);
    rc_siemens_[pair] = one.resistance_Ohm > 0.0 ? 1.0 / one.resistance_Ohm : 0.0;
  }
  PlantCell fresh{.soc = config.initial_soc,
                  .temperature_C = config.ambient_C,
                  .soc_per_As = 1.0 / config.cell.capacity_As,
                  .series_resistance_Ohm = config.cell.series_resistance_Ohm};
  fresh.voltage_V = ocv_V(fresh.soc);
  follow_temperature(fresh);
  for (std::size_t module = 0; module < config_.cells_of_module.size(); ++module) {
    first_cell_[module] = static_cast<std::uint16_t>(cells_.size());
    board_C_[module] = config.ambient_C;
    for (unsigned cell = 0; cell < config_.cells_of_module[module]; ++cell) cells_.push_back(fresh);
  }
  pack_V_ = fresh.voltage_V * static_cast<double>(cells_.size());
}

void Plant::step() {
  now_ += step_length;
  for (std::size_t index = 0; index < contactor_count; ++index) contactors_[index].update(coils_[index], now_);
  follow_temperatures();
  step_link(sum_cells());
  step_cells();
  step_boards();
}

double Plant::ocv_V(double soc) const {
  constexpr double intervals = CellPhysics::ocv_points - 1;
  const double place = soc * intervals;
  const auto index = static_cast<std::size_t>(std::clamp(place, 0.0, intervals - 1.0));
  const double* const point = &config_.cell.ocv_V[index];
  return point[0] + (point[1] - point[0]) * (place - static_cast<double>(index));
}

Plant::Source Plant::sum_cells() {
  Source source;
  for (std::size_t index = 0; index < cells_.size(); ++index) {
    const PlantCell& cell = cells_[index];
    ocv_V_[index] = ocv_V(cell.soc);
    behind_R0_V_[index] = ocv_V_[index] + cell.hysteresis * config_.cell.hysteresis_V - cell.rc_V[0] - cell.rc_V[1];
    source.open_V += behind_R0_V_[index] * cell.share;
    source.resistance_Ohm += cell.resistance_Ohm * cell.share;
  }
  return source;
}

double Plant::path_siemens(double source_Ohm) const {
  if (!is_closed(ContactorName::main_negative)) return 0.0;
  double path_Ohm = source_Ohm + config_.path_resistance_Ohm;
  if (!is_closed(ContactorName::main_positive)) {
    if (!is_closed(ContactorName::precharge)) return 0.0;
    path_Ohm += precharge_resistance_Ohm_;
  }
  return 1.0 / path_Ohm;
}

/// A charger that holds a voltage of its own: with each step it moves half way to the current that gives this voltage.
double Plant::charger_held_A(double source_Ohm) const {
  const double sensed_V = charger_senses_terminals_ ? charger_V() : link_V_;
  const double lead_Ohm = charger_senses_terminals_ ? charger_lead_Ohm_ : 0.0;
  const double loop_siemens = charger_loop_gain / (source_Ohm + config_.path_resistance_Ohm + lead_Ohm);
  return charger_A_ + (charger_voltage_V_ - sensed_V) * loop_siemens;
}

double Plant::charger_now_A(double source_Ohm) const {
  if (!is_charger_connected()) return 0.0;
  const double demand_A = std::max(charger_demand_A_, 0.0);
  if (is_charger_runaway_) return demand_A;
  if (charger_voltage_V_ > 0.0) return std::clamp(charger_held_A(source_Ohm), 0.0, demand_A);
  const double stop_V = config_.cell.voltage_max_V * static_cast<double>(cells_.size());
  const double taper_siemens = charger_loop_gain / (source_Ohm + config_.path_resistance_Ohm);
  return std::clamp((stop_V - link_V_) * taper_siemens, 0.0, demand_A);
}

/// C dV/dt = (E - V) G - V Gb + Iin, with everything but V constant over the step: V approaches exponentially the value
/// at which the currents balance. The mean of V over the step gives every current's charge exactly.
void Plant::step_link(const Source& source) {
  const double pack_siemens = path_siemens(source.resistance_Ohm);
  const double bleed_siemens = 1.0 / link_bleed_Ohm_;
  const bool is_live = is_connected();
  load_A_ = is_live && (load_demand_A_ <= 0.0 || link_V_ > 0.0) ? load_demand_A_ : 0.0;
  charger_A_ = charger_now_A(source.resistance_Ohm);

  const double total_siemens = pack_siemens + bleed_siemens;
  const double final_V = (source.open_V * pack_siemens + charger_A_ - load_A_) / total_siemens;
  const double steps = step_s * total_siemens / link_capacitance_F_;
  const double gone = -std::expm1(-steps);
  const double mean_V = final_V + (link_V_ - final_V) * gone / steps;
  link_V_ += (final_V - link_V_) * gone;
  current_A_ = (source.open_V - mean_V) * pack_siemens;
  pack_V_ = source.open_V - current_A_ * source.resistance_Ohm;

  totals_.pack_As += current_A_ * step_s;
  totals_.load_As += load_A_ * step_s;
  totals_.charger_As += charger_A_ * step_s;
  totals_.bleed_As += mean_V * bleed_siemens * step_s;
  totals_.pack_J += pack_V_ * current_A_ * step_s;
}

void Plant::step_cells() {
  double chemical_W = 0.0;
  double heat_W = 0.0;
  double shunt_W = 0.0;
  for (std::size_t index = 0; index < cells_.size(); ++index) {
    PlantCell& cell = cells_[index];
    const double shunt_siemens = cell.leak_siemens + cell.balancing_siemens;
    cell.voltage_V = (behind_R0_V_[index] - current_A_ * cell.resistance_Ohm) * cell.share;
    const double cell_A = current_A_ + cell.voltage_V * shunt_siemens;
    chemical_W += ocv_V_[index] * cell_A;
    heat_W += step_cell(cell, cell_A);
    shunt_W += cell.voltage_V * cell.voltage_V * shunt_siemens;
  }
  totals_.chemical_J += chemical_W * step_s;
  totals_.cell_heat_J += heat_W * step_s;
  totals_.shunt_J += shunt_W * step_s;
}

/// Returns the power loss of a cell. The energy of the hysteresis is lost, too, in either direction of the current.
/// Multiplies by reciprocals instead of dividing: this function is most of the cost of a step.
double Plant::step_cell(PlantCell& cell, double cell_A) const {
  const CellPhysics& kind = config_.cell;
  double lost_W = cell_A * cell_A * cell.resistance_Ohm - cell.hysteresis * kind.hysteresis_V * cell_A;
  const double siemens_factor = 1.0 / cell.resistance_factor;
  for (std::size_t pair = 0; pair < rc_pairs; ++pair) {
    double& rc_V = cell.rc_V[pair];
    lost_W += rc_V * rc_V * rc_siemens_[pair] * siemens_factor;
    rc_V += (cell_A * kind.rc[pair].resistance_Ohm * cell.resistance_factor - rc_V) * rc_fraction_[pair];
  }
  const double moved = cell_A * step_s * cell.soc_per_As;
  cell.soc -= moved + cell.self_discharge_per_s * step_s;
  if (kind.hysteresis_V > 0.0) {
    cell.hysteresis -= (std::abs(moved) * cell.hysteresis + moved) * turns_over_per_soc_;
  }
  if (!cell.is_temperature_held) {
    const double cooling_W = kind.heat_transfer_W_per_K * (cell.temperature_C - ambient_C_);
    cell.temperature_C += (lost_W - cooling_W) * kelvin_per_W_;
  }
  return lost_W;
}

void Plant::follow_temperatures() {
  for (std::size_t cell = follows_temperature_; cell < cells_.size(); cell += temperature_groups) {
    follow_temperature(cells_[cell]);
  }
  follows_temperature_ = (follows_temperature_ + 1) % temperature_groups;
}

void Plant::follow_temperature(PlantCell& cell) const {
  const CellPhysics& kind = config_.cell;
  cell.soc = std::clamp(cell.soc, -soc_beyond_max, 1.0 + soc_beyond_max);
  cell.temperature_C = std::clamp(cell.temperature_C, temperature_min_C, temperature_max_C);
  cell.resistance_factor = resistance_factor(kind.resistance_activation_K, cell.temperature_C);
  const double warmer_K = std::min(cell.temperature_C, self_discharge_known_to_C) - 25.0;
  cell.self_discharge_per_s = kind.self_discharge_per_s * std::exp2(warmer_K / self_discharge_doubles_every_K);
  refresh_share(cell);
}

void Plant::step_boards() {
  for (std::size_t module = 0; module < config_.cells_of_module.size(); ++module) {
    const double final_C = ambient_C_ + board_heating_K_per_cell * std::popcount(balancing_[module]);
    board_C_[module] += (final_C - board_C_[module]) * (step_s / board_time_constant_s);
  }
}

void Plant::set_balancing(std::size_t module, CellMask switches) {
  if (balancing_[module] == switches) return;
  balancing_[module] = switches;
  for (std::size_t cell = 0; cell < config_.cells_of_module[module]; ++cell) {
    PlantCell& one = cells_[first_cell_[module] + cell];
    one.balancing_siemens = has_cell(switches, cell) ? 1.0 / config_.balancing_resistance_Ohm : 0.0;
    refresh_share(one);
  }
}

void Plant::set_cell_resistance_Ohm(std::size_t cell, double resistance_Ohm) {
  cells_[cell].series_resistance_Ohm = resistance_Ohm;
  refresh_share(cells_[cell]);
}

void Plant::set_cell_leak_siemens(std::size_t cell, double conductance_siemens) {
  cells_[cell].leak_siemens = conductance_siemens;
  refresh_share(cells_[cell]);
}

void Plant::refresh_share(PlantCell& cell) {
  cell.resistance_Ohm = cell.series_resistance_Ohm * cell.resistance_factor;
  cell.share = 1.0 / (1.0 + cell.resistance_Ohm * (cell.leak_siemens + cell.balancing_siemens));
}

void Plant::hold_cell_temperature_C(std::size_t cell, double temperature_C) {
  cells_[cell].temperature_C = temperature_C;
  cells_[cell].is_temperature_held = true;
  follow_temperature(cells_[cell]);
}

ContactorFlags Plant::feedback() const {
  ContactorFlags flags{};
  for (std::size_t index = 0; index < contactor_count; ++index) flags[index] = contactors_[index].feedback();
  return flags;
}

bool Plant::is_connected() const {
  return is_closed(ContactorName::main_positive) && is_closed(ContactorName::main_negative);
}

bool Plant::is_charger_connected() const {
  return is_connected() && (!config_.has_charge_contactor || is_closed(ContactorName::charge));
}

}  // namespace bmu
