// Current requested from chargers: every band, delay and end of a charge at its exact threshold; and the frames sent
// for it.
#include "daemon/core/charging/charge_control.hpp"

#include <algorithm>
#include <vector>

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr std::int32_t full_uV = 4'180'000;

/// Charge control with cells set by the test.
struct Bench {
  CoreConfig config = test::small_pack();
  PackState pack;
  CurrentLimits limits;
  ChargeControl control;
  ChargeInputs in{
      .now = TimePoint{100s}, .is_wanted = true, .is_connected = true, .may_charge = true, .is_talking = true};

  explicit Bench(std::int32_t resume_below_permille = 0) {
    config.charger = {.driver = find_device("elcon_tc")->charger,
                      .current_max_mA = 20'000,
                      .voltage_max_mV = 34'000,
                      .cell_full_uV = full_uV,
                      .end_current_mA = 1'500,
                      .end_for = 30s,
                      .balance_window_uV = 10'000,
                      .resume_below_permille = resume_below_permille,
                      .opens_when_full = resume_below_permille == 0};
    config.cell.series_resistance_Ohm = 0.005;
    control.init(config);
    limits.charge.limit_mA = limits.charge_continuous.limit_mA = 20'000;
    in.pack = &pack;
    in.limits = &limits;
    cells(3'700'000);
    step(0ms);
  }
  void cells(std::int32_t max_uV, std::int32_t spread_uV = 0) {
    pack.cell_voltage_uV = {.min = max_uV - spread_uV, .max = max_uV, .count = 8, .expected = 8};
    pack.cell_voltage_uV.max_taken_at = in.now;
  }
  /// Executes one tick after this time, with a new sample of the unchanged cells and the requested current.
  void step(Duration later) {
    in.now += later;
    pack.cell_voltage_uV.max_taken_at = in.now;
    pack.current_mA = {-control.current_mA(), in.now, Validity::valid};
    control.step(in);
  }
  void run(Duration span, Duration tick = 100ms) {
    for (const TimePoint end = in.now + span; in.now < end;) step(tick);
  }
  /// Time in the present stage.
  [[nodiscard]] Duration since() const { return in.now - control.since(); }
  [[nodiscard]] Duration idle_max() const { return 5min + config.balancing.settle; }
  /// Charges to the top, until no current is requested.
  void fill() {
    run(12s);
    cells(full_uV + 20'000);
    run(20s);
    REQUIRE(control.current_mA() == 0);
    cells(full_uV);
  }
};

}  // namespace

