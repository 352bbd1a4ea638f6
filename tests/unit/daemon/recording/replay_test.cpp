// Replay of recordings: identical, or the first difference.
#include "daemon/recording/replay.hpp"

#include <string>
#include <vector>

#include "daemon/recording/base64.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"

using namespace bmu;
using bmu::test::demo_pack;

namespace {

/// Recording of a pack that closes, drives, and opens because a cell is empty; from `from` on.
std::string recorded(const PackConfig& pack, Duration from) {
  return test::recorded_run(pack,
                            "0 pack soc_permille 800\n"
                            "1 vehicle on\n"
                            "+3 load current_A 20\n"
                            "+2 cell 2.7 voltage_mV 2700\n"
                            "+3 vehicle off\n",
                            {.length = 10s, .begin_after = from});
}

struct Replayed {
  ReplayCounts counts;
  std::vector<ReplayDifference> differences;
  std::vector<RecordProblem> alterations;
  std::optional<RecordProblem> problem;
};

Replayed replayed(std::string_view text) {
  Replayed run;
  Replay replay({.differs = [&](const ReplayDifference& one) { run.differences.push_back(one); },
                 .altered = [&](const RecordProblem& one) { run.alterations.push_back(one); }});
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (!replay.take(text.substr(at, end - at))) break;
    at = end + 1;
  }
  replay.end();
  run.counts = replay.counts();
  run.problem = replay.problem();
  return run;
}

}  // namespace

