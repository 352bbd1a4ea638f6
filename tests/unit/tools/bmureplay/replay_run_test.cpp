// Replayed parts of a recording, and the reports about the others.
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/recorded_run.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/bmureplay/options.hpp"
#include "tools/bmureplay/print.hpp"
#include "tools/bmureplay/run.hpp"

using namespace bmu;
using namespace bmu::replay;

namespace {

/// Four parts of 2.5 s.
std::string drive() {
  return test::recorded_run("0 pack soc_permille 800\n1 vehicle on\n+3 load current_A 20\n",
                            {.length = 10s, .part_length = 2'500ms});
}

Outcome outcome_of(const std::vector<std::string>& files, std::optional<PackConfig> other = std::nullopt) {
  PartReader reader(files);
  return run(reader, {.threads = 2, .other = std::move(other)});
}

Outcome outcome_of_text(const std::string& text) {
  const TemporaryFolder folder;
  return outcome_of({folder.file("drive.log", text)});
}

std::uint64_t line_number(const std::string& text, std::size_t at) {
  return static_cast<std::uint64_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')) + 1;
}

/// Turns the first tick of this second into a line without meaning.
std::string damaged_at(std::string text, const std::string& second) {
  text.replace(text.find(") tick ", text.find("\n# (" + second)) + 2, 1, "x");
  return text;
}

double not_run_s(const Damage& damage) {
  return static_cast<double>(damage.not_run_us) * 1e-6;
}

}  // namespace

TEST_CASE("a setting of the recording's clock is reported once with its size, and is no time that passed",
          "[unit][recording][clock][threads]") {
  constexpr std::int64_t s_us = 1'000'000;
  // A host without a battery-backed clock, which is set within the second part.
  const std::string text = test::recorded_run("0 pack soc_permille 800\n1 vehicle on\n+3 load current_A 20\n",
                                              {.length = 10s,
                                               .part_length = 2'500ms,
                                               .from_us = 12 * s_us,
                                               .clock_set_at = 4s,
                                               .clock_set_by_us = test::recorded_from_us - 12 * s_us});
  const Outcome outcome = outcome_of_text(text);
  INFO(outcome_text(outcome, ""));
  CHECK(to_s(outcome.counts.covered) == Approx(10.0).margin(0.2));
  REQUIRE(outcome.joins.size() == 1);
  CHECK(outcome.joins[0].text == "the clock was set forward by 1699999988.0 s");
  const std::size_t head = text.find("# ahead_us ");
  const std::size_t second_part = text.find("# ahead_us ", head + 1);
  CHECK(outcome.joins[0].line == line_number(text, text.find("# ahead_us ", second_part + 1)));
  CHECK(outcome_text(outcome, "").find("note: ") != std::string::npos);

  // Damage that begins before the setting and ends after it keeps its length.
  std::string torn = text;
  torn.replace(torn.find(") tick ", torn.find("\n# (15.")) + 2, 1, "x");
  const Outcome damaged = outcome_of_text(torn);
  INFO(outcome_text(damaged, ""));
  REQUIRE(damaged.damages.size() == 1);
  CHECK(not_run_s(damaged.damages[0]) == Approx(2.0).margin(0.1));
}

TEST_CASE("what was recorded before the first whole head is damage, and the first whole part is run",
          "[unit][recording][F106][threads]") {
  const std::string whole = drive();
  const std::size_t second = whole.find("# bmud-recording", 1);
  for (const std::size_t from : {std::size_t{30}, second / 2, second - 2'000}) {
    const std::string text = whole.substr(whole.find('\n', from) + 1);
    const Outcome outcome = outcome_of_text(text);
    INFO(outcome_text(outcome, ""));
    CHECK(outcome.not_replayable.empty());
    CHECK(outcome.counts.begun == 3);
    CHECK(to_s(outcome.counts.covered) == Approx(7.5).margin(0.2));
    REQUIRE(outcome.damages.size() == 1);
    CHECK(outcome.damages[0].text.find("header incomplete") == 0);
    CHECK(outcome.damages[0].goes_on_line == line_number(text, text.find("# bmud-recording")));
    CHECK(outcome.damages[0].not_run_us == 0);
    CHECK(exit_code_of(outcome) == exit_damaged);
  }
  // A file without any part that can be replayed is not a recording, whatever else there is.
  const TemporaryFolder folder;
  const std::string headless =
      folder.file("none.log", whole.substr(whole.find("\n(17") + 1, second - whole.find("\n(17") - 1));
  const Outcome none = outcome_of({folder.file("drive.log", whole), headless});
  CHECK(none.damages.empty());
  REQUIRE(none.not_replayable.size() == 1);
  CHECK(none.not_replayable[0].find(headless + ":1: header incomplete") == 0);
  CHECK(exit_code_of(none) == exit_not_replayable);
}

TEST_CASE("of a place that cannot be run it is said where it goes on and how much is left out",
          "[unit][recording][F106][threads]") {
  const std::string whole = drive();
  const std::string middle = damaged_at(whole, "1700000006");
  const Outcome in_the_middle = outcome_of_text(middle);
  REQUIRE(in_the_middle.damages.size() == 1);
  const std::size_t next = middle.find("# bmud-recording", middle.find(") xick"));
  CHECK(in_the_middle.damages[0].goes_on_line == line_number(middle, next));
  CHECK(not_run_s(in_the_middle.damages[0]) == Approx(1.5).margin(0.06));
  const std::string told = outcome_text(in_the_middle, "");
  INFO(told);
  CHECK(told.find(" s are not run; reading goes on at line " + std::to_string(line_number(middle, next)) + "\n") !=
        std::string::npos);
  CHECK(outcome_json(in_the_middle, "").find("\"not_run_s\": 1.") != std::string::npos);

  const Outcome at_the_end = outcome_of_text(damaged_at(whole, "1700000009"));
  REQUIRE(at_the_end.damages.size() == 1);
  CHECK(at_the_end.damages[0].goes_on_line == 0);
  CHECK(not_run_s(at_the_end.damages[0]) == Approx(1.0).margin(0.06));

  // The range in between is reported once, although the next part cannot be replayed either.
  for (const auto& [second, left_out_s] : {std::pair{"1700000004", 3.5}, std::pair{"1700000006", 4.0}}) {
    std::string two = damaged_at(whole, second);
    two.replace(two.find("# core-end ", two.find(") xick")), 11, "# core-end f");
    const Outcome both = outcome_of_text(two);
    REQUIRE(both.damages.size() == 2);
    CHECK(not_run_s(both.damages[0]) == Approx(left_out_s).margin(0.06));
    CHECK(both.damages[1].not_run_us == 0);
  }
}

TEST_CASE("a part that is damaged leaves the other configuration the next ones", "[unit][recording][F106][threads]") {
  const TemporaryFolder folder;
  const std::string whole = drive();
  for (const std::string& text : {damaged_at(whole, "1700000006"), whole.substr(whole.find("\n(17") + 1)}) {
    const Outcome outcome = outcome_of({folder.file("drive.log", text)}, test::demo_pack());
    INFO(outcome_text(outcome, "same.json"));
    CHECK(outcome.changes.is_empty());
    CHECK(outcome.damages.size() == 1);
    CHECK(outcome.damages[0].goes_on_line > 0);
    CHECK(to_s(outcome.counts.covered) > 7.0);
    CHECK(exit_code_of(outcome) == exit_damaged);
  }
}

TEST_CASE("another configuration that has other modules is what is wrong", "[unit][recording][threads]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", drive());
  const auto other = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
  REQUIRE(other);
  const Outcome outcome = outcome_of({file}, *other);
  CHECK(outcome.misfit == "does not fit " + file + ": it has 1 module, the recorded pack 4");
  CHECK(outcome.not_replayable.empty());
  CHECK(outcome.damages.empty());
  CHECK(exit_code_of(outcome) == exit_config);
}
