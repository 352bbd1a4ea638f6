// A core on its bench (core_bench.hpp) with simulated cells: each is a SimulatedCell that carries the pack's current
// and is measured as the POLL arrives. For tests of the core's charge estimates, in minutes of virtual time.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "tests/support/core_bench.hpp"
#include "tests/support/simulated_cell.hpp"

namespace bmu::test {

class LivingPack {
 public:
  /// `truth`: how each cell, by number through the pack, differs from the cell file; all others are as in the file.
  LivingPack(const CoreConfig& config, double soc, const std::vector<SimulatedCellOptions>& truth = {},
             const PersistentState& state = {})
      : dynamics_(std::make_unique<CellDynamics>(config.dynamics ? *config.dynamics : dynamics_of(config.cell))),
        bench_(std::make_unique<CoreBench>(config, state)) {
    const std::size_t count = cell_count(config);
    for (std::size_t number = 0; number < count; ++number) {
      SimulatedCellOptions options = number < truth.size() ? truth[number] : SimulatedCellOptions{.soc = soc};
      options.sensor_gain = 0.0;  // the pack has one sensor for all
      options.sensor_offset_A = 0.0;
      cells_.emplace_back(*dynamics_, options);
    }
    bench_->before_poll = [this] { measure(); };
    measure();
  }

  // The pack's true current, positive out of it, and the errors of its sensor.
  double current_A = 0.0;
  double sensor_gain = 0.0;
  double sensor_offset_A = 0.0;
  double temperature_C = 25.0;

  void run(Duration duration) {
    apply();
    bench_->run(duration);
  }
  [[nodiscard]] CoreBench& bench() { return *bench_; }
  [[nodiscard]] const Core& core() const { return bench_->core(); }
  [[nodiscard]] const PackEstimate& estimate() const { return core().estimate(); }
  [[nodiscard]] const SimulatedCell& cell(std::size_t number) const { return cells_[number]; }
  [[nodiscard]] std::size_t size() const { return cells_.size(); }

 private:
  void apply() {
    const bool is_closed = bench_->core().sequence().phase == Phase::closed;
    const double flows_A = is_closed ? current_A : 0.0;
    bench_->current_mA =
        static_cast<std::int32_t>(std::lround((flows_A * (1.0 + sensor_gain) + sensor_offset_A) * 1e3));
  }
  /// Lets the cells carry the current since they were last measured.
  void measure() {
    const bool is_closed = bench_->core().sequence().phase == Phase::closed;
    const double passed_s = measured_at_ == TimePoint{} ? 1e-3 : to_s(bench_->now() - measured_at_);
    measured_at_ = bench_->now();
    apply();
    std::size_t number = 0;
    for (BenchModule& module : bench_->modules) {
      for (std::size_t cell = 0; cell < module.cell_count; ++cell, ++number) {
        const CellSample sample =
            cells_[number].run(std::max(passed_s, 1e-3), is_closed ? current_A : 0.0, temperature_C);
        module.cell_voltage_uV[cell] = known(std::lround(sample.voltage_V * 1e6));
      }
      module.cell_temperature_dC.fill(known(std::lround(temperature_C * 10.0)));
    }
  }

  std::unique_ptr<CellDynamics> dynamics_;
  std::unique_ptr<CoreBench> bench_;
  std::vector<SimulatedCell> cells_;
  TimePoint measured_at_{};
};

}  // namespace bmu::test
