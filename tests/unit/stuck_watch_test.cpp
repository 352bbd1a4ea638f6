// Values that stand still although the current moves or charge flows, and those that may.
#include "daemon/core/stuck_watch.hpp"

#include "daemon/core/estimators/ocv_shift.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/module_feed.hpp"

using namespace bmu;
using test::ModuleFeed;

namespace {

CoreConfig pack_of_2_mOhm() {
  CoreConfig config = test::small_pack();
  config.cell.series_resistance_Ohm = 0.002;  // 5 mV at 2.5 A
  return config;
}
constexpr std::int32_t shows_mA = 2'500;

/// Two modules of four cells that are polled every 100 ms; each cell as it is told to be.
class Watched {
 public:
  explicit Watched(const CoreConfig& config = pack_of_2_mOhm()) : feed_(config) { watch_.init(config); }

  void poll(std::int32_t current_mA, Duration later = 100ms) {
    tell(later);
    watch_.update(feed_.modules(), {current_mA, feed_.now(), Validity::valid}, window_);
  }
  /// 10 ms in which this current flows, with a sample of it; cells are polled in every `ticks_of_a_poll`th.
  void tick(std::int32_t current_mA) {
    if (++ticks_ % ticks_of_a_poll == 0) {
      tell(10ms);
    } else {
      feed_.pass(10ms);
    }
    window_.add(current_mA, feed_.now());
    watch_.update(feed_.modules(), {current_mA, feed_.now(), Validity::valid}, window_);
  }
  /// The cells come, and the current does not.
  void poll_blind() {
    tell(100ms);
    watch_.update(feed_.modules(), {}, window_);
  }
  /// Polls that move the cells as any real cell moves, except those that are kept.
  void wiggle(int polls, std::int32_t current_mA) {
    for (int count = 0; count < polls; ++count) {
      for (auto& module : cells_uV) {
        for (std::int32_t& value_uV : module) value_uV += value_uV == kept_uV ? 0 : (count % 2 == 0 ? 100 : -100);
      }
      poll(current_mA);
    }
  }
  [[nodiscard]] Reading longest() const { return watch_.longest_ms(feed_.modules()); }
  [[nodiscard]] std::int64_t charge_shown_uAs() const { return watch_.charge_shown_uAs(); }
  void forget() { watch_.forget(); }

  static constexpr std::int32_t not_measured = -1;
  static constexpr std::int32_t kept_uV = 3'700'000;
  int ticks_of_a_poll = 10;
  std::array<std::array<std::int32_t, 4>, 2> cells_uV{
      {{3'700'100, 3'700'100, 3'700'100, 3'700'100}, {3'700'100, 3'700'100, 3'700'100, 3'700'100}}};

