// Resumption of a charge after a power cut: the limit of 24 h to the tick, how long the charger must be steady, how
// often a charge resumes, and the events that end the waiting.
#include "daemon/core/charging/charge_resume.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr Duration tick = 10ms;

struct Bench {
  ChargeResume resume;
  ChargeResumeInputs in{.now = TimePoint{100s}, .is_hands_off = true, .all_talk = true};

  [[nodiscard]] bool step(Duration later = tick) {
    in.now += later;
    return resume.step(in);
  }
  /// Cuts the power: silence in a tick in which the pack still charges; then the pack opens.
  TimePoint cut() {
    in.is_charging = true;
    in.is_silent = in.has_fault = true;
    in.all_talk = false;
    CHECK_FALSE(step());
    const TimePoint at = in.now;
    in.is_charging = false;
    CHECK_FALSE(step());
    return at;
  }
  void come_back() {
    in.is_silent = in.has_fault = false;
    in.all_talk = true;
  }
};

}  // namespace

TEST_CASE("a charge goes on up to 24 h after it was interrupted, and not a tick later",
          "[unit][core][charger][BMU_11]") {
  struct Case {
    Duration after;
    bool goes_on;
  };
  for (const Case& one : {Case{24h - tick, true}, Case{24h, true}, Case{24h + 1ns, false}, Case{24h + tick, false}}) {
    Bench bench;
    const TimePoint cut_at = bench.cut();
    CHECK(bench.resume.is_pending());
    // The charger is back early enough to have been steady for exactly the required time at this instant.
    bench.come_back();
    CHECK_FALSE(bench.step(cut_at + one.after - ChargeResume::steady - bench.in.now));
    CHECK(bench.resume.is_pending());
    CAPTURE(to_s(one.after));
    CHECK(bench.step(ChargeResume::steady) == one.goes_on);
    CHECK_FALSE(bench.resume.is_pending());
    CHECK_FALSE(bench.step());  // only once
  }
}

TEST_CASE("the 24 h begin with the last tick that still charged", "[unit][core][charger]") {
  Bench bench;
  bench.in.is_charging = bench.in.is_silent = true;
  bench.in.all_talk = false;
  for (int count = 0; count < 100; ++count) CHECK_FALSE(bench.step());
  const TimePoint last = bench.in.now;
  bench.in.is_charging = false;
  bench.come_back();
  CHECK_FALSE(bench.step(last + 24h - ChargeResume::steady - bench.in.now));
  CHECK(bench.step(ChargeResume::steady));
}

TEST_CASE("a charger that is back has to be steady for five seconds", "[unit][core][charger]") {
  Bench bench;
  static_cast<void>(bench.cut());
  bench.come_back();
  CHECK_FALSE(bench.step());
  CHECK_FALSE(bench.step(5s - 1ns));
  bench.in.all_talk = false;  // one charger silent for a tick
  CHECK_FALSE(bench.step());
  bench.in.all_talk = true;
  CHECK_FALSE(bench.step());
  CHECK_FALSE(bench.step(5s - 1ns));
  CHECK(bench.step(1ns));
}

TEST_CASE("silence, its fault, or a wish that is there keeps it waiting, and ends nothing", "[unit][core][charger]") {
  bool ChargeResumeInputs::*const what =
      GENERATE(&ChargeResumeInputs::is_silent, &ChargeResumeInputs::has_fault, &ChargeResumeInputs::is_wanted);
  Bench bench;
  static_cast<void>(bench.cut());
  bench.come_back();
  bench.in.*what = true;
  CHECK_FALSE(bench.step());
  CHECK_FALSE(bench.step(6s));
  CHECK(bench.resume.is_pending());
  bench.in.*what = false;
  CHECK(bench.step());
}

TEST_CASE("anybody's hand ends the wait for good", "[unit][core][charger]") {
  const int how = GENERATE(0, 1, 2);
  Bench bench;
  static_cast<void>(bench.cut());
  bench.come_back();
  CHECK_FALSE(bench.step());
  if (how == 0) bench.resume.cancel();
  if (how == 1) bench.resume.start_over();
  if (how == 2) {
    bench.in.is_hands_off = false;
    CHECK_FALSE(bench.step());
    bench.in.is_hands_off = true;
  }
  CHECK_FALSE(bench.resume.is_pending());
  CHECK_FALSE(bench.step(6s));
}

TEST_CASE("a charger that comes and goes is charged with ten times, until it is plugged in anew",
          "[unit][core][charger]") {
  Bench bench;
  int times = 0;
  for (int count = 0; count < 15; ++count) {
    static_cast<void>(bench.cut());
    CHECK(bench.resume.is_pending() == (count < 10));  // no resumption is announced after the last one
    bench.come_back();
    CHECK_FALSE(bench.step());
    if (bench.step(5s)) ++times;
  }
  CHECK(times == 10);
  CHECK_FALSE(bench.resume.is_pending());
  bench.resume.start_over();
  static_cast<void>(bench.cut());
  CHECK(bench.resume.is_pending());
  bench.come_back();
  CHECK_FALSE(bench.step());
  CHECK(bench.step(5s));
}

TEST_CASE("a charge that goes on by itself is not resumed once it is over", "[unit][core][charger]") {
  Bench bench;
  bench.in.is_charging = bench.in.is_silent = bench.in.has_fault = bench.in.is_wanted = true;
  CHECK_FALSE(bench.step());
  // The charger is received again while its fault is still confirmed: the fault may still open the pack.
  bench.in.is_silent = false;
  CHECK_FALSE(bench.step());
  CHECK(bench.resume.is_pending());
  bench.in.has_fault = false;
  CHECK_FALSE(bench.step());
  CHECK_FALSE(bench.resume.is_pending());
  SECTION("it is over") {
    bench.in.is_charging = bench.in.is_wanted = false;
    CHECK_FALSE(bench.step(6s));
    CHECK_FALSE(bench.step(6s));
    CHECK_FALSE(bench.resume.is_pending());
  }
  SECTION("it is interrupted once more: that counts anew") {
    static_cast<void>(bench.cut());
    CHECK(bench.resume.is_pending());
    bench.in.is_wanted = false;
    bench.come_back();
    CHECK_FALSE(bench.step());
    CHECK(bench.step(5s));
  }
}

TEST_CASE("what was not interrupted is not gone on with", "[unit][core][charger]") {
  Bench bench;
  CHECK_FALSE(bench.step());
  CHECK_FALSE(bench.step(10s));
  bench.in.is_silent = true;  // the pack did not charge
  CHECK_FALSE(bench.step());
  bench.in.is_silent = false;
  CHECK_FALSE(bench.step(10s));
  CHECK_FALSE(bench.resume.is_pending());
}
