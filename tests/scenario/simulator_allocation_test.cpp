// The emulated devices promise no heap, and the simulator none while nothing new happens. Every operator new of this
// program is counted.
#include <memory>

#include "mmu/simulator.hpp"
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
    (void)mmu->tick(now, MmuMeasurements{.measured_cells = first_cells(12)});
    (void)pdu->tick(now, PduMeasurements{.feedback = plant->feedback()});
    (void)sensor->tick(now, SensorMeasurements{.current_mA = 1});
    plant->drive(pdu->outputs().contactors);
    plant->step();
  }
  mmu->restart(now);
  CHECK(allocation_count() == before);
}

TEST_CASE("the simulator at work allocates nothing", "[scenario][simulator]") {
  Scenario script = *parse_scenario("0.2 load profile drive\n0.3 cell 2.7 voltage_mV ..2500 over 2\n3 vehicle on");
  const auto simulator = std::make_unique<Simulator>(four_modules(), std::move(script), power_up);
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
  CHECK(allocation_count() == before);
  CHECK(frames > 3'000);
}

}  // namespace
}  // namespace bmu