 private:
  void tell(Duration later) {
    feed_.pass(later);
    feed_.poll();
    for (std::uint8_t node = 1; node <= 2; ++node) {
      std::vector<SignalValue> cells;
      for (const std::int32_t value_uV : cells_uV[node - 1U]) {
        cells.push_back(value_uV == not_measured ? not_known(Validity::open_circuit) : known(value_uV));
      }
      feed_.cells(node, cells, known(14'800));
    }
  }

  ModuleFeed feed_;
  StuckWatch watch_;
  CurrentWindow window_;
  int ticks_ = 0;
};

}  // namespace

TEST_CASE("in a rest, or while no more flows than balances a cell, a cell may stand still for as long as it likes",
          "[unit][plausibility][F12]") {
  for (const std::int32_t current_mA : {0, 500, -500}) {
    Watched watched;
    for (int count = 0; count < 60'000; ++count) watched.poll(current_mA);
    CHECK(watched.longest().is_known);
    CHECK(watched.longest().value == 0);
  }
}

TEST_CASE("at a steady current time counts from when the charge must show, and exactly from there",
          "[unit][plausibility][F12]") {
  for (const std::int32_t current_mA : {501, 50'000, -20'000}) {
    Watched watched;
    const std::int64_t a_poll_uAs = std::int64_t{std::abs(current_mA)} * 100;
    const std::int64_t polls = (watched.charge_shown_uAs() + a_poll_uAs - 1) / a_poll_uAs;
    watched.poll(current_mA);
    for (std::int64_t count = 1; count < polls; ++count) watched.poll(current_mA);
    CHECK(watched.longest().value == 0);
    watched.poll(current_mA);
    CHECK(watched.longest().value == 100);
    for (int count = 0; count < 30; ++count) watched.poll(current_mA);
    CHECK(watched.longest().value == 3'100);
  }
}

TEST_CASE("charge that has flowed back proves nothing", "[unit][plausibility][F12]") {
  Watched watched;
  const std::int32_t current_mA = shows_mA / 2 - 1;  // there and back is no step that shows
  const std::int64_t polls = watched.charge_shown_uAs() / (std::int64_t{current_mA} * 100);
  for (const std::int32_t way_mA : {current_mA, -current_mA, current_mA}) {
    for (std::int64_t count = 0; count < polls; ++count) watched.poll(way_mA);
  }
  CHECK(watched.longest().value == 0);
}

TEST_CASE("no charge counts before it is the whole thousandths of the capacity that show",
          "[unit][plausibility][F12]") {
  CoreConfig config = pack_of_2_mOhm();
  config.cell.ocv.clear();
  config.cell.ocv.push_back({0, 3'000'000});
  config.cell.ocv.push_back({1000, 4'500'000});  // 5 mV at 3.3 thousandths, and so at 4
  for (const std::int32_t current_mA : {20'000, -20'000}) {
    Watched watched(config);
    REQUIRE(watched.charge_shown_uAs() == 720'000'000);
    watched.poll(current_mA);
    for (int count = 1; count < 360; ++count) watched.poll(current_mA);
    CHECK(watched.longest().value == 0);
    watched.poll(current_mA);
    CHECK(watched.longest().value == 100);
  }
}

TEST_CASE("a current that has become less by 1 mA works against the charge", "[unit][plausibility][F12]") {
  Watched watched;
  REQUIRE(watched.charge_shown_uAs() == 900'000'000);
  for (int count = 0; count < 180; ++count) watched.poll(50'001);
  // 5.0001 mV by 900.0179 As, but 4 uV less by what a worn cell makes of the milliampere.
  watched.poll(50'000);
  CHECK(watched.longest().value == 0);
}

TEST_CASE("a hole in the current is no charge", "[unit][plausibility][F12]") {
  Watched watched;
  watched.poll(50'000);
  for (int count = 0; count < 100; ++count) watched.poll(50'000, 1'001ms);
  CHECK(watched.longest().value == 0);
}

TEST_CASE("a charger that holds its voltage holds the cells, too, while its current falls",
          "[unit][plausibility][F12]") {
  Watched watched;  // 2 mOhm, 1 V over half of 50 Ah
  double current_A = 20.0;
  for (int count = 0; count < 72'000; ++count) {
    watched.poll(static_cast<std::int32_t>(-current_A * 1e3));
    // As much less by resistance as the charge is more: 14 uV each As, at 2 mOhm.
    current_A -= current_A * 0.1 * 1e6 / (50.0 * 3'600.0) * 1e-6 * 1.0 / 0.002;
    CHECK(watched.longest().value == 0);
  }
}

TEST_CASE("of current and charge that work against each other the stronger one counts by what is left of it",
          "[unit][plausibility][F12]") {
  // After a little charge at 50 A the load goes: 100 mV up by resistance, and next to nothing down.
  Watched step;
  for (int count = 0; count < 20; ++count) step.poll(50'000);
  for (int count = 0; count < 10; ++count) step.poll(0);
  CHECK(step.longest().value == 1'000);
  // After half the capacity a little of the current is gone, be it a step that shows or not: the charge counts.
  for (const std::int32_t less_mA : {10'000, 1'000}) {
    Watched flow;
    for (int count = 0; count < 100; ++count) flow.poll(900'000, 1s);
    const std::int64_t before = flow.longest().value;
    flow.poll(900'000 - less_mA, 1s);
    CHECK(flow.longest().value == before + 1'000);
  }
}

TEST_CASE("what is left of current and charge that work against each other counts from 5 mV on, exactly",
          "[unit][plausibility][F12]") {
  const CoreConfig config = pack_of_2_mOhm();
  int exactly = 0;
  for (int polls = 1; polls <= 9; ++polls) {
    for (std::int32_t less_mA = 2'500; less_mA < 2'900; ++less_mA) {
      Watched step;
      for (int count = 0; count <= polls; ++count) step.poll(50'000);
      step.poll(50'000 - less_mA);
      const std::int64_t flowed_uAs = std::int64_t{polls} * 5'000'000 + std::int64_t{50'000 - less_mA} * 100;
      const std::int64_t left_uV = std::int64_t{less_mA} * 2 - std::llround(ocv_shift(config.cell, flowed_uAs).most_uV);
      CHECK(step.longest().value == (left_uV >= 5'000 ? 100 : 0));
      exactly += left_uV == 5'000 ? 1 : 0;
    }
  }
  CHECK(exactly > 0);
  exactly = 0;
  for (std::int32_t current_mA = 900'000; current_mA < 908'000; current_mA += 1'000) {
    for (std::int32_t less_mA = 2'450; less_mA < 2'550; ++less_mA) {
      Watched flow;
      for (int count = 0; count <= 2; ++count) flow.poll(current_mA, 1s);
      const std::int64_t before = flow.longest().value;
      flow.poll(current_mA - less_mA, 1s);
      const std::int64_t flowed_uAs = (std::int64_t{3} * current_mA - less_mA) * 1'000;
      const std::int64_t left_uV =
          std::llround(ocv_shift(config.cell, flowed_uAs).least_uV) - std::int64_t{less_mA} * 4;
      CHECK(flow.longest().value == before + (left_uV >= 5'000 ? 1'000 : 0));
      exactly += left_uV == 5'000 ? 1 : 0;
    }
  }
  CHECK(exactly > 0);
}

TEST_CASE("a slow part of the resistance counts where it works against the charge", "[unit][plausibility][F12]") {
  for (const auto& [rc_resistance_Ohm, counts] : {std::pair{0.0, true}, std::pair{0.002, false}}) {
    CoreConfig config = pack_of_2_mOhm();
    config.cell.rc_resistance_Ohm = rc_resistance_Ohm;
    Watched flow(config);
    for (int count = 0; count < 100; ++count) flow.poll(900'000, 1s);  // half the capacity: at least 0.5 V
    const std::int64_t before = flow.longest().value;
    flow.poll(800'000, 1s);  // 0.4 V, or 0.8 V
    CHECK(flow.longest().value == before + (counts ? 1'000 : 0));
  }
}

TEST_CASE("the slowest part counts as well, and what the cold makes of it all", "[unit][plausibility][F12]") {
  for (const auto& [slow_Ohm, activation_K, counts] :
       {std::tuple{0.0, 0.0, true}, std::tuple{0.002, 0.0, false}, std::tuple{0.0, 1'400.0, false}}) {
    CoreConfig config = pack_of_2_mOhm();
    config.cell.slow_rc_resistance_Ohm = slow_Ohm;
    config.cell.resistance_activation_K = activation_K;
    Watched flow(config);
    for (int count = 0; count < 100; ++count) flow.poll(900'000, 1s);
    const std::int64_t before = flow.longest().value;
    flow.poll(800'000, 1s);
    CHECK(flow.longest().value == before + (counts ? 1'000 : 0));
  }
}

TEST_CASE("a step has to show in a hot cell, too, whose resistance is less", "[unit][plausibility][F12]") {
  CoreConfig config = pack_of_2_mOhm();
  config.cell.resistance_activation_K = 2'500.0;  // at 60 C 0.414 of it: 5 mV at 6.04 A
  for (const auto& [step_mA, counts] : {std::pair{6'000, false}, std::pair{6'100, true}}) {
    Watched step(config);
    step.poll(0);
    step.poll(step_mA);
    step.poll(step_mA);
    CHECK((step.longest().value > 0) == counts);
  }
}

TEST_CASE("what flowed while the current was not known is not counted", "[unit][plausibility][F12]") {
  Watched watched;
  watched.poll(50'000);
  const std::int64_t polls = watched.charge_shown_uAs() / 5'000'000 + 11;
  for (std::int64_t count = 0; count < polls; ++count) watched.poll_blind();
  for (int count = 0; count < 5; ++count) watched.poll(50'000);
  CHECK(watched.longest().value == 0);
}

TEST_CASE("the smallest charge that shows counts like any other", "[unit][plausibility][F12]") {
  CoreConfig config = test::small_pack();
  config.cell.series_resistance_Ohm = 0.0;
  config.cell.capacity_uAs = 1'000;
  config.cell.ocv.clear();
  config.cell.ocv.push_back({0, 0});
  config.cell.ocv.push_back({1000, 5'000'000});  // 5 mV for each uAs
  Watched watched(config);
  CHECK(watched.charge_shown_uAs() == 1);
  watched.poll(50'000);
  watched.poll(50'000);
  CHECK(watched.longest().value == 100);
}

TEST_CASE("the least a charge moves a cell is on the flattest stretch, the most on the steepest",
          "[unit][plausibility][F12]") {
  CellModel cell;
  cell.capacity_uAs = 1'000'000;
  cell.ocv.push_back({0, 3'000'000});
  cell.ocv.push_back({200, 3'200'000});   // 1 mV each permille
  cell.ocv.push_back({300, 3'204'000});   // 0.04 mV
  cell.ocv.push_back({1000, 3'554'000});  // 0.5 mV
  CHECK(ocv_shift(cell, 100'000).least_uV == Approx(4'000));
  CHECK(ocv_shift(cell, 100'000).most_uV == Approx(100'000));
  CHECK(ocv_shift(cell, 110'000).least_uV == Approx(9'000));
  CHECK(ocv_shift(cell, 0).most_uV == Approx(0).margin(1e-6));
  CHECK(ocv_shift(cell, 2'000'000).least_uV == Approx(554'000));
  CHECK(ocv_shift(cell, 2'000'000).most_uV == Approx(554'000));
  CHECK(charge_for_shift_uAs(cell, 5'000) == 102'000);
  CHECK(charge_for_shift_uAs(cell, 555'000) == 0);
  CHECK(charge_for_shift_uAs({}, 5'000) == 0);
}

TEST_CASE("time counts from the change of current that a cell must show, and exactly from there",
          "[unit][plausibility][F12]") {
  for (const std::int32_t change_mA : {shows_mA - 1, shows_mA, -shows_mA + 1, -shows_mA}) {
    Watched watched;
    watched.poll(0);
    for (int count = 0; count < 20; ++count) watched.poll(change_mA);
    CHECK(watched.longest().value == (std::abs(change_mA) >= shows_mA ? 2'000 : 0));
  }
}

TEST_CASE("a sample within a poll cycle of a step of the current stands for the current on either side of it",
          "[unit][plausibility][F12]") {
  // The value comes with the poll in tick 50, the step in one of those before or after it.
  for (const auto& [from_mA, to_mA] : {std::pair{0, 20'000}, std::pair{20'000, 0}, std::pair{-20'000, 10'000}}) {
    for (int step = 35; step <= 75; ++step) {
      Watched watched;
      watched.cells_uV[0].fill(3'600'000);
      watched.cells_uV[1].fill(3'600'000);
      for (int tick = 1; tick <= 1'050; ++tick) {
        if (tick == 50) {
          watched.cells_uV[0].fill(Watched::kept_uV);
          watched.cells_uV[1].fill(Watched::kept_uV);
        }
        watched.tick(tick < step ? from_mA : to_mA);
      }
      CAPTURE(from_mA, to_mA, step);
      // 10 s in all. Those around the step are left out; whoever has stood still before and after it has to show.
      if (step <= 62) CHECK(watched.longest().value == 0);
      if (step >= 63) CHECK(watched.longest().value >= 9'500);
    }
  }
}

TEST_CASE("a sample stands for the current within 120 ms of it, however long the next sample takes",
          "[unit][plausibility][F12]") {
  // The value comes with the poll in tick 30; the next samples are those of ticks 60, 90 and so on.
  for (int step = 15; step <= 55; ++step) {
    Watched watched;
    watched.ticks_of_a_poll = 30;
    for (auto& module : watched.cells_uV) module.fill(Watched::kept_uV);
    for (int tick = 1; tick <= 1'050; ++tick) watched.tick(tick < step ? 0 : 20'000);
    CAPTURE(step);
    if (step <= 42) CHECK(watched.longest().value == 0);
    if (step >= 43) CHECK(watched.longest().value >= 9'500);
  }
}

TEST_CASE("a sample stands for the currents of the configured poll cycle around it, and 100 ms at least",
          "[unit][plausibility][F12]") {
  struct Case {
    Duration period;
    int last_step;  // that the value of tick 24 is no reference for, and 20 ms behind the cycle
  };
  for (const Case& one : {Case{120ms, 38}, Case{100ms, 36}, Case{20ms, 36}}) {
    for (int step = 10; step <= 45; ++step) {
      CoreConfig config = pack_of_2_mOhm();
      config.poll.period = one.period;
      Watched watched(config);
      watched.ticks_of_a_poll = 12;
      for (int tick = 1; tick <= 1'050; ++tick) {
        if (tick == 24) {
          for (auto& module : watched.cells_uV) module.fill(Watched::kept_uV);
        }
        watched.tick(tick < step ? 0 : 20'000);
      }
      CAPTURE(to_ms(one.period), step);
      if (step <= one.last_step) CHECK(watched.longest().value == 0);
      if (step > one.last_step) CHECK(watched.longest().value >= 9'500);
    }
  }
}

TEST_CASE("a later sample, too, is no reference for the current before a step within a poll cycle behind it",
          "[unit][plausibility][F12]") {
  // Around the first sample, in tick 10, the current swings; then it rests, until a step.
  for (int step = 61; step <= 160; ++step) {
    Watched watched;
    for (auto& module : watched.cells_uV) module.fill(Watched::kept_uV);
    const auto current_mA = [step](int tick) {
      return tick >= step ? 20'000 : tick <= 30 && tick % 2 == 0 ? 40'000 : 0;
    };
    int tick = 1;
    for (; tick <= 62; ++tick) watched.tick(current_mA(tick));
    for (; tick <= 1'160; ++tick) watched.tick(current_mA(tick));
    CAPTURE(step);
    // The sample of tick 50 is the first whose surroundings are steady, to tick 62.
    if (step <= 62) CHECK(watched.longest().value == 0);
    if (step >= 63) CHECK(watched.longest().value >= 9'500);
  }
}

TEST_CASE("a current that swings faster than cells are polled shows nothing by its steps, and by its charge as before",
          "[unit][plausibility][F12]") {
  Watched watched;
  const auto swing = [&watched](int ticks) {
    for (int tick = 0; tick < ticks; ++tick) watched.tick(tick % 14 < 7 ? 100'000 : 0);
  };
  const auto ticks_to_show = static_cast<int>(watched.charge_shown_uAs() / 500'000);  // 50 A on average
  swing(ticks_to_show - 20);
  CHECK(watched.longest().value == 0);
  swing(140);
  CHECK(watched.longest().value >= 1'000);
}

TEST_CASE("the charge counts from the first sample, although a later one came at a steadier current",
          "[unit][plausibility][F12]") {
  Watched watched;
  const auto ticks_to_show = static_cast<int>(watched.charge_shown_uAs() / 500'000);
  for (int tick = 0; tick < ticks_to_show - 20; ++tick) watched.tick(tick % 14 < 7 ? 100'000 : 0);
  CHECK(watched.longest().value == 0);
  for (int tick = 0; tick < 120; ++tick) watched.tick(50'000);
  CHECK(watched.longest().value >= 800);
}

TEST_CASE("a step counts from the steadiest sample, exactly, and a steady current has no width",
          "[unit][plausibility][F12]") {
  Watched ripple;  // of 1 mA around the first sample
  for (int tick = 1; tick <= 9; ++tick) ripple.tick(1);
  for (int tick = 10; tick <= 60; ++tick) ripple.tick(0);
  for (int tick = 61; tick <= 160; ++tick) ripple.tick(shows_mA);
  CHECK(ripple.longest().value >= 900);

  Watched back;  // 0 A and 20 A around the first sample, then 20 A, then 10 A, between them
  for (int tick = 1; tick <= 14; ++tick) back.tick(0);
  for (int tick = 15; tick <= 500; ++tick) back.tick(20'000);
  CHECK(back.longest().value == 0);
  for (int tick = 501; tick <= 600; ++tick) back.tick(10'000);
  CHECK(back.longest().value >= 900);
}

TEST_CASE("each sample is tried as a reference, also where they come as far apart as the currents around them",
          "[unit][plausibility][F12]") {
  // Samples in ticks 12, 24, 36, 48 and 60. Only that of tick 36 is without a swing within 120 ms.
  Watched watched;
  watched.ticks_of_a_poll = 12;
  for (auto& module : watched.cells_uV) module.fill(Watched::kept_uV);
  for (int tick = 1; tick < 24; ++tick) watched.tick(tick % 2 == 0 ? 2 * shows_mA : 0);
  for (int tick = 24; tick <= 48; ++tick) watched.tick(shows_mA);
  CHECK(watched.longest().value == 0);
  for (int tick = 49; tick <= 60; ++tick) watched.tick(2 * shows_mA);
  CHECK(watched.longest().value == 120);
}

TEST_CASE("the second sample is tried as a reference when it comes just as the currents around the first are known",
          "[unit][plausibility][F12]") {
  // Samples in ticks 12, 24, 36 and 48. Only that of tick 24 is without a swing within 120 ms.
  Watched watched;
  watched.ticks_of_a_poll = 12;
  for (auto& module : watched.cells_uV) module.fill(Watched::kept_uV);
  for (int tick = 1; tick < 12; ++tick) watched.tick(tick % 2 == 0 ? 2 * shows_mA : 0);
  for (int tick = 12; tick <= 36; ++tick) watched.tick(shows_mA);
  CHECK(watched.longest().value == 0);
  for (int tick = 37; tick <= 48; ++tick) watched.tick(2 * shows_mA);
  CHECK(watched.longest().value == 120);
}

TEST_CASE("of samples at equally steady currents the first is the reference", "[unit][plausibility][F12]") {
  Watched watched;
  int ticks = 0;
  const auto run_to = [&](int tick, std::int32_t low_mA, std::int32_t high_mA) {
    for (; ticks < tick; ++ticks) watched.tick(ticks % 2 == 0 ? low_mA : high_mA);
  };
  run_to(7, 100'000, 100'000);  // 52 A to 100 A around the first sample: its charge proves nothing for long
  run_to(25, 52'000, 54'000);
  run_to(1'700, 50'000, 51'000);  // some 850 As, and 900 As show
  CHECK(watched.longest().value == 0);
  run_to(1'950, 50'000, 51'000);
  CHECK(watched.longest().value >= 500);
}

TEST_CASE("a single cell that stands still is named, its neighbours are not", "[unit][plausibility][F12]") {
  Watched watched;
  watched.cells_uV[1][2] = Watched::kept_uV;
  watched.wiggle(1, 0);
  watched.wiggle(30, 20'000);
  CHECK(watched.longest().value == 3'000);
  CHECK(watched.longest().element == Element{.module_node = 2, .number = 3, .pack_number = 7});
}

TEST_CASE("the first other digit ends it", "[unit][plausibility][F12]") {
  Watched watched;
  watched.cells_uV[0][0] = Watched::kept_uV;
  watched.wiggle(1, 0);
  watched.wiggle(79, 20'000);
  CHECK(watched.longest().value == 7'900);
  watched.cells_uV[0][0] += 100;  // a step of the wire
  watched.poll(20'000);
  CHECK(watched.longest().value == 0);
}

TEST_CASE("a current that comes back to where it was stops the clock, and does not turn it back",
          "[unit][plausibility][F12]") {
  Watched watched;
  watched.cells_uV[0][0] = Watched::kept_uV;
  watched.wiggle(1, 0);
  watched.wiggle(10, 20'000);
  watched.wiggle(50, 0);
  CHECK(watched.longest().value == 1'000);
  watched.wiggle(10, -20'000);
  CHECK(watched.longest().value == 2'000);
}

TEST_CASE("what was not measured, a hole and an unknown current prove nothing", "[unit][plausibility][F12]") {
  Watched invalid;
  invalid.cells_uV[0][0] = Watched::kept_uV;
  invalid.wiggle(1, 0);
  invalid.wiggle(10, 20'000);
  invalid.cells_uV[0][0] = Watched::not_measured;
  invalid.poll(20'000);
  CHECK(invalid.longest().value == 0);
  for (const auto& [hole, counted_ms] : {std::pair{Duration{1s}, 1'000}, std::pair{1s + 1ns, 0}}) {
    Watched silent;
    silent.poll(0);
    silent.poll(20'000, hole);
    CHECK(silent.longest().value == counted_ms);
  }
  Watched blind;
  blind.poll(20'000);
  blind.poll_blind();
  CHECK(blind.longest().value == 0);
  Watched forgotten;
  forgotten.poll(0);
  forgotten.poll(20'000);
  CHECK(forgotten.longest().value == 100);
  forgotten.forget();
  CHECK(forgotten.longest().value == 0);
}

TEST_CASE("a pack whose cell file has no curve is watched by current alone", "[unit][plausibility][F12]") {
  CoreConfig config = pack_of_2_mOhm();
  config.cell.ocv.clear();
  Watched watched(config);
  CHECK(watched.charge_shown_uAs() == 0);
  for (int count = 0; count < 6'000; ++count) watched.poll(50'000);
  CHECK(watched.longest().value == 0);
  watched.poll(50'000 + shows_mA);
  CHECK(watched.longest().value == 100);
}

TEST_CASE("of cells that stand still as long the first is named", "[unit][plausibility][F12]") {
  Watched watched;
  watched.poll(0);
  watched.poll(20'000);
  CHECK(watched.longest().element == Element{.module_node = 1, .number = 1, .pack_number = 1});
}

TEST_CASE("a cell of no volts stands still like any other, and not when it comes first or is not measured",
          "[unit][plausibility][F12]") {
  Watched shorted;
  for (auto& module : shorted.cells_uV) module.fill(0);
  shorted.poll(20'000);
  shorted.poll(20'000);
  CHECK(shorted.longest().value == 0);
  shorted.poll(0);
  CHECK(shorted.longest().value == 100);
  for (auto& module : shorted.cells_uV) module.fill(Watched::not_measured);
  shorted.poll(0);
  CHECK(shorted.longest().value == 0);
}

TEST_CASE("a pack whose cell file has no resistance is watched by charge alone", "[unit][plausibility][F12]") {
  Watched watched(test::small_pack());
  watched.poll(0);
  for (int count = 0; count < 100; ++count) watched.poll(50'000);
  CHECK(watched.longest().is_known);
  CHECK(watched.longest().value == 0);
}

namespace {

/// Drives with a current that changes all the time; the cells follow by their resistance, except in `stuck_modules`.
bool becomes_a_fault(std::size_t stuck_module, Duration at_most, std::int32_t swing_mA = 10'000) {
  test::CoreBench bench(pack_of_2_mOhm());
  REQUIRE(bench.close());
  bench.current_mA = 10'000;
  bench.run(100ms);
  std::int64_t polls = 0;
  bench.before_poll = [&bench, &polls, stuck_module, swing_mA] {
    ++polls;
    bench.current_mA = 10'000 + static_cast<std::int32_t>(polls / 5 % 2) * swing_mA;
    for (std::size_t index = 0; index < bench.modules.size(); ++index) {
      if (index == stuck_module && polls > 5) continue;
      for (auto& cell : bench.modules[index].cell_voltage_uV) cell = known(3'700'000 - bench.current_mA * 2);
    }
    bench.pack_voltage_mV = 29'600;
  };
  return bench.run_until([&] { return bench.is_active(FaultId::stuck_values); }, at_most);
}

}  // namespace

TEST_CASE("a module that repeats itself while driving opens the pack, one at a steady current does not",
          "[unit][core][plausibility][F12]") {
  constexpr std::size_t none = 9;
  CHECK(becomes_a_fault(1, 20s));
  CHECK_FALSE(becomes_a_fault(none, 60s));
  CHECK_FALSE(becomes_a_fault(1, 60s, 0));
}
