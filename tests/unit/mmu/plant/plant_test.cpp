// Emulated pack compared with closed forms, and its charge and energy balance.
#include "mmu/plant/plant.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <memory>

#include "mmu/plant/load_profile.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/processor_time.hpp"

namespace bmu {
namespace {

constexpr double step_s = 0.001;
constexpr ContactorFlags all_open{};
constexpr ContactorFlags negative_only{false, true, false, false};
constexpr ContactorFlags precharging{false, true, true, false};
constexpr ContactorFlags closed{true, true, false, false};

/// 3.0 V empty to 4.0 V full, linearly: OCV = 3 + soc.
CellPhysics straight_cell() {
  CellPhysics cell;
  for (std::size_t point = 0; point < CellPhysics::ocv_points; ++point) {
    cell.ocv_V[point] = 3.0 + static_cast<double>(point) * 1e-3;
  }
  cell.capacity_As = 36'000.0;
  cell.series_resistance_Ohm = 0.002;
  cell.rc[0] = {.resistance_Ohm = 0.003, .time_constant_s = 20.0};
  cell.heat_capacity_J_per_K = 400.0;
  cell.heat_transfer_W_per_K = 0.5;
  return cell;
}

PlantConfig pack_config(std::size_t modules = 2, std::uint8_t cells = 6) {
  PlantConfig config;
  config.cell = straight_cell();
  for (std::size_t module = 0; module < modules; ++module) config.cells_of_module.push_back(cells);
  config.initial_soc = 0.5;
  return config;
}

void run(Plant& plant, Duration duration) {
  for (Duration done{}; done < duration; done += Plant::step_length) plant.step();
}

void settle_with(Plant& plant, const ContactorFlags& coils) {
  plant.drive(coils);
  run(plant, 100ms);
}

TEST_CASE("an open pack rests at its open-circuit voltage", "[unit][plant]") {
  Plant plant(pack_config());
  run(plant, 10s);
  CHECK(plant.pack_V() == Approx(12 * 3.5));
  CHECK(plant.link_V() == 0.0);
  CHECK(plant.current_A() == 0.0);
  CHECK(plant.cell(0).soc == 0.5);
}

TEST_CASE("only negative closed, no current flows", "[unit][plant]") {
  Plant plant(pack_config());
  settle_with(plant, negative_only);
  CHECK(plant.current_A() == 0.0);
  CHECK(plant.link_V() == 0.0);
}

TEST_CASE("precharge follows 1 - exp(-t / RC)", "[unit][plant]") {
  PlantConfig config = pack_config();
  config.link_bleed_Ohm = 1e12;
  const double total_Ohm = config.precharge_resistance_Ohm + config.path_resistance_Ohm + 12 * 0.002;
  const double time_constant_s = total_Ohm * config.link_capacitance_F;
  for (const double multiple : {0.5, 1.0, 2.0, 3.0, 5.0}) {
    Plant fresh(config);
    fresh.drive(precharging);
    run(fresh, 20ms);  // the contact closes with the next step
    const auto steps = static_cast<int>(std::lround(multiple * time_constant_s / step_s));
    for (int step = 0; step < steps; ++step) fresh.step();
    const double expected_V = 42.0 * (1.0 - std::exp(-steps * step_s / time_constant_s));
    CHECK(fresh.link_V() == Approx(expected_V).epsilon(1e-4));
  }
}

TEST_CASE("a small bleed resistor keeps the precharge from getting there", "[unit][plant]") {
  Plant plant(pack_config());
  plant.set_link_bleed_Ohm(100.0);
  plant.drive(precharging);
  run(plant, 5s);
  CHECK(plant.link_V() == Approx(42.0 * 100.0 / 200.026).epsilon(1e-3));
}

TEST_CASE("behind open contactors the link falls by its bleed resistor alone", "[unit][plant]") {
  PlantConfig config = pack_config();
  Plant plant(config);
  settle_with(plant, closed);
  const double full_V = plant.link_V();
  REQUIRE(full_V == Approx(42.0).epsilon(1e-3));
  plant.drive(all_open);
  run(plant, 9ms);
  const double before_V = plant.link_V();
  run(plant, 20s);  // time constant of the bleed resistor
  CHECK(plant.link_V() == Approx(before_V * std::exp(-1.0)).epsilon(1e-3));
}

TEST_CASE("a load flows only while both main contactors are closed", "[unit][plant]") {
  Plant plant(pack_config());
  plant.set_load_A(10.0);
  settle_with(plant, precharging);
  CHECK(plant.load_A() == 0.0);
  settle_with(plant, closed);
  CHECK(plant.load_A() == 10.0);
  CHECK(plant.current_A() == Approx(10.0).margin(0.01));
  settle_with(plant, all_open);
  CHECK(plant.load_A() == 0.0);
  CHECK(plant.current_A() == 0.0);
}

TEST_CASE("a welded contactor keeps the path closed", "[unit][plant]") {
  Plant plant(pack_config());
  plant.set_load_A(10.0);
  settle_with(plant, closed);
  plant.contactor(ContactorName::main_positive).set_fault(ContactorFault::welded);
  settle_with(plant, negative_only);
  CHECK(plant.current_A() == Approx(10.0).margin(0.01));
  CHECK(plant.feedback()[0]);
  settle_with(plant, all_open);
  CHECK(plant.current_A() == 0.0);
}

constexpr ContactorFlags positive_only{true, false, false, false};

/// Pack that was closed without current, with these contactors welded, and its coils then released.
Plant opened_with_welded(std::initializer_list<ContactorName> welded) {
  Plant plant(pack_config());
  settle_with(plant, closed);
  for (const ContactorName name : welded) plant.contactor(name).set_fault(ContactorFault::welded);
  settle_with(plant, all_open);
  return plant;
}

TEST_CASE("one welded main alone carries nothing: the link falls as if both were open", "[unit][plant]") {
  for (const ContactorName welded : {ContactorName::main_positive, ContactorName::main_negative}) {
    Plant plant = opened_with_welded({welded});
    plant.set_load_A(10.0);
    const double before_V = plant.link_V();
    run(plant, 20s);
    CHECK(plant.link_V() == Approx(before_V * std::exp(-1.0)).epsilon(1e-3));
    CHECK(plant.current_A() == 0.0);
    CHECK(plant.load_A() == 0.0);
    CHECK(plant.feedback()[static_cast<std::size_t>(welded)]);
  }
}

TEST_CASE("both mains welded: with every coil off the link stays up and the current goes on", "[unit][plant]") {
  Plant plant = opened_with_welded({ContactorName::main_positive, ContactorName::main_negative});
  run(plant, 20s);
  CHECK(plant.link_V() == Approx(42.0).epsilon(1e-3));
  plant.set_load_A(10.0);
  run(plant, 100ms);
  CHECK(plant.current_A() == Approx(10.0).margin(0.01));
}

TEST_CASE("a welded main shows with the first contact that closes the loop", "[unit][plant]") {
  SECTION("positive: negative alone brings the link up at once, without precharge") {
    Plant plant(pack_config());
    plant.contactor(ContactorName::main_positive).set_fault(ContactorFault::welded);
    plant.drive(negative_only);
    run(plant, 21ms);
    CHECK(plant.link_V() > 30.0);
  }
  SECTION("negative: positive alone does") {
    Plant plant(pack_config());
    plant.contactor(ContactorName::main_negative).set_fault(ContactorFault::welded);
    plant.drive(positive_only);
    run(plant, 21ms);
    CHECK(plant.link_V() > 30.0);
  }
  SECTION("precharge: negative alone charges the link slowly") {
    Plant plant(pack_config());
    plant.contactor(ContactorName::precharge).set_fault(ContactorFault::welded);
    plant.drive(negative_only);
    run(plant, 21ms);
    CHECK(plant.link_V() < 5.0);
    run(plant, 2s);
    CHECK(plant.link_V() > 40.0);
  }
  SECTION("negative and precharge: the link stays up behind open coils, through the resistor") {
    Plant plant = opened_with_welded({ContactorName::main_negative, ContactorName::precharge});
    run(plant, 60s);
    CHECK(plant.link_V() == Approx(42.0 * 10'000.0 / 10'100.0).epsilon(1e-3));
    CHECK(plant.current_A() == Approx(plant.link_V() / 10'000.0).epsilon(1e-3));
  }
}

TEST_CASE("charge is conserved: what leaves the cells is in the load, the bleed resistor or the link",
          "[unit][plant]") {
  Plant plant(pack_config());
  plant.drive(precharging);
  run(plant, 500ms);
  plant.drive(closed);
  for (int second = 0; second < 60; ++second) {
    plant.set_load_A(load_at(LoadProfile::drive, std::chrono::seconds(second)));
    run(plant, 1s);
  }
  const PlantTotals& totals = plant.totals();
  const double link_As = plant.link_V() * plant.link_capacitance_F();
  CHECK(totals.pack_As == Approx(totals.load_As + totals.bleed_As + link_As).epsilon(1e-9));
  for (std::size_t cell = 0; cell < plant.cell_count(); ++cell) {
    CHECK((0.5 - plant.cell(cell).soc) * 36'000.0 == Approx(totals.pack_As).epsilon(1e-9));
  }
}

TEST_CASE("energy is conserved: chemistry gives what terminals, heat and RC pairs take", "[unit][plant]") {
  Plant plant(pack_config());
  plant.set_balancing(0, first_cells(3));
  plant.drive(closed);
  plant.set_load_A(30.0);
  run(plant, 60s);
  const PlantTotals& totals = plant.totals();
  double stored_J = 0.0;
  for (std::size_t cell = 0; cell < plant.cell_count(); ++cell) {
    const double capacitance_F = 20.0 / 0.003;
    stored_J += 0.5 * capacitance_F * plant.cell(cell).rc_V[0] * plant.cell(cell).rc_V[0];
  }
  CHECK(totals.chemical_J == Approx(totals.pack_J + totals.cell_heat_J + totals.shunt_J + stored_J).epsilon(1e-4));
}

TEST_CASE("after a current step the RC pair goes to its end as exp(-t / tau) says", "[unit][plant]") {
  PlantConfig config = pack_config(1, 1);
  config.link_bleed_Ohm = 1e12;
  Plant plant(config);
  settle_with(plant, closed);
  plant.set_load_A(20.0);
  for (const double time_s : {1.0, 10.0, 20.0, 60.0}) {
    Plant fresh = plant;
    for (int step = 0; step < static_cast<int>(time_s / step_s); ++step) fresh.step();
    const double end_V = 20.0 * 0.003;
    CHECK(fresh.cell(0).rc_V[0] == Approx(end_V * (1.0 - std::exp(-time_s / 20.0))).epsilon(1e-3));
  }
  run(plant, 100s);
  const double loaded_V = plant.cell(0).voltage_V;
  plant.set_load_A(0.0);
  run(plant, 20ms);
  CHECK(plant.cell(0).voltage_V - loaded_V == Approx(20.0 * 0.002).epsilon(0.02));  // R0 at once
  run(plant, 20s);
  CHECK(plant.cell(0).rc_V[0] == Approx(20.0 * 0.003 * std::exp(-1.0)).epsilon(0.01));
}

TEST_CASE("of two pairs each goes to its end in its own time", "[unit][plant]") {
  PlantConfig config = pack_config(1, 1);
  config.link_bleed_Ohm = 1e12;
  config.cell.rc[1] = {.resistance_Ohm = 0.004, .time_constant_s = 300.0};
  Plant plant(config);
  settle_with(plant, closed);
  plant.set_load_A(10.0);
  run(plant, 60s);
  const PlantCell& cell = plant.cell(0);
  CHECK(cell.rc_V[0] == Approx(10.0 * 0.003 * (1.0 - std::exp(-60.0 / 20.0))).epsilon(1e-3));
  CHECK(cell.rc_V[1] == Approx(10.0 * 0.004 * (1.0 - std::exp(-60.0 / 300.0))).epsilon(1e-3));
  const double expected_V = plant.ocv_V(cell.soc) - cell.rc_V[0] - cell.rc_V[1] - 10.0 * 0.002;
  CHECK(cell.voltage_V == Approx(expected_V).epsilon(1e-6));
}

TEST_CASE("all resistances are larger in the cold, as Arrhenius says", "[unit][plant]") {
  PlantConfig config = pack_config(1, 2);
  config.cell.resistance_activation_K = 2'500.0;
  Plant plant(config);
  plant.hold_cell_temperature_C(0, 25.0);
  plant.hold_cell_temperature_C(1, -10.0);
  settle_with(plant, closed);
  plant.set_load_A(10.0);
  run(plant, 120s);
  const double factor = std::exp(2'500.0 * (1.0 / 263.15 - 1.0 / 298.15));
  CHECK(factor == Approx(3.05).epsilon(0.01));
  const PlantCell& warm = plant.cell(0);
  const PlantCell& cold = plant.cell(1);
  CHECK(cold.resistance_Ohm == Approx(0.002 * factor));
  CHECK(cold.rc_V[0] == Approx(warm.rc_V[0] * factor).epsilon(1e-6));
  CHECK(warm.voltage_V - cold.voltage_V == Approx(10.0 * 0.005 * (factor - 1.0)).epsilon(0.01));
}

TEST_CASE("a cell that warms up follows within a tenth of a second", "[unit][plant]") {
  PlantConfig config = pack_config();
  config.cell.resistance_activation_K = 2'500.0;
  config.ambient_C = 0.0;
  Plant plant(config);
  CHECK(plant.cell(3).resistance_factor == Approx(std::exp(2'500.0 * (1.0 / 273.15 - 1.0 / 298.15))));
  plant.set_ambient_C(1'000.0);
  run(plant, 60s);
  const double before_C = plant.cell(3).temperature_C;
  run(plant, 100ms);
  REQUIRE(before_C > 20.0);
  const double at_most = std::exp(2'500.0 * (1.0 / (before_C + 273.15) - 1.0 / 298.15));
  CHECK(plant.cell(3).resistance_factor <= at_most);
  CHECK(plant.cell(3).resistance_factor > at_most * 0.98);
}

TEST_CASE("a cell rests higher after charging than after discharging, and turns over with the charge that flows",
          "[unit][plant]") {
  PlantConfig config = pack_config(1, 1);
  config.link_bleed_Ohm = 1e12;
  config.cell.hysteresis_V = 0.020;
  config.cell.hysteresis_charge = 0.05;
  config.cell.rc = {};
  config.cell.capacity_As = 3'600.0;
  Plant plant(config);
  settle_with(plant, closed);
  const auto rests_above_ocv_V = [&plant] {
    plant.set_load_A(0.0);
    run(plant, 1s);
    return plant.cell(0).voltage_V - plant.ocv_V(plant.cell(0).soc);
  };
  CHECK(rests_above_ocv_V() == Approx(0.0).margin(1e-6));
  plant.set_load_A(36.0);
  run(plant, 20s);  // a fifth of the capacity
  CHECK(rests_above_ocv_V() == Approx(-0.020 * (1.0 - std::exp(-4.0))).epsilon(0.01));
  const double turned_V = rests_above_ocv_V();
  plant.set_load_A(-36.0);
  run(plant, 5s);  // back by the hysteresis charge
  CHECK(rests_above_ocv_V() == Approx(0.020 + (turned_V - 0.020) * std::exp(-1.0)).epsilon(0.01));
  plant.set_load_A(-36.0);
  run(plant, 25s);
  CHECK(rests_above_ocv_V() == Approx(0.020).epsilon(0.02));
}

TEST_CASE("a full turn with hysteresis loses energy, and the books agree", "[unit][plant]") {
  PlantConfig config = pack_config(1, 2);
  config.cell.hysteresis_V = 0.020;
  config.cell.series_resistance_Ohm = 0.0;
  config.cell.rc = {};
  config.cell.capacity_As = 3'600.0;
  Plant plant(config);
  settle_with(plant, closed);
  for (int turn = 0; turn < 4; ++turn) {
    plant.set_load_A(turn % 2 == 0 ? 36.0 : -36.0);
    run(plant, 20s);
  }
  const PlantTotals& totals = plant.totals();
  CHECK(totals.chemical_J == Approx(totals.pack_J + totals.cell_heat_J).epsilon(1e-6));
  CHECK(totals.cell_heat_J > 0.5 * 4 * 720.0 * 2 * 0.020);
}

TEST_CASE("a cell discharges itself, twice as fast ten kelvin warmer", "[unit][plant]") {
  PlantConfig config = pack_config(1, 2);
  config.cell.self_discharge_per_s = 1e-5;
  Plant plant(config);
  plant.hold_cell_temperature_C(0, 25.0);
  plant.hold_cell_temperature_C(1, 35.0);
  run(plant, 100s);
  CHECK(0.5 - plant.cell(0).soc == Approx(1e-3).epsilon(1e-6));
  CHECK(0.5 - plant.cell(1).soc == Approx(2e-3).epsilon(1e-6));
}

TEST_CASE("a worn cell with half the capacity is emptied twice as fast", "[unit][plant]") {
  Plant plant(pack_config());
  plant.set_cell_capacity_As(4, 18'000.0);
  settle_with(plant, closed);
  plant.set_load_A(20.0);
  run(plant, 60s);
  CHECK(0.5 - plant.cell(4).soc == Approx(2.0 * (0.5 - plant.cell(5).soc)).epsilon(1e-9));
}

TEST_CASE("balancing draws its current from its own cell only", "[unit][plant][MMU_3][BMS_NF.3]") {
  PlantConfig config = pack_config(1, 4);
  config.balancing_resistance_Ohm = 58.0;
  Plant plant(config);
  plant.set_balancing(0, cell_bit(2));
  run(plant, 60s);
  const double expected_As = 3.5 / 58.0 * 60.0;  // 60 mA
  CHECK((0.5 - plant.cell(2).soc) * 36'000.0 == Approx(expected_As).epsilon(2e-3));
  CHECK(plant.cell(1).soc == 0.5);
  CHECK(plant.board_C(0) == Approx(25.0 + 4.0 * (1.0 - std::exp(-1.0))).epsilon(0.01));
  plant.set_balancing(0, 0);
  const double soc = plant.cell(2).soc;
  run(plant, 10s);
  CHECK(plant.cell(2).soc == soc);
}

TEST_CASE("a raised resistance sags under load, a leak empties its cell", "[unit][plant]") {
  Plant plant(pack_config());
  plant.set_cell_resistance_Ohm(5, 0.080);
  plant.set_cell_leak_siemens(7, 1.0 / 0.5);
  settle_with(plant, closed);
  plant.set_load_A(20.0);
  run(plant, 100ms);
  CHECK(plant.cell(4).voltage_V - plant.cell(5).voltage_V == Approx(20.0 * 0.078).epsilon(0.01));
  run(plant, 60s);
  CHECK(plant.cell(7).soc < plant.cell(6).soc - 0.01);
}

TEST_CASE("heat: a steady current ends at the temperature where loss and cooling meet", "[unit][plant]") {
  PlantConfig config = pack_config(1, 1);
  config.cell.heat_capacity_J_per_K = 10.0;  // a time constant of 20 s, so that the test is short
  config.cell.capacity_As = 1e9;
  Plant plant(config);
  settle_with(plant, closed);
  plant.set_load_A(30.0);
  run(plant, 300s);
  const double loss_W = 30.0 * 30.0 * (0.002 + 0.003);
  CHECK(plant.cell(0).temperature_C == Approx(25.0 + loss_W / 0.5).epsilon(1e-3));
  plant.hold_cell_temperature_C(0, 61.0);
  run(plant, 10s);
  CHECK(plant.cell(0).temperature_C == 61.0);
}

TEST_CASE("the charger fills up to the cells' maximum voltage without swinging", "[unit][plant]") {
  PlantConfig config = pack_config();
  config.cell.capacity_As = 360.0;
  config.cell.voltage_max_V = 3.9;
  Plant plant(config);
  settle_with(plant, closed);
  plant.set_charger_A(10.0);
  run(plant, 1s);
  CHECK(plant.current_A() == Approx(-10.0).margin(0.01));
  run(plant, 10s);
  double last_A = -plant.current_A();
  int swings = 0;
  for (int step = 0; step < 60'000; ++step) {
    plant.step();
    if (-plant.current_A() > last_A + 1e-9) ++swings;
    last_A = -plant.current_A();
  }
  CHECK(plant.link_V() <= 12 * 3.9 + 1e-6);
  CHECK(last_A < 2.0);
  CHECK(swings < 10);
}

TEST_CASE("a charger holds its voltage at the pack, or at terminals that are its lead's drop above it",
          "[unit][plant][PB_F.3]") {
  for (const bool senses_terminals : {false, true}) {
    CAPTURE(senses_terminals);
    PlantConfig config = pack_config();
    config.cell.capacity_As = 360.0;
    Plant plant(config);
    plant.set_charger_lead_Ohm(0.5);
    plant.set_charger_voltage_V(46.0);
    plant.set_charger_senses_terminals(senses_terminals);
    settle_with(plant, closed);
    CHECK(plant.charger_V() == plant.link_V());
    plant.set_charger_A(2.0);
    run(plant, 1s);
    REQUIRE(plant.charger_A() == Approx(2.0).margin(1e-6));
    CHECK(plant.charger_V() == Approx(plant.link_V() + 1.0).margin(1e-6));
    for (int step = 0; step < 600'000 && plant.charger_A() > 1.0; ++step) plant.step();
    REQUIRE(plant.charger_A() == Approx(1.0).margin(1e-3));
    CHECK(plant.charger_V() == Approx(senses_terminals ? 46.0 : 46.5).margin(0.02));
    CHECK(plant.link_V() == Approx(senses_terminals ? 45.5 : 46.0).margin(0.02));
  }
}

TEST_CASE("a charger behind the charge contactor needs it closed, one on the link does not", "[unit][plant]") {
  constexpr ContactorFlags charging{true, true, false, true};
  constexpr ContactorFlags charge_only{false, false, false, true};
  PlantConfig config = pack_config();
  for (const bool has_charge_contactor : {false, true}) {
    config.has_charge_contactor = has_charge_contactor;
    Plant plant(config);
    plant.set_charger_A(10.0);
    settle_with(plant, charge_only);
    CHECK(plant.charger_A() == 0.0);
    settle_with(plant, closed);
    CHECK(plant.charger_A() == (has_charge_contactor ? 0.0 : 10.0));
    settle_with(plant, charging);
    CHECK(plant.charger_A() == 10.0);
    CHECK(plant.current_A() == Approx(-10.0).margin(0.01));
    plant.set_load_A(4.0);
    run(plant, 10ms);
    CHECK(plant.current_A() == Approx(-6.0).margin(0.01));
    settle_with(plant, closed);
    CHECK(plant.current_A() == Approx(has_charge_contactor ? 4.0 : -6.0).margin(0.01));
  }
  Plant welded(config);
  welded.set_charger_A(10.0);
  welded.contactor(ContactorName::charge).set_fault(ContactorFault::welded);
  settle_with(welded, closed);
  CHECK(welded.charger_A() == 10.0);
  CHECK(welded.feedback()[3]);
  for (const ContactorName name : {ContactorName::main_positive, ContactorName::main_negative}) {
    welded.contactor(name).set_fault(ContactorFault::welded);
  }
  settle_with(welded, all_open);
  CHECK(welded.current_A() == Approx(-10.0).margin(0.01));
}

TEST_CASE("a runaway charger does not stop where the cells are full", "[unit][plant]") {
  PlantConfig config = pack_config();
  config.cell.capacity_As = 360.0;
  config.cell.voltage_max_V = 3.6;
  Plant plant(config);
  settle_with(plant, closed);
  plant.set_charger_A(10.0);
  plant.set_charger_runaway(true);
  run(plant, 10s);
  CHECK(plant.charger_A() == 10.0);
  CHECK(plant.link_V() > 12 * 3.7);
  plant.set_charger_runaway(false);
  run(plant, 1s);
  CHECK(plant.charger_A() == 0.0);
  plant.set_charger_runaway(true);
  settle_with(plant, all_open);
  CHECK(plant.charger_A() == 0.0);
}

TEST_CASE("beyond full and empty the open-circuit voltage goes on", "[unit][plant]") {
  const Plant plant(pack_config());
  CHECK(plant.ocv_V(1.1) == Approx(4.1));
  CHECK(plant.ocv_V(-0.1) == Approx(2.9));
  CHECK(plant.ocv_V(0.0005) == Approx(3.0005));
}

TEST_CASE("a cell that is abused for ever stays finite", "[unit][plant]") {
  PlantConfig config = pack_config();
  config.cell.heat_capacity_J_per_K = 45.0;
  config.cell.heat_transfer_W_per_K = 0.15;
  config.cell.capacity_As = 360.0;
  config.cell.self_discharge_per_s = 1e-8;
  const double current_A = GENERATE(-400.0, 400.0);
  Plant plant(config);
  settle_with(plant, closed);
  plant.set_cell_resistance_Ohm(3, 0.3);
  plant.set_load_A(current_A);
  run(plant, 600s);
  INFO(current_A);
  for (std::size_t index = 0; index < plant.cell_count(); ++index) {
    INFO(index);
    CHECK(std::isfinite(plant.cell(index).voltage_V));
    CHECK(std::abs(plant.cell(index).soc - 0.5) <= 1.1);
    CHECK(std::abs(plant.cell(index).temperature_C) < 1'200.0);
  }
  CHECK(std::isfinite(plant.current_A()));
}

TEST_CASE("the drive profile stays within 50 A, regenerates, and repeats", "[unit][plant]") {
  double least_A = 0.0;
  double most_A = 0.0;
  double sum_A = 0.0;
  for (int ms = 0; ms < 16'000; ++ms) {
    const double current_A = load_at(LoadProfile::drive, std::chrono::milliseconds(ms));
    least_A = std::min(least_A, current_A);
    most_A = std::max(most_A, current_A);
    sum_A += current_A;
    CHECK(current_A == load_at(LoadProfile::drive, std::chrono::milliseconds(ms + 32'000)));
  }
  CHECK(most_A <= 50.0);
  CHECK(most_A > 45.0);
  CHECK(least_A < -10.0);
  CHECK(sum_A / 16'000 > 5.0);
}

TEST_CASE("63 modules of 12 cells are simulated faster than real time", "[unit][plant][performance]") {
  const auto plant = std::make_unique<Plant>(pack_config(63, 12));
  plant->drive(closed);
  plant->set_load_A(20.0);
  const double before_s = test::processor_time_s();
  run(*plant, 2s);
  const double took_s = test::processor_time_s() - before_s;
  std::printf("plant: 756 cells, 2 s in %.1f ms of processor time: %.0f times real time\n", took_s * 1e3, 2.0 / took_s);
  CHECK(took_s < 2.0);
}

}  // namespace
}  // namespace bmu
