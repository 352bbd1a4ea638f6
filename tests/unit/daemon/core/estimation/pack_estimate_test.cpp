// States of charge of a whole pack from the data on the bus: their start, the published value, the state kept over
// restarts, and the reports when something differs from the pack file.
#include "daemon/core/estimation/pack_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::LivingPack;
using test::SimulatedCellOptions;

namespace {

/// Two modules of four cells with tables of their own, 10 Ah each.
CoreConfig sloped_pack() {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = std::llround(config.dynamics->capacity_As * 1e6);
  config.limits.cell_undervoltage = {.warn = 2'600'000, .open = 2'500'000, .hysteresis = 10'000};
  return config;
}

/// Alternates between ten seconds at 1C and ten seconds at rest.
void drive(LivingPack& pack, int turns) {
  for (int turn = 0; turn < turns; ++turn) {
    pack.current_A = turn % 2 == 0 ? 10.0 : 0.0;
    pack.run(10s);
  }
}

PersistentState kept_after_drive(const CoreConfig& config, double soc) {
  LivingPack pack(config, soc);
  pack.bench().observe(WallClockSeen{1'700'000'000'000});
  pack.run(3s);
  REQUIRE(pack.bench().close());
  drive(pack, 6);
  pack.bench().give(Command::shut_down);
  pack.run(1s);
  REQUIRE(pack.core().persistent().soc.is_kept);
  return pack.core().persistent();
}

std::int32_t worst_off_permille(const LivingPack& pack) {
  double worst = 0.0;
  for (std::size_t number = 0; number < pack.size(); ++number) {
    worst = std::max(worst, std::abs(pack.estimate().cell_soc(number).soc - pack.cell(number).soc()));
  }
  return static_cast<std::int32_t>(std::lround(worst * 1e3));
}

}  // namespace

TEST_CASE("nothing is told of a charge before the pack has rested, and then what the voltages say",
          "[unit][estimators][BMS_F.6]") {
  LivingPack pack(sloped_pack(), 0.6);
  CHECK_FALSE(pack.core().soc_permille());
  pack.run(500ms);
  CHECK_FALSE(pack.core().soc_permille());
  CHECK(pack.estimate().origin() == SocOrigin::none);
  pack.run(2500ms);
  REQUIRE(pack.core().soc_permille());
  CHECK(std::abs(*pack.core().soc_permille() - 600) <= 5);
  CHECK(pack.estimate().origin() == SocOrigin::voltage);
  CHECK(worst_off_permille(pack) <= 5);
  CHECK(std::count_if(pack.bench().events().begin(), pack.bench().events().end(),
                      [](const Event& event) { return event.id == EventId::soc_started; }) == 1);
}

TEST_CASE("a current that is no rest keeps a pack from beginning", "[unit][estimators][BMS_F.6]") {
  LivingPack pack(sloped_pack(), 0.6);
  pack.sensor_offset_A = 0.201;  // soc/rest_current_mA is 200
  pack.run(5s);
  CHECK_FALSE(pack.core().soc_permille());
  pack.sensor_offset_A = 0.2;
  pack.run(3s);
  CHECK(pack.core().soc_permille());
}

TEST_CASE("in a drive every cell is followed, and what is told never steps", "[unit][estimators][BMS_F.6][BMU_8]") {
  std::vector<SimulatedCellOptions> truth;
  for (int number = 0; number < 8; ++number) truth.push_back({.soc = 0.55 + 0.02 * number, .voltage_noise_V = 0.001});
  LivingPack pack(sloped_pack(), 0.6, truth);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  double before = pack.estimate().told_soc();
  for (int turn = 0; turn < 30; ++turn) {
    pack.current_A = turn % 2 == 0 ? 10.0 : 0.0;
    for (int step = 0; step < 100; ++step) {
      pack.run(100ms);
      const double told = pack.estimate().told_soc();
      // A tenth of a second at 1C over about nine tenths of the capacity, and 2 % a second in the start phase.
      REQUIRE(std::abs(told - before) <= 10.0 * 0.12 / 36'000.0 / 0.8 + 0.02 * 0.12);
      before = told;
    }
  }
  CHECK(worst_off_permille(pack) <= 10);
  const PackSoc& whole = pack.estimate().pack();
  CHECK(whole.emptiest == 0);
  CHECK(whole.fullest == 7);
  CHECK(whole.soc == Approx(pack.cell(0).soc() / (pack.cell(0).soc() + 1.0 - pack.cell(7).soc())).margin(0.02));
  CHECK_FALSE(pack.bench().is_active(FaultId::soc_methods_disagree));
  CHECK_FALSE(pack.bench().is_active(FaultId::cell_model_mismatch));
}

TEST_CASE("a sensor that counts too much shifts the estimate by little", "[unit][estimators][BMS_F.6]") {
  LivingPack pack(sloped_pack(), 0.9);
  pack.sensor_gain = 0.02;
  pack.sensor_offset_A = 0.05;
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(600s);
  CHECK(worst_off_permille(pack) <= 10);
  for (std::size_t number = 0; number < pack.size(); ++number) {
    const SocEstimate estimate = pack.estimate().cell_soc(number);
    CHECK(std::abs(estimate.soc - pack.cell(number).soc()) <= 2.0 * estimate.sigma);
  }
}

TEST_CASE("the method of the pack file is the one that is told", "[unit][estimators][BMS_F.6]") {
  for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
    CoreConfig config = sloped_pack();
    config.soc.method = method;
    LivingPack pack(config, 0.5);
    pack.run(3s);
    REQUIRE(pack.bench().close());
    drive(pack, 4);
    CHECK(pack.estimate().method() == method);
    CHECK(pack.estimate().cell_soc(3).soc == pack.estimate().cell(3).estimate(method).soc);
    CHECK(pack.estimate().pack().soc == Approx(pack.estimate().cell(0).estimate(method).soc).margin(0.001));
  }
}

TEST_CASE("a new life goes on with what the one before has kept, and says how old that is",
          "[unit][estimators][BMS_F.6]") {
  const CoreConfig config = sloped_pack();
  const PersistentState state = kept_after_drive(config, 0.6);
  CHECK(state.soc.unix_time_ms > 1'700'000'000'000);
  const double kept = state.soc.told_ppm / 1e6;
  LivingPack pack(config, kept, {}, state);
  pack.bench().observe(WallClockSeen{state.soc.unix_time_ms + 3'600'000});
  pack.run(3s);
  REQUIRE(pack.core().soc_permille());
  CHECK(pack.estimate().origin() == SocOrigin::former);
  REQUIRE(pack.estimate().record_age());
  CHECK(to_s(*pack.estimate().record_age()) == Approx(3'600.0).margin(5.0));
  CHECK(pack.estimate().told_soc() == Approx(kept).margin(0.005));
}

TEST_CASE("life after life at rest the same is known, not less and not more", "[unit][estimators][BMS_F.6]") {
  const bool is_flat = GENERATE(false, true);
  CAPTURE(is_flat);
  CoreConfig config = sloped_pack();
  if (is_flat) config.dynamics = test::flat_cell();
  const PersistentState first = kept_after_drive(config, 0.6);
  REQUIRE(first.soc.is_last);
  PersistentState state = first;
  const double soc = first.soc.told_ppm / 1e6;
  for (int life = 0; life < 10; ++life) {
    LivingPack pack(config, soc, {}, state);
    pack.bench().observe(WallClockSeen{state.soc.unix_time_ms + 60'000});
    pack.run(4s);
    REQUIRE(pack.estimate().origin() == SocOrigin::former);
    pack.bench().give(Command::shut_down);
    pack.run(1s);
    state = pack.core().persistent();
    REQUIRE(state.soc.is_last);
  }
  const std::int32_t sigma_ppm = first.soc.modules[1].cells[0].sigma_ppm;
  CHECK(state.soc.modules[1].cells[0].sigma_ppm > 0.85 * sigma_ppm);
  CHECK(state.soc.modules[1].cells[0].sigma_ppm < 1.3 * sigma_ppm);
}

TEST_CASE("a life that was killed leaves its record's one percent in doubt, one that ended does not",
          "[unit][estimators][BMS_F.6]") {
  const CoreConfig config = sloped_pack();
  PersistentState ended = kept_after_drive(config, 0.6);
  for (CellSocRecord& cell : ended.soc.modules[1].cells) cell.sigma_ppm = 5'000;
  for (CellSocRecord& cell : ended.soc.modules[2].cells) cell.sigma_ppm = 5'000;
  PersistentState killed = ended;
  killed.soc.is_last = false;
  const auto sigma_after = [&](const PersistentState& state) {
    LivingPack pack(config, state.soc.told_ppm / 1e6, {}, state);
    REQUIRE(pack.bench().run_until([&] { return pack.core().soc_permille().has_value(); }, 5s));
    CHECK_FALSE(pack.core().persistent().soc.is_last);  // from now on a current may flow
    return pack.estimate().cell(0).filter().model_sigma();
  };
  CHECK(sigma_after(ended) == Approx(0.005).epsilon(0.2));
  CHECK(sigma_after(killed) == Approx(0.0112).epsilon(0.2));
}

TEST_CASE("what was told before goes on from there, however far off it was", "[unit][estimators][BMS_F.6]") {
  const CoreConfig config = sloped_pack();
  PersistentState state = kept_after_drive(config, 0.6);
  state.soc.told_ppm -= 100'000;
  LivingPack pack(config, 0.59, {}, state);
  double first = 0.0;
  REQUIRE(pack.bench().run_until([&] { return pack.core().soc_permille().has_value(); }, 5s));
  first = pack.estimate().told_soc();
  CHECK(first == Approx(state.soc.told_ppm / 1e6).margin(0.01));
  pack.run(1s);
  CHECK(pack.estimate().told_soc() - first <= 0.025);
  pack.run(10s);
  CHECK(pack.estimate().told_soc() == Approx(pack.estimate().pack().soc).margin(0.001));
}

TEST_CASE("a record of other modules, of another cell file, or that the voltages contradict is of no use",
          "[unit][estimators][BMS_F.6]") {
  const CoreConfig config = sloped_pack();
  PersistentState state = kept_after_drive(config, 0.6);
  double soc = 0.59;
  SECTION("another module") {
    state.soc.modules[1].serial_number += 1;
  }
  SECTION("another cell file") {
    state.soc.capacity_uAs += 1;
  }
  SECTION("charged by somebody else meanwhile") {
    soc = 0.9;
  }
  SECTION("a module with another number of cells") {
    state.soc.modules[2].cell_count = 3;
  }
  LivingPack pack(config, soc, {}, state);
  pack.bench().observe(WallClockSeen{state.soc.unix_time_ms + 3'600'000});
  pack.run(4s);
  REQUIRE(pack.core().soc_permille());
  CHECK(pack.estimate().origin() == SocOrigin::voltage);
  CHECK(worst_off_permille(pack) <= 6);
}

TEST_CASE("with a record nothing begins before all modules have said who they are", "[unit][estimators][BMS_F.6]") {
  const CoreConfig config = sloped_pack();
  const PersistentState state = kept_after_drive(config, 0.6);
  LivingPack pack(config, 0.59, {}, state);
  pack.bench().is_lost = [](const CanFrame& frame) { return frame.id == internal_bus::ident.base_id + 2; };
  pack.run(5s);
  CHECK_FALSE(pack.core().soc_permille());
  pack.bench().is_lost = {};
  pack.run(5s);
  CHECK(pack.core().soc_permille());
  CHECK(pack.estimate().origin() == SocOrigin::former);
}

TEST_CASE("a record is written when a cell has moved by one percent, and at the end", "[unit][estimators][BMS_F.6]") {
  LivingPack pack(sloped_pack(), 0.6);
  pack.run(10s);
  REQUIRE(pack.core().persistent().soc.is_kept);
  const std::int32_t begun_ppm = pack.core().persistent().soc.modules[1].cells[0].soc_ppm;
  CHECK(std::abs(begun_ppm - 600'000) <= 5'000);
  REQUIRE(pack.bench().close());
  pack.run(20s);
  const std::uint32_t generation = pack.core().persistent_generation();
  pack.current_A = 10.0;
  pack.run(20s);  // half a percent
  CHECK(pack.core().persistent().soc.modules[1].cells[0].soc_ppm > 592'000);
  CHECK(pack.core().persistent_generation() == generation);
  pack.run(30s);
  CHECK(pack.core().persistent_generation() > generation);
  pack.bench().give(Command::shut_down);
  pack.run(1s);
  CHECK(pack.core().persistent().soc.told_ppm == Approx(pack.estimate().told_soc() * 1e6).margin(500.0));
}

TEST_CASE("while the sensor is silent the doubt grows, little while everything is open", "[unit][estimators]") {
  LivingPack pack(sloped_pack(), 0.6);
  pack.run(30s);
  const double before = pack.estimate().pack().sigma;
  pack.bench().sensor_talks = false;
  pack.run(1800s);
  REQUIRE(pack.estimate().pack().is_known);
  // 200 mA of 10 Ah for half an hour.
  const double grown = pack.estimate().pack().sigma - before;
  CHECK(grown > 0.008);
  CHECK(grown < 0.03);
}

TEST_CASE("a cell at the end of a charge is an anchor, and when that was is told", "[unit][estimators][BMS_F.6]") {
  LivingPack pack(sloped_pack(), 0.999);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.run(30s);
  CHECK(pack.estimate().anchored_at() == TimePoint{});
  pack.current_A = -0.4;
  pack.run(300s);
  const TimePoint anchored_at = pack.estimate().anchored_at();
  REQUIRE(anchored_at != TimePoint{});
  CHECK(pack.bench().now() - anchored_at < 300s);
  CHECK(pack.estimate().cell_soc(0).soc > 0.99);
  CHECK(pack.estimate().cell_soc(0).sigma < 0.02);
}

TEST_CASE("modules that say nothing more leave their cells to counting", "[unit][estimators]") {
  LivingPack pack(sloped_pack(), 0.6);
  pack.run(30s);
  for (test::BenchModule& module : pack.bench().modules) module.talks = false;
  pack.run(2s);
  const double before = pack.estimate().cell_soc(0).sigma;
  pack.run(600s);
  REQUIRE(pack.estimate().pack().is_known);
  CHECK(pack.estimate().cell_soc(0).soc == Approx(0.6).margin(0.01));
  CHECK(pack.estimate().cell_soc(0).sigma > before);
}

TEST_CASE("other cells in a module begin anew, and the pack is not known meanwhile", "[unit][estimators]") {
  PackEstimate estimate;
  estimate.init(sloped_pack());
  CHECK_FALSE(estimate.pack().is_known);
  CHECK_FALSE(estimate.disagreement_permille().is_known);
  CHECK_FALSE(estimate.misfit_permille().is_known);
  SocRecords records;
  CHECK_FALSE(estimate.record(records));
  LivingPack pack(sloped_pack(), 0.6);
  pack.run(3s);
  REQUIRE(pack.core().soc_permille());
  pack.bench().modules[1].serial_number += 7;
  for (int cell = 0; cell < 4; ++cell) pack.bench().modules[1].restarted = true;
  pack.run(20s);
  REQUIRE(pack.core().soc_permille());
  CHECK(pack.estimate().origin() == SocOrigin::voltage);
}

TEST_CASE("a cell of another chemistry is named", "[unit][estimators]") {
  // Pack file with a flat curve, shifted by -0.5 V, for cells at 4 V.
  CoreConfig config = sloped_pack();
  LivingPack truth(config, 0.5);
  CoreConfig wrong = config;
  wrong.dynamics = test::flat_cell();
  for (double& ocv_V : wrong.dynamics->rows[0].ocv_V) ocv_V -= 0.5;
  for (double& ocv_V : wrong.dynamics->rows[1].ocv_V) ocv_V -= 0.5;
  test::CoreBench bench(wrong);
  for (test::BenchModule& module : bench.modules) module.cell_voltage_uV.fill(known(4'000'000));
  bench.run(120s);
  CHECK(bench.is_active(FaultId::cell_model_mismatch));
  CHECK(bench.core().faults().state(FaultId::cell_model_mismatch).confirmed.element.pack_number == 1);
}

TEST_CASE("records are worth replacing when they say something else", "[unit][estimators]") {
  SocRecords one{.is_kept = true, .unix_time_ms = 5, .capacity_uAs = 100, .told_ppm = 500'000};
  one.modules[1].cell_count = 2;
  one.modules[1].serial_number = 9;
  one.modules[1].cells[1] = {.soc_ppm = 500'000, .sigma_ppm = 20'000, .hysteresis_permille = 100};
  const auto changed = [&one](auto change) {
    SocRecords other = one;
    change(other);
    return is_worth_recording(one, other);
  };
  CHECK(is_worth_recording({}, one));
  CHECK_FALSE(is_worth_recording(one, {}));
  CHECK_FALSE(is_worth_recording(one, one));
  CHECK_FALSE(changed([](SocRecords& to) { to.unix_time_ms = 77; }));
  CHECK(changed([](SocRecords& to) { to.is_last = true; }));
  CHECK_FALSE(changed([](SocRecords& to) { to.modules[1].cells[1].health.capacity_ppm += 9'999; }));
  CHECK(changed([](SocRecords& to) { to.modules[1].cells[1].health.capacity_ppm += 10'000; }));
  CHECK(changed([](SocRecords& to) { to.modules[1].cells[1].health.resistance_ppm -= 10'000; }));
  CHECK_FALSE(changed([](SocRecords& to) { to.told_ppm = 509'999; }));
  CHECK(changed([](SocRecords& to) { to.told_ppm = 510'000; }));
  CHECK(changed([](SocRecords& to) { to.told_ppm = 490'000; }));
  CHECK(changed([](SocRecords& to) { to.capacity_uAs = 101; }));
  CHECK(changed([](SocRecords& to) { to.modules[1].serial_number = 8; }));
  CHECK(changed([](SocRecords& to) { to.modules[2].cell_count = 1; }));
  CHECK_FALSE(changed([](SocRecords& to) { to.modules[1].cells[1].soc_ppm += 9'999; }));
  CHECK(changed([](SocRecords& to) { to.modules[1].cells[1].soc_ppm -= 10'000; }));
  CHECK_FALSE(changed([](SocRecords& to) { to.modules[1].cells[1].sigma_ppm += 9'999; }));
  CHECK(changed([](SocRecords& to) { to.modules[1].cells[1].sigma_ppm += 10'000; }));
}
