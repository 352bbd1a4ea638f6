// bmud_simulation: runs drawn from seeds, and the long run (docs/simulation.md).
#include <chrono>
#include <cstdio>
#include <iostream>
#include <thread>

#include <unistd.h>

#include "daemon/shell/cli/command_line.hpp"
#include "tests/simulation/long_life.hpp"
#include "tests/simulation/sweep.hpp"

namespace bmu::test {
namespace {

constexpr int exit_failed = 1;                       // a rule was broken
constexpr std::int64_t memory_growth_most_kB = 512;  // of pages that were never touched before

struct Options {
  std::optional<std::uint64_t> seed;
  std::string seeds = "1..1000";
  std::vector<std::size_t> only;
  bool is_traced = false;
  bool minimises = false;
  bool has_no_guests = false;
  bool is_json = false;
  double days = 0.0;
  bool ticks_fully = false;
  unsigned threads = std::max(std::thread::hardware_concurrency(), 1U);
};

std::optional<SeedRange> parse_range(const std::string& text) {
  SeedRange range;
  unsigned long long first = 0;
  unsigned long long last = 0;
  int end = 0;
  if (std::sscanf(text.c_str(), "%llu..%llu%n", &first, &last, &end) != 2) return {};
  if (static_cast<std::size_t>(end) != text.size() || first > last) return {};
  range.first = first;
  range.last = last;
  return range;
}

int run_one(const Options& options) {
  Plan plan = draw_plan(*options.seed, !options.has_no_guests);
  if (!options.only.empty()) keep_only(plan, options.only);
  if (options.is_traced) std::cout << to_text(plan);
  LifeOptions life;
  if (options.is_traced) life.trace = &std::cout;
  const Outcome outcome = live(plan, life);
  std::printf("seed %llu, %s: %zu faults, %.1f s, decisions %016llx\n", static_cast<unsigned long long>(plan.seed),
              std::string(plan.pack_name).c_str(), outcome.faults.size(), to_s(outcome.lived),
              static_cast<unsigned long long>(outcome.hash));
  if (!outcome.violation) return exit_codes::exit_ok;
  std::printf("FAILED at %.3f s: %s: %s\n", to_s(outcome.violation->at),
              std::string(to_text(outcome.violation->rule)).c_str(), outcome.violation->text.c_str());
  std::vector<std::size_t> least = options.only;
  if (options.minimises) {
    least.clear();
    for (const FaultEvent& fault : minimise(plan, outcome.violation->rule, {}).faults) least.push_back(fault.number);
  }
  std::printf("    %s\n", reproduction(plan.seed, least, !options.has_no_guests).c_str());
  return exit_failed;
}

int run_many(const Options& options, SeedRange seeds) {
  SweepOptions sweep_options{
      .threads = options.threads, .minimises = options.minimises, .has_guests = !options.has_no_guests};
  const std::uint64_t all = seeds.last - seeds.first + 1;
  if (isatty(STDERR_FILENO) != 0) {
    sweep_options.progress = [all](std::uint64_t done) {
      std::fprintf(stderr, "\r%llu of %llu seeds%s", static_cast<unsigned long long>(done),
                   static_cast<unsigned long long>(all), done == all ? "\n" : "");
    };
  }
  const SweepResult result = sweep(seeds, sweep_options);
  std::cout << (options.is_json ? to_json(result) : to_text(result));
  return result.failed.empty() ? exit_codes::exit_ok : exit_failed;
}

int run_long(const Options& options) {
  LongOptions life{.length = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(options.days * 86'400)),
                   .ticks_fully = options.ticks_fully};
  if (isatty(STDERR_FILENO) != 0) {
    life.progress = [](Duration lived) { std::fprintf(stderr, "\r%.2f days", to_s(lived) / 86'400); };
  }
  const auto began_at = std::chrono::steady_clock::now();
  const LongResult result = live_long(life);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_at).count();
  std::printf("%s%.0f s, %.0f times as fast as real time\n", to_text(result).c_str(), took_s,
              to_s(result.lived) / took_s);
  const bool is_well = result.wrong.empty() && result.allocations == 0 &&
                       result.memory_last_kB <= result.memory_first_kB + memory_growth_most_kB;
  return is_well ? exit_codes::exit_ok : exit_failed;
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Lives of a pack with faults, drawn from seeds and judged: docs/simulation.md");
  app.add_option("--seed", options.seed, "One seed");
  app.add_option("--only", options.only, "Of its faults only those with these numbers")->delimiter(',');
  app.add_option("--seeds", options.seeds, "From one seed to another, on all processors")->capture_default_str();
  app.add_flag("--trace", options.is_traced, "With --seed: print the plan and what happens");
  app.add_flag("--minimise", options.minimises, "Leave faults out as long as the same rule is broken");
  app.add_flag("--no-guests", options.has_no_guests,
               "Everybody lives as if there were no chargers and inverters on a bus");
  app.add_flag("--json", options.is_json, "With --seeds: the summary as JSON");
  app.add_option("--threads", options.threads, "How many lives at the same time")->capture_default_str();
  app.add_option("--days", options.days, "One long life of so many days instead")
      ->check(command_line::number(0.01, 1000));
  app.add_flag("--fully", options.ticks_fully, "With --days: the core is called every 10 ms at night, too");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return command_line::report(app, error);
  }
  if (options.days > 0.0) return run_long(options);
  if (options.seed) return run_one(options);
  const std::optional<SeedRange> range = parse_range(options.seeds);
  if (range) return run_many(options, *range);
  std::fprintf(stderr, "bmud_simulation: --seeds %s: expected FROM..TO\n", options.seeds.c_str());
  return exit_codes::exit_usage;
}

}  // namespace
}  // namespace bmu::test

int main(int argc, char** argv) {
  return bmu::test::run(argc, argv);
}
