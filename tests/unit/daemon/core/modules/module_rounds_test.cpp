// Poll times of modules of another manufacturer, and whether their bleeding has stopped.
#include "daemon/core/modules/module_rounds.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};
constexpr Duration period = 100ms;

ModuleRounds begun(std::uint8_t start_rounds = 0) {
  ModuleRounds rounds;
  rounds.init(start_rounds, start);
  return rounds;
}
/// One round per period, the first at `start`.
struct Rounds {
  ModuleRounds rounds = begun();
  TimePoint now = start - period;

  void ask(bool is_told_to_bleed) {
    now += period;
    rounds.begin(now, is_told_to_bleed);
  }
  [[nodiscard]] bool may_leave_now() const { return rounds.have_stopped_bleeding(now); }
  [[nodiscard]] bool may_leave_next() const { return rounds.have_stopped_bleeding(now + 10ms); }
};

}  // namespace

TEST_CASE("modules of another maker are asked once a period, from the start on", "[unit][core][foreign_modules]") {
  ModuleRounds rounds = begun();
  CHECK(rounds.is_due(start, period));
  rounds.begin(start, false);
  CHECK_FALSE(rounds.is_due(start + period - 1ns, period));
  CHECK(rounds.is_due(start + period, period));
  rounds.begin(start + period, false);
  CHECK(rounds.count() == 2);
  // After a gap no burst follows.
  CHECK(rounds.is_due(start + 950ms, period));
  rounds.begin(start + 950ms, false);
  CHECK_FALSE(rounds.is_due(start + 1'049ms, period));
  CHECK(rounds.is_due(start + 1'050ms, period));
}

TEST_CASE("a period that becomes shorter counts from the last round on", "[unit][core][foreign_modules]") {
  ModuleRounds rounds = begun();
  CHECK(rounds.is_due(start, 400ms));
  rounds.begin(start, false);
  CHECK_FALSE(rounds.is_due(start + 39ms, 40ms));
  CHECK(rounds.is_due(start + 40ms, 40ms));
}

TEST_CASE("the first rounds after a start ask for nothing", "[unit][core][foreign_modules]") {
  ModuleRounds rounds = begun(2);
  CHECK(rounds.is_start());
  rounds.begin(start, false);
  CHECK(rounds.is_start());
  rounds.begin(start + period, false);
  CHECK_FALSE(rounds.is_start());
  rounds.start_over(start + 1s);
  CHECK(rounds.is_start());
  CHECK(rounds.is_due(start + 1s, period));
}

TEST_CASE("who was never told to bleed may be left at once", "[unit][core][foreign_modules]") {
  CHECK(begun().have_stopped_bleeding(start));
}

TEST_CASE("modules that are told to bleed are not left, and once told to stop a tick later",
          "[unit][core][foreign_modules]") {
  Rounds bench;
  bench.ask(true);
  CHECK_FALSE(bench.may_leave_now());
  CHECK_FALSE(bench.may_leave_next());
  bench.ask(false);
  CHECK_FALSE(bench.may_leave_now());  // the bus may not have accepted it
  CHECK(bench.may_leave_next());
}

TEST_CASE("a last word that did not get out has told nobody, however often", "[unit][core][foreign_modules]") {
  Rounds bench;
  bench.ask(true);
  for (int round = 0; round < 3; ++round) {
    bench.ask(false);
    bench.rounds.note_failed();
    CHECK_FALSE(bench.may_leave_next());
  }
  bench.ask(false);
  CHECK(bench.may_leave_next());
}

TEST_CASE("a word to bleed that did not get out is taken for heard", "[unit][core][foreign_modules]") {
  Rounds bench;
  bench.ask(false);
  bench.ask(true);
  bench.rounds.note_failed();
  CHECK_FALSE(bench.may_leave_next());
}

TEST_CASE("words that did not get out keep nobody whom nobody told to bleed", "[unit][core][foreign_modules]") {
  Rounds bench;
  bench.ask(false);
  bench.ask(false);
  bench.rounds.note_failed();
  CHECK(bench.may_leave_next());
}

TEST_CASE("a start that asks for nothing has told modules to stop", "[unit][core][foreign_modules]") {
  Rounds bench;
  bench.ask(true);
  bench.rounds.start_over(bench.now);
  CHECK_FALSE(bench.may_leave_next());  // nothing has been sent since
  bench.ask(false);
  CHECK(bench.may_leave_next());
}
