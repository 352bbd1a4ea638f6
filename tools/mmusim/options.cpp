#include "tools/mmusim/options.hpp"

#include <utility>

#include "daemon/shell/cli/command_line.hpp"

namespace bmu::sim {
namespace {

constexpr const char* description =
    "Emulates the devices of the internal bus (modules, current sensor, PDU) from a pack model with currents and\n"
    "temperatures. If the pack file has modules of another manufacturer, these are emulated with their protocol.";

constexpr const char* footer = R"(
Examples:
  mmusim --pack config/packs/demo-48s.json                              at rest on the pack's own bus, until Ctrl-C
  mmusim --pack config/packs/demo-48s.json --bus vcan0 --scenario vcan-fixtures/demo.scn --seconds 20
  mmusim --pack config/packs/demo-48s.json --with-master --scenario vcan-fixtures/undervoltage.scn
  mmusim --pack config/packs/demo-48s.json --with-master --scenario vcan-fixtures/demo.scn --record drive.log
                                                                        a test without bus and daemon, in milliseconds
  mmusim --pack config/packs/demo-48s.json --events -                   type "vehicle on", "cell 2.7 voltage_mV 2700"
  mmusim --check --scenario my.scn --pack my.json                       checks the script for this pack
  mmusim --properties                                                   lists the properties of a script

A script has one event per line, TIME_S TARGET PROPERTY [VALUE], e.g. "12.3 cell 2.7 voltage_mV 2700", or a condition,
e.g. "wait contactor main_positive open within 0.3"; docs/scenarios.md explains it. Events are shown on standard error
as they happen, a summary on standard output at the end. A script that ends the run, or fails, ends this program.

Exit codes:
  0   the conditions of the script held; or there are none, and --seconds, SIGINT or SIGTERM ended the run; or the check
      passed
  1   error of the bus or of another part of the system
  2   the command line is wrong
  3   a condition of the script did not hold, or the run ended (also by --seconds or a signal) before it was decided: line,
      expected and found state
  65  the scenario is wrong or cannot be read: every problem is reported with line and column
  78  the pack file is wrong: every problem is reported)";

/// Nine frames of each module then still take a fifth of the default poll period.
constexpr std::uint64_t frame_spacing_max_us = 2'000;

void declare(CLI::App& app, Options& options) {
  app.set_version_flag("--version", "mmusim " BMUD_VERSION);
  app.footer(footer);
  app.add_option("--pack", options.pack, "pack file: modules, kind of cell, sensor")->type_name("FILE");
  app.add_option("--bus", options.bus, "can0, vcan0 or unix:NAME; default: the pack's internal bus")->type_name("BUS");
  app.add_option("--charger-bus", options.charger_bus,
                 "bus of the charger, if the pack file has one that is driven; default: the one in the pack file")
      ->type_name("BUS");
  app.add_option("--vehicle-bus", options.vehicle_bus,
                 "bus of the vehicle, on which a display requests data, if the pack file has such requests answered; "
                 "default: the one in the pack file")
      ->type_name("BUS");
  app.add_option("--inverter-bus", options.inverter_bus,
                 "bus of the inverter, if the pack has one; default: the one in the pack file")
      ->type_name("BUS");
  app.add_option("--second-pack-bus", options.second_pack_bus,
                 "bus of the pack beside this one, if the pack file has one; default: the one in the pack file")
      ->type_name("BUS");
  app.add_option("--scenario", options.scenario, "the script; default: no events")->type_name("FILE");
  app.add_option("--events", options.events,
                 "events of a script without their time, one per line, read from this pipe; -: from standard input")
      ->check([](const std::string& pipe) { return pipe.empty() ? "found nothing, expected a pipe, or -" : ""; })
      ->type_name("PIPE");
  app.add_option("--seconds", options.seconds, "end after this time")->check(command_line::number(0.001, 1e6));
  app.add_option("--seed", options.seed,
                 "of what a script leaves to chance and of the measuring noise (0.2 mV, 20 mA); "
                 "0: no noise")
      ->check(command_line::whole_number(0))
      ->capture_default_str();
  app.add_option("--frame-spacing-us", options.frame_spacing_us,
                 "from one frame of a module's answer to its next, as small controllers need it; "
                 "0: all of them with the next millisecond")
      ->check(command_line::whole_number(0, frame_spacing_max_us))
      ->capture_default_str();
  app.add_flag("--with-master", options.has_master,
               "run the daemon's core beside the pack, without a bus, as fast as possible");
  app.add_option("--record", options.record, "with --with-master: record all observations and decisions, for bmureplay")
      ->type_name("FILE");
  app.add_flag("--virtual-time", options.is_virtual, "the same without a master: the emulated pack alone");
  app.add_flag("--json", options.is_json, "the result as JSON on standard output");
  app.add_flag("--quiet", options.is_quiet, "print errors only");
  app.add_flag("--check", options.only_check, "check the scenario, with the pack if one is given, then exit");
  app.add_flag("--properties", options.only_properties,
               "print all properties a script can set or test as a table, then exit");
}

void refuse_buses_in_virtual_time(const Options& options) {
  if (!options.is_virtual) return;
  const std::pair<const char*, const std::string&> named[] = {{"--bus", options.bus},
                                                              {"--charger-bus", options.charger_bus},
                                                              {"--vehicle-bus", options.vehicle_bus},
                                                              {"--inverter-bus", options.inverter_bus},
                                                              {"--second-pack-bus", options.second_pack_bus}};
  for (const auto& [option, bus] : named) {
    if (!bus.empty()) throw CLI::ValidationError(option, "not allowed with --virtual-time or --with-master");
  }
}

/// Checks that CLI11 cannot make.
void conclude(const Options& options) {
  if (options.only_properties) return;
  if (options.only_check && options.scenario.empty()) {
    throw CLI::ValidationError("--scenario", "required with --check");
  }
  if (!options.record.empty() && !options.has_master) {
    throw CLI::ValidationError("--record", "requires --with-master (on a bus use bmud --record)");
  }
  if (options.is_virtual && !options.events.empty()) {
    throw CLI::ValidationError("--events", "not allowed in virtual time, which does not wait for events");
  }
  if (!options.only_check && options.pack.empty()) {
    throw CLI::ValidationError("--pack", "required");
  }
  refuse_buses_in_virtual_time(options);
  if (options.is_virtual && !options.only_check && options.scenario.empty() && !options.seconds) {
    throw CLI::ValidationError("--seconds", "required without a scenario");
  }
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  CLI::App app(description, "mmusim");
  Options options;
  try {
    declare(app, options);
    command_line::add_self_description(app, 1);
    app.parse(argc, argv);
    options.is_virtual = options.is_virtual || options.has_master;
    conclude(options);
    return {options, exit_ok};
  } catch (const CLI::ParseError& error) {
    return {std::nullopt, command_line::report(app, error)};
  }
}

}  // namespace bmu::sim
