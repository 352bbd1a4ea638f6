// mmusim: modules, power distribution unit, current sensor and pack on a bus, as a script wants them.
#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>

#include "config/pack_config.hpp"
#include "tools/mmusim/options.hpp"
#include "tools/mmusim/run.hpp"

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

void report(const ScenarioProblems& problems, const std::string& file) {
  for (const ScenarioProblem& problem : problems) complain(to_text(problem, file));
}

std::optional<Scenario> load_scenario(const std::string& file) {
  if (file.empty()) return Scenario{};
  const std::optional<std::string> text = read_file(file);
  if (!text) {
    complain(file + ": cannot be read");
    return std::nullopt;
  }
  Result<Scenario, ScenarioProblems> scenario = parse_scenario(*text);
  if (!scenario) {
    report(scenario.error(), file);
    return std::nullopt;
  }
  return std::move(*scenario);
}

std::optional<PackConfig> load_pack(const std::string& file) {
  Result<PackConfig, ConfigProblems> pack = load_pack_config(file);
  if (!pack) {
    for (const ConfigProblem& problem : pack.error()) complain(to_text(problem));
    return std::nullopt;
  }
  return std::move(*pack);
}

int run_on_bus(const Options& options, const PackConfig& pack, Scenario scenario) {
  SimulatorConfig config = simulator_config(pack.core);
  config.seed = options.seed;
  config.cell_noise_uV = options.seed == 0 ? 0 : noise_of_cells_uV;
  config.current_noise_mA = options.seed == 0 ? 0 : noise_of_current_mA;
  if (const ScenarioProblems problems = check_against(scenario, config); !problems.empty()) {
    report(problems, options.scenario);
    return exit_scenario;
  }
  if (options.only_check) {
    std::printf("%s: ok, %zu events for %s\n", options.scenario.empty() ? "no scenario" : options.scenario.c_str(),
                scenario.events.size(), pack.name.c_str());
    return exit_ok;
  }

  auto port = open_bus(options.bus.empty() ? pack.buses.internal : options.bus, PortOptions{});
  if (!port) {
    complain(to_text(port.error()));
    return exit_system;
  }
  const TimePoint now = monotonic_now();
  Simulator simulator(config, std::move(scenario), now);
  Run run(options, simulator, std::move(*port), now);
  const Result<void, OsError> ended = run.run();
  if (!ended) complain(to_text(ended.error()));
  if (!options.is_quiet) run.print_summary();
  return ended ? exit_ok : exit_system;
}

int run(const Options& options) {
  if (options.only_properties) {
    std::fputs(property_table_markdown().c_str(), stdout);
    return exit_ok;
  }
  // Pack before scenario: both are reported when both are wrong, and the code is the pack's.
  std::optional<PackConfig> pack;
  if (!options.pack.empty()) pack = load_pack(options.pack);
  std::optional<Scenario> scenario = load_scenario(options.scenario);
  if (!options.pack.empty() && !pack) return exit_pack;
  if (!scenario) return exit_scenario;
  return pack ? run_on_bus(options, *pack, std::move(*scenario)) : exit_ok;
}

/// Stop signals come through a descriptor, so they must not end the program before.
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
