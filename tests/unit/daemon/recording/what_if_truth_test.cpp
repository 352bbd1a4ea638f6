// Results of bmureplay --config compared with a pack that has the other configuration: nothing is invented.
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/what_if.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"

using namespace bmu;
using bmu::test::demo_pack;

namespace {

constexpr std::int64_t wall_us = test::recorded_from_us;

/// Demonstration pack with one text of its files replaced.
PackConfig changed_pack(std::string_view was, std::string_view becomes) {
  PackSources sources = demo_pack().sources;
  const std::size_t at = sources.pack_text.find(was);
  REQUIRE(at != std::string::npos);
  sources.pack_text.replace(at, was.size(), becomes);
  auto pack = parse_pack_config(sources);
  if (!pack) FAIL(to_text(pack.error().front()));
  return *pack;
}

/// Kind of an event, without the cell, the value and the limit.
std::string kind_of(std::string_view text) {
  const std::size_t first = text.find(": ");
  if (first == std::string_view::npos) return std::string(text);
  return std::string(text.substr(0, text.find(": ", first + 2)));
}

struct Happened {
  std::int64_t log_us = 0;
  std::string kind;
};

std::vector<Happened> events_of(std::string_view text) {
  std::vector<Happened> events;
  RecordReader reader;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(line.size() + 1);
    if (reader.take(line) != RecordReader::Took::of_tick) continue;
    const auto* const event = std::get_if<RecordEvent>(&reader.line());
    if (event != nullptr) events.push_back({reader.clock().to_log_us(reader.tick().at), kind_of(event->text)});
  }
  return events;
}

bool has(const std::vector<Happened>& events, const WhatIfMove& move) {
  constexpr std::int64_t near_us = 300'000;
  for (const Happened& event : events) {
    if (event.kind == kind_of(move.text) && std::llabs(event.log_us - move.log_us) <= near_us) return true;
  }
  return false;
}

/// Every event reported for the second core really happens, and those reported for the recorded core only do not.
void hold_against_truth(std::string_view script, Duration length, const PackConfig& other) {
  const std::string then = test::recorded_run(script, length);
  const std::vector<Happened> truth = events_of(test::recorded_run(other, script, {.length = length}));
  std::vector<WhatIfMove> moves;
  WhatIf what_if({.other = [&](const PackConfig&) -> Result<CoreConfig, std::string> { return other.core; },
                  .moves = [&](const WhatIfMove& move) { moves.push_back(move); }});
  std::string_view rest = then;
  while (!rest.empty() && what_if.take(rest.substr(0, rest.find('\n')))) rest.remove_prefix(rest.find('\n') + 1);
  what_if.end();
  REQUIRE_FALSE(what_if.problem());
  for (const WhatIfMove& move : moves) {
    const bool is_command = (move.text.find("contactors: ") == 0 && move.text.find(" -> ") == std::string::npos) ||
                            move.text.find("outputs: ") == 0;
    const bool hangs_on_phase = move.text.find("SOC: initialised to") == 0;  // phase of the polls
    if (is_command || hangs_on_phase) continue;
    CAPTURE(move.log_us - wall_us, move.text, move.is_recorded);
    CHECK(has(truth, move) != move.is_recorded);
  }
}

constexpr std::string_view load_script =
    "0 pack soc_permille 500\n"
    "2 vehicle on\n"
    "5 load current_A 0..75 over 3\n"
    "12 load current_A 0\n"
    "14 load current_A ..95 over 4\n"
    "24 load current_A 0\n";

}  // namespace

TEST_CASE("another warning level tells of the warning, and makes no fault up", "[unit][recording][FS_6]") {
  hold_against_truth(load_script, 26s, changed_pack("\"warn_mA\": 70000", "\"warn_mA\": 62000"));
}

TEST_CASE("another poll period makes nothing up", "[unit][recording][FS_6]") {
  for (const char* period : {"40", "50", "80", "90"}) {
    CAPTURE(period);
    hold_against_truth(load_script, 26s,
                       changed_pack("\"period_ms\": 100,", "\"period_ms\": " + std::string(period) + ","));
  }
}

TEST_CASE("a laxer limit of temperature makes nothing up", "[unit][recording][FS_6]") {
  hold_against_truth(
      "0 pack soc_permille 600\n2 vehicle on\n5 load current_A 20\n8 cell 2.5 temperature_dC 250..620 over 20\n", 45s,
      changed_pack("\"warn_dC\": 500, \"open_dC\": 580", "\"warn_dC\": 520, \"open_dC\": 600"));
}

TEST_CASE("balancing that is switched off makes no switch disobey", "[unit][recording][FS_6][slow]") {
  hold_against_truth(
      "0 pack soc_permille 900\n0 cell 1.3 soc_permille 930\n0 cell 2.2 soc_permille 915\n2 vehicle on\n"
      "5 load current_A -5\n60 load current_A 0\n",
      200s, changed_pack("\"balancing\": {\"enabled\": true", "\"balancing\": {\"enabled\": false"));
}
