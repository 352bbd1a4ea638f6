// Row 104: two faults at once. Row 105: a fault in each step of the closing.
#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
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
      if (one.outcome == Outcome::opens && one.in_phase == Phase::closed) cases.push_back({&one, row->allowed});
    }
  }
  return cases;
}

/// Both hooks, the first one's first.
void inject_both(const Case& one, const Case& other, WiredPack& pack) {
  one.inject(pack);
  const auto first_sent = std::exchange(pack.on_sent, {});
  const auto first_ms = std::exchange(pack.each_ms, {});
  other.inject(pack);
  if (first_sent && pack.on_sent) {
    pack.on_sent = [first = first_sent, second = pack.on_sent](CanFrame& frame, const WiredPack& now) {
      Fate fate = first(frame, now);
      if (!fate.is_lost) {
        const Fate more = second(frame, now);
        fate = {more.is_lost, fate.delay + more.delay, more.twin ? more.twin : fate.twin};
      }
      return fate;
    };
  } else if (first_sent) {
    pack.on_sent = first_sent;
  }
  if (first_ms && pack.each_ms) {
    pack.each_ms = [first = first_ms, second = pack.each_ms](WiredPack& now) {
      first(now);
      second(now);
    };
  } else if (first_ms) {
    pack.each_ms = first_ms;
  }
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
  for (int round = 0; round < pairs_a_run; ++round) {
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
    const Duration allowed = std::min(first.allowed, second.allowed);
    INFO("pair " << round << ": " << one.what << "; " << other.what << "; pack of " << config.name);
    INFO("to repeat: BMUD_SEED=" << used << " test_catalogue \"[F104]\"");
    const TimePoint broken_at = pack.now();
    inject_both(one, other, pack);
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
