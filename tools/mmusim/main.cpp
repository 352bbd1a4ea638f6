// mmusim: emulates modules, power distribution unit, current sensor and pack on a bus, as directed by a script.
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "config/pack_config.hpp"
#include "daemon/shell/system/whole_file.hpp"
#include "tools/common/bus_text.hpp"
#include "tools/common/virtual_run.hpp"
#include "tools/mmusim/options.hpp"
#include "tools/mmusim/run.hpp"
#include "tools/mmusim/virtual.hpp"

namespace {

using namespace bmu;
using namespace bmu::sim;

constexpr std::int32_t noise_of_cells_uV = 200;
constexpr std::int32_t noise_of_current_mA = 20;

void complain(const std::string& text) {
  std::fprintf(stderr, "mmusim: %s\n", text.c_str());
}

std::optional<std::string> read_file(const std::string& name) {
  std::ifstream stream(name, std::ios::binary);
  if (!stream) return std::nullopt;
  std::string text;
  std::array<char, 4096> part{};
  while (stream.read(part.data(), part.size()) || stream.gcount() > 0) {
    text.append(part.data(), static_cast<std::size_t>(stream.gcount()));
  }
  return stream.bad() ? std::nullopt : std::optional(std::move(text));
}

/// Valid lines are still checked against the pack, so that all problems of a script are reported at once.
std::optional<ScenarioReading> load_script(const Options& options) {
  if (options.scenario.empty()) return ScenarioReading{};
  const std::optional<std::string> text = read_file(options.scenario);
  // On a bus the master is another process: its state cannot be queried.
  const bool has_vocabulary = options.has_master || options.only_check;
  if (text) return read_scenario(*text, has_vocabulary ? core_vocabulary() : MasterVocabulary{});
  complain(options.scenario + ": cannot be read: " + std::strerror(errno));
  return std::nullopt;
}

void add_problems_with_pack(ScenarioReading& script, const SimulatorConfig& config) {
  const ScenarioProblems more = check_against(script.scenario, config);
  script.problems.insert(script.problems.end(), more.begin(), more.end());
  std::stable_sort(script.problems.begin(), script.problems.end(),
                   [](const ScenarioProblem& one, const ScenarioProblem& other) { return one.line < other.line; });
}

std::optional<PackConfig> load_pack(const std::string& file) {
  Result<PackConfig, ConfigProblems> pack = load_pack_config(file);
  if (!pack) {
    for (const ConfigProblem& problem : pack.error()) complain(to_text(problem));
    return std::nullopt;
  }
  return std::move(*pack);
}

SimulatorConfig config_for(const Options& options, const PackConfig& pack) {
  SimulatorConfig config = simulator_config(pack.core);
  config.seed = options.seed;
  const Duration frame_spacing = std::chrono::microseconds{options.frame_spacing_us};
  for (MmuConfig& module : config.modules) module.frame_spacing = frame_spacing;
  config.foreign.frame_spacing = frame_spacing;
  config.cell_noise_uV = options.seed == 0 ? 0 : noise_of_cells_uV;
  config.current_noise_mA = options.seed == 0 ? 0 : noise_of_current_mA;
  return config;
}

int tell_check(const Options& options, const Scenario& scenario, const std::optional<PackConfig>& pack) {
  std::printf(
      "%s: ok, %zu lines%s\n", options.scenario.c_str(), scenario.lines.size(),
      pack ? (" for " + pack->name).c_str() : "; without --pack, whether a pack has these cells is not checked");
  return exit_ok;
}

BusNames bus_names(const Options& options, const PackConfig& pack) {
  return pack.buses.with({.internal = options.bus,
                          .vehicle = options.vehicle_bus,
                          .charger = options.charger_bus,
                          .second_pack = options.second_pack_bus,
                          .inverter = options.inverter_bus});
}

bool is_there(Port port, const CoreConfig& pack) {
  switch (port) {
    case Port::internal: return true;
    case Port::charger: return pack.charger.driver != nullptr;
    case Port::inverter: return pack.inverter.driver != nullptr;
    case Port::second_pack: return pack.second_pack.base_id != 0;
    case Port::vehicle: return pack.vehicle.request_id != 0;
  }
  return false;
}

/// Opens one port per bus, because two ports of one program would receive each other's frames. None: one of them cannot
/// be opened; the reason has been printed.
std::optional<RunPorts> open_ports(const BusNames& names, const CoreConfig& pack) {
  RunPorts ports{.served_by = served_by(names)};
  for (const Port port : all_ports) {
    if (!is_there(port, pack)) continue;
    const Port serving = ports.served_by.at(static_cast<std::size_t>(port));
    std::unique_ptr<BusPort>& bus = ports.ports.at(static_cast<std::size_t>(serving));
    if (bus != nullptr) continue;
    auto opened = open_bus(names.name(port), PortOptions{});
    if (!opened) {
      complain(open_failure_text(names.name(port), opened.error()));
      return std::nullopt;
    }
    bus = std::move(*opened);
  }
  return ports;
}

int run_on_bus(const Options& options, const PackConfig& pack, SimulatorConfig config, Scenario scenario) {
  std::optional<LiveEvents> events;
  if (!options.events.empty()) {
    auto opened = LiveEvents::open(options.events);
    if (!opened) {
      complain(to_text(opened.error()));
      return exit_system;
    }
    events = std::move(*opened);
  }
  std::optional<RunPorts> ports = open_ports(bus_names(options, pack), pack.core);
  if (!ports) return exit_system;
  config.served_by = ports->served_by;
  const TimePoint now = monotonic_now();
  Simulator simulator(config, std::move(scenario), now);
  Run run(options, simulator, std::move(*ports), std::move(events), now);
  const Result<void, OsError> ended = run.run();
  if (!ended) complain(to_text(ended.error()));
  simulator.script().conclude(simulator.now());
  const int code = tell_result(options, run.result());
  return ended ? code : exit_system;
}

int run(const Options& options) {
  if (options.only_properties) {
    std::printf("%s\n%s", property_table_markdown().c_str(), state_table_markdown().c_str());
    return exit_ok;
  }
  // The pack is read before the scenario: both are reported if both are wrong, and the exit code is the pack's.
  std::optional<PackConfig> pack;
  if (!options.pack.empty()) pack = load_pack(options.pack);
  std::optional<ScenarioReading> script = load_script(options);
  const SimulatorConfig config = pack ? config_for(options, *pack) : SimulatorConfig{};
  if (script && pack) add_problems_with_pack(*script, config);
  if (script) {
    for (const ScenarioProblem& problem : script->problems) complain(to_text(problem, options.scenario));
  }
  if (!options.pack.empty() && !pack) return exit_config;
  const std::string cell_file = pack ? pack->sources.cell_name : "";
  if (const std::string same = same_file_among(options.record, {options.pack, options.scenario, cell_file});
      !same.empty()) {
    complain("--record: '" + same + "' is an input file, expected another path");
    return exit_usage;
  }
  if (!script || !script->problems.empty()) return exit_data;
  if (options.only_check) return tell_check(options, script->scenario, pack);
  if (options.is_virtual) return run_virtual(options, *pack, config, std::move(script->scenario));
  return run_on_bus(options, *pack, config, std::move(script->scenario));
}

/// Blocks the stop signals until they are read from a descriptor, so that they do not end the program earlier.
void block_stop_signals() {
  sigset_t stops{};
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  sigprocmask(SIG_BLOCK, &stops, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
  const ParsedOptions parsed = parse_options(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  block_stop_signals();
  return run(*parsed.options);
}
