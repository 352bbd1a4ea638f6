// Cost of the emulated pack: one simulated second, with a master that polls everything every 100 ms. The rate is the
// number of simulated seconds per second of one core: mmusim in real time needs more than 1. Also the cost of a module
// unit's front end: a transfer made and read, a temperature from a resistance.
#include <memory>

#include <benchmark/benchmark.h>

#include "mmu/scenario/simulator.hpp"
#include "tests/support/mmu_bench.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

SimulatorConfig pack_of_modules(std::int64_t modules) {
  SimulatorConfig config;
  config.cell_noise_uV = 200;
  config.plant.cell.ocv_V.fill(3.7);
  for (std::int64_t node = 1; node <= modules; ++node) {
    config.modules.push_back({.node = static_cast<std::uint8_t>(node)});
    config.plant.cells_of_module.push_back(12);
  }
  return config;
}

void live_a_second(benchmark::State& state) {
  const auto simulator = std::make_unique<Simulator>(pack_of_modules(state.range(0)), Scenario{}, power_up);
  std::uint8_t counter = 0;
  std::int64_t frames = 0;
  while (state.KeepRunning()) {
    for (int ms = 0; ms < 1000; ++ms) {
      if (ms % 100 == 0) simulator->observe(poll_frame(0, want_all | want_sync, ++counter), simulator->now());
      frames += static_cast<std::int64_t>(simulator->advance(simulator->now() + 1ms).size());
    }
  }
  benchmark::DoNotOptimize(frames);
  state.counters["times_real_time"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void make_and_read_transfer(benchmark::State& state) {
  FrontEndInputs inputs;
  inputs.cell_voltage_uV.fill(3'700'000);
  inputs.cell_sensor_Ohm.fill(10e3);
  inputs.board_sensor_Ohm.fill(10e3);
  const auto wanted = static_cast<TransferWanted>(state.range(0));
  while (state.KeepRunning()) {
    ++inputs.module_mV;
    benchmark::DoNotOptimize(read(convert(inputs, wanted)));
  }
}

void read_thermistor(benchmark::State& state) {
  const auto curve = static_cast<ThermistorCurve>(state.range(0));
  std::uint16_t input_raw = 0;
  while (state.KeepRunning()) {
    input_raw = static_cast<std::uint16_t>((input_raw + 7U) % 20'000U);
    benchmark::DoNotOptimize(temperature_dC(curve, static_cast<std::uint16_t>(input_raw + 2'000U), 30'000));
  }
}

BENCHMARK(make_and_read_transfer)
    ->Arg(static_cast<int>(TransferWanted::voltages))
    ->Arg(static_cast<int>(TransferWanted::everything));
BENCHMARK(read_thermistor)
    ->Arg(static_cast<int>(ThermistorCurve::table))
    ->Arg(static_cast<int>(ThermistorCurve::steinhart_hart));
BENCHMARK(live_a_second)->Arg(1)->Arg(16)->Arg(63)->Unit(benchmark::kMillisecond);

}  // namespace
