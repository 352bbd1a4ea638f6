// Lives from seeds, in the normal run; bmud_simulation takes thousands of them (docs/simulation.md).
#include <algorithm>
#include <set>
#include <string>

#include "tests/simulation/mutants.hpp"
#include "tests/simulation/sweep.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu::test {
namespace {

constexpr SeedRange usual_seeds{1, 40};
constexpr std::uint64_t charger_seed = 8;
constexpr std::uint64_t inverter_seed = 10;

Outcome life_of(std::uint64_t seed, TimePoint starts_at = WiredPack::start) {
  return live(draw_plan(seed), {.starts_at = starts_at});
}

Outcome life_without_guest(std::uint64_t seed) {
  return live(draw_plan(seed, false), {});
}

std::string told(const Outcome& outcome) {
  if (!outcome.violation) return "";
  return std::string(to_text(outcome.violation->rule)) + ": " + outcome.violation->text;
}

/// In this life the mutant is noticed, by the rule that it breaks before any other.
bool is_noticed(std::size_t index, std::uint64_t seed) {
  const Mutant mutant = make_mutants()[index];
  const Outcome outcome = live(draw_plan(seed), {.mutant = &mutant});
  return outcome.violation && outcome.violation->rule == mutant.noticed_by;
}

/// In its own life, or, where the plans have changed since, in another one.
bool is_noticed(std::size_t index) {
  constexpr std::uint64_t seeds = 300;
  const std::uint64_t own = make_mutants()[index].seed;
  if (own != 0 && is_noticed(index, own)) return true;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    if (is_noticed(index, seed)) return true;
  }
  return false;
}

Mutant hides_emergency_stop() {
  for (const Mutant& mutant : make_mutants()) {
    if (mutant.name == "does not see the emergency stop") return mutant;
  }
  return {};
}

bool overlap(const FaultEvent& one, const FaultEvent& other) {
  return one.begins_at <= other.ends_at && other.begins_at <= one.ends_at;
}

}  // namespace

TEST_CASE("lives with faults of every kind break no rule", "[simulation][seeds][BMS_F.1][F104][slow]") {
  const SweepResult result = sweep(usual_seeds, {.threads = 2});
  INFO(to_text(result));
  CHECK(result.failed.empty());
  CHECK(result.seeds == usual_seeds.last);
  CHECK(result.times_closed > result.seeds);  // each of them closes, at the end at the latest
}

// A seed that broke a rule once, and what it has shown: in the life that it was then, without a guest.
TEST_CASE(
    "119: a key that is turned right after a slow POLL closes the pack: all modules asked twice within 10 ms kept "
    "the current from coming",
    "[simulation][seeds][regression]") {
  CHECK(told(life_without_guest(119)).empty());
}
TEST_CASE("85, 672: a bus that was full for seconds comes back, and nothing closes",
          "[simulation][seeds][regression]") {
  CHECK(told(life_without_guest(85)).empty());
  CHECK(told(life_without_guest(672)).empty());
}

TEST_CASE("a life goes the same way twice", "[simulation][seeds][slow]") {
  for (const std::uint64_t seed : {3U, 22U}) CHECK(life_of(seed).hash == life_of(seed).hash);
  CHECK(life_of(3).hash != life_of(22).hash);
  for (const std::uint64_t seed : {charger_seed, inverter_seed}) CHECK(life_of(seed).hash == life_of(seed).hash);
}

TEST_CASE("who has no guest lives as if nobody had any", "[simulation][seeds]") {
  CHECK(draw_plan(charger_seed).guest == Guest::charger);
  CHECK(draw_plan(inverter_seed).guest == Guest::inverter);
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Plan plan = draw_plan(seed, false);
    CHECK(plan.guest == Guest::nobody);
    CHECK(plan.config->charger.driver == nullptr);
    CHECK(plan.config->inverter.driver == nullptr);
    if (draw_plan(seed).guest == Guest::nobody) CHECK(to_text(draw_plan(seed)) == to_text(plan));
  }
}

