// What steps of the current tell about cells and about the sensor, with the trouble codes that follow.
#include "daemon/core/estimators/step_response.hpp"

#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;

namespace {

constexpr std::int32_t model_uOhm = 2'000;

CoreConfig pack_of_2_mOhm() {
  CoreConfig config = test::small_pack();
  config.cell.series_resistance_Ohm = model_uOhm * 1e-6;
  return config;
}

/// A closed pack whose load goes up and down, and whose cells follow by resistances of their own.
struct Drive {
  Drive() {
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
      bench.current_mA = ++polls / 5 % 2 == 0 ? low_mA : high_mA;  // just behind the sample
    };
  }

  [[nodiscard]] const StepResponse& steps() const { return bench.core().watchers().steps; }

  CoreBench bench{pack_of_2_mOhm()};
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
  CHECK(drive.steps().average_uOhm() == 0);  // one or two steps are no measurement
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

TEST_CASE("steps that are too small say nothing", "[unit][estimators][BMS_F.6]") {
  Drive drive;
  drive.high_mA = drive.low_mA + 7'900;  // a tenth of the continuous current is a step
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
  drive.resistance_uOhm[1][0] = 6'000;  // of 2.5 mOhm on average
  drive.bench.run(60s);
  CHECK(drive.bench.is_active(FaultId::cell_resistance));
  CHECK(drive.bench.core().faults().state(FaultId::cell_resistance).confirmed.element ==
        Element{.module_node = 2, .number = 1, .pack_number = 5});
  CHECK(told_trouble_codes(drive.bench) == std::pair<std::int64_t, std::int64_t>{1, 0});
  CHECK(drive.bench.core().sequence().phase == Phase::closed);  // it wears, and endangers nothing yet
}

TEST_CASE("cells that have all become poor are a poor battery", "[unit][core][estimators][BMS_F.7]") {
  Drive drive;
  for (auto& module : drive.resistance_uOhm) module.fill(3 * model_uOhm);
  drive.bench.run(60s);
  CHECK(drive.bench.is_active(FaultId::pack_resistance));
  CHECK_FALSE(drive.bench.is_active(FaultId::cell_resistance));
  CHECK(told_trouble_codes(drive.bench) == std::pair<std::int64_t, std::int64_t>{2, 0});
}

TEST_CASE("voltages that rise when more current is said to flow out show a sensor the wrong way round",
          "[unit][core][estimators][F12]") {
  Drive drive;
  drive.is_reversed = true;
  REQUIRE(drive.bench.run_until([&] { return drive.bench.is_active(FaultId::current_contradicts_voltage); }, 20s));
  CHECK_FALSE(drive.bench.core().outputs().any_contactor());
}
