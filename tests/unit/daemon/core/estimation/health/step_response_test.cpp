// Current steps evaluated for the cells and for the sensor, with the resulting trouble codes.
#include "daemon/core/estimation/health/step_response.hpp"

#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;

namespace {

constexpr std::int32_t model_uOhm = 2'000;

CoreConfig pack_of_2_mOhm(double activation_K = 0.0) {
  CoreConfig config = test::small_pack();
  config.cell.series_resistance_Ohm = model_uOhm * 1e-6;
  config.cell.resistance_activation_K = activation_K;
  return config;
}

/// Closed pack with an alternating load; each cell follows by its own resistance.
struct Drive {
  explicit Drive(const CoreConfig& config = pack_of_2_mOhm()) : bench(config) {
    for (auto& module : resistance_uOhm) module.fill(model_uOhm);
    REQUIRE(bench.close());
    bench.before_poll = [this] {
      const std::int64_t real_mA = is_reversed ? -bench.current_mA : bench.current_mA;
      for (std::size_t module = 0; module < bench.modules.size(); ++module) {
        for (std::size_t cell = 0; cell < 4; ++cell) {
          const std::int64_t voltage_uV = 3'700'000 - real_mA * resistance_uOhm[module][cell] / 1'000;
          bench.modules[module].cell_voltage_uV[cell] = known(voltage_uV);
        }
      }
      bench.current_mA = ++polls / 5 % 2 == 0 ? low_mA : high_mA;  // just after the sample
    };
  }

  [[nodiscard]] const StepResponse& steps() const { return bench.core().watchers().steps; }

  CoreBench bench;
  std::array<std::array<std::int32_t, 4>, 2> resistance_uOhm{};
  std::int32_t low_mA = 5'000;
  std::int32_t high_mA = 45'000;
  bool is_reversed = false;
  std::int64_t polls = 0;
};

std::pair<std::int64_t, std::int64_t> told_trouble_codes(const CoreBench& bench) {
  std::pair<std::int64_t, std::int64_t> codes{-1, -1};
  for (const OutgoingFrame& out : bench.sent()) {
    if (out.port != Port::vehicle || out.frame.id != 0x622) continue;
    codes = {read_raw<vehicle_bus::pack_status, "dtc_1">(out.frame),
             read_raw<vehicle_bus::pack_status, "dtc_2">(out.frame)};
  }
  return codes;
}

}  // namespace

