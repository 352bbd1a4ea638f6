// What would have happened with other limits: told, and nothing else told.
#include "daemon/recording/what_if.hpp"

#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/record_writer.hpp"
#include "mmu/scenario.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;
using bmu::test::demo_pack;

namespace {

constexpr std::int64_t wall_us = 1'700'000'000'000'000;

/// Closes, drives, and opens because a cell is empty; recorded in two parts.
std::string recorded(const PackConfig& pack, const std::string& end = "+2 cell 2.7 voltage_mV 2700\n") {
  auto scenario =
      parse_scenario("0 pack soc_permille 800\n1 vehicle on\n+3 load current_A 20\n" + end, core_vocabulary());
  REQUIRE(scenario);
  VirtualRun run(pack.core, simulator_config(pack.core), *scenario);
  RecordWriter writer({.version = "0.1.0",
                       .buses = {.internal = "vcan0", .vehicle = "vcan0"},
                       .sources = pack.sources,
                       .hash = pack.core.hash});
  writer.begin(run.core(), run.now(), wall_us);
  run.set_tap(&writer);
  while (run.elapsed() < 3s) run.step();
  writer.begin(run.core(), run.now(), wall_us + 3'000'000, true);
  while (run.elapsed() < 10s) run.step();
  return writer.text();
}

struct Told {
  std::vector<WhatIfMove> moves;
  std::vector<WhatIfReport> reports;
  ReplayCounts counts;
  std::optional<RecordProblem> problem;

  [[nodiscard]] const WhatIfMove* find(std::string_view part, bool is_recorded) const {
    for (const WhatIfMove& move : moves) {
      if (move.is_recorded == is_recorded && move.text.find(part) != std::string::npos) return &move;
    }
    return nullptr;
  }
};

Told told(std::string_view text, const CoreConfig& other) {
  Told result;
  WhatIf what_if({.other = [&](const PackConfig&) -> Result<CoreConfig, std::string> { return other; },
                  .moves = [&](const WhatIfMove& move) { result.moves.push_back(move); },
                  .reports = [&](const WhatIfReport& report) { result.reports.push_back(report); }});
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (!what_if.take(line)) break;
    text.remove_prefix(line.size() + 1);
  }
  what_if.end();
  result.counts = what_if.counts();
  result.problem = what_if.problem();
  return result;
}

}  // namespace

TEST_CASE("with the same limits nothing would have gone otherwise", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  const Told same = told(recorded(pack), pack.core);
  REQUIRE_FALSE(same.problem);
  for (const WhatIfMove& move : same.moves) UNSCOPED_INFO(move.log_us << " " << move.text);
  CHECK(same.moves.empty());
  CHECK(same.reports.empty());
  CHECK(same.counts.ticks > 900);
  CHECK(same.counts.begun == 2);
}

TEST_CASE("a lower limit would have kept the pack closed", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.limits.cell_undervoltage.warn = 2'600'000;
  other.limits.cell_undervoltage.limit = 2'600'000;
  other.limits.cell_undervoltage.open = 2'500'000;
  const Told run = told(recorded(pack), other);
  REQUIRE_FALSE(run.problem);
  for (const WhatIfMove& move : run.moves)
    UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
  const WhatIfMove* const opened = run.find("contactors: all open", true);
  REQUIRE(opened);
  CHECK(opened->parts);
  CHECK(run.find("fault: a cell's voltage is too low", true) != nullptr);
  // The frames of a core that was not to open are given back to it: it does not believe its bus to be dead.
  CHECK(run.find("do not get onto the bus", false) == nullptr);
  CHECK(run.find("cell's voltage is too low", false) == nullptr);
  // A world whose contacts open although they are commanded closed is none to go on in.
  CHECK(run.find("auxiliary contact", false) == nullptr);
  // Up to the opening nothing differs but what the vehicle is told that it may take.
  for (const WhatIfMove& move : run.moves) CHECK(move.log_us >= wall_us + 5'900'000);
}

TEST_CASE("reports that would have said something else are told, each with both", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.vehicle.name[0] = 'X';
  const Told run = told(recorded(pack, ""), other);
  CHECK(run.moves.empty());
  CHECK(run.reports.size() == 10);  // one a second
  for (const WhatIfReport& report : run.reports) {
    CHECK(report.recorded.id == 0x620);
    CHECK(report.other.data[0] == 'X');
    CHECK(report.recorded.data[0] == static_cast<std::uint8_t>(pack.core.vehicle.name[0]));
  }
}

TEST_CASE("a higher limit would have opened a pack that stayed closed", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.limits.cell_undervoltage.warn = 3'990'000;
  other.limits.cell_undervoltage.limit = 3'980'000;
  other.limits.cell_undervoltage.open = 3'970'000;
  const Told run = told(recorded(pack, ""), other);
  REQUIRE_FALSE(run.problem);
  CHECK(run.find("cell's voltage is too low", false) != nullptr);
  const WhatIfMove* const opened = run.find("contactors: all open", false);
  REQUIRE(opened);
  CHECK(opened->parts);
  CHECK(run.find("", true) == nullptr);
}

TEST_CASE("a configuration that cannot take over the state is refused with the reason", "[unit][recording]") {
  const PackConfig pack = demo_pack();
  WhatIf what_if({.other = [](const PackConfig&) -> Result<CoreConfig, std::string> {
    return failure(std::string("too small"));
  }});
  const std::string text = recorded(pack);
  std::string_view rest = text;
  while (!rest.empty() && what_if.take(rest.substr(0, rest.find('\n')))) rest.remove_prefix(rest.find('\n') + 1);
  REQUIRE(what_if.problem());
  CHECK(what_if.problem()->kind == RecordProblemKind::other_pack);
  CHECK(what_if.problem()->text == "too small");
}

TEST_CASE("a leap of years within a recording is a gap for both, and takes no time", "[unit][recording]") {
  const PackConfig pack = demo_pack();
  const std::string text = recorded(pack, "");
  const Told as_recorded = told(text, pack.core);
  const std::string leap =
      "(1800000000.000000) vcan0 123#00 R\n"
      "# (1800000000.010000) tick 0000000000000000\n"
      "(1900000000.000000) vcan0 123#00 R\n"
      "(1900000000.000500) vcan0 123#00 R\n"
      "# (1900000000.010000) tick 0000000000000000\n";
  const Told run = told(text + leap, pack.core);
  REQUIRE_FALSE(run.problem);
  CHECK(run.counts.observations == as_recorded.counts.observations + 3);
  CHECK(run.counts.ticks == as_recorded.counts.ticks + 2);
  CHECK(run.find("stopped or starved for 99999", false) != nullptr);
}