TEST_CASE("a recording decides again what it decided, from whenever it began", "[unit][recording][FS_6]") {
  const PackConfig pack = demo_pack();
  for (const Duration from : {Duration{0ms}, Duration{2'345ms}, Duration{6'000ms}}) {
    const Replayed run = replayed(recorded(pack, from));
    if (run.problem) FAIL("line " << run.problem->line << ": " << run.problem->text);
    CHECK(run.counts.ticks_different == 0);
    CHECK(run.counts.ticks > 300);
    CHECK(run.counts.observations > 1'000);
    CHECK(run.counts.begun == 1);
    CHECK(to_s(run.counts.covered) == Approx(10.0 - to_s(from)).margin(0.05));
  }
}

TEST_CASE("a frame that was another one is found at the tick that it changes", "[unit][recording][FS_6]") {
  std::string text = recorded(demo_pack(), 0ms);
  const std::size_t sent = text.find("\n# > vcan0 040#", text.find(" tick ", text.size() / 2));
  REQUIRE(sent != std::string::npos);
  text[sent + 16] = text[sent + 16] == '0' ? '1' : '0';
  CHECK(replayed(text).counts.ticks_different == 0);  // the lines are for people; only the fingerprint is compared

  const std::size_t tick = text.find(" tick ", text.size() / 2);
  text[tick + 6] = text[tick + 6] == '0' ? '1' : '0';
  const Replayed run = replayed(text);
  CHECK(run.counts.ticks_different == 1);
  REQUIRE(run.differences.size() == 1);
  CHECK(run.differences[0].line > 1);
  CHECK(run.differences[0].recorded == run.differences[0].replayed);
}

TEST_CASE("lines that are missing, changed or added are named, and the recording goes on", "[unit][recording][F106]") {
  const std::string text = recorded(demo_pack(), 0ms);
  const std::size_t half = text.find(" tick ", text.size() / 2);
  const std::size_t line_begin = text.find("\n(17", half) + 1;
  const std::size_t line_end = text.find('\n', line_begin) + 1;
  const auto line_number_of = [&text](std::size_t at) {
    return static_cast<std::uint64_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')) +
           1;
  };
  const std::uint64_t tick_line = line_number_of(text.rfind("\n# (", line_begin) + 1);
  const auto altered = [&](const char* what, const std::string& changed) {
    CAPTURE(what);
    const Replayed run = replayed(changed);
    CHECK_FALSE(run.problem);
    CHECK(run.counts.ticks > 900);
    REQUIRE(run.alterations.size() == 1);
    CHECK(run.alterations[0].line == tick_line);
    CHECK(run.alterations[0].text.find("the lines from here to line ") == 0);
  };
  std::string changed = text;
  changed.erase(line_begin, line_end - line_begin);
  altered("missing", changed);
  changed = text;
  changed.insert(line_end, text.substr(line_begin, line_end - line_begin));
  altered("twice", changed);
  changed = text;
  char& digit = changed[changed.find('#', line_begin) + 1];
  digit = digit == '0' ? '1' : '0';
  altered("changed", changed);
  changed = text;
  changed.insert(line_end, "# a person's own words\n\n");
  CHECK(replayed(changed).alterations.empty());
  CHECK(replayed(text).alterations.empty());
}

TEST_CASE("a recording that is damaged is run as far as it is good", "[unit][recording][F106]") {
  const std::string text = recorded(demo_pack(), 0ms);
  const auto problem_of = [&](std::string_view old_part, std::string_view new_part) {
    std::string changed = text;
    const std::size_t at = changed.find(old_part);
    REQUIRE(at != std::string::npos);
    changed.replace(at, old_part.size(), new_part);
    const Replayed run = replayed(changed);
    REQUIRE(run.problem);
    INFO(run.problem->text);
    CHECK(run.problem->line > 0);
    return run.problem->text;
  };
  CHECK(problem_of("# bmud-recording 1", "# bmud-recording 2") == "found a recording of format '2', expected 1");
  CHECK(problem_of("# pack | {", "# pack | {{").find("the recorded configuration: ") == 0);
  CHECK(problem_of("\"name\":", "\"name\" :").find("found configuration ") == 0);
  CHECK(problem_of("# image AAAA", "# image AAA-").find("expected base64") == 0);
  CHECK(problem_of("# core-end ", "# core-end f").find("the state of the core is damaged") == 0);
  const std::string altered_head = "the header was modified: a line is missing, changed or added";
  CHECK(problem_of("# version 0.1.0\n", "# version 0.1.1\n") == altered_head);
  CHECK(problem_of("# version 0.1.0\n", "") == altered_head);
  CHECK(problem_of("# version 0.1.0\n", "# version 0.1.0\n# internal_kbit_per_s 500\n") == altered_head);
  CHECK(problem_of(") tick ", ") tack ").find("column ") == 0);
  CHECK(problem_of("# ahead_us ", "# ahead_us x") == "expected the offset of the clocks in microseconds");

  // Truncated in the middle of a line: all ticks before it are valid.
  const Replayed torn = replayed(std::string_view(text).substr(0, text.size() - 25));
  CHECK(torn.counts.ticks > 900);
  CHECK(torn.counts.ticks_different == 0);
}

TEST_CASE("a pack file with other line ends comes back from its recording as it was", "[unit][recording]") {
  PackSources sources = demo_pack().sources;
  std::string text;
  for (const char letter : sources.pack_text) text += letter == '\n' ? std::string("\r\n") : std::string(1, letter);
  sources.pack_text = text;
  const auto pack = parse_pack_config(sources);
  REQUIRE(pack);
  const Replayed run = replayed(recorded(*pack, 0ms));
  if (run.problem) FAIL("line " << run.problem->line << ": " << run.problem->text);
  CHECK(run.counts.ticks > 900);
  CHECK(run.counts.ticks_different == 0);
}

TEST_CASE("a recording whose lines were given other ends is refused by that name", "[unit][recording][F106]") {
  std::string text;
  for (const char letter : recorded(demo_pack(), 9s)) text += letter == '\n' ? "\r\n" : std::string(1, letter);
  const Replayed run = replayed(text);
  REQUIRE(run.problem);
  CHECK(run.problem->text == "found lines that end in CR LF, expected LF as written; remove the CRs with tr -d '\\r'");
}

TEST_CASE("an empty line between a decision and its lines changes nothing", "[unit][recording][F106]") {
  std::string text = recorded(demo_pack(), 0ms);
  for (std::size_t at = text.find("\n# >"); at != std::string::npos; at = text.find("\n# >", at + 100'000)) {
    text.insert(at, "\n");
  }
  const Replayed run = replayed(text);
  CHECK_FALSE(run.problem);
  CHECK(run.counts.ticks_different == 0);
}

TEST_CASE("times that no core can have had are refused", "[unit][recording][F106]") {
  const std::string text = recorded(demo_pack(), 0ms);
  for (const char* time : {"(999999999999.000000)", "(0000000000.000001)"}) {
    std::string changed = text;
    const std::size_t tick = changed.rfind("# (", changed.find(") tick ", changed.size() / 2));
    changed.replace(tick + 2, changed.find(')', tick) - tick - 1, time);
    const Replayed run = replayed(changed);
    CAPTURE(time);
    REQUIRE(run.problem);
    CHECK(run.problem->text.find("found a time before that of the previous line") == 0);
  }
}

TEST_CASE("a frame before the head is refused", "[unit][recording]") {
  const Replayed run = replayed("# bus internal vcan0\n(1700000000.000000) vcan0 143#11 R\n");
  REQUIRE(run.problem);
  CHECK(run.problem->line == 2);
}

TEST_CASE("a bus that no log can name is refused", "[unit][recording][F106]") {
  for (const std::string& name : {std::string("two words"), std::string("a\x7F"), std::string(64, 'c')}) {
    const Replayed run = replayed("# bmud-recording 1\n# bus vehicle " + name + "\n");
    CAPTURE(name);
    REQUIRE(run.problem);
    CHECK(run.problem->line == 2);
    CHECK(run.problem->text.find("expected an interface name") == 0);
  }
}

TEST_CASE("bytes as text of RFC 4648", "[unit][recording]") {
  const auto bytes = [](std::string_view text) { return std::vector<std::uint8_t>(text.begin(), text.end()); };
  const std::pair<const char*, const char*> rows[] = {{"", ""},
                                                      {"f", "Zg=="},
                                                      {"fo", "Zm8="},
                                                      {"foo", "Zm9v"},
                                                      {"foob", "Zm9vYg=="},
                                                      {"fooba", "Zm9vYmE="},
                                                      {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, coded] : rows) {
    CHECK(to_base64(bytes(plain)) == coded);
    std::vector<std::uint8_t> back;
    REQUIRE(append_base64(coded, back));
    CHECK(back == bytes(plain));
  }
  std::vector<std::uint8_t> none;
  for (const char* wrong : {"Zg=", "Zg==Zg==", "Z===", "Zm9-", "=Zm9"}) CHECK_FALSE(append_base64(wrong, none));
}
