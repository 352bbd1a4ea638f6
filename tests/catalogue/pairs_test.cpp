// Row 104: two faults at once. Row 105: a fault in each step of the closing.
#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "mmu/random.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr std::uint64_t usual_seed = 1;
constexpr int pairs_a_run = 60;

struct Opening {
  const Case* what;
  Duration allowed;
};

/// Cases of rows 1 to 30 that open a closed pack.
std::vector<Opening> openings() {
  std::vector<Opening> cases;
  for (const Row* row : all_rows()) {
    if (row->number > 30 || !row->state.empty()) continue;
    for (const Case& one : row->cases) {
      if (one.outcome == Outcome::opens && one.in_phase == Phase::closed && one.fit == nullptr)
        cases.push_back({&one, row->allowed});
    }
  }
  return cases;
}

/// The second does not undo the first: both forging the same frames may make right ones of them.
bool can_be_together(const Case& one, const Case& other, const WiredPack& pack) {
  WiredPack with_one = pack;
  WiredPack with_other = pack;
  one.inject(with_one);
  other.inject(with_other);
  return !(with_one.on_sent && with_other.on_sent) && !(with_one.each_ms && with_other.each_ms);
}

Duration configured(const Case& one, const Pack& pack) {
  return one.configured(pack.config, *find_fault(one.fault));
}

std::uint64_t seed() {
  const char* const wanted = std::getenv("BMUD_SEED");
  return wanted == nullptr ? usual_seed : std::strtoull(wanted, nullptr, 10);
}

}  // namespace

TEST_CASE("F104: two faults at once open within the shorter of their times", "[catalogue][F104]") {
  const std::vector<Opening> cases = openings();
  REQUIRE(cases.size() > 25);
  const std::uint64_t used = seed();
  RandomSource random(used);
  for (int round = 0; round < pairs_a_run;) {
    const Pack& config = packs()[random.next() % packs().size()];
    const Opening& first = cases[random.next() % cases.size()];
    const Opening& second = cases[random.next() % cases.size()];
    const Case& one = *first.what;
    const Case& other = *second.what;
    WiredPack pack = closed_pack(config);
    for (const Case* each : {&one, &other}) {
      if (each->prepare) each->prepare(pack);
    }
    pack.run(Duration{1ms} * static_cast<std::int64_t>(random.next() % 500));
    if (!can_be_together(one, other, pack)) continue;
    ++round;
    const Duration allowed = std::min(first.allowed, second.allowed);
    INFO("pair " << round << ": " << one.what << "; " << other.what << "; pack of " << config.name);
    INFO("to repeat: BMUD_SEED=" << used << " test_catalogue \"[F104]\"");
    const TimePoint broken_at = pack.now();
    one.inject(pack);
    other.inject(pack);
    const bool is_opened = pack.run_until([](const WiredPack& now) { return is_open(now, Until::command); }, 2s);
    REQUIRE(is_opened);
    CHECK(pack.now() - broken_at <= allowed);
    pack.run(13s);
    CHECK_FALSE(pack.coils_are_driven());
  }
}

namespace {

struct Step {
  std::string_view name;
  Phase phase;
};
constexpr Step steps[] = {{"main negative", Phase::main_negative},
                          {"precharge", Phase::precharge},
                          {"main positive", Phase::main_positive},
                          {"closed", Phase::closed}};

}  // namespace

/// In each step of the closing, at its beginning and at every few milliseconds of it, a fault does what it does in a
/// closed pack, and in the same time. A fault that only shows in a closed pack (a current, a contact) is none here.
TEST_CASE("F105: a fault in a step of the closing opens as it does later", "[catalogue][F105]") {
  const std::vector<Opening> cases = openings();
  for (const Pack& config : packs()) {
    for (const Opening& opening : cases) {
      const Case* const one = opening.what;
      if (!one->is_seen_open || one->prepare) continue;
      for (const Step& step : steps) {
        for (const Duration later : {0ms, 13ms, 26ms, 49ms}) {
          INFO(one->what << ", in step " << step.name << " after " << ms_text(later) << " ms, pack of " << config.name);
          Case in_step = *one;
          in_step.in_phase = step.phase;
          const std::optional<WiredPack> begun = pack_in(in_step, config);
          REQUIRE(begun);
          WiredPack pack = *begun;
          pack.run(later);
          const TimePoint broken_at = pack.now();
          one->inject(pack);
          const bool is_opened = pack.run_until([](const WiredPack& now) { return is_open(now, Until::command); }, 2s);
          REQUIRE(is_opened);
          CHECK(pack.now() - broken_at <= configured(*one, config));
          CHECK(pack.run_until([&](const WiredPack& now) { return is_present(now, one->fault); }, 200ms));
        }
      }
    }
  }
}

}  // namespace bmu::test