TEST_CASE("each cell's resistance is what a step of the current does to its voltage", "[unit][estimators][BMS_F.6]") {
  Drive drive;
  drive.resistance_uOhm[0][2] = 2'600;
  drive.bench.run(1s);
  CHECK(drive.steps().average_uOhm() == 0);  // one or two steps are not sufficient
  CHECK_FALSE(drive.steps().worst_cell_permille().is_known);
  drive.bench.run(10s);
  CHECK(drive.steps().cell_resistance_uOhm(0) == model_uOhm);
  CHECK(drive.steps().cell_resistance_uOhm(2) == 2'600);
  CHECK(drive.steps().cell_resistance_uOhm(7) == model_uOhm);
  CHECK(drive.steps().average_uOhm() == 2'075);
  CHECK(drive.steps().worst_cell_permille().value == 1'253);
  CHECK(drive.steps().worst_cell_permille().element == Element{.module_node = 1, .number = 3, .pack_number = 3});
  CHECK(drive.steps().average_permille().value == 1'037);
  CHECK(drive.steps().contradiction().value == 0);
}

TEST_CASE("cells that are exchanged are measured anew, the others' resistances stay", "[unit][estimators][BMS_F.6]") {
  Drive drive;
  drive.bench.run(10s);
  StepResponse steps = drive.steps();
  REQUIRE(steps.average_uOhm() == model_uOhm);
  steps.forget_module(1);
  CHECK(steps.average_uOhm() == 0);
  CHECK_FALSE(steps.worst_cell_permille().is_known);
  for (std::size_t cell = 0; cell < 4; ++cell) CHECK(steps.cell_resistance_uOhm(cell) == 0);
  for (std::size_t cell = 4; cell < 8; ++cell) CHECK(steps.cell_resistance_uOhm(cell) == model_uOhm);
}

TEST_CASE("a current that rises and falls slowly does not shift a resistance: it is that of the POLL",
          "[unit][estimators][BMS_F.6]") {
  Drive drive;
  // High and rising, then low and falling; no sample falls on a POLL. Sampled 10 ms from it, each would be 150 mA off.
  drive.bench.each_ms = [&] {
    const std::int64_t ms = (to_ms(drive.bench.now().time_since_epoch()) + 950) % 1'000;
    drive.bench.current_mA = static_cast<std::int32_t>(ms < 500 ? 45'000 + 15 * (ms - 250) : 5'000 - 15 * (ms - 750));
  };
  drive.bench.is_lost = [&](const CanFrame& frame) {
    return frame.id == internal_bus::sensor_current.base_id && to_ms(drive.bench.now().time_since_epoch()) % 100 == 0;
  };
  drive.bench.run(20s);
  CHECK(std::abs(drive.steps().cell_resistance_uOhm(0) - model_uOhm) <= 2);
}

TEST_CASE("a step between a POLL and the sample of the current before it is known by the sample behind the POLL",
          "[unit][estimators][BMS_F.6]") {
  Drive drive;
  // The step comes 10 ms before every tenth POLL, in the middle of the 40 ms without a sample.
  drive.bench.each_ms = [&] {
    const std::int64_t ms = (to_ms(drive.bench.now().time_since_epoch()) + 10) % 2'000;
    drive.bench.current_mA = ms < 1'000 ? drive.low_mA : drive.high_mA;
  };
  drive.bench.is_lost = [&](const CanFrame& frame) {
    return frame.id == internal_bus::sensor_current.base_id && to_ms(drive.bench.now().time_since_epoch()) % 100 == 0;
  };
  drive.bench.run(40s);
  CHECK(std::abs(drive.steps().cell_resistance_uOhm(0) - model_uOhm) <= 2);
}

TEST_CASE("a module that told another moment's voltages is no part of a picture", "[unit][estimators][BMS_F.6]") {
  Drive drive;
  // Module 2 is received only after its single poll, long after the change of the current.
  drive.bench.is_lost = [&](const CanFrame& frame) {
    const bool is_of_2 = (frame.id & 0x3FU) == 2 && frame.id >= 0x100 && frame.id < 0x300;
    return is_of_2 && to_ms(drive.bench.now().time_since_epoch()) % 100 < 50;
  };
  drive.bench.run(20s);
  CHECK(drive.bench.core().modules().find(2)->answers_missed < 3);
  CHECK(drive.steps().average_uOhm() == 0);
}

TEST_CASE("steps that are too small say nothing", "[unit][estimators][BMS_F.6]") {
  Drive drive;
  drive.high_mA = drive.low_mA + 7'900;  // a step requires a tenth of the continuous current
  drive.bench.run(20s);
  CHECK(drive.steps().average_uOhm() == 0);
  drive.high_mA = drive.low_mA + 8'000;
  drive.bench.run(20s);
  CHECK(drive.steps().average_uOhm() == model_uOhm);
}

TEST_CASE("a cell with more than twice the average resistance is a poor one, and the vehicle is told",
          "[unit][core][estimators][BMS_F.7]") {
  Drive drive;
  drive.bench.run(20s);
  CHECK_FALSE(drive.bench.is_active(FaultId::cell_resistance));
  CHECK(told_trouble_codes(drive.bench) == std::pair<std::int64_t, std::int64_t>{0, 0});
  drive.resistance_uOhm[1][0] = 6'000;  // with an average of 2.5 mOhm
  drive.bench.run(60s);
  CHECK(drive.bench.is_active(FaultId::cell_resistance));
  CHECK(drive.bench.core().faults().state(FaultId::cell_resistance).confirmed.element ==
        Element{.module_node = 2, .number = 1, .pack_number = 5});
  CHECK(told_trouble_codes(drive.bench) == std::pair<std::int64_t, std::int64_t>{1, 0});
  CHECK(drive.bench.core().sequence().phase == Phase::closed);  // worn, but not yet dangerous
}

TEST_CASE("cells that have all become poor are a poor battery", "[unit][core][estimators][BMS_F.7]") {
  Drive drive;
  for (auto& module : drive.resistance_uOhm) module.fill(3 * model_uOhm);
  drive.bench.run(60s);
  CHECK(drive.bench.is_active(FaultId::pack_resistance));
  CHECK_FALSE(drive.bench.is_active(FaultId::cell_resistance));
  CHECK(told_trouble_codes(drive.bench) == std::pair<std::int64_t, std::int64_t>{2, 0});
}

TEST_CASE("a pack in the cold is no poor battery: its resistance is compared with the model's at its temperature",
          "[unit][core][estimators][BMS_F.7]") {
  constexpr double activation_K = 2'500.0;
  const auto cold_uOhm = static_cast<std::int32_t>(model_uOhm * resistance_factor(activation_K, 2.0));
  REQUIRE(cold_uOhm > 2 * model_uOhm);
  for (const double known_K : {activation_K, 0.0}) {
    Drive drive(pack_of_2_mOhm(known_K));
    for (auto& module : drive.bench.modules) module.cell_temperature_dC.fill(known(20));
    for (auto& module : drive.resistance_uOhm) module.fill(cold_uOhm);
    drive.bench.run(60s);
    REQUIRE(drive.steps().average_permille().is_known);
    CHECK(drive.bench.is_active(FaultId::pack_resistance) == (known_K == 0.0));
    if (known_K != 0.0) CHECK(std::abs(drive.steps().average_permille().value - 1'000) <= 2);
  }
}

TEST_CASE("voltages that rise when more current is said to flow out show a sensor the wrong way round",
          "[unit][core][estimators][F18]") {
  Drive drive;
  drive.is_reversed = true;
  CHECK(drive.steps().latest_contradiction() == Contradiction::none);
  REQUIRE(drive.bench.run_until([&] { return drive.bench.is_active(FaultId::current_contradicts_voltage); }, 20s));
  drive.bench.run(5s);
  CHECK(drive.steps().latest_contradiction() == Contradiction::against);  // also for the open pack
  CHECK_FALSE(drive.bench.core().outputs().any_contactor());
}

namespace {

/// Cells that bleed while the current is low: their voltages fall by the drop in their sense wires.
struct BleedingDrive : Drive {
  explicit BleedingDrive(std::uint16_t cells, std::int64_t wire_drop_uV, std::int64_t told_ahead) {
    const auto before = bench.before_poll;
    bench.before_poll = [this, before, cells, wire_drop_uV, told_ahead] {
      before();
      if (!bleeds) return;
      const auto is_low = [](std::int64_t poll) { return poll / 5 % 2 == 0; };
      for (test::BenchModule& module : bench.modules) {
        // The reported state may be that of a switch after the sample.
        module.balancing_cells = is_low(polls - 1 + told_ahead) ? cells : std::uint16_t{0};
        for (std::size_t cell = 0; cell < 4; ++cell) {
          const bool is_on = (cells >> cell & 1U) != 0 && is_low(polls - 1);
          if (is_on) module.cell_voltage_uV[cell] = known(module.cell_voltage_uV[cell].value - wire_drop_uV);
        }
      }
    };
  }

  bool bleeds = false;
};

}  // namespace

TEST_CASE("a cell that begins or ceases to bleed with a step of the current shows no resistance by it",
          "[unit][estimators][balancing][BMS_F.6]") {
  for (const std::int64_t told_ahead : {0, 1}) {
    CAPTURE(told_ahead);
    BleedingDrive drive(0b0010, 30'000, told_ahead);
    drive.bench.run(20s);
    REQUIRE(drive.steps().cell_resistance_uOhm(1) == model_uOhm);
    drive.bleeds = true;
    drive.bench.run(60s);
    CHECK(drive.steps().cell_resistance_uOhm(1) == model_uOhm);  // 30 mV by 40 A would be as much as a third of it
    CHECK(drive.steps().cell_resistance_uOhm(0) == model_uOhm);
    CHECK(drive.bench.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("all cells beginning to bleed with a step of the current do not contradict it",
          "[unit][core][estimators][balancing]") {
  for (const std::int64_t told_ahead : {0, 1}) {
    CAPTURE(told_ahead);
    BleedingDrive drive(0b1111, 150'000, told_ahead);
    drive.bench.run(20s);
    drive.bleeds = true;
    drive.bench.run(60s);
    CHECK(drive.bench.core().faults().state(FaultId::current_contradicts_voltage).count == 0);
    CHECK(drive.bench.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("a step that is too small for a verdict still says which way the cells answered it, one below 3 mV does not",
          "[unit][core][estimators]") {
  struct Row {
    std::int32_t high_mA;
    bool is_reversed;
    StepAnswer answer;
  };
  for (const Row& row : {Row{2'000, false, StepAnswer::with}, Row{2'000, true, StepAnswer::against},
                         Row{1'400, true, StepAnswer::none}}) {
    CAPTURE(row.high_mA, row.is_reversed);
    Drive drive;
    drive.low_mA = 0;
    drive.high_mA = row.high_mA;
    drive.is_reversed = row.is_reversed;
    drive.bench.run(5s);
    CHECK(drive.steps().latest_answer() == row.answer);
    CHECK(drive.steps().latest_contradiction() == Contradiction::none);
    // The last answer stays until the next step.
    drive.high_mA = 0;
    drive.bench.run(5s);
    CHECK(drive.steps().latest_answer() == row.answer);
    drive.high_mA = 4'000;
    drive.is_reversed = !row.is_reversed;
    drive.bench.run(5s);
    CHECK(drive.steps().latest_answer() == (row.is_reversed ? StepAnswer::with : StepAnswer::against));
  }
}

namespace {

/// Sensor that repeats its last value while the load behind it changes.
struct Standstill {
  explicit Standstill(const CoreConfig& config = pack_of_2_mOhm()) : bench(config) {
    REQUIRE(bench.close());
    bench.before_poll = [this] {
      for (BenchModule& module : bench.modules) {
        for (SignalValue& cell : module.cell_voltage_uV) cell = known(3'700'000 - real_mA * model_uOhm / 1'000);
      }
    };
    bench.current_mA = 5'000;
    real_mA = 5'000;
  }
  [[nodiscard]] bool opens_within(Duration duration) {
    return bench.run_until([this] { return bench.is_active(FaultId::current_contradicts_voltage); }, duration);
  }

  using BenchModule = test::BenchModule;
  CoreBench bench;
  std::int64_t real_mA = 0;
};

constexpr std::int64_t unseen_step_mA = 16'000;  // a fifth of 80 A

}  // namespace

TEST_CASE("voltages that step while the current is said to stand still show a sensor that stands still",
          "[unit][core][estimators][F12]") {
  for (const std::int64_t step_mA : {unseen_step_mA, -unseen_step_mA, std::int64_t{90'000}}) {
    Standstill pack;
    pack.bench.run(4s);
    pack.real_mA += step_mA;
    CHECK(pack.opens_within(600ms));
    CHECK_FALSE(pack.bench.core().outputs().any_contactor());
    CHECK(pack.bench.core().watchers().steps.latest_contradiction() == Contradiction::without);
  }
  Standstill small;
  small.bench.run(4s);
  small.real_mA += unseen_step_mA - 100;
  CHECK_FALSE(small.opens_within(5s));
}

TEST_CASE("a step soon after the current has moved may be an echo of that, later it is none",
          "[unit][core][estimators][F12]") {
  for (const auto& [after, opens] : {std::pair{Duration{2s}, false}, std::pair{Duration{3500ms}, true}}) {
    Standstill pack;
    pack.bench.run(4s);
    pack.bench.current_mA = 30'000;
    pack.real_mA = 30'000;
    pack.bench.run(after);
    pack.real_mA = 60'000;
    CHECK(pack.opens_within(800ms) == opens);
  }
}

TEST_CASE("a step of the cells that the pack voltage does not have is no step of the current",
          "[unit][core][estimators][F12]") {
  for (const std::int32_t follows_mV : {0, 60}) {  // the cells' sum steps by 8 x 20 mV
    CoreConfig config = pack_of_2_mOhm();
    Standstill pack(config);
    pack.bench.pack_voltage_mV = 29'520;
    pack.bench.run(4s);
    pack.real_mA += 10'000;
    pack.bench.pack_voltage_mV = 29'520 - follows_mV;
    CHECK_FALSE(pack.opens_within(2s));
  }
  Standstill away;
  away.bench.pack_voltage_mV = 29'520;
  away.bench.run(4s);
  away.real_mA += 20'000;  // 320 mV down
  away.bench.pack_voltage_mV = 29'520 + 320;
  CHECK_FALSE(away.opens_within(2s));
}

TEST_CASE("a wobble that is over within two polls is no step", "[unit][core][estimators]") {
  Standstill pack;
  pack.bench.run(4s);
  pack.real_mA += 90'000;
  pack.bench.run(150ms);
  pack.real_mA -= 90'000;
  CHECK_FALSE(pack.opens_within(3s));
}

TEST_CASE("a closed pack whose current is really steady goes on", "[unit][core][estimators]") {
  Standstill pack;
  pack.bench.current_mA = 60'000;
  pack.real_mA = 60'000;
  CHECK_FALSE(pack.opens_within(60s));
}
