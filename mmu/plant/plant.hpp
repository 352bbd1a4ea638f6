// Physical model for the emulated devices, as ideal sensors would measure it: cells, balancing resistors, contactors,
// precharge resistor, DC link capacitor, load, charger.
//
//      cells        main_positive (closed: path resistance)
//    +--||||--+-----o/ o-----------------+----------+--------+---------+----o/ o----+
//    |        +-----o/ o--[precharge]----+          |        |         |   charge   |
//    |                                            [C]     [bleed]    load        charger
//    +--------------o/ o-----------------+----------+--------+---------+------------+
//                main_negative
//
//   cell      as in daemon/core/cell/cell_model.hpp: OCV, hysteresis, an ohmic resistance and two RC elements, all of
//             these resistances larger in the cold, and self-discharge. Each has a capacity, resistance and temperature
//             of its own; it is heated by the losses of its resistances and its hysteresis, and cools to the air. A
//             balancing resistor and a leak are in parallel to it. Whatever is done to it, it goes no further than half
//             its capacity beyond full and empty, and than -100 and 1000 C: real cells burn, the model stays finite.
//   DC link   solved in closed form over a step (the pack, the resistor and the capacitor are one exponential), so that
//             a time constant far below the step is no problem and charge is conserved exactly.
//   load      a demanded current, positive out of the pack; flows only while both main contactors are closed.
//   charger   a constant current into the pack under the same condition, tapering off when the cells' voltages are at
//             their maximum on average, or at a voltage of its own; a runaway one continues. It measures that voltage
//             at the pack, by sense wires, or at its own terminals, which are higher by the drop of its leads. It is
//             behind the charge contactor if the pack has one, otherwise on the DC link: then that contactor moves and
//             reports but switches nothing.
//
// Deterministic: fixed steps of 1 ms in doubles, no randomness in here. No heap; the object is large (cells inside), so
// do not put it on a small stack. Cost: about 10 ns per cell and step: 756 cells run 100 times faster than real time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "mmu/devices/contactor.hpp"
#include "mmu/devices/sampling.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

inline constexpr std::size_t plant_modules_max = internal_bus::node_count_max;
inline constexpr std::size_t plant_cells_max = plant_modules_max * mmu_cells_max;

/// RC element of a cell: a voltage that a current builds up and that decays again.
struct RcPair {
  double resistance_Ohm = 0.0;  // at 25 C
  double time_constant_s = 1.0;
};
inline constexpr std::size_t rc_pairs = 2;

/// A type of cell. The open-circuit voltage is given at every permille, so that a table of whole permille points with
/// straight lines between them is represented exactly and read without a search. Outside 0 to 1 its first or last slope
/// continues.
struct CellPhysics {
  static constexpr std::size_t ocv_points = 1001;
  std::array<double, ocv_points> ocv_V{};
  double capacity_As = 3600.0;
  double series_resistance_Ohm = 0.0;  // at 25 C
  std::array<RcPair, rc_pairs> rc{};
  double resistance_activation_K = 0.0;
  double hysteresis_V = 0.0;
  double hysteresis_charge = 0.03;    // share of the capacity
  double self_discharge_per_s = 0.0;  // share of the capacity, at 25 C
  double heat_capacity_J_per_K = 1.0;
  double heat_transfer_W_per_K = 0.0;
  double voltage_max_V = 4.2;  // where the charger stops, times the cells
};

struct PlantConfig {
  CellPhysics cell;
  FixedVector<std::uint8_t, plant_modules_max> cells_of_module;
  double initial_soc = 0.8;
  double ambient_C = 25.0;
  double balancing_resistance_Ohm = 62.0;  // 60 mA at 3.7 V
  double path_resistance_Ohm = 0.002;      // contactors, fuse, busbars
  double precharge_resistance_Ohm = 100.0;
  double link_capacitance_F = 2000e-6;
  double link_bleed_Ohm = 10e3;
  bool has_charge_contactor = false;  // between DC link and charger; without it the charger is on the DC link
  Contactor::Mechanics contactor;
};

