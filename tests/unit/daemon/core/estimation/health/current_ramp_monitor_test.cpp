// Changes of the current over seconds, compared with the cells: eight of 2 mOhm, ten sample sets a second.
#include "daemon/core/estimation/health/current_ramp_monitor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "protocol/image.hpp"
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

/// Cells and a current sensor; `shown_mA` maps the real current to the shown one.
struct Pack {
  CurrentRampMonitor monitor;
  TimePoint now{100s};
  std::function<double(double)> shown_mA = [](double real_mA) { return real_mA; };
  double before_mA = 0.0;       // shown in the last sample set
  double drift_uV_per_s = 0.0;  // of each cell
  double drifted_uV = 0.0;
  double offset_of_first_uV = 0.0;  // one cell alone
  double pack_share = 1.0;          // of the cell voltage change, seen in the pack voltage
  bool knows_range = true;
  bool knows_pack = true;
  bool knows_load = false;  // recent current
  std::int32_t resistance_uOhm = 2'000;

  /// Changes the current linearly to `to_mA`.
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
    CHECK(follows.good == 90);  // from 5 A beyond the calm, which has a mean of 0.1 A by then
    CHECK_FALSE(good.monitor.is_against_current());
    Pack bad{.shown_mA = reversed};
    CHECK(bad.calm(6s).bad == 0);
    const Verdicts contradicts = bad.run(10s, 0.0, to_mA);
    CHECK(contradicts.good == 0);
    CHECK(contradicts.bad == 90);
    CHECK(contradicts.first_bad_after == 1'100ms);
    CHECK(bad.monitor.is_against_current());
  }
}

