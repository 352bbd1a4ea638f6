#include "tools/mmusim/options.hpp"

#include "tools/common/command_line.hpp"

namespace bmu::sim {
namespace {

constexpr const char* description =
    "Answers the master in place of the devices on the internal bus (module units, current sensor, power distribution\n"
    "unit), from a scripted model of the pack, with its currents and its heat.";

constexpr const char* footer = R"(
Examples:
  mmusim --pack config/packs/demo-48s.json                              at rest on the pack's own bus, until Ctrl-C
  mmusim --pack config/packs/demo-48s.json --bus vcan0 --scenario vcan-fixtures/demo.scn --seconds 20
  mmusim --check --scenario my.scn --pack my.json                       is the script right for this pack?
  mmusim --properties                                                   what a script can say

A script has one event a line, TIME_S TARGET PROPERTY [VALUE], as in "12.3 cell 2.7 voltage_mV 2700";
docs/scenarios.md explains it. Events are told on standard error as they happen, a summary on standard output at the end.

Exit codes:
  0   ended by --seconds, SIGINT or SIGTERM; or the check found nothing
  1   the bus or another part of the system refused
  2   the command line is wrong
  65  the scenario is wrong or cannot be read: every problem is reported with line and column
  78  the pack file is wrong: every problem is reported)";

void declare(CLI::App& app, Options& options) {
  app.set_version_flag("--version", "mmusim " BMUD_VERSION);
  app.footer(footer);
  app.add_option("--pack", options.pack, "pack file: modules, kind of cell, sensor")->type_name("FILE");
  app.add_option("--bus", options.bus, "can0, vcan0 or unix:NAME; default: the pack's internal bus")->type_name("BUS");
  app.add_option("--scenario", options.scenario, "the script; without it nothing happens")->type_name("FILE");
  app.add_option("--seconds", options.seconds, "end after this time")->check(command_line::number(0.001, 1e6));
  app.add_option("--seed", options.seed, "of the measuring noise (0.2 mV, 20 mA); 0: none")
      ->check(command_line::whole_number(0))
      ->capture_default_str();
  app.add_flag("--quiet", options.is_quiet, "tell only errors");
  app.add_flag("--check", options.only_check, "check the scenario, and against the pack if one is given; then end");
  app.add_flag("--properties", options.only_properties, "print what a script can say, as a table; then end");
}

/// What CLI11 cannot check.
void conclude(const Options& options) {
  if (options.only_properties) return;
  if (options.only_check && options.scenario.empty()) {
    throw CLI::ValidationError("--scenario", "is missing: what shall be checked?");
  }
  if (!options.only_check && options.pack.empty()) {
    throw CLI::ValidationError("--pack", "is missing: which pack shall be emulated?");
  }
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  CLI::App app(description, "mmusim");
  Options options;
  try {
    declare(app, options);
    app.parse(argc, argv);
    conclude(options);
    return {options, exit_ok};
  } catch (const CLI::ParseError& error) {
    return {std::nullopt, command_line::report(app, error)};
  }
}

}  // namespace bmu::sim