struct PlantCell {
  double soc = 0.0;
  std::array<double, rc_pairs> rc_V{};
  double hysteresis = 0.0;  // -1 after long discharging to 1 after long charging
  double temperature_C = 25.0;
  double voltage_V = 0.0;              // at its terminals, of the last step
  double soc_per_As = 0.0;             // of its own capacity
  double series_resistance_Ohm = 0.0;  // at 25 C
  double leak_siemens = 0.0;           // conductance of a fault in parallel
  double balancing_siemens = 0.0;      // conductance of the balancing resistor, 0 when its switch is off
  bool is_temperature_held = false;    // held by the script: a heater, a fire

  // Derived, from the temperature at the last update.
  double resistance_factor = 1.0;     // of all resistances, against 25 C
  double resistance_Ohm = 0.0;        // the series resistance, now
  double self_discharge_per_s = 0.0;  // of its charge when full
  double share = 1.0;                 // of voltage and resistance, with shunts: 1 / (1 + R0 * (leak + balancing))
};

/// Sums since the start, to check the balances of charge and energy.
struct PlantTotals {
  double pack_As = 0.0;      // out of the pack's terminals
  double load_As = 0.0;      // into the load, minus the returned charge
  double charger_As = 0.0;   // out of the charger
  double bleed_As = 0.0;     // through the bleed resistor
  double chemical_J = 0.0;   // OCV * current of all cells
  double cell_heat_J = 0.0;  // in R0, the RC pairs and the hysteresis
  double pack_J = 0.0;       // delivered at the cells' terminals, without what flows through leaks and balancing
  double shunt_J = 0.0;      // in balancing resistors and leaks
};

class Plant {
 public:
  static constexpr Duration step_length = 1ms;

  explicit Plant(const PlantConfig& config);

  /// One millisecond.
  void step();

  // Actions of devices and people.
  void drive(const ContactorFlags& coils) { coils_ = coils; }
  void set_balancing(std::size_t module, CellMask switches);
  void set_load_A(double current_A) { load_demand_A_ = current_A; }
  void set_charger_A(double current_A) { charger_demand_A_ = current_A; }
  /// Resistance of its leads, both directions together.
  void set_charger_lead_Ohm(double resistance_Ohm) { charger_lead_Ohm_ = resistance_Ohm; }
  /// Voltage that it holds; 0: the cells' maximum.
  void set_charger_voltage_V(double voltage_V) { charger_voltage_V_ = voltage_V; }
  void set_charger_senses_terminals(bool senses) { charger_senses_terminals_ = senses; }
  void set_charger_runaway(bool is_runaway) { is_charger_runaway_ = is_runaway; }
  void set_ambient_C(double temperature_C) { ambient_C_ = temperature_C; }
  void set_link_capacitance_F(double capacitance_F) { link_capacitance_F_ = capacitance_F; }
  void set_link_bleed_Ohm(double resistance_Ohm) { link_bleed_Ohm_ = resistance_Ohm; }
  void set_precharge_resistance_Ohm(double resistance_Ohm) { precharge_resistance_Ohm_ = resistance_Ohm; }
  void set_cell_soc(std::size_t cell, double soc) { cells_[cell].soc = soc; }
  /// At 25 C.
  void set_cell_resistance_Ohm(std::size_t cell, double resistance_Ohm);
  /// An aged cell: the same state of charge is less charge.
  void set_cell_capacity_As(std::size_t cell, double capacity_As) { cells_[cell].soc_per_As = 1.0 / capacity_As; }
  void set_cell_leak_siemens(std::size_t cell, double conductance_siemens);
  void hold_cell_temperature_C(std::size_t cell, double temperature_C);
  void release_cell_temperature(std::size_t cell) { cells_[cell].is_temperature_held = false; }
  [[nodiscard]] Contactor& contactor(ContactorName name) { return contactors_[static_cast<std::size_t>(name)]; }

