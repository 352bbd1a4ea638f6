// Changes of the current that take seconds, against the cells: eight of 2 mOhm, ten pictures a second.
#include "daemon/core/estimators/current_ramp_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr std::int64_t capacity_As = 144'000;

struct Verdicts {
  int good = 0;
  int bad = 0;
  Duration first_bad_after{};
};

/// Cells, and a sensor that shows what `shown_mA` makes of the real current.
struct Pack {
  CurrentRampMonitor monitor;
  TimePoint now{100s};
  std::function<double(double)> shown_mA = [](double real_mA) { return real_mA; };
  double before_mA = 0.0;       // shown in the last picture
  double drift_uV_per_s = 0.0;  // of each cell
  double drifted_uV = 0.0;
  double offset_of_first_uV = 0.0;  // one cell alone
  double pack_share = 1.0;          // of what the cells' voltages move, the pack voltage has
  bool knows_range = true;
  bool knows_pack = true;
  bool knows_load = false;  // what flowed lately
  std::int32_t resistance_uOhm = 2'000;

  /// The current goes evenly to `to_mA`.
  Verdicts run(Duration span, double from_mA, double to_mA) {
    constexpr Duration step = 100ms;
    Verdicts found;
    for (Duration at = step; at <= span; at += step) {
      const double real_mA =
          from_mA + (to_mA - from_mA) * (static_cast<double>(at.count()) / static_cast<double>(span.count()));
      now += step;
      take(real_mA, step);
      const Reading& reading = monitor.implausible_current();
      if (!reading.is_known) continue;
      CHECK(reading.taken_at == now);
      if (reading.value == 0) ++found.good;
      if (reading.value != 0 && found.bad++ == 0) found.first_bad_after = at;
    }
    return found;
  }

