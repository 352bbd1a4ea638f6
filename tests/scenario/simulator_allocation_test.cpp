// The emulated devices guarantee to use no heap, and the simulator none while nothing new happens. Every operator new
// of this program is counted.
#include <memory>

#include "mmu/scenario/simulator.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

CanFrame contactor_frame(std::uint8_t outputs, std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::contactor_command);
  frame.data[0] = outputs;
  seal(internal_bus::contactor_command, counter, frame);
  return frame;
}

SimulatorConfig four_modules() {
  SimulatorConfig config;
  config.cell_noise_uV = 200;
  config.current_noise_mA = 20;
  config.sensor.has_second = true;
  config.plant.cell.ocv_V.fill(3.7);
  for (std::uint8_t node = 1; node <= 4; ++node) {
    config.modules.push_back({.node = node});
    config.plant.cells_of_module.push_back(12);
  }
  return config;
}

TEST_CASE("devices and plant never touch the heap", "[scenario][mmu][pdu][sensor][plant]") {
  const auto mmu = std::make_unique<Mmu>(MmuConfig{.node = 3}, power_up);
  const auto pdu = std::make_unique<Pdu>(power_up);
  const auto sensor = std::make_unique<CurrentSensor>(CurrentSensorConfig{}, power_up);
  const auto plant = std::make_unique<Plant>(four_modules().plant);
  const std::uint64_t before = allocation_count();
  std::uint8_t counter = 0;
  TimePoint now = power_up;
  for (int step = 0; step < 5'000; ++step) {
    now += 1ms;
    if (step % 50 == 0) {
      pdu->observe(contactor_frame(0x03, ++counter), now);
      mmu->observe(poll_frame(0, want_all | want_sync, counter), now);
      mmu->observe(balance_frame(3, counter, {1, 2, 3}), now);
    }
    (void)mmu->tick(now, convert(FrontEndInputs{}, mmu->wants(now)));
    (void)pdu->tick(now, PduMeasurements{.feedback = plant->feedback()});
    (void)sensor->tick(now, SensorMeasurements{.current_mA = 1});
    plant->drive(pdu->outputs().contactors);
    plant->step();
  }
  mmu->restart(now);
  CHECK(allocation_count() == before);
}

TEST_CASE("a module on its own never touches the heap, with a damaged front end neither", "[scenario][mmu][MMU_A]") {
  const auto mmu = std::make_unique<Mmu>(MmuConfig{.node = 3}, power_up);
  FrontEndInputs inputs;
  inputs.external_supply_mV = 0;
  inputs.module_mV = 43'000;
  inputs.cell_voltage_uV.fill(3'600'000);
  inputs.cell_voltage_uV[4] = 3'620'000;
  inputs.board_sensor_Ohm.fill(10e3);
  RandomSource random(3);
  bool has_balanced = false;
  const std::uint64_t before = allocation_count();
  mmu->observe(command_frame(3, 1, {1, 1, 1}), power_up);
  for (TimePoint now = power_up + 1ms; now < power_up + 100s; now += 1ms) {
    FrontEndTransfer transfer = convert(inputs, mmu->wants(now));
    if (random.next() % 8 == 0) damage(transfer.groups[random.next() % register_group_count], 1, random);
    (void)mmu->tick(now, transfer);
    has_balanced = has_balanced || mmu->balancing_cells() == cell_bit(4);
  }
  CHECK(allocation_count() == before);
  CHECK(has_balanced);
  CHECK(mmu->counts().damaged_groups > 500);
}

/// Allocations while the script runs for 5 s with a master; more than `frames_min` frames must have been sent.
std::uint64_t allocations_of(std::string_view script, std::size_t frames_min) {
  const auto simulator = std::make_unique<Simulator>(four_modules(), *parse_scenario(script), power_up);
  const std::uint64_t before = allocation_count();
  std::uint8_t counter = 0;
  std::size_t frames = 0;
  for (int step = 0; step < 5'000; ++step) {
    if (step % 50 == 0) {
      simulator->observe(contactor_frame(0x03, ++counter), simulator->now());
      simulator->observe(poll_frame(0, want_all | want_sync, counter), simulator->now());
    }
    frames += simulator->advance(simulator->now() + 1ms).size();
  }
  const std::uint64_t allocated = allocation_count() - before;
  CHECK(frames > frames_min);
  return allocated;
}

TEST_CASE("the simulator at work allocates nothing", "[scenario][simulator]") {
  CHECK(allocations_of("0.2 load profile drive\n0.3 cell 2.7 voltage_mV ..2500 over 2\n3 vehicle on", 3'000) == 0);
}

TEST_CASE("nor does it with everything at fault that a script can break", "[scenario][simulator]") {
  CHECK(allocations_of("0.2 cell 2.7 stuck on\n0.2 cell 2.8 wire open_silent\n0.3 module 1 stuck on\n"
                       "0.3 module 1 delay_ms 500\n0.3 module 2 replay on\n0.3 module 3 sends_as_node 4\n"
                       "0.3 module 4 omits cells\n0.4 stranger 2 connected\n0.4 stranger 63 connected\n"
                       "0.3 module 1 external_supply_mV 0\n0.3 module 2 crc_error_permille 500\n"
                       "0.3 module 2 crc_wrong_bits 64\n0.3 module 3 thermistor_curve steinhart_hart\n0.3 module 2 "
                       "converts steinhart_hart\n"
                       "0.3 board_thermistor 4.1 state open\n1 stranger 2 disconnected\n2 stranger 2 connected\n0.5 "
                       "sensor current stuck on\n"
                       "0.5 sensor current_2 inverted on\n0.6 charger runaway on\n0.7 insulation wire open",
                       3'000) == 0);
}

}  // namespace
}  // namespace bmu