TEST_CASE("a life goes the same way wherever the clock stands: 2^31 and 2^32 of what it may be counted in come by",
          "[simulation][seeds][time][slow]") {
  constexpr std::int64_t half = 1LL << 31;
  constexpr std::int64_t whole = 1LL << 32;
  const Duration wraps[] = {std::chrono::microseconds{half},  std::chrono::microseconds{whole},
                            std::chrono::seconds{65'536},     std::chrono::milliseconds{half},
                            std::chrono::milliseconds{whole}, std::chrono::nanoseconds{1LL << 53},
                            std::chrono::seconds{half}};
  for (const std::uint64_t seed : {std::uint64_t{7}, charger_seed, inverter_seed}) {
    const std::uint64_t wanted = life_of(seed).hash;
    for (const Duration wrap : wraps) {
      INFO("seed " << seed << ", " << to_s(wrap) << " s");
      const Outcome outcome = life_of(seed, TimePoint{wrap - 20s});
      CHECK(told(outcome).empty());
      CHECK(outcome.hash == wanted);
    }
  }
}

TEST_CASE("every mutant is noticed, by the rule it breaks", "[simulation][seeds][mutants][slow]") {
  const std::vector<Mutant> mutants = make_mutants();
  for (std::size_t index = 0; index < mutants.size(); ++index) {
    INFO(mutants[index].name);
    CHECK(is_noticed(index));
  }
}

TEST_CASE("docs/simulation.md has the number of the mutants", "[simulation][docs]") {
  const std::string page = read_file(in_source("docs/simulation.md"));
  CHECK(page.find(" " + std::to_string(make_mutants().size()) + " mutants each do one thing wrong") !=
        std::string::npos);
}

TEST_CASE("what is left of a plan that fails still fails, and without any of its faults it does not",
          "[simulation][seeds]") {
  const Mutant mutant = hides_emergency_stop();
  const Plan whole = draw_plan(mutant.seed);
  const Outcome outcome = live(whole, {.mutant = &mutant});
  REQUIRE(outcome.violation);
  REQUIRE(whole.faults.size() > 1);
  Plan least = minimise(whole, outcome.violation->rule, {.mutant = &mutant});
  REQUIRE(least.faults.size() == 1);
  CHECK(least.faults[0].kind->name == "emergency_stop");
  CHECK(live(least, {.mutant = &mutant}).violation);
  CHECK(reproduction(whole.seed, {least.faults[0].number}) == "bmud_simulation --seed " + std::to_string(whole.seed) +
                                                                  " --only " + std::to_string(least.faults[0].number) +
                                                                  " --trace");
  keep_only(least, {});
  CHECK_FALSE(live(least, {.mutant = &mutant}).violation);
}

TEST_CASE("plans have every kind of fault, in order, and never two of a group at a time", "[simulation][seeds]") {
  std::set<std::string_view> drawn;
  std::set<std::string_view> packs;
  std::set<std::string_view> guests;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    const Plan plan = draw_plan(seed);
    packs.insert(plan.pack_name);
    if (plan.guest == Guest::charger) guests.insert(plan.config->charger.driver->name);
    if (plan.guest == Guest::inverter) guests.insert(plan.config->inverter.driver->name);
    for (std::size_t index = 0; index < plan.faults.size(); ++index) {
      const FaultEvent& fault = plan.faults[index];
      drawn.insert(fault.kind->name);
      CHECK(fault.length() >= fault.kind->shortest);
      CHECK(fault.length() <= fault.kind->longest);
      CHECK(fault.number == index + 1);
      CHECK(can_happen(*fault.kind, plan.guest));
      for (std::size_t other = 0; other < index; ++other) {
        const bool is_one_group = plan.faults[other].kind->group == fault.kind->group;
        CHECK_FALSE((is_one_group && overlap(plan.faults[other], fault)));
      }
    }
  }
  CHECK(drawn.size() == fault_kinds().size());
  CHECK(packs.size() == 11);
  std::set<std::string_view> all_guests;
  for (const ChargerDriver* driver : charger_drivers()) all_guests.insert(driver->name);
  for (const InverterDriver* driver : inverter_drivers()) all_guests.insert(driver->name);
  CHECK(guests == all_guests);
}

}  // namespace bmu::test
