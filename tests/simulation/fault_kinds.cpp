// The kinds of faults, a row each.
#include <cstdlib>

#include "protocol/tables/internal_bus.hpp"
#include "tests/simulation/plan.hpp"

namespace bmu::test {

std::int64_t Draw::between(std::int64_t least, std::int64_t most) {
  return least + static_cast<std::int64_t>(random.next() % static_cast<std::uint64_t>(most - least + 1));
}

const ModuleConfig& Draw::module() {
  return config.modules[static_cast<std::size_t>(between(0, std::ssize(config.modules) - 1))];
}

bool can_happen(const FaultKind& kind, Guest guest) {
  switch (kind.happens) {
    case Happens::to_anybody: return true;
    case Happens::to_any_guest: return guest != Guest::nobody;
    case Happens::to_a_charger: return guest == Guest::charger;
    case Happens::to_an_inverter: return guest == Guest::inverter;
  }
  return false;
}

std::string_view to_text(Effect effect) {
  switch (effect) {
    case Effect::opens: return "opens";
    case Effect::opens_once: return "opens, is not seen by an open pack";
    case Effect::opens_driving: return "opens a pack that drives";
    case Effect::opens_at_end: return "opens when it is over";
    case Effect::may_open: return "may open";
    case Effect::stays_closed: return "stays closed";
  }
  return "";
}

namespace {

/// Targets of rows that have only texts: "cell 2.7", drawn from the pack.
std::string cell_of(Draw& draw) {
  const ModuleConfig& module = draw.module();
  return "cell " + std::to_string(module.node) + "." + std::to_string(draw.between(1, module.cell_count));
}
std::string module_of(Draw& draw) {
  return "module " + std::to_string(draw.module().node);
}
/// The same event for every module of the pack.
std::string all_modules(const Draw& draw, std::string_view word) {
  std::string text;
  for (const ModuleConfig& module : draw.config.modules) {
    text += (text.empty() ? "" : "; ") + ("module " + std::to_string(module.node)) + " " + std::string(word);
  }
  return text;
}
void on_and_off(FaultEvent& event, const std::string& who, std::string_view begin, std::string_view end) {
  event.begin_text = who + " " + std::string(begin);
  event.end_text = who + " " + std::string(end);
}
void cell_shows(FaultEvent& event, const std::string& cell, std::int64_t voltage_mV) {
  on_and_off(event, cell, "voltage_mV " + std::to_string(voltage_mV), "voltage_mV auto");
}

/// A second module that answers under a node number of the pack, or under a free one.
std::string stranger_at(std::uint8_t node) {
  return "stranger " + std::to_string(node);
}
std::uint8_t free_node(const CoreConfig& config) {
  std::uint8_t highest = 0;
  for (const ModuleConfig& module : config.modules) highest = std::max(highest, module.node);
  return static_cast<std::uint8_t>(highest + 1);
}

CanFrame foreign_frame(const FaultEvent& event) {
  const auto counter = static_cast<std::uint8_t>(event.amount);
  const MessageSpec& message = event.amount % 2 == 0 ? internal_bus::poll : internal_bus::contactor_command;
  CanFrame frame = make_frame(message);
  seal(message, counter, frame);
  return frame;
}

/// Of valid form, with a wrong checksum.
CanFrame damaged(const MessageSpec& message, std::uint8_t node) {
  CanFrame frame = make_frame(message, node);
  seal(message, 0, frame);
  frame.data[7] ^= 0x55U;
  return frame;
}

/// Of the guest's bus: a frame that only the master may send there. It permits no current.
CanFrame foreign_order(const CoreConfig& config) {
  if (config.charger.driver != nullptr) return config.charger.driver->command(0, {});
  return config.inverter.driver->frame(0, {}, {}).value_or(CanFrame{});
}
/// A frame of the guest with a wrong length, which no node accepts.
CanFrame wrong_word(const CoreConfig& config) {
  CanFrame frame = config.charger.driver != nullptr ? config.charger.driver->reports(0, {})[0]
                                                    : config.inverter.driver->words({})[0];
  frame.length = 3;
  return frame;
}

constexpr std::int64_t year_ms = 365LL * 86'400 * 1'000;
constexpr std::int64_t years_since_1970 = 53;

void set_wall_clock(Stage& stage, const FaultEvent& event) {
  constexpr std::int64_t offsets_ms[] = {year_ms, -year_ms, -years_since_1970 * year_ms, 3'600'000, -3'600'000};
  stage.wall_offset_ms = offsets_ms[static_cast<std::size_t>(event.amount)];
  stage.tell_wall_clock();
}

void tell_health(Stage& stage, const FaultEvent& event) {
  const auto bits = static_cast<std::uint64_t>(event.amount);
  stage.pack.observe(HealthSeen{{.store_write_failed = (bits & 1U) != 0,
                                 .history_write_failed = (bits & 2U) != 0,
                                 .memory_low = (bits & 4U) != 0,
                                 .disk_low = (bits & 8U) != 0}});
}

constexpr std::int32_t far_beyond_permille = 1'200;  // of a limit

using D = Draw;
using E = FaultEvent;
using S = Stage;
using enum Effect;
constexpr auto in_the_core = Reached::in_the_core;
using enum Happens;

const FaultKind kinds[] = {
    // cells
    {.name = "cell_high",
     .group = "cell",
     .allowed = 450ms,
     .draw =
         [](D& d, E& e) {
           cell_shows(e, cell_of(d), d.config.limits.cell_overvoltage.open / 1'000 + d.between(20, 400));
         }},
    {.name = "cell_low",
     .group = "cell",
     .effect = opens_driving,
     .allowed = 450ms,
     .draw =
         [](D& d, E& e) {
           cell_shows(e, cell_of(d), d.config.limits.cell_undervoltage.open / 1'000 - d.between(20, 1'500));
         }},
    {.name = "wire_off",
     .group = "cell",
     .allowed = 500ms,
     .draw = [](D& d, E& e) { on_and_off(e, cell_of(d), "wire open", "wire closed"); }},
    // temperatures; a jump is accepted with the next sample only
    {.name = "cell_hot",
     .group = "temperature",
     .allowed = 1470ms,
     .shortest = 1s,
     .draw =
         [](D& d, E& e) {
           on_and_off(
               e, cell_of(d),
               "temperature_dC " + std::to_string(d.config.limits.cell_overtemperature.open + d.between(20, 300)),
               "temperature_dC 250");
         }},
    {.name = "thermistor_off",
     .group = "temperature",
     .allowed = 950ms,
     .shortest = 1s,
     .draw =
         [](D& d, E& e) {
           const ModuleConfig& module = d.module();
           on_and_off(e,
                      "thermistor " + std::to_string(module.node) + "." +
                          std::to_string(d.between(1, module.temperature_sensor_count)),
                      "state open", "state ok");
         }},
    // modules
    {.name = "module_silent",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "silent", "talking"); }},
    {.name = "all_modules_silent",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw =
         [](D& d, E& e) {
           e.begin_text = all_modules(d, "silent");
           e.end_text = all_modules(d, "talking");
         }},
    {.name = "status_missing",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "omits status", "omits nothing"); }},
    {.name = "cells_missing",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "omits cells", "omits nothing"); }},
    {.name = "temperatures_missing",
     .group = "module",
     .allowed = 650ms,
     .hides = true,  // 400 and the longer age of some packs
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "omits temperatures", "omits nothing"); }},
    {.name = "counter_frozen",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "frozen_counter on", "frozen_counter off"); }},
    {.name = "old_answers",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "replay on", "replay off"); }},
    {.name = "module_damaged",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "damaged_frames on", "damaged_frames off"); }},
    {.name = "self_test_failed",
     .group = "module",
     .allowed = 450ms,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "self_test failed", "self_test ok"); }},
    {.name = "module_slow",
     .group = "module",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d,
                E& e) { on_and_off(e, module_of(d), "delay_ms " + std::to_string(d.between(1, 300)), "delay_ms 0"); }},
    {.name = "module_reset",
     .group = "module",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d, E& e) { e.begin_text = module_of(d) + " restart"; }},
    {.name = "module_power_lost",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw =
         [](D& d, E& e) {
           on_and_off(e, module_of(d), "silent", "talking");
           e.end_text += "; " + e.end_text.substr(0, e.end_text.find(" talking")) + " restart";
         }},
    {.name = "two_of_a_number",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, stranger_at(d.module().node), "connected", "disconnected"); }},
    {.name = "module_of_nobody",
     .group = "stranger",
     .effect = stays_closed,
     .draw = [](D& d, E& e) { on_and_off(e, stranger_at(free_node(d.config)), "connected", "disconnected"); }},
    {.name = "module_supply_lost",
     .group = "module",
     .allowed = 400ms,
     .hides = true,
     .draw = [](D& d, E& e) { on_and_off(e, module_of(d), "external_supply_mV 0", "external_supply_mV 12000"); }},
    // sensor
    {.name = "current_silent",
     .group = "current",
     .allowed = 300ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "sensor current", "silent", "talking"); }},
    {.name = "current_wrong",
     .group = "current",
     .allowed = 300ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "sensor current", "error on", "error off"); }},
    {.name = "current_out_high",
     .group = "current",
     .allowed = 450ms,
     .draw =
         [](D& d, E& e) {
           on_and_off(
               e, "sensor current",
               "value_mA " + std::to_string(d.config.limits.discharge_overcurrent.open / 1'000 * far_beyond_permille),
               "value_mA auto");
         }},
    {.name = "current_in_high",
     .group = "current",
     .allowed = 450ms,
     .draw =
         [](D& d, E& e) {
           on_and_off(
               e, "sensor current",
               "value_mA " + std::to_string(-d.config.limits.charge_overcurrent.open / 1'000 * far_beyond_permille),
               "value_mA auto");
         }},
    {.name = "pack_voltage_silent",
     .group = "voltage",
     .allowed = 310ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "sensor pack_voltage", "silent", "talking"); }},
    {.name = "link_voltage_silent",
     .group = "voltage",
     .allowed = 310ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "sensor link_voltage", "silent", "talking"); }},
    {.name = "pack_voltage_off",
     .group = "voltage",
     .allowed = 1s,
     .hides = true,
     .draw =
         [](D& d, E& e) {
           on_and_off(e, "sensor pack_voltage",
                      "offset_mV " + std::to_string((d.between(0, 1) == 0 ? 1 : -1) *
                                                    d.config.limits.pack_voltage_mismatch.open * 2),
                      "offset_mV 0");
         }},
    // power distribution unit and inputs
    {.name = "pdu_silent",
     .group = "pdu",
     .allowed = 300ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "pdu", "silent", "talking"); }},
    {.name = "pdu_damaged",
     .group = "pdu",
     .allowed = 300ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "pdu", "damaged_frames on", "damaged_frames off"); }},
    {.name = "emergency_stop",
     .group = "estop",
     .allowed = 20ms,
     .shortest = 2ms,
     .longest = 4s,
     .draw = [](D& d, E& e) { on_and_off(e, d.between(1, 2) == 1 ? "estop 1" : "estop 2", "pressed", "released"); }},
    {.name = "interlock",
     .group = "interlock",
     .allowed = 100ms,
     .shortest = 20ms,
     .draw = [](D&, E& e) { on_and_off(e, "interlock", "open", "closed"); }},
    {.name = "insulation_bad",
     .group = "insulation",
     .allowed = 1s,
     .shortest = 1s,
     .draw =
         [](D& d, E& e) {
           const bool is_measured = d.config.insulation.monitoring == InsulationMonitoring::measured;
           on_and_off(e, "insulation", is_measured ? "resistance_kOhm 1" : "monitor device_error",
                      is_measured ? "resistance_kOhm 1200" : "monitor normal");
         }},
    // contactors
    {.name = "auxiliary_open",
     .group = "contactor",
     .effect = opens_once,
     .allowed = 300ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "contactor main_positive", "feedback open", "feedback auto"); }},
    {.name = "contactor_drops",
     .group = "contactor",
     .effect = opens_once,
     .allowed = 300ms,
     .hides = true,
     .draw = [](D&, E& e) { on_and_off(e, "contactor main_negative", "stuck_open", "ok"); }},
    {.name = "welded",
     .group = "contactor",
     .effect = may_open,
     .draw = [](D&, E& e) { on_and_off(e, "contactor main_positive", "welded", "ok"); }},
    {.name = "no_precharge",
     .group = "contactor",
     .effect = may_open,
     .draw = [](D&, E& e) { on_and_off(e, "precharge", "resistance_Ohm 1000000000", "resistance_Ohm 100"); }},
    // the wire
    {.name = "loss",
     .group = "wire",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 600); },
     .begin = [](S& s, const E& e) { s.wire.lost_permille = static_cast<std::uint32_t>(e.amount); },
     .end = [](S& s, const E&) { s.wire.lost_permille = 0; }},
    {.name = "disorder",
     .group = "wire",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 300); },
     .begin =
         [](S& s, const E& e) {
           s.wire.late_permille = 300;
           s.wire.late_max = std::chrono::milliseconds{e.amount};
         },
     .end = [](S& s, const E&) { s.wire.late_permille = 0; }},
    {.name = "delay",
     .group = "wire",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d, E& e) { e.amount = d.between(1, 150); },
     .begin = [](S& s, const E& e) { s.wire.late_fixed = std::chrono::milliseconds{e.amount}; },
     .end = [](S& s, const E&) { s.wire.late_fixed = {}; }},
    {.name = "everything_late",
     .group = "port",
     .allowed = 400ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.latency = 300ms; },
     .end = [](S& s, const E&) { s.pack.latency = {}; }},
    {.name = "duplication",
     .group = "twice",
     .effect = stays_closed,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 300); },
     .begin = [](S& s, const E& e) { s.wire.twice_permille = static_cast<std::uint32_t>(e.amount); },
     .end = [](S& s, const E&) { s.wire.twice_permille = 0; }},
    {.name = "corruption",
     .group = "damage",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d, E& e) { e.amount = d.between(1, 100); },
     .begin = [](S& s, const E& e) { s.wire.damaged_permille = static_cast<std::uint32_t>(e.amount); },
     .end = [](S& s, const E&) { s.wire.damaged_permille = 0; }},
    {.name = "babble_strongest",
     .group = "flood",
     .allowed = 400ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.flood = CanFrame{.id = 0, .length = 8}; },
     .end = [](S& s, const E&) { s.pack.flood.reset(); }},
    {.name = "babble_as_pdu",
     .group = "flood",
     .allowed = 400ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.flood = damaged(internal_bus::pdu_status, 0); },
     .end = [](S& s, const E&) { s.pack.flood.reset(); }},
    {.name = "babble_as_module",
     .group = "flood",
     .effect = may_open,
     .hides = true,
     .draw = [](D& d, E& e) { e.amount = d.module().node; },
     .begin = [](S& s,
                 const E& e) { s.pack.flood = damaged(internal_bus::status, static_cast<std::uint8_t>(e.amount)); },
     .end = [](S& s, const E&) { s.pack.flood.reset(); }},
    {.name = "wire_cut",
     .group = "port",
     .allowed = 400ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.is_cut = true; },
     .end = [](S& s, const E&) { s.pack.is_cut = false; }},
    {.name = "port_down",
     .group = "port",
     .allowed = 100ms,
     .reached = in_the_core,
     .hides = true,
     .shortest = 20ms,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.set_port(false); },
     .end = [](S& s, const E&) { s.pack.set_port(true); }},
    {.name = "frames_swallowed",
     .group = "port",
     .allowed = 400ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.is_swallowing = true; },
     .end = [](S& s, const E&) { s.pack.is_swallowing = false; }},
    {.name = "sends_refused",
     .group = "port",
     .allowed = 400ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.pack.sends_fail = true; },
     .end = [](S& s, const E&) { s.pack.sends_fail = false; }},
    // Each frame of the master is disturbed until its controller is off the bus: 32 attempts, from its next frame on.
    {.name = "bus_off",
     .group = "port",
     .allowed = 150ms,
     .reached = in_the_core,
     .hides = true,
     .draw = [](D&, E&) {},
     .begin =
         [](S& s, const E&) {
           s.pack.bus().disturb = [](Station sender, const CanFrame&, TimePoint) -> std::optional<WireFault> {
             if (sender != Station::master) return {};
             return WireFault{.hurt = Hurt::sender};
           };
         },
     .end =
         [](S& s, const E&) {
           s.pack.bus().disturb = {};
           s.pack.bus().restart(Station::master, s.pack.now());
         }},
    {.name = "second_master",
     .group = "master",
     .effect = opens_once,
     .allowed = 100ms,
     .shortest = 200ms,
     .longest = 1s,
     .draw = [](D& d, E& e) { e.amount = d.between(0, 255); },
     .begin = [](S& s, const E& e) { s.pack.send_as_stranger(foreign_frame(e)); },
     .end = [](S&, const E&) {}},
    // the daemon and its machine
    {.name = "pause_short",
     .group = "daemon",
     .effect = may_open,
     .hides = true,
     .shortest = 20ms,
     .longest = 130ms,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E& e) { s.pack.stop(e.length()); },
     .end = [](S&, const E&) {}},
    {.name = "pause_long",
     .group = "daemon",
     .effect = opens_at_end,
     .allowed = 20ms,
     .reached = in_the_core,
     .hides = true,
     .shortest = 150ms,
     .longest = 5s,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E& e) { s.pack.stop(e.length()); },
     .end = [](S&, const E&) {}},
    {.name = "power_cut",
     .group = "daemon",
     .effect = opens_at_end,
     .allowed = 20ms,
     .reached = in_the_core,
     .hides = true,
     .shortest = 300ms,
     .longest = 6s,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.cut_power(); },
     .end = [](S& s, const E&) { s.boot(); }},
    {.name = "wall_clock",
     .group = "clock",
     .effect = stays_closed,
     .draw = [](D& d, E& e) { e.amount = d.between(0, 4); },
     .begin = set_wall_clock,
     .end =
         [](S& s, const E&) {
           s.wall_offset_ms = 0;
           s.tell_wall_clock();
         }},
    {.name = "machine_unwell",
     .group = "health",
     .effect = stays_closed,
     .draw = [](D& d, E& e) { e.amount = d.between(1, 15); },
     .begin = tell_health,
     .end = [](S& s, const E&) { s.pack.observe(HealthSeen{}); }},
    // The bus of a charger or inverter. The reaction to its silence is checked by the frames really received
    // (flow_oracle.hpp).
    {.name = "outer_loss",
     .group = "outer_wire",
     .effect = may_open,
     .happens = to_any_guest,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 900); },
     .begin = [](S& s, const E& e) { s.outer.wire.lost_permille = static_cast<std::uint32_t>(e.amount); },
     .end = [](S& s, const E&) { s.outer.wire.lost_permille = 0; }},
    {.name = "outer_disorder",
     .group = "outer_wire",
     .effect = may_open,
     .happens = to_any_guest,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 1'500); },
     .begin =
         [](S& s, const E& e) {
           s.outer.wire.late_permille = 300;
           s.outer.wire.late_max = std::chrono::milliseconds{e.amount};
         },
     .end = [](S& s, const E&) { s.outer.wire.late_permille = 0; }},
    {.name = "outer_delay",
     .group = "outer_wire",
     .effect = may_open,
     .happens = to_any_guest,
     .draw = [](D& d, E& e) { e.amount = d.between(1, 500); },
     .begin = [](S& s, const E& e) { s.outer.wire.late_fixed = std::chrono::milliseconds{e.amount}; },
     .end = [](S& s, const E&) { s.outer.wire.late_fixed = {}; }},
    {.name = "outer_duplication",
     .group = "outer_twice",
     .effect = stays_closed,
     .happens = to_any_guest,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 500); },
     .begin = [](S& s, const E& e) { s.outer.wire.twice_permille = static_cast<std::uint32_t>(e.amount); },
     .end = [](S& s, const E&) { s.outer.wire.twice_permille = 0; }},
    {.name = "outer_corruption",
     .group = "outer_damage",
     .effect = may_open,
     .happens = to_any_guest,
     .draw = [](D& d, E& e) { e.amount = d.between(10, 500); },
     .begin = [](S& s, const E& e) { s.outer.wire.damaged_permille = static_cast<std::uint32_t>(e.amount); },
     .end = [](S& s, const E&) { s.outer.wire.damaged_permille = 0; }},
    {.name = "outer_babble",
     .group = "outer_flood",
     .effect = may_open,
     .happens = to_any_guest,
     .draw = [](D& d, E& e) { e.amount = d.between(0, 1); },
     .begin =
         [](S& s, const E& e) {
           s.outer.flood = e.amount == 0 ? CanFrame{.id = 0, .length = 8} : wrong_word(s.pack.config());
         },
     .end = [](S& s, const E&) { s.outer.flood.reset(); }},
    {.name = "outer_port_down",
     .group = "outer_port",
     .effect = may_open,
     .happens = to_any_guest,
     .shortest = 20ms,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.outer.set_port(false, s.pack); },
     .end = [](S& s, const E&) { s.outer.set_port(true, s.pack); }},
    {.name = "outer_second_master",
     .group = "outer_master",
     .effect = may_open,
     .happens = to_any_guest,
     .draw = [](D&, E&) {},
     .begin = [](S& s, const E&) { s.outer.send_as_stranger(foreign_order(s.pack.config())); },
     .end = [](S&, const E&) {}},
    // the charger
    {.name = "mains_lost",
     .group = "mains",
     .effect = may_open,
     .happens = to_a_charger,
     .shortest = 300ms,
     .draw = [](D&, E& e) { on_and_off(e, "charger mains", "off", "on"); }},
    {.name = "charger_runs_away",
     .group = "charger_will",
     .effect = may_open,
     .happens = to_a_charger,
     .draw = [](D&, E& e) { on_and_off(e, "charger obeys", "nobody", "master"); }},
    {.name = "charger_keeps_on",
     .group = "charger_will",
     .effect = may_open,
     .happens = to_a_charger,
     .longest = 15s,
     .draw = [](D&, E& e) { on_and_off(e, "charger unstoppable", "on", "off"); }},
    // the inverter
    {.name = "inverter_silent",
     .group = "inverter_word",
     .effect = may_open,
     .happens = to_an_inverter,
     .longest = 16s,
     .draw = [](D&, E& e) { on_and_off(e, "inverter", "silent", "talking"); }},
    {.name = "inverter_failed",
     .group = "inverter_state",
     .effect = stays_closed,
     .happens = to_an_inverter,
     .draw = [](D&, E& e) { on_and_off(e, "inverter failed", "on", "off"); }},
    {.name = "inverter_wild",
     .group = "inverter_will",
     .effect = may_open,
     .happens = to_an_inverter,
     .draw = [](D&, E& e) { on_and_off(e, "inverter obeys", "nobody", "master"); }},
};

}  // namespace

std::span<const FaultKind> fault_kinds() {
  return kinds;
}

}  // namespace bmu::test