  void take(double real_mA, Duration step) {
    drifted_uV += drift_uV_per_s * std::chrono::duration<double>(step).count();
    const double cell_uV = 3'700'000.0 - real_mA * resistance_uOhm / 1e3 + drifted_uV;
    const double first_uV = cell_uV + offset_of_first_uV;
    const double sum_uV = 7.0 * cell_uV + first_uV;
    const double pack_uV = 8.0 * 3'700'000.0 + pack_share * (sum_uV - 8.0 * 3'700'000.0);
    const double said_mA = shown_mA(real_mA);
    const auto mA = [](double value) { return static_cast<std::int32_t>(std::lround(value)); };
    if (knows_load) monitor.follow_current({mA(said_mA), now, Validity::valid});
    monitor.take({.taken_at = now,
                  .current = {true, mA(said_mA), mA(said_mA)},
                  .since_last = {knows_range, mA(std::min(said_mA, before_mA)), mA(std::max(said_mA, before_mA))},
                  .sum_uV = std::llround(sum_uV),
                  .lowest_uV = mA(std::min(cell_uV, first_uV)),
                  .highest_uV = mA(std::max(cell_uV, first_uV)),
                  .pack_mV = {mA(pack_uV / 1e3), now, knows_pack ? Validity::valid : Validity::unknown}},
                 {.count = 8,
                  .resistance_uOhm = resistance_uOhm,
                  .unseen_uV = 10'000,
                  .capacity_As = capacity_As,
                  .calm_mA = 1'000});
    before_mA = said_mA;
  }

  Verdicts calm(Duration span, double current_mA = 0.0) { return run(span, current_mA, current_mA); }
};

double reversed(double real_mA) {
  return -real_mA;
}
double zero(double /*real_mA*/) {
  return 0.0;
}

}  // namespace

TEST_CASE("a load that swells shows the direction of the sensor from the first 5 A on", "[unit][estimators][F18]") {
  for (const double to_mA : {50'000.0, -50'000.0}) {
    CAPTURE(to_mA);
    Pack good;
    CHECK(good.calm(6s).bad == 0);
    const Verdicts follows = good.run(10s, 0.0, to_mA);
    CHECK(follows.bad == 0);
    CHECK(follows.good == 90);  // from 5 A beyond the calm on, whose mean is 0.1 A on the way
    Pack bad{.shown_mA = reversed};
    CHECK(bad.calm(6s).bad == 0);
    const Verdicts contradicts = bad.run(10s, 0.0, to_mA);
    CHECK(contradicts.good == 0);
    CHECK(contradicts.bad == 90);
    CHECK(contradicts.first_bad_after == 1'100ms);
  }
}

TEST_CASE("a change is judged from a current that flows already, too", "[unit][estimators][F18]") {
  for (const bool is_reversed : {false, true}) {
    Pack pack;
    if (is_reversed) pack.shown_mA = reversed;
    CHECK(pack.run(10s, 0.0, 30'000.0).bad == 0);  // there was no calm before it
    CHECK(pack.calm(6s, 30'000.0).bad == 0);
    const Verdicts found = pack.run(10s, 30'000.0, 20'000.0);
    CHECK((found.bad > 0) == is_reversed);
    CHECK((found.good > 0) == !is_reversed);
  }
}

TEST_CASE("less than 5 A, or than 1 mV of a cell, is not judged", "[unit][estimators][F18]") {
  Pack small{.shown_mA = reversed};
  small.calm(6s);
  const Verdicts of_small = small.run(10s, 0.0, 4'990.0);
  CHECK(of_small.bad + of_small.good == 0);
  // Cells move by 4 mV, and 5 A are shown.
  for (const auto& [resistance_uOhm, is_judged] : {std::pair{199, false}, std::pair{201, true}}) {
    Pack weak{.shown_mA = [](double real_mA) { return -real_mA / 4.0; }, .resistance_uOhm = resistance_uOhm};
    weak.calm(6s);
    CHECK((weak.calm(1s, 20'000.0).bad > 0) == is_judged);
  }
}

TEST_CASE("what the cells do has to be beyond half of the answer, the drift and a millivolt",
          "[unit][estimators][F18]") {
  // Shown: a charge of 10 A, which raises a cell by 20 mV. Real: a load that lowers it, for 5 s.
  for (const auto& [real_mA, drift_uV_per_s, is_bad] :
       {std::tuple{5'450.0, 0.0, false}, std::tuple{5'550.0, 0.0, true}, std::tuple{5'450.0, -100.0, false},
        std::tuple{5'550.0, -100.0, true}, std::tuple{5'700.0, 100.0, false}, std::tuple{6'100.0, 100.0, true}}) {
    CAPTURE(real_mA, drift_uV_per_s);
    const double share = 10'000.0 / real_mA;
    Pack pack{.shown_mA = [share](double real) { return -real * share; }, .drift_uV_per_s = drift_uV_per_s};
    pack.calm(6s);
    pack.calm(5s, real_mA);
    CHECK(pack.monitor.implausible_current().is_known == is_bad);
  }
}

TEST_CASE("the voltages of a former load that fade are no answer to the next one", "[unit][estimators][F18]") {
  Pack pack{.drift_uV_per_s = -2'000.0};
  pack.calm(10s);
  CHECK(pack.run(1s, 0.0, -6'000.0).bad == 0);  // a charge, which raises a cell by 12 mV
  CHECK(pack.calm(39s, -6'000.0).bad == 0);     // by now it has fallen by 66 mV
}

TEST_CASE("a change is judged from five times as much on as flowed to the other side before",
          "[unit][estimators][F18]") {
  // 100 ms, which are between three pictures, as a mean of two seconds: just below a tenth.
  for (const auto& [before_mA, is_judged] : {std::pair{20'000.0, true}, std::pair{21'000.0, false}}) {
    for (const double sign : {1.0, -1.0}) {
      CAPTURE(before_mA, sign);
      Pack pack{.shown_mA = reversed};
      pack.calm(6s);
      pack.calm(100ms, -sign * before_mA);
      CHECK((pack.calm(100ms, sign * 10'000.0).bad > 0) == is_judged);
    }
  }
}

TEST_CASE("a calm at zero counts from 1 s on, for four times as long, and for a minute", "[unit][estimators][F18]") {
  for (const auto& [calm, wait, is_judged] :
       {std::tuple{Duration{1s}, Duration{0s}, false}, std::tuple{Duration{1'100ms}, Duration{0s}, true},
        std::tuple{Duration{6s}, Duration{21s}, true}, std::tuple{Duration{6s}, Duration{25s}, false},
        std::tuple{Duration{30s}, Duration{58s}, true}, std::tuple{Duration{30s}, Duration{61s}, false}}) {
    CAPTURE(calm.count(), wait.count());
    Pack pack{.shown_mA = reversed};
    pack.calm(calm);
    for (Duration at{}; at < wait; at += 200ms) pack.run(200ms, 4'800.0, 2'000.0);  // no calm
    CHECK((pack.run(300ms, 5'000.0, 6'000.0).bad > 0) == is_judged);
  }
}

TEST_CASE("a calm at another current than zero counts from 2 s on", "[unit][estimators][F18]") {
  for (const auto& [calm, is_judged] : {std::pair{Duration{2s}, false}, std::pair{Duration{2'100ms}, true}}) {
    Pack pack{.shown_mA = reversed};
    pack.calm(calm, 20'000.0);
    CHECK((pack.calm(300ms, 30'000.0).bad > 0) == is_judged);
  }
}

TEST_CASE("a load that grows so slowly that it is calm all the way is compared with the calm at zero",
          "[unit][estimators][F18]") {
  for (const bool is_reversed : {false, true}) {
    Pack pack;
    if (is_reversed) pack.shown_mA = reversed;
    pack.calm(15s);
    const Verdicts found = pack.run(40s, 0.0, 12'000.0);
    CHECK((found.bad > 0) == is_reversed);
    CHECK((found.good > 0) == !is_reversed);
  }
}

TEST_CASE("of two calms at zero the one counts that can be compared with for longer", "[unit][estimators][F18]") {
  Pack pack{.shown_mA = reversed};
  pack.calm(15s);
  pack.calm(100ms, 2'000.0);  // a precharge
  pack.calm(1'500ms);
  for (Duration at{}; at < 20s; at += 200ms)
    pack.run(200ms, 4'800.0, 2'000.0);  // no calm, and longer than four times that
  CHECK(pack.run(300ms, 5'500.0, 6'000.0).bad > 0);
}

TEST_CASE("a precharge is no current to the other side of the charge that follows it", "[unit][estimators][F18]") {
  for (const bool is_reversed : {false, true}) {
    Pack pack{.knows_load = true};
    if (is_reversed) pack.shown_mA = reversed;
    pack.calm(6s);
    pack.run(600ms, 3'600.0, 0.0);
    pack.calm(500ms);
    const Verdicts found = pack.calm(2s, -6'000.0);
    CHECK((found.bad > 0) == is_reversed);
    CHECK((found.good > 0) == !is_reversed);
  }
}

TEST_CASE("a picture of cells that were sampled behind a step, before the sensor shows it, is part of no calm",
          "[unit][estimators][F18]") {
  double delayed_mA = 0.0;
  double last_mA = 0.0;
  Pack pack{.shown_mA = [&](double real_mA) {
    delayed_mA = last_mA;  // of the picture before
    last_mA = real_mA;
    return -delayed_mA;
  }};
  pack.calm(6s);
  CHECK(pack.calm(1s, 5'200.0).bad == 9);  // all that show it
}

TEST_CASE("a current that flowed already counts until it has moved a permille of the capacity",
          "[unit][estimators][F18]") {
  for (const auto& [wait, is_judged] : {std::pair{Duration{3'500ms}, true}, std::pair{Duration{5s}, false}}) {
    Pack pack{.shown_mA = reversed};
    pack.calm(6s, 32'000.0);  // 144 As in 4.5 s
    pack.calm(100ms, 20'000.0);
    for (Duration at{}; at < wait; at += 200ms) pack.run(200ms, 24'800.0, 22'000.0);  // no calm
    CHECK((pack.calm(100ms, 20'000.0).bad > 0) == is_judged);
  }
}

TEST_CASE("a gap between the pictures begins anew", "[unit][estimators][F18]") {
  Pack pack{.shown_mA = reversed};
  pack.calm(6s);
  pack.knows_range = false;
  pack.run(100ms, 0.0, 0.0);
  pack.knows_range = true;
  CHECK(pack.run(2s, 0.0, 20'000.0).bad == 0);
}

TEST_CASE("one cell that moves alone is no answer to the current", "[unit][estimators][F18]") {
  Pack pack;
  pack.calm(6s);
  pack.offset_of_first_uV = -500'000.0;  // the sum falls by 500 mV, while a charge of 10 A raises each other cell by 20
  CHECK(pack.run(1s, -9'000.0, -10'000.0).bad == 0);
  Pack frozen{.shown_mA = zero, .offset_of_first_uV = 0.0};
  frozen.calm(6s);
  frozen.offset_of_first_uV = -500'000.0;
  CHECK(frozen.calm(5s).bad == 0);
}

TEST_CASE("cells that move while the pack voltage does not are no answer to the current", "[unit][estimators][F18]") {
  for (const auto& [share, is_bad] : {std::pair{0.45, false}, std::pair{0.55, true}, std::pair{-1.0, false}}) {
    CAPTURE(share);
    Pack pack{.shown_mA = reversed, .pack_share = share};
    pack.calm(6s);
    CHECK((pack.run(10s, 0.0, 50'000.0).bad > 0) == is_bad);
  }
  Pack without{.shown_mA = reversed, .pack_share = 0.0, .knows_pack = false};
  without.calm(6s);
  CHECK(without.run(10s, 0.0, 50'000.0).bad > 0);
  Pack frozen{.shown_mA = zero, .knows_pack = false};
  frozen.calm(6s);
  CHECK(frozen.run(10s, 0.0, 50'000.0).bad == 0);
}

TEST_CASE("cells that fall while the current is said to be zero show a sensor that stands still",
          "[unit][estimators][F12]") {
  Pack pack{.shown_mA = zero};
  pack.calm(6s);
  const Verdicts found = pack.run(10s, 0.0, 50'000.0);
  CHECK(found.bad > 0);
  CHECK(found.first_bad_after == 1'100ms);  // 5.5 A in 2 mOhm are 11 mV
  Pack slow{.shown_mA = zero};
  slow.calm(20s);
  CHECK(slow.run(60s, 0.0, 20'000.0).bad > 0);
  Pack just_below{.shown_mA = zero};
  just_below.calm(6s);
  CHECK(just_below.run(10s, 0.0, 5'490.0).bad == 0);
  Pack of_wires{.shown_mA = zero, .pack_share = 0.4};  // the pack voltage does not follow
  of_wires.calm(6s);
  CHECK(of_wires.run(10s, 0.0, 50'000.0).bad == 0);
  Pack fading{.shown_mA = zero, .drift_uV_per_s = 3'000.0};
  fading.calm(6s);
  CHECK(fading.calm(60s).bad == 0);
  Pack elsewhere{.shown_mA = [](double /*real_mA*/) { return 8'000.0; }};  // a knee of the curve could do that
  elsewhere.calm(6s, 8'000.0);
  CHECK(elsewhere.run(10s, 8'000.0, 50'000.0).bad == 0);
}

TEST_CASE("after a load a change is judged if it is eight times as large, or once that has faded",
          "[unit][estimators][F18]") {
  for (const auto& [load_mA, rest, is_judged] :
       {std::tuple{1'120.0, Duration{6s}, true}, std::tuple{1'350.0, Duration{6s}, false},
        std::tuple{40'000.0, Duration{60s}, false}, std::tuple{40'000.0, Duration{1'500s}, true}}) {
    CAPTURE(load_mA, rest.count());
    Pack pack{.shown_mA = reversed, .knows_load = true};
    pack.calm(60s, load_mA);
    pack.calm(rest);
    CHECK((pack.calm(1s, 10'000.0).bad > 0) == is_judged);
  }
  Pack precharged{.shown_mA = reversed, .knows_load = true};
  precharged.calm(1s);
  precharged.calm(300ms, 7'000.0);
  precharged.calm(6s);
  CHECK(precharged.calm(1s, 30'000.0).bad > 0);
  // Cells that fall by 40 mV while the current is zero, after 100 A and after none.
  for (const bool had_load : {false, true}) {
    Pack pack{.shown_mA = zero, .knows_load = true};
    if (had_load) pack.shown_mA = [](double real_mA) { return real_mA; };
    pack.calm(60s, had_load ? 100'000.0 : 0.0);
    pack.shown_mA = zero;
    pack.calm(6s);
    CHECK((pack.run(5s, 0.0, 20'000.0).bad > 0) != had_load);
  }
}

namespace {

/// A cell with the time constants of a fitted one and a curve that is steep at its end: what a sensor that is right has
/// to go with.
struct SlowCell {
  double charge_As = 0.0;
  double branch_V[3] = {};

  [[nodiscard]] double soc() const { return charge_As / static_cast<double>(capacity_As); }
  double voltage_V(double current_A, double step_s) {
    charge_As -= current_A * step_s;
    // Of the resistance at once, as in config/cells/a123-26650.json at 25 C.
    constexpr double share[] = {0.427, 1.420, 1.401};
    constexpr double tau_s[] = {6.0, 60.0, 350.0};
    double polarisation_V = 0.0;
    for (std::size_t branch = 0; branch < 3; ++branch) {
      const double settled_V = current_A * 0.002 * share[branch];
      branch_V[branch] += (settled_V - branch_V[branch]) * (1.0 - std::exp(-step_s / tau_s[branch]));
      polarisation_V += branch_V[branch];
    }
    return 3.2 + 0.9 * soc() + 0.05 * std::log(std::max(soc(), 1e-3)) - current_A * 0.002 - polarisation_V;
  }
};

}  // namespace

TEST_CASE("whatever the load does, cells that follow it do not contradict it", "[unit][estimators][F18][F12]") {
  int judged = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    test::Chance chance(seed);
    CurrentRampMonitor monitor;
    SlowCell cell{.charge_As = chance.between(0.03, 0.98) * static_cast<double>(capacity_As)};
    TimePoint now{100s};
    double current_A = 0.0;
    std::int32_t before_mA = 0;
    while (now < TimePoint{1'300s} && cell.soc() > 0.005) {  // below, an undervoltage has opened
      const double to_A = chance.between(0.0, 1.0) < 0.4 ? 0.0 : chance.between(-60.0, 120.0);
      const int ramp = static_cast<int>(chance.between(1.0, 150.0));
      const int hold = static_cast<int>(chance.between(0.0, chance.one_in(3.0) ? 1'500.0 : 200.0));
      const double step_A = (to_A - current_A) / ramp;
      for (int index = 0; index < ramp + hold && cell.soc() > 0.005; ++index, now += 100ms) {
        if (index < ramp) current_A += step_A;
        const auto said_mA = static_cast<std::int32_t>(std::lround(current_A * 1e3 + chance.between(-200.0, 200.0)));
        const auto cell_uV = static_cast<std::int32_t>(std::lround(cell.voltage_V(current_A, 0.1) * 1e4)) * 100;
        monitor.follow_current({said_mA, now, Validity::valid});
        monitor.take(
            {.taken_at = now,
             .current = {true, said_mA, said_mA},
             .since_last = {true, std::min(said_mA, before_mA), std::max(said_mA, before_mA)},
             .sum_uV = std::int64_t{cell_uV} * 8,
             .lowest_uV = cell_uV,
             .highest_uV = cell_uV,
             .pack_mV = {cell_uV * 8 / 1'000, now, Validity::valid}},
            {.count = 8, .resistance_uOhm = 2'000, .unseen_uV = 10'000, .capacity_As = capacity_As, .calm_mA = 1'000});
        before_mA = said_mA;
        const Reading& reading = monitor.implausible_current();
        judged += reading.is_known ? 1 : 0;
        if (!reading.is_known || reading.value == 0) continue;
        CAPTURE(seed, current_A, to_ms(now.time_since_epoch()));
        FAIL("a sensor that is right is taken for one that is not");
      }
    }
  }
  CHECK(judged > 1'000);
}
