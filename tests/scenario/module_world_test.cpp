// Modules in the emulated pack, where cells really lose charge through their switches: in autonomous mode, with a front
// end that fails, with a thermistor of another curve than configured.
#include <algorithm>
#include <string>

#include "mmu/scenario/simulator.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;
using namespace internal_bus;

/// One module of small cells: a minute at 58 mA takes 2.9 mV off a cell.
class SmallModule {
 public:
  explicit SmallModule(std::string_view script, const MmuConfig& module = {.node = 1})
      : simulator(config_of(module), *parse_scenario(script), power_up) {}

  Simulator simulator;
  std::vector<CanFrame> heard;

  void run(Duration duration) {
    for (const TimePoint end = simulator.now() + duration; simulator.now() < end;) {
      for (const SentFrame& sent : simulator.advance(simulator.now() + 1ms)) heard.push_back(sent.frame);
    }
  }
  void poll(unsigned flags) { simulator.observe(poll_frame(0, flags, ++poll_counter_), simulator.now()); }
  void run_polled(Duration duration, unsigned flags = 0) {
    for (Duration done{}; done < duration; done += 100ms) {
      poll(flags);
      run(100ms);
    }
  }
  void command(std::initializer_list<std::uint8_t> bytes) {
    simulator.observe(command_frame(1, ++command_counter_, bytes), simulator.now());
  }
  [[nodiscard]] const Mmu& mmu() const { return simulator.mmu(0); }
  [[nodiscard]] double spread_mV() const {
    double low_V = 10.0;
    double high_V = 0.0;
    for (std::size_t cell = 0; cell < simulator.plant().cell_count(); ++cell) {
      low_V = std::min(low_V, simulator.plant().cell(cell).voltage_V);
      high_V = std::max(high_V, simulator.plant().cell(cell).voltage_V);
    }
    return (high_V - low_V) * 1e3;
  }
  [[nodiscard]] CanFrame last(std::uint32_t id) const {
    const auto found = std::find_if(heard.rbegin(), heard.rend(), [id](const CanFrame& one) { return one.id == id; });
    REQUIRE(found != heard.rend());
    return *found;
  }

 private:
  static SimulatorConfig config_of(const MmuConfig& module) {
    SimulatorConfig config;
    for (std::size_t permille = 0; permille < CellPhysics::ocv_points; ++permille) {
      config.plant.cell.ocv_V[permille] = 3.0 + 1.2e-3 * static_cast<double>(permille);
    }
    config.plant.cell.capacity_As = 1'440.0;
    config.plant.cell.series_resistance_Ohm = 0.002;
    config.plant.cell.heat_capacity_J_per_K = 50.0;
    config.plant.cells_of_module.push_back(module.cell_count);
    config.modules.push_back(module);
    config.cell_noise_uV = 300;
    return config;
  }

  std::uint8_t poll_counter_ = 0;
  std::uint8_t command_counter_ = 0;
};

