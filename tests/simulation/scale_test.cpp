// docs/scale.md: the duration of poll cycles on a bus with exact lengths, compared with that of the bits alone; and a
// test that the bound for pack files is one.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "config/checks/bus_budget.hpp"
#include "daemon/core/modules/poll_schedule.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/polled_pack.hpp"

namespace bmu::test {
namespace {

const std::string page_file = test::in_source("docs/scale.md");
const std::string begin_mark = "<!-- begin of the tables: written by BMUD_REWRITE=1 test_simulation \"[docs]\" -->\n";
const std::string end_mark = "<!-- end of the tables -->\n";

constexpr std::size_t module_counts[] = {1, 4, 8, 16, 32, 63};
constexpr Duration default_period = PollConfig{}.period;

std::string text_of(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}
double in_ms(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}
double ratio(Duration one, Duration other) {
  return static_cast<double>(one.count()) / static_cast<double>(other.count());
}

Duration longest_cycle(const CoreConfig& config, std::int32_t rate_kbit_per_s) {
  const std::optional<Duration> cycle = cycle_time_max(config, all_wants, rate_kbit_per_s);
  REQUIRE(cycle);
  return *cycle;
}

Duration shortest_period(const CoreConfig& config, std::int32_t rate_kbit_per_s) {
  const std::optional<Duration> period = period_min(config, rate_kbit_per_s);
  REQUIRE(period);
  return *period;
}

/// Polled at the default period or, if it is too short, at the shortest possible one, rounded up to ten milliseconds,
/// as pack files may have it.
CoreConfig polled(std::size_t modules, std::int32_t rate_kbit_per_s) {
  CoreConfig config = pack_of(modules);
  const Duration least = shortest_period(config, rate_kbit_per_s);
  config.poll.period =
      std::max<Duration>(default_period, std::chrono::ceil<std::chrono::milliseconds>(least / 10) * 10);
  for (Duration AgeConfig::*age : {&AgeConfig::cell_voltage, &AgeConfig::temperature, &AgeConfig::module_status,
                                   &AgeConfig::pack_current, &AgeConfig::pack_voltage, &AgeConfig::pdu_status}) {
    config.ages.*age = 4 * config.poll.period;
  }
  return config;
}

struct Run {
  std::size_t modules = 0;
  std::int32_t rate_kbit_per_s = 0;
  CoreConfig config;
  std::vector<PollCycle> cycles;
  PollCycle typical;  // the one in the middle
  PollCycle longest;
  double load = 0.0;
};

constexpr std::int64_t periods_of_settling = 50;  // identities, limits, and messages that are sent once
constexpr std::int64_t periods_measured = 60;

Run run(std::size_t modules, std::int32_t rate_kbit_per_s, Pace pace) {
  Run result{.modules = modules, .rate_kbit_per_s = rate_kbit_per_s, .config = polled(modules, rate_kbit_per_s)};
  PolledPack pack(result.config, std::int64_t{rate_kbit_per_s} * 1'000, pace);
  static_cast<void>(pack.run(periods_of_settling * result.config.poll.period));
  const Duration before = pack.busy();
  const Duration measured_for = periods_measured * result.config.poll.period;
  result.cycles = pack.run(measured_for);
  result.load = ratio(pack.busy() - before, measured_for);
  const std::int64_t with_identities = measured_for / identity_period + 1;
  REQUIRE(std::ssize(result.cycles) >= periods_measured - with_identities - 1);  // and those at both ends
  std::vector<PollCycle> sorted = result.cycles;
  std::sort(sorted.begin(), sorted.end(), [](const auto& one, const auto& other) { return one.took < other.took; });
  result.typical = sorted[sorted.size() / 2];
  result.longest = sorted.back();
  return result;
}

const std::vector<Run>& all_runs(Pace pace) {
  static std::vector<Run> by_pace[3];
  std::vector<Run>& runs = by_pace[static_cast<std::size_t>(pace)];
  if (!runs.empty()) return runs;
  for (const std::int32_t rate_kbit_per_s : bus_rates_kbit_per_s) {
    for (const std::size_t modules : module_counts) runs.push_back(run(modules, rate_kbit_per_s, pace));
  }
  return runs;
}

/// The most modules of 12 cells that a pack file with default period and ages may have: all answers fit between two
/// polls, and the ages leave room for one lost answer and the longest cycle.
std::size_t modules_by_age(std::int32_t rate_kbit_per_s) {
  std::size_t most = 0;
  for (std::size_t modules = 1; modules <= modules_max; ++modules) {
    const Duration cycle = longest_cycle(pack_of(modules), rate_kbit_per_s);
    const AgeConfig ages;
    const bool is_in_time = shortest_period(pack_of(modules), rate_kbit_per_s) <= default_period;
    const bool fits = is_in_time && 2 * default_period + cycle <= ages.cell_voltage;
    if (fits) most = modules;
  }
  return most;
}
std::size_t modules_by_load(std::int32_t rate_kbit_per_s) {
  std::size_t most = 0;
  for (std::size_t modules = 1; modules <= modules_max; ++modules) {
    if (bus_load_permille(pack_of(modules), default_period, rate_kbit_per_s) <= bus_load_max_permille) {
      most = modules;
    }
  }
  return most;
}

// --- the page -------------------------------------------------------------------------------------------------------

std::string cycle_table() {
  std::string text =
      "| modules | kbit/s | minimum, ms | measured, ms | ratio | with all others, ms | at the next millisecond, ms | "
      "paced modules, ms | bound, ms |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (std::size_t index = 0; index < all_runs(Pace::prompt).size(); ++index) {
    const Run& one = all_runs(Pace::prompt)[index];
    const Run& ticked = all_runs(Pace::ticked)[index];
    const Run& paced = all_runs(Pace::paced)[index];
    text += "| " + std::to_string(one.modules) + " | " + std::to_string(one.rate_kbit_per_s) + " | " +
            text_of(in_ms(one.typical.minimum), 2) + " | " + text_of(in_ms(one.typical.took), 2) + " | " +
            text_of(ratio(one.typical.took, one.typical.minimum), 3) + " | " + text_of(in_ms(one.longest.took), 2) +
            " | " + text_of(in_ms(ticked.typical.took), 2) + " | " + text_of(in_ms(paced.typical.took), 2) + " | " +
            text_of(in_ms(longest_cycle(one.config, one.rate_kbit_per_s)), 1) + " |\n";
  }
  return text;
}

std::string load_table() {
  std::string text =
      "| modules | kbit/s | poll period, ms | load measured, % | load at worst, % |\n|---|---|---|---|---|\n";
  for (const Run& one : all_runs(Pace::prompt)) {
    const std::int64_t worst = bus_load_permille(one.config, one.config.poll.period, one.rate_kbit_per_s);
    text += "| " + std::to_string(one.modules) + " | " + std::to_string(one.rate_kbit_per_s) + " | " +
            std::to_string(to_ms(one.config.poll.period)) + " | " + text_of(100.0 * one.load, 1) + " | " +
            text_of(static_cast<double>(worst) / 10.0, 1) + " |\n";
  }
  return text;
}

std::string most_table() {
  std::string text = "| kbit/s | most modules | cells | without a warning of the load |\n|---|---|---|---|\n";
  for (const std::int32_t rate_kbit_per_s : bus_rates_kbit_per_s) {
    const std::size_t most = modules_by_age(rate_kbit_per_s);
    text += "| " + std::to_string(rate_kbit_per_s) + " | " + std::to_string(most) + " | " + std::to_string(12 * most) +
            " | " + std::to_string(std::min(most, modules_by_load(rate_kbit_per_s))) + " |\n";
  }
  return text;
}

std::string tables() {
  return "\n### Poll cycles\n\n" + cycle_table() + "\n### Load\n\n" + load_table() + "\n### Largest packs\n\n" +
         most_table() + "\n";
}

}  // namespace

TEST_CASE("a poll cycle takes at most 1.10 times what its bits take", "[simulation][scale][BMS_F.2][slow]") {
  for (const Run& one : all_runs(Pace::prompt)) {
    INFO(one.modules << " modules at " << one.rate_kbit_per_s << " kbit/s");
    CHECK(ratio(one.typical.took, one.typical.minimum) <= 1.10);
    for (const PollCycle& cycle : one.cycles) {
      REQUIRE(cycle.took >= cycle.minimum);  // a minimum
      REQUIRE(ratio(cycle.took - cycle.others, cycle.minimum) <= 1.10);
    }
  }
}

TEST_CASE("no measured cycle is longer than the bound that pack files are judged by", "[simulation][scale][slow]") {
  for (const Pace pace : {Pace::prompt, Pace::ticked, Pace::paced}) {
    for (const Run& one : all_runs(pace)) {
      INFO(one.modules << " modules at " << one.rate_kbit_per_s << " kbit/s");
      CHECK(one.longest.took <= longest_cycle(one.config, one.rate_kbit_per_s));
    }
  }
}

TEST_CASE("modules that look at their bus once a millisecond and answer in one go take a millisecond more at most",
          "[simulation][scale][slow]") {
  for (std::size_t index = 0; index < all_runs(Pace::ticked).size(); ++index) {
    const Run& ticked = all_runs(Pace::ticked)[index];
    INFO(ticked.modules << " modules at " << ticked.rate_kbit_per_s << " kbit/s");
    for (const PollCycle& cycle : ticked.cycles) {
      REQUIRE(cycle.took - cycle.others <= cycle.minimum * 11 / 10 + 1ms);
    }
  }
}

TEST_CASE("no measured load is higher than the one that pack files are judged by", "[simulation][scale][slow]") {
  for (const Run& one : all_runs(Pace::prompt)) {
    INFO(one.modules << " modules at " << one.rate_kbit_per_s << " kbit/s");
    const std::int64_t worst = bus_load_permille(one.config, one.config.poll.period, one.rate_kbit_per_s);
    CHECK(1'000.0 * one.load <= static_cast<double>(worst));
    CHECK(1'000.0 * one.load >= 0.75 * static_cast<double>(worst));  // and it is not too high
  }
}

TEST_CASE("docs/scale.md says what is measured", "[simulation][scale][docs][slow]") {
  std::ifstream stream(page_file, std::ios::binary);
  std::stringstream committed;
  committed << stream.rdbuf();
  const std::string page = committed.str();
  const std::size_t first = page.find(begin_mark);
  const std::size_t last = page.find(end_mark);
  REQUIRE(first != std::string::npos);
  REQUIRE(last != std::string::npos);
  const std::size_t from = first + begin_mark.size();
  if (std::getenv("BMUD_REWRITE") != nullptr) {
    std::ofstream(page_file, std::ios::binary) << page.substr(0, from) + tables() + page.substr(last);
    return;
  }
  INFO("to write it anew: BMUD_REWRITE=1 test_simulation \"[docs]\"");
  CHECK(page.substr(from, last - from) == tables());
}

}  // namespace bmu::test