TEST_CASE("a change is judged from a current that flows already, too", "[unit][estimators][F18]") {
  for (const bool is_reversed : {false, true}) {
    Pack pack;
    if (is_reversed) pack.shown_mA = reversed;
    CHECK(pack.run(10s, 0.0, 30'000.0).bad == 0);  // no calm before it
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
  CHECK(pack.run(1s, 0.0, -6'000.0).bad == 0);  // a charging current, which raises a cell by 12 mV
  CHECK(pack.calm(39s, -6'000.0).bad == 0);     // the cell has fallen by 66 mV by then
}

TEST_CASE("a change is judged from five times as much on as flowed to the other side before",
          "[unit][estimators][F18]") {
  // 100 ms, which three sample sets cover, as a mean of two seconds: just below a tenth.
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
    delayed_mA = last_mA;  // of the previous sample set
    last_mA = real_mA;
    return -delayed_mA;
  }};
  pack.calm(6s);
  CHECK(pack.calm(1s, 5'200.0).bad == 9);  // all sample sets that show it
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
  Pack of_wires{.shown_mA = zero, .pack_share = 0.4};  // the pack voltage does not change accordingly
  of_wires.calm(6s);
  CHECK(of_wires.run(10s, 0.0, 50'000.0).bad == 0);
  Pack fading{.shown_mA = zero, .drift_uV_per_s = 3'000.0};
  fading.calm(6s);
  CHECK(fading.calm(60s).bad == 0);
  Pack elsewhere{.shown_mA = [](double /*real_mA*/) { return 8'000.0; }};  // a knee of the curve can cause that
  elsewhere.calm(6s, 8'000.0);
  CHECK(elsewhere.run(10s, 8'000.0, 50'000.0).bad == 0);
}

TEST_CASE("whether the voltages moved against the current or without it is of the latest contradiction",
          "[unit][estimators][F18][F12]") {
  Pack pack{.shown_mA = reversed};
  pack.calm(6s);
  CHECK(pack.run(2s, 0.0, 10'000.0).bad > 0);
  CHECK(pack.monitor.is_against_current());
  pack.shown_mA = zero;
  CHECK(pack.calm(400s).bad == 0);  // the effect of the earlier current fades
  CHECK(pack.run(10s, 0.0, 50'000.0).bad > 0);
  CHECK_FALSE(pack.monitor.is_against_current());
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

/// Cell with the time constants of a fitted one and a curve that is steep at its end; a correct sensor must be
/// plausible with it.
struct SlowCell {
  double charge_As = 0.0;
  double branch_V[3] = {};

  [[nodiscard]] double soc() const { return charge_As / static_cast<double>(capacity_As); }
  double voltage_V(double current_A, double step_s) {
    charge_As -= current_A * step_s;
    // Relative to the ohmic resistance, as in config/cells/a123-26650.json at 25 C.
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

TEST_CASE("whatever the load does, cells that follow it do not contradict it", "[unit][estimators]") {
  int judged = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    test::Chance chance(seed);
    CurrentRampMonitor monitor;
    SlowCell cell{.charge_As = chance.between(0.03, 0.98) * static_cast<double>(capacity_As)};
    TimePoint now{100s};
    double current_A = 0.0;
    std::int32_t before_mA = 0;
    while (now < TimePoint{1'300s} && cell.soc() > 0.005) {  // below, an undervoltage opens the pack
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

namespace {

constexpr std::int32_t rest_uV = 3'700'000;

/// Monitor that receives exact values of one cell, the pack's only one.
struct Exact {
  CurrentRampMonitor monitor;
  CurrentRampMonitor::Cells cells{
      .count = 1, .resistance_uOhm = 2'000, .unseen_uV = 10'000, .capacity_As = capacity_As, .calm_mA = 1'000};
  TimePoint now{200s};
  std::int32_t before_mA = 0;
  bool knows_pack = true;

  PackPicture picture(Duration later, std::int32_t current_mA, std::int32_t cell_uV) {
    now += later;
    const PackPicture result{.taken_at = now,
                             .current = {true, current_mA, current_mA},
                             .since_last = {true, std::min(current_mA, before_mA), std::max(current_mA, before_mA)},
                             .sum_uV = cell_uV,
                             .lowest_uV = cell_uV,
                             .highest_uV = cell_uV,
                             .pack_mV = {cell_uV / 1'000, now, knows_pack ? Validity::valid : Validity::unknown}};
    before_mA = current_mA;
    return result;
  }
  const Reading& tell(Duration later, std::int32_t current_mA, std::int32_t cell_uV = rest_uV) {
    monitor.take(picture(later, current_mA, cell_uV), cells);
    return monitor.implausible_current();
  }
  /// Ten sample sets a second, the first one after 100 ms.
  void calm(Duration span, std::int32_t current_mA, std::int32_t cell_uV = rest_uV) {
    for (Duration at{}; at < span; at += 100ms) tell(100ms, current_mA, cell_uV);
  }
  /// Currents that belong to no calm, with changes that are not judged.
  void fidget(Duration span, std::int32_t cell_uV = rest_uV) {
    for (Duration at{}; at < span; at += 200ms) {
      tell(100ms, 2'000, cell_uV);
      tell(100ms, 4'800, cell_uV);
    }
  }
  void flowed(Duration since_100s, std::int32_t current_mA, Validity validity = Validity::valid) {
    monitor.follow_current({current_mA, TimePoint{100s} + since_100s, validity});
  }
};

bool contradicts(const Reading& reading) {
  return reading.is_known && reading.value == 1;
}
bool follows(const Reading& reading) {
  return reading.is_known && reading.value == 0;
}

}  // namespace

TEST_CASE("a change is judged from exactly 5 A on, or two and a half times a wider calm", "[unit][estimators][F18]") {
  struct Case {
    std::int64_t calm_mA;
    std::int32_t change_mA;
    bool is_judged;
  };
  for (const Case& one :
       {Case{1'000, 5'000, true}, {1'000, 4'999, false}, {4'000, 10'000, true}, {4'000, 9'999, false}}) {
    for (const std::int32_t sign : {1, -1}) {
      CAPTURE(one.calm_mA, one.change_mA, sign);
      Exact exact;
      exact.cells.calm_mA = one.calm_mA;
      exact.calm(3s, 0);
      const Reading& reading = exact.tell(100ms, sign * one.change_mA, rest_uV + sign * 60'000);
      CHECK(contradicts(reading) == one.is_judged);
      CHECK(reading.is_known == one.is_judged);
    }
  }
}

TEST_CASE("an answer of exactly a millivolt is judged, and a movement of exactly half of it and a millivolt",
          "[unit][estimators][F18]") {
  for (const auto& [change_mA, is_judged] : {std::pair{10'000, true}, std::pair{9'999, false}}) {
    Exact exact;
    exact.cells.resistance_uOhm = 100;
    exact.calm(3s, 0);
    CHECK(contradicts(exact.tell(100ms, change_mA, rest_uV + 60'000)) == is_judged);
  }
  for (const auto& [moved_uV, is_judged] : {std::pair{11'000, true}, std::pair{10'999, false}}) {
    Exact exact;
    exact.calm(3s, 0);
    CHECK(contradicts(exact.tell(100ms, 10'000, rest_uV + moved_uV)) == is_judged);
  }
}

TEST_CASE("the lowest and the highest cell have moved by exactly half as much as all together on the average",
          "[unit][estimators][F18]") {
  struct Case {
    std::int32_t lowest_uV;
    std::int32_t highest_uV;
    bool is_judged;
  };
  for (const Case& one :
       {Case{5'500, 30'000, true}, {5'499, 30'000, false}, {30'000, 5'500, true}, {30'000, 5'499, false}}) {
    CAPTURE(one.lowest_uV, one.highest_uV);
    Exact exact;
    exact.calm(3s, 0);
    exact.cells.count = 8;  // eight cells expect 160 mV: 88 mV are required
    PackPicture picture = exact.picture(100ms, 10'000, rest_uV + 200'000);
    picture.lowest_uV = rest_uV + one.lowest_uV;
    picture.highest_uV = rest_uV + one.highest_uV;
    exact.monitor.take(picture, exact.cells);
    CHECK(contradicts(exact.monitor.implausible_current()) == one.is_judged);
  }
}

TEST_CASE("the current of a calm is the mean in which the last counts for a quarter", "[unit][estimators][F18]") {
  for (const auto& [current_mA, is_judged] : {std::pair{5'200, true}, std::pair{5'199, false}}) {
    Exact exact;
    for (const std::int32_t calm_mA : {0, 0, 0, 800, 800}) exact.tell(500ms, calm_mA);  // the last is part of no calm
    CHECK(contradicts(exact.tell(100ms, current_mA, rest_uV + 60'000)) == is_judged);
  }
}

TEST_CASE("the current that flowed lately rises within 10 s and fades within 400 s", "[unit][estimators][F18]") {
  // The first value counts at once. Four times R by that current is required beyond the 11 mV for a change of 10 A.
  const auto check_lately = [](std::int32_t lately_mA, const std::function<void(Exact&)>& flow) {
    for (const bool is_judged : {true, false}) {
      CAPTURE(lately_mA, is_judged);
      Exact exact;
      flow(exact);
      exact.calm(3s, 0);
      const std::int32_t least_uV = 11'000 + 4 * 2 * lately_mA;
      CHECK(contradicts(exact.tell(100ms, 10'000, rest_uV + least_uV - (is_judged ? 0 : 1))) == is_judged);
    }
  };
  check_lately(10'000, [](Exact& exact) { exact.flowed(0s, -10'000); });
  check_lately(10'775, [](Exact& exact) {
    exact.flowed(0s, 10'000);
    exact.flowed(10s, 0);                           // 9'750
    exact.flowed(5s, 90'000);                       // older than the last value
    exact.flowed(10s, 90'000);                      // same time as the last value
    exact.flowed(11s, 90'000, Validity::unknown);   // no value
    exact.flowed(11s, 90'000, Validity::doubtful);  // not a value either
    exact.flowed(11s, 20'000);                      // a tenth of the difference
  });
  check_lately(9'750, [](Exact& exact) {
    exact.flowed(0s, 10'000);
    exact.flowed(10s, 10'000);  // a current equal to the first one fades
  });
  check_lately(9'210, [](Exact& exact) {
    exact.flowed(0s, 9'300);
    exact.flowed(3'828ms, 0);
    exact.flowed(4'828ms, 9'211);  // larger by 1 uA
  });
  check_lately(0, [](Exact& exact) {
    exact.flowed(0s, 10'000);
    exact.flowed(400s, 0);
  });
}

TEST_CASE("a calm of a moment is one at zero up to exactly 1 A", "[unit][estimators][F18]") {
  for (const auto& [current_mA, is_judged] : {std::pair{1'000, true}, std::pair{1'001, false}}) {
    for (const std::int32_t sign : {1, -1}) {
      Exact exact;
      exact.cells.calm_mA = 2'000;
      exact.calm(1'500ms, sign * current_mA);
      CHECK(contradicts(exact.tell(100ms, 11'000, rest_uV + 60'000)) == is_judged);
    }
  }
}

TEST_CASE("what drifted in a calm counts for the last minute of it", "[unit][estimators][F18]") {
  struct Case {
    int before_s;
    int rise_s;  // by 1 mV a second
    int after_s;
    bool is_judged;
  };
  for (const Case& one : {Case{0, 30, 90, true}, {100, 20, 40, false}}) {
    Exact exact;
    exact.calm(std::chrono::seconds{one.before_s}, 0);
    for (int second = 1; second <= one.rise_s; ++second) exact.calm(1s, 0, rest_uV + 1'000 * second);
    const std::int32_t last_uV = rest_uV + 1'000 * one.rise_s;
    exact.calm(std::chrono::seconds{one.after_s}, 0, last_uV);
    exact.fidget(50s, last_uV);
    CHECK(contradicts(exact.tell(100ms, 10'000, last_uV + 15'000)) == one.is_judged);
  }
}

TEST_CASE("pictures of a calm are kept from exactly 2 s on, and compared for four times that",
          "[unit][estimators][F12]") {
  for (const Duration last : {2'000ms, 2'001ms}) {
    Exact exact;
    exact.tell(0s, 0);
    exact.tell(8s, 0);  // a quarter of that is 2 s after the first
    CHECK(contradicts(exact.tell(last, 0, rest_uV - 40'000)) == (last == 2s));
  }
}

TEST_CASE("two pictures of one instant are not compared", "[unit][estimators][F12]") {
  Exact exact;
  exact.tell(0s, 0);
  CHECK_FALSE(exact.tell(0s, 0, rest_uV - 40'000).is_known);
}

TEST_CASE("a pack voltage moves with the cells if it does so by exactly half as much, or one of the two is not known",
          "[unit][estimators][F18]") {
  const auto valid = [](std::int32_t pack_mV) { return Voltage_mV{pack_mV, TimePoint{1s}, Validity::valid}; };
  const auto moves = [&valid](std::int64_t cells_uV, std::int32_t pack_mV) {
    return is_move_of_pack(cells_uV, valid(30'000), valid(30'000 + pack_mV));
  };
  CHECK(moves(2'000, 1));
  CHECK_FALSE(moves(2'001, 1));
  CHECK(moves(-2'000, -1));
  CHECK_FALSE(moves(-2'001, -1));
  CHECK_FALSE(moves(2'000, -1));
  CHECK_FALSE(moves(-2'000, 1));
  CHECK(moves(1, 1));
  CHECK(moves(0, 0));
  CHECK(is_move_of_pack(-2'000, Voltage_mV{}, valid(30'000)));
  CHECK(is_move_of_pack(2'000, valid(30'000), Voltage_mV{}));
}

TEST_CASE("a short calm at zero leaves the longer one in its place, whatever calm was between them",
          "[unit][estimators][F18]") {
  Exact exact;
  exact.calm(15s, 0);
  exact.tell(100ms, 2'000);
  exact.calm(2'200ms, 4'000);
  exact.calm(1'500ms, 0);
  exact.fidget(20s);
  CHECK(contradicts(exact.tell(100ms, 10'000, rest_uV + 60'000)));
}

TEST_CASE("of two calms at zero that can be compared with for as long the later one counts",
          "[unit][estimators][F18]") {
  Exact exact;
  exact.tell(0s, 0);
  exact.tell(16s, 0);  // kept with the next: from 0 s to 4 s, and valid for 16 s
  exact.tell(100ms, 0);
  exact.tell(900ms, 3'000);
  const std::int32_t later_uV = rest_uV + 60'000;
  exact.tell(100ms, 0, later_uV);    // at 17.1 s
  exact.tell(2'320ms, 0, later_uV);  // to 17.68 s, and valid for 2.32 s
  exact.tell(100ms, 0, later_uV);
  // Compared with the later calm nothing has moved by 1 mV.
  CHECK_FALSE(exact.tell(100ms, 10'000, later_uV + 500).is_known);
}

TEST_CASE("what flowed to the other side is exactly a fifth of the change, as a mean of two seconds",
          "[unit][estimators][F18]") {
  struct Case {
    std::int32_t other_mA;
    std::int32_t change_mA;
    bool is_judged;
  };
  for (const Case& one : {Case{2'000, 10'000, true}, {2'001, 10'000, false}, {2'000, 9'999, false}}) {
    for (const std::int32_t sign : {1, -1}) {
      CAPTURE(one.other_mA, one.change_mA, sign);
      Exact exact;
      exact.calm(3s, 0);
      exact.tell(2s, -sign * one.other_mA);
      CHECK(contradicts(exact.tell(100ms, sign * one.change_mA, rest_uV + sign * 60'000)) == one.is_judged);
    }
  }
}

TEST_CASE("the current of a calm has moved exactly a permille of the capacity", "[unit][estimators][F18]") {
  for (const auto& [of_cell_As, is_judged] : {std::pair{32'000, true}, std::pair{31'999, false}}) {
    Exact exact;
    exact.cells.capacity_As = of_cell_As;
    exact.tell(100ms, 10'000);
    exact.tell(4s, 10'000);  // kept as 1 s after the first
    exact.tell(100ms, 10'000);
    CHECK(contradicts(exact.tell(100ms, 20'000, rest_uV + 60'000)) == is_judged);  // 3.2 s later
  }
}

TEST_CASE("one calm that is contradicted is enough, whatever the other one says", "[unit][estimators][F18]") {
  struct Case {
    std::int32_t flowing_uV;  // while 20 A flow
    std::int32_t then_uV;     // 30 A
  };
  for (const Case& one : {Case{3'500'000, 3'550'000}, {3'800'000, 3'750'000}}) {
    Exact exact;
    exact.calm(3s, 0, 3'700'000);
    exact.calm(3s, 20'000, one.flowing_uV);
    CHECK(contradicts(exact.tell(100ms, 30'000, one.then_uV)));
  }
  Exact right;
  right.calm(3s, 0, 3'700'000);
  right.calm(3s, 20'000, 3'660'000);
  CHECK(follows(right.tell(100ms, 30'000, 3'640'000)));
}

TEST_CASE("a sensor stands still within the calm of zero, in the calm and now", "[unit][estimators][F12]") {
  struct Case {
    std::int32_t calm_mA;
    std::int32_t then_mA;
    bool is_judged;
  };
  for (const Case& one : {Case{0, 1'000, true},
                          {0, -1'000, true},
                          {1'000, 1'000, true},
                          {-1'000, -1'000, true},
                          {1'500, 900, false},
                          {900, 1'500, false}}) {
    CAPTURE(one.calm_mA, one.then_mA);
    Exact exact;
    exact.calm(3s, one.calm_mA);
    CHECK(contradicts(exact.tell(100ms, one.then_mA, rest_uV - 60'000)) == one.is_judged);
  }
}

TEST_CASE("cells that move while a sensor stands still have to move beyond what it says and a millivolt",
          "[unit][estimators][F12]") {
  struct Case {
    std::int32_t calm_mA;
    std::int32_t then_mA;
    std::int32_t fall_uV;
    bool is_judged;
  };
  for (const Case& one :
       {Case{500, 500, 11'000, true}, {500, 500, 10'999, false}, {0, 1'000, 19'000, true}, {0, 1'000, 18'999, false}}) {
    CAPTURE(one.then_mA, one.fall_uV);
    Exact exact;
    exact.calm(3s, one.calm_mA);
    CHECK(contradicts(exact.tell(100ms, one.then_mA, rest_uV - one.fall_uV)) == one.is_judged);
  }
}

TEST_CASE("that a sensor stands still is said where the pack voltage is known before and after",
          "[unit][estimators][F12]") {
  for (const bool is_before : {false, true}) {
    for (const bool is_after : {false, true}) {
      Exact exact;
      exact.knows_pack = is_before;
      exact.calm(3s, 0);
      exact.knows_pack = is_after;
      CHECK(contradicts(exact.tell(100ms, 0, rest_uV - 60'000)) == (is_before && is_after));
    }
  }
}

namespace {

// State of a monitor, in the order of its image.
struct CalmImage {
  TimePoint taken_at{};
  std::int32_t current_mA = 0;
  std::int64_t lately_mA = 0;
  std::int64_t sum_uV = 0;
  std::int32_t lowest_uV = 0;
  std::int32_t highest_uV = 0;
  Voltage_mV pack_mV{};
};
struct ReferenceImage {
  CalmImage first;
  CalmImage last;
  std::int64_t risen_uA = 0;
  std::int64_t fallen_uA = 0;
};
struct MonitorImage {
  std::array<CalmImage, 32> ring{};
  std::size_t head = 0;
  CalmImage latest;
  CalmImage waiting;
  ReferenceImage reference;
  ReferenceImage at_zero;
  std::int64_t lately_uA = 0;
  TimePoint lately_at{};
  Reading implausible_current;
  bool is_against_current = false;
};

template <class T>
std::vector<std::uint8_t> image_of(const T& of) {
  std::vector<std::uint8_t> bytes(image_size(of));
  write_image(of, bytes);
  return bytes;
}

bool is_possible(const MonitorImage& state) {
  CurrentRampMonitor monitor;
  return !read_image(image_of(state), monitor);
}

}  // namespace

TEST_CASE("a monitor that has seen nothing, or has forgotten it, knows nothing", "[unit][estimators][image]") {
  const std::vector<std::uint8_t> nothing = image_of(MonitorImage{});
  CHECK(image_of(CurrentRampMonitor{}) == nothing);
  Exact exact;
  exact.calm(5s, 0);
  exact.tell(100ms, 10'000, rest_uV + 60'000);
  CHECK(image_of(exact.monitor) != nothing);
  exact.monitor.forget();
  CHECK(image_of(exact.monitor) == nothing);
  exact.monitor.take({}, exact.cells);  // an empty sample set
  CHECK(image_of(exact.monitor) == nothing);
}

TEST_CASE("what flows while there is no calm to compare with is counted to no side", "[unit][estimators][image]") {
  Exact exact;
  exact.fidget(4s);
  MonitorImage state;
  REQUIRE_FALSE(read_image(image_of(exact.monitor), state));
  CHECK(image_of(state.reference) == image_of(ReferenceImage{}));
  CHECK(image_of(state.at_zero) == image_of(ReferenceImage{}));
}

TEST_CASE("what a monitor cannot know is refused when it is read", "[unit][estimators][image]") {
  constexpr std::int64_t sum_max_uV = 1'000'000'000'000;
  constexpr std::int64_t change_max_uA = 8'589'934'590'000;  // twice the widest range of a current
  constexpr std::int64_t lately_max_mA = 2'147'483'647;
  const auto with = [](const auto& change) {
    MonitorImage state;
    change(state);
    return is_possible(state);
  };
  CHECK(with([](MonitorImage&) {}));
  for (const auto& [value, is_possible] :
       {std::pair{lately_max_mA, true}, std::pair{lately_max_mA + 1, false}, std::pair{std::int64_t{-1}, false}}) {
    CHECK(with([value = value](MonitorImage& state) { state.latest.lately_mA = value; }) == is_possible);
  }
  for (const auto& [value, is_possible] : {std::pair{sum_max_uV, true}, std::pair{sum_max_uV + 1, false},
                                           std::pair{-sum_max_uV, true}, std::pair{-sum_max_uV - 1, false}}) {
    CHECK(with([value = value](MonitorImage& state) { state.ring[31].sum_uV = value; }) == is_possible);
  }
  for (const auto& [value, is_possible] :
       {std::pair{change_max_uA, true}, std::pair{change_max_uA + 1, false}, std::pair{std::int64_t{-1}, false}}) {
    CHECK(with([value = value](MonitorImage& state) { state.reference.risen_uA = value; }) == is_possible);
    CHECK(with([value = value](MonitorImage& state) { state.at_zero.fallen_uA = value; }) == is_possible);
  }
  CHECK(with([](MonitorImage& state) { state.head = 31; }));
  CHECK_FALSE(with([](MonitorImage& state) { state.head = 32; }));
  CHECK_FALSE(with([](MonitorImage& state) { state.lately_uA = -1; }));
}