TEST_CASE("the current rises by its ramp, to the least of all limits, and falls at once", "[unit][charger][BMU_11]") {
  Bench bench;
  REQUIRE(bench.control.stage() == ChargeStage::charging);
  CHECK(bench.control.current_mA() == 0);
  bench.step(1s);
  CHECK(bench.control.current_mA() == 2'000);
  bench.step(500ms);
  CHECK(bench.control.current_mA() == 3'000);
  bench.step(10s);  // a late tick must not cause a larger increase
  CHECK(bench.control.current_mA() == 5'000);
  bench.run(20s);
  CHECK(bench.control.current_mA() == 20'000);
  bench.limits.charge_continuous.limit_mA = 12'000;
  bench.step(10ms);
  CHECK(bench.control.current_mA() == 12'000);
  bench.limits.charge.limit_mA = 7'000;
  bench.step(10ms);
  CHECK(bench.control.current_mA() == 7'000);
  bench.pack.cell_voltage_uV.count = 7;
  bench.step(10ms);
  CHECK(bench.control.current_mA() == 0);
}

TEST_CASE("whatever is missing ends the charge in the same tick", "[unit][charger]") {
  for (bool ChargeInputs::*needed :
       {&ChargeInputs::is_wanted, &ChargeInputs::is_connected, &ChargeInputs::may_charge, &ChargeInputs::is_talking}) {
    Bench bench;
    bench.run(5s);
    REQUIRE(bench.control.current_mA() > 0);
    bench.in.*needed = false;
    bench.step(10ms);
    CHECK(bench.control.current_mA() == 0);
    CHECK_FALSE(bench.control.is_enabled());
    CHECK(bench.control.stage() == (needed == &ChargeInputs::is_wanted ? ChargeStage::off : ChargeStage::waiting));
  }
}

TEST_CASE("the highest cell is followed from 50 mV below full on", "[unit][charger]") {
  Bench bench;
  bench.run(12s);
  bench.cells(full_uV - ChargeControl::near_band_uV);
  bench.step(100ms);
  CHECK_FALSE(bench.control.is_held());
  bench.cells(full_uV - ChargeControl::near_band_uV + 1);
  bench.step(100ms);
  CHECK(bench.control.is_held());
  bench.run(5s);
  CHECK(bench.control.current_mA() == 20'000);  // may rise below full
  bench.cells(full_uV + 5'000);                 // 1 A over 5 mOhm: removed within a second
  bench.run(1s);
  CHECK(bench.control.current_mA() == 19'000);
}

TEST_CASE("the top is within 10 mV of full, for as long as the pack file says", "[unit][charger]") {
  Bench bench;
  bench.fill();
  bench.cells(full_uV - ChargeControl::top_band_uV - 1);
  bench.limits.charge.limit_mA = 1'000;
  bench.run(60s);
  CHECK(bench.control.stage() == ChargeStage::charging);
  bench.cells(full_uV - ChargeControl::top_band_uV);
  bench.step(100ms);
  bench.run(30s - 100ms);
  CHECK(bench.control.stage() == ChargeStage::charging);
  bench.step(100ms);
  CHECK(bench.control.stage() == ChargeStage::full);
  CHECK(bench.control.is_done());
}

TEST_CASE("more than the end current is no end", "[unit][charger]") {
  Bench bench;
  bench.fill();
  bench.limits.charge.limit_mA = 1'501;
  bench.cells(full_uV - 5'000);
  bench.run(120s);
  CHECK(bench.control.stage() == ChargeStage::charging);
  bench.limits.charge.limit_mA = 1'500;
  bench.run(31s);
  CHECK(bench.control.stage() == ChargeStage::full);
}

TEST_CASE("a cell that is held for four hours counts as full", "[unit][charger]") {
  Bench bench;
  bench.run(12s);
  bench.cells(full_uV - 1'000);
  bench.step(100ms);
  bench.step(100ms);
  const TimePoint held_since = bench.in.now;
  while (bench.in.now - held_since < ChargeControl::hold_max - 1s) bench.step(1s);
  CHECK(bench.control.stage() == ChargeStage::charging);
  bench.step(1s);
  bench.step(1s);
  CHECK(bench.control.stage() == ChargeStage::full);
}

TEST_CASE("cells that are apart at the top are balanced, and charged on when the highest has come down",
          "[unit][charger]") {
  Bench bench;
  bench.fill();
  bench.in.has_to_balance = true;
  SECTION("within the window") {
    bench.cells(full_uV, 10'000);
    bench.run(31s);
    CHECK(bench.control.stage() == ChargeStage::full);
  }
  SECTION("beyond it, with nothing to bleed") {
    bench.cells(full_uV, 10'001);
    bench.in.has_to_balance = false;
    bench.run(31s);
    CHECK(bench.control.stage() == ChargeStage::full);
    CHECK_FALSE(bench.control.is_in_progress());
  }
  SECTION("beyond it") {
    bench.cells(full_uV, 10'001);
    bench.run(31s);
    REQUIRE(bench.control.stage() == ChargeStage::balancing);
    CHECK(bench.control.is_in_progress());  // a pause does not end the charge
    CHECK(bench.control.current_mA() == 0);
    bench.in.is_bleeding = true;
    SECTION("bleeding has brought the highest down") {
      // The voltage drop of the first five minutes is not bled charge: the reference is the voltage at their end.
      bench.cells(full_uV - 25'000, 10'001);
      bench.run(5min - bench.since() - 100ms);
      bench.cells(full_uV - 30'000, 10'001);
      bench.step(100ms);
      CHECK(bench.control.stage() == ChargeStage::balancing);
      bench.cells(full_uV - 49'999, 10'001);
      bench.run(1h);
      CHECK(bench.control.stage() == ChargeStage::balancing);
      bench.cells(full_uV - 50'000, 10'001);
      bench.step(100ms);
      CHECK(bench.control.stage() == ChargeStage::charging);
    }
    SECTION("it has come down with nothing bled") {
      bench.in.is_bleeding = false;
      bench.run(5min - bench.since());
      bench.cells(full_uV - 50'000, 10'001);
      bench.step(100ms);
      CHECK(bench.control.stage() == ChargeStage::balancing);
      bench.in.is_bleeding = true;
      bench.step(100ms);
      CHECK(bench.control.stage() == ChargeStage::charging);
    }
    SECTION("nothing is bled any more") {
      bench.step(100ms);
      bench.in.is_bleeding = false;
      // At the top by the criterion of has_reached_top, or with enough margin for the charge to continue.
      const auto [below_uV, next] = GENERATE(table<std::int32_t, ChargeStage>(
          {{10'000, ChargeStage::full}, {10'001, ChargeStage::charging}, {19'999, ChargeStage::charging}}));
      bench.cells(full_uV - below_uV, 10'001);
      bench.step(100ms);
      bench.run(bench.idle_max() - 100ms);
      CHECK(bench.control.stage() == ChargeStage::balancing);
      // An unmeasured cell is neither at the top nor below it.
      bench.pack.cell_voltage_uV.count = 7;
      bench.step(100ms);
      CHECK(bench.control.stage() == ChargeStage::balancing);
      bench.pack.cell_voltage_uV.count = 8;
      bench.step(100ms);
      CHECK(bench.control.stage() == next);
      if (next == ChargeStage::full) return;
      // Cells were bled: the next top may pause again.
      bench.fill();
      bench.cells(full_uV, 10'001);
      bench.run(31s);
      CHECK(bench.control.stage() == ChargeStage::balancing);
    }
    SECTION("it takes too long") {
      bench.run(24h - bench.since() - 1min, 1min);
      CHECK(bench.control.stage() == ChargeStage::balancing);
      bench.step(1min);
      CHECK(bench.control.stage() == ChargeStage::full);
    }
  }
}

TEST_CASE("little that the highest cell is to come down does not bring a charge back that has no room",
          "[unit][charger]") {
  Bench bench;
  bench.config.charger.resume_uV = 1'000;
  bench.control.init(bench.config);
  bench.fill();
  bench.in.has_to_balance = bench.in.is_bleeding = true;
  bench.cells(full_uV, 10'001);
  bench.run(31s);
  REQUIRE(bench.control.stage() == ChargeStage::balancing);
  bench.run(5min);
  bench.cells(full_uV - 10'000, 10'001);
  bench.step(100ms);
  CHECK(bench.control.stage() == ChargeStage::balancing);
  bench.cells(full_uV - 10'001, 10'001);
  bench.step(100ms);
  CHECK(bench.control.stage() == ChargeStage::charging);
}

TEST_CASE("a pause in which nothing is bled ends by itself, and is the last one", "[unit][charger]") {
  const bool falls = GENERATE(false, true);
  Bench bench(falls ? 900 : 0);
  bench.fill();
  bench.in.has_to_balance = true;
  bench.cells(full_uV, 10'001);
  bench.run(31s);
  REQUIRE(bench.control.stage() == ChargeStage::balancing);
  bench.cells(full_uV - 50'000, 10'001);
  bench.run(bench.idle_max() - bench.since());
  CHECK(bench.control.stage() == ChargeStage::balancing);
  bench.step(100ms);
  REQUIRE(bench.control.stage() == ChargeStage::charging);
  bench.cells(3'700'000);
  bench.fill();
  bench.cells(full_uV, 10'001);
  bench.run(31s);
  CHECK(bench.control.stage() == ChargeStage::full);
  // In a new charge a pause for bleeding is possible again.
  bench.cells(3'700'000);
  if (falls) bench.in.soc_permille = 899;
  bench.in.is_wanted = falls;
  bench.step(100ms);
  bench.in.is_wanted = true;
  bench.in.soc_permille.reset();
  bench.fill();
  bench.cells(full_uV, 10'001);
  bench.run(31s);
  CHECK(bench.control.stage() == ChargeStage::balancing);
}

TEST_CASE("a full pack stays full until it is unplugged, or has fallen below what the pack file says",
          "[unit][charger]") {
  Bench bench(900);
  bench.fill();
  bench.run(31s);
  REQUIRE(bench.control.stage() == ChargeStage::full);
  CHECK_FALSE(bench.control.is_done());
  bench.cells(3'900'000);
  bench.in.soc_permille = 900;
  bench.step(100ms);
  CHECK(bench.control.stage() == ChargeStage::full);
  bench.in.soc_permille = 899;
  bench.step(100ms);
  CHECK(bench.control.stage() == ChargeStage::charging);
  Bench plain;
  plain.fill();
  plain.run(31s);
  plain.in.soc_permille = 10;
  plain.step(100ms);
  CHECK(plain.control.stage() == ChargeStage::full);
  plain.in.is_wanted = false;
  plain.step(100ms);
  plain.in.is_wanted = true;
  plain.step(100ms);
  CHECK(plain.control.stage() == ChargeStage::charging);
}

TEST_CASE("stages have names of their own", "[unit][charger]") {
  for (std::size_t stage = 0; stage < charge_stage_count; ++stage) {
    CHECK(to_text(static_cast<ChargeStage>(stage)) != "?");
  }
  CHECK(to_text(static_cast<ChargeStage>(charge_stage_count)) == "?");
}

// --- frames sent ----------------------------------------------------------------------------------------------------

namespace {

/// Core that charges, with charger reports set by the test.
struct Plugged {
  CoreConfig config;
  std::vector<bool> talks;
  std::uint16_t troubles = 0;
  TimePoint report_at{};
  test::Boxed<test::CoreBench> bench;

  Plugged(const char* protocol, std::uint8_t units)
      : config(with(protocol, units)), talks(units, true), bench(std::in_place, config) {
    bench->observe(PortChanged{Port::charger, true});
    bench->each_ms = [this] {
      if (bench->now() < report_at) return;
      const ChargerDriver& driver = *config.charger.driver;
      report_at = bench->now() + driver.report_period;
      for (std::uint8_t unit = 0; unit < talks.size(); ++unit) {
        const ChargerReport report{.voltage_mV = known(29'600), .current_mA = known(0), .troubles = troubles};
        if (!talks[unit]) continue;
        for (const CanFrame& frame : driver.reports(unit, report)) bench->observe(FrameReceived{Port::vehicle, frame});
      }
    };
  }
  static CoreConfig with(const char* protocol, std::uint8_t units) {
    CoreConfig config = test::small_pack();
    config.charger = {.driver = find_device(protocol)->charger,
                      .unit_count = units,
                      .current_max_mA = 20'000,
                      .voltage_max_mV = 34'000,
                      .cell_full_uV = full_uV,
                      .end_current_mA = 500};
    return config;
  }
  void plug_in() {
    bench->run(1500ms);
    bench->inputs.charger_connected = true;
    REQUIRE(bench->run_until([this] { return bench->core().sequence().phase == Phase::closed; }, 3s));
  }
  [[nodiscard]] std::vector<ChargerOrder> orders_since(std::size_t from) const {
    std::vector<ChargerOrder> orders;
    for (std::size_t index = from; index < bench->sent().size(); ++index) {
      const OutgoingFrame& sent = bench->sent()[index];
      if (sent.port != Port::charger) continue;
      orders.push_back(config.charger.driver->order_of(sent.frame)->order);
    }
    return orders;
  }
};

}  // namespace

TEST_CASE("a unit that comes late waits until the others have come down for it", "[unit][core][charger]") {
  Plugged plugged("elcon_tc", 2);
  plugged.talks[1] = false;
  plugged.plug_in();
  plugged.bench->run(10s);
  const Core& core = plugged.bench->core();
  const std::int32_t alone_mA = core.ordered_mA(0);
  REQUIRE(alone_mA > 4'000);
  CHECK(core.ordered_mA(1) == 0);
  plugged.talks[1] = true;
  plugged.bench->run(2s);
  CHECK(core.ordered_mA(0) <= alone_mA / 2 + 2'000);
  CHECK(core.ordered_mA(1) == 0);
  plugged.bench->run(plugged.config.charger.driver->settle - 2s);
  CHECK(core.ordered_mA(1) == 0);
  plugged.bench->run(2s);
  CHECK(core.ordered_mA(1) == core.ordered_mA(0));
  CHECK(core.gate_refusals() == 0);
}

TEST_CASE("less is told within a moment, and not with every tick", "[unit][core][charger]") {
  Plugged plugged("elcon_tc", 1);
  plugged.plug_in();
  plugged.bench->run(10s);
  const Core& core = plugged.bench->core();
  REQUIRE(core.ordered_mA(0) > 4'000);
  const std::size_t before = plugged.bench->sent().size();
  plugged.bench->modules[0].talks = false;  // its cells become stale, and no current is requested
  REQUIRE(plugged.bench->run_until([&] { return core.charge_control().current_mA() == 0; }, 1s));
  plugged.bench->run(60ms);
  CHECK(core.ordered_mA(0) == 0);
  CHECK(plugged.orders_since(before).size() <= 5);
}

TEST_CASE("what did not go out was not asked for", "[unit][core][charger]") {
  Plugged plugged("elcon_tc", 1);
  plugged.plug_in();
  plugged.bench->observe(PortChanged{Port::charger, false});
  const std::int32_t before_mA = plugged.bench->core().ordered_mA(0);
  plugged.bench->run(2s);
  CHECK(plugged.bench->core().charge_control().current_mA() > before_mA);
  CHECK(plugged.bench->core().ordered_mA(0) == before_mA);
}

TEST_CASE("a command that was lost on its way out comes again before its period is over, and not with every tick",
          "[unit][core][charger]") {
  Plugged plugged("elcon_tc", 1);
  plugged.plug_in();
  plugged.bench->run(10s);
  const std::size_t before = plugged.bench->sent().size();
  const auto count = [&] { return plugged.orders_since(before).size(); };
  REQUIRE(plugged.bench->run_until([&] { return count() == 1; }, 1s));
  plugged.bench->observe(SendFailed{Port::charger, plugged.config.charger.driver->command(0, {})});
  plugged.bench->run(40ms);
  CHECK(count() == 1);
  plugged.bench->run(40ms);
  CHECK(count() == 2);
  plugged.bench->run(400ms);
  CHECK(count() == 2);
}

TEST_CASE("latched errors are cleared by a bit that comes and goes, ten times and no more", "[unit][core][charger]") {
  Plugged plugged("brusa_nlg5", 1);
  plugged.troubles = bit_of(ChargerTrouble::no_command);
  plugged.plug_in();
  const std::size_t from = plugged.bench->sent().size();
  plugged.bench->run(40s);
  const std::vector<ChargerOrder> orders = plugged.orders_since(from);
  std::size_t last = 0;
  std::size_t cleared = 0;
  for (std::size_t index = 0; index < orders.size(); ++index) {
    if (!orders[index].clears_errors) continue;
    if (cleared > 0) CHECK(index - last >= 19);  // with a command every 100 ms
    last = index;
    ++cleared;
  }
  CHECK(cleared >= 8);
  CHECK(cleared <= 10);
  CHECK(last < orders.size() / 2 + 20);
}

TEST_CASE("the first word to a charger is said when its bus comes up, and not counted as said before",
          "[unit][core][charger]") {
  Plugged plugged("elcon_tc", 1);
  test::CoreBench& bench = *plugged.bench;
  bench.observe(PortChanged{Port::charger, false});
  const std::size_t before = bench.sent().size();
  bench.run(1s);
  CHECK(plugged.orders_since(before).empty());
  bench.observe(PortChanged{Port::charger, true});
  bench.run(20ms);
  CHECK(plugged.orders_since(before).size() == 1);
}