TEST_CASE("a module taken out of its vehicle balances itself and goes to sleep",
          "[scenario][mmu][MMU_A][MMU_AB][MMU_IMB][MMU_7]") {
  SmallModule module(
      "0 pack soc_permille 500\n0 cell 1.2 soc_permille 507\n0 cell 1.9 soc_permille 515\n"
      "0 pdu silent\n0 sensor current silent\n0 sensor pack_voltage silent\n0 sensor link_voltage silent\n2 module 1 "
      "external_supply_mV 0");
  module.run_polled(1s, want_status);
  module.command({1, 1, 1});
  module.run_polled(1s, want_status);
  CHECK(module.spread_mV() > 17.0);
  CHECK(module.mmu().supply() == SupplyInUse::external);
  module.run(2s);
  CHECK(module.mmu().supply() == SupplyInUse::module);
  CHECK(module.mmu().mode() == UnitMode::autonomous);

  int rounds = 0;
  CellMask before = 0;
  CellMask balanced = 0;
  Duration longest{};
  Duration on_for{};
  for (int tenth = 0; tenth < 4'000 && !module.mmu().is_asleep(); ++tenth) {
    module.run(100ms);
    const CellMask now = module.mmu().balancing_cells();
    if (now != 0 && before == 0) ++rounds;
    on_for = now != 0 ? on_for + 100ms : 0ms;
    longest = std::max(longest, on_for);
    balanced = static_cast<CellMask>(balanced | now);
    before = now;
  }
  CHECK(module.mmu().is_asleep());
  CHECK(rounds == 5);  // 18 mV, less 2.9 in each minute, until no more than 5
  CHECK(balanced == (cell_bit(1) | cell_bit(8)));
  CHECK(longest >= 59'900ms);
  CHECK(longest <= 60'100ms);
  CHECK(module.spread_mV() <= 5.3);  // 5 mV, and the noise
  module.heard.clear();
  module.run(10s);
  CHECK(module.heard.end() == std::find_if(module.heard.begin(), module.heard.end(), [](const CanFrame& frame) {
          return frame.id >= 0x100 && frame.id < 0x400;
        }));
}

TEST_CASE("a module whose supply only dips changes nothing", "[scenario][mmu][MMU_11]") {
  SmallModule module(
      "0 module 1 talks_on_own_supply on\n1 module 1 external_supply_mV 3000\n1.035 module 1 external_supply_mV 12000\n"
      "2 module 1 external_supply_mV 3000");
  module.run_polled(1'500ms, want_status);
  CHECK(read_raw<status, "external_supply_low">(module.last(0x101)) == 0);
  module.run_polled(1s, want_status);
  CHECK(read_raw<status, "external_supply_low">(module.last(0x101)) == 1);
  CHECK(read_raw<status, "supply">(module.last(0x101)) == 1);
  CHECK(read_raw<status, "mode">(module.last(0x101)) == static_cast<std::int64_t>(Mode::normal));
}

TEST_CASE("a front end with errors loses samples, not the pack", "[scenario][mmu][MMU_PEC]") {
  SmallModule module("0 pack soc_permille 500\n1 module 1 crc_error_permille 100\n1 module 1 crc_wrong_bits 3");
  module.run_polled(1s, want_all);
  CHECK(read_raw<status, "front_end_crc_errors">(module.last(0x101)) == 0);
  CHECK(module.mmu().counts().damaged_groups == 0);
  module.heard.clear();
  module.run_polled(10s, want_all | want_sync);
  CHECK(module.mmu().counts().damaged_groups > 400);  // of 6 groups in each of 1000 transfers
  CHECK(module.mmu().counts().damaged_groups < 800);
  std::size_t with_error_flag = 0;
  std::size_t answers = 0;
  for (const CanFrame& frame : module.heard) {
    if (frame.id == 0x101) {
      ++answers;
      with_error_flag += read_raw<status, "front_end_crc_errors">(frame) == 1 ? 1U : 0U;
      CHECK(read<status, "cell_voltage_age_ms">(frame).value < 100);
    }
    if (frame.id == 0x141) {
      const SignalValue voltage = read<cells_1, "cell_voltage_1_uV">(frame);
      if (voltage.is_valid()) CHECK(std::abs(voltage.value - 3'600'000) < 1'000);
    }
  }
  CHECK(answers == 100);
  CHECK(with_error_flag > 80);
}

TEST_CASE("with a front end that is never right nothing is said to be measured", "[scenario][mmu][MMU_PEC]") {
  SmallModule module("1 module 1 crc_errors on\n5 module 1 crc_errors off");
  module.run_polled(3s, want_all);
  CHECK_FALSE(read<status, "cell_voltage_age_ms">(module.last(0x101)).is_valid());
  CHECK_FALSE(read<cells_1, "cell_voltage_1_uV">(module.last(0x141)).is_valid());
  CHECK_FALSE(read<temp_1, "cell_temperature_1_dC">(module.last(0x241)).is_valid());
  module.run_polled(3s, want_all);
  CHECK(read<cells_1, "cell_voltage_1_uV">(module.last(0x141)).is_valid());
  CHECK(read<temp_1, "cell_temperature_1_dC">(module.last(0x241)) == known(250));
  CHECK(read_raw<status, "front_end_crc_errors">(module.last(0x101)) == 0);
}

TEST_CASE("a thermistor of the other curve reads a little wrong", "[scenario][mmu][MMU_NTC][RR_5]") {
  const auto measured_dC = [](std::string_view script, ThermistorCurve curve) {
    SmallModule module(script, {.node = 1, .thermistor_curve = curve});
    module.run_polled(2s, want_temp);
    return read<temp_1, "cell_temperature_1_dC">(module.last(0x241)).value;
  };
  constexpr std::string_view as_taken_for = "0 pack temperature_dC 500\n0 pack ambient_dC 500";
  constexpr std::string_view by_formula =
      "0 pack temperature_dC 500\n0 pack ambient_dC 500\n0 module 1 thermistor_curve steinhart_hart";
  CHECK(measured_dC(as_taken_for, ThermistorCurve::table) == 500);
  CHECK(measured_dC(as_taken_for, ThermistorCurve::steinhart_hart) == 500);
  CHECK(measured_dC(by_formula, ThermistorCurve::steinhart_hart) == 500);
  CHECK(measured_dC(by_formula, ThermistorCurve::table) == 504);  // 4161 Ohm
}

TEST_CASE("a script makes a unit convert by the other curve, with thermistors to match or without",
          "[scenario][mmu][MMU_NTC][RR_5]") {
  const auto measured_dC = [](std::string_view script) {
    SmallModule module("0 pack temperature_dC 500\n0 pack ambient_dC 500\n" + std::string(script));
    module.run_polled(2s, want_temp);
    return read<temp_1, "cell_temperature_1_dC">(module.last(0x241)).value;
  };
  CHECK(measured_dC("0 module 1 converts steinhart_hart") == 500);
  CHECK(measured_dC("0 module 1 converts steinhart_hart\n0 module 1 thermistor_curve table") == 497);  // 4211 Ohm
  CHECK(measured_dC("0 module 1 converts steinhart_hart\n1 module 1 converts table") == 500);
}

/// Bleed current of a cell.
double bled_A(const SmallModule& module, std::size_t cell) {
  const PlantCell& one = module.simulator.plant().cell(cell);
  return one.voltage_V * one.balancing_siemens;
}

TEST_CASE("no current flows through an open wire", "[scenario][mmu][MMU_3]") {
  const auto bleeding = [](std::string_view wires, std::initializer_list<std::uint8_t> minutes) {
    // The module does not detect silent open wires, so it has nothing to refuse.
    SmallModule module("0 pack soc_permille 500\n" + std::string(wires));
    module.run_polled(1s);
    const CanFrame order = balance_frame(1, 1, minutes);
    module.simulator.observe(order, module.simulator.now());
    module.run_polled(2s);
    CellMask cells = 0;
    for (std::size_t cell = 0; cell < 12; ++cell) {
      if (bled_A(module, cell) > 0.05) cells = static_cast<CellMask>(cells | cell_bit(cell));
    }
    return cells;
  };
  CHECK(bleeding("", {1, 1, 0, 1}) == (first_cells(2) | cell_bit(3)));
  CHECK(bleeding("2 cell 1.2 wire open_silent", {7, 1}) == 0);     // its own upper wire
  CHECK(bleeding("2 cell 1.2 wire open_silent", {7, 7, 1}) == 0);  // its lower one
  CHECK(bleeding("2 cell 1.2 wire open_silent", {1, 7, 7, 1}) == (cell_bit(0) | cell_bit(3)));
  CHECK(bleeding("2 cell 1.2 wire open_silent", {7, 1, 1}) == (cell_bit(1) | cell_bit(2)));  // both in series
  CHECK(bleeding("2 cell 1.12 wire open_silent", {7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 1, 1}) == cell_bit(10));
}

TEST_CASE("a board sensor off ends balancing until it is back", "[scenario][mmu][MMU_16][MMU_17]") {
  SmallModule module("5 board_thermistor 1.3 state open\n8 board_thermistor 1.3 state ok");
  module.run_polled(1s);
  module.command({3, 0x20, 0x00, 0x00, 0x00, 0x00});  // cell 1, a minute
  module.run_polled(3s, want_temp);
  CHECK(module.mmu().balancing_cells() == cell_bit(0));
  module.run_polled(3s, want_temp);
  CHECK(module.mmu().balancing_cells() == 0);
  CHECK(read<temp_2, "board_temperature_3_dC">(module.last(0x281)).validity == Validity::sensor_fault);
  module.run_polled(4s);
  CHECK(module.mmu().balancing_cells() == cell_bit(0));
}

}  // namespace
}  // namespace bmu
