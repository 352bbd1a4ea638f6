// Replay with other limits: the differences are reported, and nothing else.
#include "daemon/recording/what_if.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"

using namespace bmu;
using bmu::test::demo_pack;

namespace {

constexpr std::int64_t wall_us = test::recorded_from_us;

/// Recording in two parts of a pack that closes, drives, and opens because a cell is empty.
std::string recorded(const PackConfig& pack, const std::string& end = "+2 cell 2.7 voltage_mV 2700\n") {
  return test::recorded_run(pack, "0 pack soc_permille 800\n1 vehicle on\n+3 load current_A 20\n" + end,
                            {.length = 10s, .part_length = 5s});
}

/// Recording of the same pack, started when it is closed.
std::string recorded_closed(const PackConfig& pack, const std::string& end) {
  return test::recorded_run(pack, "0 pack soc_permille 800\n1 vehicle on\n+4 load current_A 20\n" + end,
                            {.length = 12s, .begin_after = 5s});
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

/// Time at which closed contactors opened.
std::optional<std::int64_t> opened_at(std::string_view text, bool is_closed = false) {
  RecordReader reader;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(line.size() + 1);
    if (reader.take(line) != RecordReader::Took::of_tick) continue;
    const auto* const outputs = std::get_if<RecordOutputs>(&reader.line());
    if (outputs == nullptr) continue;
    if (is_closed && !outputs->outputs.any_contactor()) return reader.clock().to_log_us(reader.tick().at);
    is_closed = outputs->outputs.main_positive;
  }
  return std::nullopt;
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
  CHECK(run.find("fault: cell voltage too low", true) != nullptr);
  // The frames of a core that would not open are echoed to it: it does not consider its bus dead.
  CHECK(run.find("not transmitted in time", false) == nullptr);
  CHECK(run.find("cell voltage too low", false) == nullptr);
  // The replay does not continue with contacts that open although commanded closed.
  CHECK(run.find("auxiliary contact", false) == nullptr);
  // Up to the opening nothing differs but the limits reported to the vehicle.
  for (const WhatIfMove& move : run.moves) CHECK(move.log_us >= wall_us + 5'900'000);
}

TEST_CASE("reports that would have said something else are told, each with both", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.vehicle.name[0] = 'X';
  const Told run = told(recorded(pack, ""), other);
  CHECK(run.moves.empty());
  CHECK(run.reports.size() == 10);  // one per second
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
  CHECK(run.find("cell voltage too low", false) != nullptr);
  const WhatIfMove* const opened = run.find("contactors: all open", false);
  REQUIRE(opened);
  CHECK(opened->parts);
  CHECK(run.find("", true) == nullptr);
}

TEST_CASE("with stricter limits it opens when a pack with those limits would have opened", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  const std::string text = recorded(pack, "+2 cell 2.7 voltage_mV ..2600 over 3\n");
  for (const std::int32_t open_uV : {2'990'000, 2'950'000, 2'900'000, 2'850'000, 2'820'000, 2'810'000}) {
    PackConfig stricter = pack;
    stricter.core.limits.cell_undervoltage.open = open_uV;
    stricter.core.limits.cell_undervoltage.limit =
        std::max(open_uV, pack.core.limits.cell_undervoltage.limit.value_or(open_uV));
    const std::optional<std::int64_t> truth_us =
        opened_at(recorded(stricter, "+2 cell 2.7 voltage_mV ..2600 over 3\n"));
    REQUIRE(truth_us);
    const Told run = told(text, stricter.core);
    for (const WhatIfMove& move : run.moves)
      UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
    CAPTURE(open_uV, *truth_us);
    CHECK(run.find("does not answer", false) == nullptr);
    CHECK(run.find("does not answer", true) == nullptr);
    CHECK(run.find("too old", false) == nullptr);
    const WhatIfMove* const opened = run.find("contactors: all open", false);
    REQUIRE(opened);
    // The recorded core polled its modules every 100 ms: a value is confirmed at most this much later.
    CHECK(opened->log_us >= *truth_us - 20'000);
    CHECK(opened->log_us <= *truth_us + 120'000);
    CHECK(run.find("fault: cell voltage too low: cell 2.7 ", false) != nullptr);
  }
}

TEST_CASE("a core that asks more often than the recording's hears what the modules said last",
          "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.poll.period = 40ms;
  const Told run = told(recorded_closed(pack, ""), other);
  for (const WhatIfMove& move : run.moves)
    UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
  CHECK(run.moves.empty());
  CHECK(run.counts.ticks > 600);
}

TEST_CASE("an opening that comes a little later is told as that, with its reason", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.limits.cell_undervoltage.confirm += 30ms;
  const Told run = told(recorded(pack, "+2 cell 2.7 voltage_mV ..2600 over 3\n"), other);
  for (const WhatIfMove& move : run.moves)
    UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
  CAPTURE(run.moves.size());
  const WhatIfMove* const before = run.find("contactors: all open", true);
  const WhatIfMove* const later = run.find("fault: cell voltage too low", false);
  REQUIRE(before);
  REQUIRE(later);
  CHECK(later->log_us - before->log_us == Approx(30'000).margin(10'000));
  // The missing feedback of the contacts belongs to the recorded pack.
  CHECK(run.find("auxiliary contact", false) == nullptr);
}

TEST_CASE("contactors that close a few ticks apart are the same, not those that close at another time",
          "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  const std::string text = recorded(pack, "");
  const auto closes_otherwise = [&](Duration settle) {
    CoreConfig other = pack.core;
    other.contactors.settle = settle;
    const Told run = told(text, other);
    for (const WhatIfMove& move : run.moves)
      UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
    return run.find("contactors: ", true) != nullptr || run.find("contactors: ", false) != nullptr;
  };
  REQUIRE(pack.core.contactors.settle == 100ms);
  CHECK_FALSE(closes_otherwise(90ms));
  CHECK_FALSE(closes_otherwise(60ms));
  CHECK(closes_otherwise(20ms));
}

TEST_CASE("a module that falls silent in the recording is silent for both", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.poll.period = 70ms;
  const std::string text = recorded_closed(pack, "+2 module 3 silent\n");
  const Told run = told(text, other);
  for (const WhatIfMove& move : run.moves)
    UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
  const std::optional<std::int64_t> recorded_us = opened_at(text, true);
  REQUIRE(recorded_us);
  // It opens as well, at the same time except for its own poll rate.
  if (!run.moves.empty()) {
    const WhatIfMove* const open = run.find("contactors: all open", false);
    const WhatIfMove* const recorded_open = run.find("contactors: all open", true);
    REQUIRE((open != nullptr || recorded_open != nullptr));
    const std::int64_t at_us = (open != nullptr ? open : recorded_open)->log_us;
    CHECK(std::llabs(at_us - *recorded_us) < 150'000);
  }
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

TEST_CASE("while the machine stood still in the recording, the second core decides nothing",
          "[unit][recording][FS_6][slow]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  other.limits.cell_undervoltage.open = pack.core.limits.cell_undervoltage.open - 100'000;
  const std::string script = "0 pack soc_permille 800\n1 vehicle on\n+2 load current_A 20\n";
  // From waiting for the modules to driving; short and long stops: within a tick's tolerance, below and above a stall.
  for (Duration at = 200ms; at < 3s; at += 170ms) {
    for (const Duration length : {15ms, 30ms, 60ms, 110ms, 129ms, 140ms, 300ms}) {
      const Told run =
          told(test::recorded_run(pack, script, {.length = 4s, .stops_at = at, .stops_for = length}), other);
      CAPTURE(at.count(), length.count());
      REQUIRE_FALSE(run.problem);
      CHECK(run.counts.ticks > 300);
      for (const WhatIfMove& move : run.moves)
        UNSCOPED_INFO(move.log_us << (move.is_recorded ? " not " : " but ") << move.text);
      CHECK(run.moves.empty());
      CHECK(run.reports.empty());
    }
  }
}

TEST_CASE("what would have opened the second core while the machine stood still opens it when that goes on",
          "[unit][recording][FS_6][slow]") {
  const PackConfig pack = demo_pack();
  CoreConfig other = pack.core;
  // A single sample is sufficient, and urgent for the second core alone.
  other.limits.discharge_overcurrent.warn = 25'000;
  other.limits.discharge_overcurrent.open = 30'000;
  other.limits.discharge_overcurrent.confirm = 0ms;
  const std::string script = "0 pack soc_permille 800\n1 vehicle on\n5 load current_A 40\n";
  const auto opened_at_us = [&](Duration at, Duration length) {
    const Told run = told(test::recorded_run(pack, script, {.length = 7s, .stops_at = at, .stops_for = length}), other);
    REQUIRE_FALSE(run.problem);
    const WhatIfMove* const opened = run.find("contactors: all open", false);
    REQUIRE(opened);
    return opened->log_us - wall_us;
  };
  const std::int64_t without_stop_us = opened_at_us({}, {});
  int later_count = 0;
  for (Duration at = 4'950ms; at < 5'050ms; at += 1ms) {
    const std::int64_t at_us = std::chrono::duration_cast<std::chrono::microseconds>(at).count();
    const std::int64_t opened_us = opened_at_us(at, 100ms);
    CAPTURE(at_us, opened_us, without_stop_us);
    const bool is_before = without_stop_us <= at_us + 1'000;
    CHECK(opened_us >= (is_before ? without_stop_us : at_us + 100'000));
    later_count += is_before ? 0 : 1;
  }
  CHECK(later_count > 0);
}

TEST_CASE("before the first tick of a recording the second core decides nothing, however long that takes",
          "[unit][recording]") {
  const PackConfig pack = demo_pack();
  const std::string text = recorded(pack, "");
  std::string without_ticks;
  int lines = 0;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n') + 1);
    rest.remove_prefix(line.size());
    const bool is_tick = line.find(" tick ") != std::string_view::npos && line.starts_with("# (");
    const bool is_of_tick = line.starts_with("# > ") || line.starts_with("# = ") || line.starts_with("# ! ");
    if (!is_tick && !is_of_tick) without_ticks += line;
    lines += line.starts_with('(') ? 1 : 0;
    if (lines == 100) break;
  }
  // Urgent for the second core alone, and no frame for six years.
  CoreConfig other = pack.core;
  other.limits.cell_undervoltage.open = 3'990'000;
  const Told run = told(without_ticks + "(1900000000.000000) vcan0 123#00 R\n", other);
  CHECK(run.counts.observations > 10);
  CHECK(run.counts.ticks == 0);
}

TEST_CASE("a leap of years within a recording is a gap for both, and takes no time", "[unit][recording]") {
  const PackConfig pack = demo_pack();
  const std::string text = recorded(pack, "");
  const Told as_recorded = told(text, pack.core);
  const std::string leap =
      "(1800000000.000000) vcan0 123#00 R\n"
      "# (1800000000.010000) tick 0000000000000000 00000000\n"
      "(1900000000.000000) vcan0 123#00 R\n"
      "(1900000000.000500) vcan0 123#00 R\n"
      "# (1900000000.010000) tick 0000000000000000 00000000\n";
  const Told run = told(text + leap, pack.core);
  REQUIRE_FALSE(run.problem);
  CHECK(run.counts.observations == as_recorded.counts.observations + 3);
  CHECK(run.counts.ticks == as_recorded.counts.ticks + 2);
  CHECK(run.find("control loop: stalled for 99999", false) != nullptr);
}