  // Measurable quantities.
  [[nodiscard]] const PlantConfig& config() const { return config_; }
  [[nodiscard]] std::size_t cell_count() const { return cells_.size(); }
  [[nodiscard]] std::size_t first_cell(std::size_t module) const { return first_cell_[module]; }
  [[nodiscard]] const PlantCell& cell(std::size_t cell) const { return cells_[cell]; }
  [[nodiscard]] double pack_V() const { return pack_V_; }
  [[nodiscard]] double link_V() const { return link_V_; }
  [[nodiscard]] double current_A() const { return current_A_; }  // mean of the last step, positive leaves the pack
  [[nodiscard]] bool is_closed(ContactorName name) const {
    return contactors_[static_cast<std::size_t>(name)].is_closed();
  }
  [[nodiscard]] ContactorFlags feedback() const;
  /// Whether both main contactors are closed, commanded or welded: the load is on the pack.
  [[nodiscard]] bool is_connected() const;
  /// Whether the charge contactor is closed as well, if there is one: the charger is on the pack, too.
  [[nodiscard]] bool is_charger_connected() const;
  [[nodiscard]] double load_A() const { return load_A_; }
  [[nodiscard]] double charger_A() const { return charger_A_; }
  [[nodiscard]] double charger_lead_Ohm() const { return charger_lead_Ohm_; }
  /// Voltage at the charger's terminals.
  [[nodiscard]] double charger_V() const { return link_V_ + charger_A_ * charger_lead_Ohm_; }
  [[nodiscard]] double link_capacitance_F() const { return link_capacitance_F_; }
  [[nodiscard]] double link_bleed_Ohm() const { return link_bleed_Ohm_; }
  [[nodiscard]] double precharge_resistance_Ohm() const { return precharge_resistance_Ohm_; }
  [[nodiscard]] double ambient_C() const { return ambient_C_; }
  [[nodiscard]] double board_C(std::size_t module) const { return board_C_[module]; }
  [[nodiscard]] const PlantTotals& totals() const { return totals_; }
  [[nodiscard]] double ocv_V(double soc) const;

 private:
  struct Source {  // the cells as one: a voltage behind a resistance
    double open_V = 0.0;
    double resistance_Ohm = 0.0;
  };
  [[nodiscard]] Source sum_cells();
  void step_link(const Source& source);
  void step_cells();
  double step_cell(PlantCell& cell, double cell_A) const;
  void step_boards();
  void follow_temperatures();
  void follow_temperature(PlantCell& cell) const;
  static void refresh_share(PlantCell& cell);
  [[nodiscard]] double path_siemens(double source_Ohm) const;  // pack to DC link; 0 when open
  [[nodiscard]] double charger_now_A(double source_Ohm) const;
  [[nodiscard]] double charger_held_A(double source_Ohm) const;

  PlantConfig config_;
  FixedVector<PlantCell, plant_cells_max> cells_;
  std::array<double, plant_cells_max> ocv_V_{};        // of this step
  std::array<double, plant_cells_max> behind_R0_V_{};  // voltage of a cell without its ohmic drop
  std::array<std::uint16_t, plant_modules_max> first_cell_{};
  std::array<CellMask, plant_modules_max> balancing_{};
  std::array<double, plant_modules_max> board_C_{};
  std::array<Contactor, contactor_count> contactors_;
  ContactorFlags coils_{};
  TimePoint now_{};
  std::array<double, rc_pairs> rc_fraction_{};  // share of the way to its final voltage in one step
  std::array<double, rc_pairs> rc_siemens_{};   // at 25 C; 0 for an unused element
  double turns_over_per_soc_;                   // of the hysteresis
  double kelvin_per_W_;                         // of one step
  std::size_t follows_temperature_ = 0;         // the next group of cells to update
  double link_capacitance_F_;
  double link_bleed_Ohm_;
  double precharge_resistance_Ohm_;
  double ambient_C_;
  double load_demand_A_ = 0.0;
  double charger_demand_A_ = 0.0;
  double charger_lead_Ohm_ = 0.0;
  double charger_voltage_V_ = 0.0;
  bool charger_senses_terminals_ = false;
  bool is_charger_runaway_ = false;
  double load_A_ = 0.0;
  double charger_A_ = 0.0;
  double current_A_ = 0.0;
  double pack_V_ = 0.0;
  double link_V_ = 0.0;
  PlantTotals totals_;
};

}  // namespace bmu
