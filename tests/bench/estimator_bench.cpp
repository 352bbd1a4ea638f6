// Cost of an estimator of charge or resistance for one sample of one cell, compared with plain coulomb counting.
#include <vector>

#include <benchmark/benchmark.h>

#include "daemon/core/estimation/health/cell_health.hpp"
#include "daemon/core/estimation/health/resistance_tracker.hpp"
#include "daemon/core/estimation/soc/cell_estimate.hpp"
#include "daemon/core/estimation/soc/soc_coulomb.hpp"
#include "daemon/core/estimation/soc/soc_filter.hpp"
#include "daemon/core/estimation/soc/soc_mixed.hpp"
#include "tests/support/simulated_cell.hpp"

namespace {

using namespace bmu;

std::vector<CellSample> drive_of(const CellDynamics& cell) {
  constexpr double passed_s = 0.1;
  test::SimulatedCell truth(cell, {.soc = 0.9, .voltage_noise_V = 0.001});
  test::SimulatedDrive drive(cell, 1);
  std::vector<CellSample> samples;
  for (int k = 0; k < 20'000; ++k) samples.push_back(truth.run(passed_s, drive.current_A(passed_s, truth.soc()), 12.0));
  return samples;
}

template <class Estimator>
void sample_of_one_cell(benchmark::State& state) {
  const CellDynamics cell = test::sloped_cell();
  const std::vector<CellSample> samples = drive_of(cell);
  Estimator estimator;
  estimator.begin(cell, {}, {.soc = 0.8, .sigma = 0.1}, 12.0);
  std::size_t next = 0;
  for ([[maybe_unused]] auto _ : state) {
    estimator.update(samples[next]);
    next = next + 1 == samples.size() ? 0 : next + 1;
  }
  benchmark::DoNotOptimize(estimator.estimate());
}

void sample_of_one_cells_resistance(benchmark::State& state) {
  const CellDynamics cell = test::sloped_cell();
  const std::vector<CellSample> samples = drive_of(cell);
  const ExpectedResistance expected(cell);
  ResistanceTracker tracker;
  tracker.begin(expected);
  std::size_t next = 0;
  for ([[maybe_unused]] auto _ : state) {
    tracker.update(samples[next]);
    next = next + 1 == samples.size() ? 0 : next + 1;
  }
  benchmark::DoNotOptimize(tracker.estimate(resistance_reference_C));
}

/// All estimates of the daemon for a cell: every method in parallel, and its health.
void sample_of_one_cells_whole(benchmark::State& state) {
  const CellDynamics cell = test::sloped_cell();
  const std::vector<CellSample> samples = drive_of(cell);
  const HealthModel model{.expected = ExpectedResistance(cell), .rated_As = cell.capacity_As};
  const ChargeEndConfig ends{.full_V = 4.095, .full_current_A = 0.5, .empty_V = 3.205, .empty_current_A = 2.0};
  CellEstimate estimate;
  ModelMemo memo;
  CellHealth health;
  estimate.begin(cell, {}, {.soc = 0.8, .sigma = 0.1}, 12.0);
  health.begin(model);
  std::size_t next = 0;
  for ([[maybe_unused]] auto _ : state) {
    health.take(samples[next], estimate.update(samples[next], ends, memo));
    next = next + 1 == samples.size() ? 0 : next + 1;
  }
  benchmark::DoNotOptimize(estimate.estimate(SocMethod::ekf));
  benchmark::DoNotOptimize(health.capacity_As());
}

}  // namespace

BENCHMARK(sample_of_one_cell<SocFilter>);
BENCHMARK(sample_of_one_cell<SocMixed>);
BENCHMARK(sample_of_one_cell<SocCoulomb>);
BENCHMARK(sample_of_one_cells_resistance);
BENCHMARK(sample_of_one_cells_whole);
