// Cost for the control loop: one received frame, one decision.
#include "tests/support/core_bench.hpp"

#include <benchmark/benchmark.h>

namespace {

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::pack_of;

/// All observations of a core of `modules` x 12 cells during some seconds of driving, in order.
struct Recording {
  std::vector<Observation> observations;
  std::vector<std::pair<std::size_t, TimePoint>> decisions;  // number of observations before, and time
};

Recording record(std::size_t modules) {
  CoreBench bench(pack_of(modules));
  Recording recording;
  for (const Port port : {Port::internal, Port::vehicle}) {  // the bench observed them before the callbacks were set
    recording.observations.push_back({bench.now(), PortChanged{port, true}});
  }
  recording.decisions.emplace_back(1, bench.now());  // and decided at once when the first was up
  bench.on_observe = [&](const Observation& observation) { recording.observations.push_back(observation); };
  bench.on_decide = [&](TimePoint at) { recording.decisions.emplace_back(recording.observations.size(), at); };
  bench.link_rise_mV_per_ms = 2'000;
  (void)bench.close();
  bench.current_mA = 40'000;
  bench.run(5s);
  return recording;
}

/// Feeds a core all observations and decides at the original times; only the selected half is timed.
enum class Timed { observe, decide };

void replay(benchmark::State& state, Timed timed) {
  const auto modules = static_cast<std::size_t>(state.range(0));
  const Recording recording = record(modules);
  std::int64_t done = 0;
  while (state.KeepRunning()) {
    Core core(pack_of(modules), TimePoint{1s});
    std::size_t told = 0;
    double elapsed_s = 0;
    for (const auto& [until, at] : recording.decisions) {
      const auto t0 = std::chrono::steady_clock::now();
      for (; told < until; ++told) benchmark::DoNotOptimize(core.observe(recording.observations[told]));
      const auto t1 = std::chrono::steady_clock::now();
      benchmark::DoNotOptimize(core.decide(at));
      const auto t2 = std::chrono::steady_clock::now();
      elapsed_s += std::chrono::duration<double>(timed == Timed::observe ? t1 - t0 : t2 - t1).count();
    }
    state.SetIterationTime(elapsed_s);
    done += static_cast<std::int64_t>(timed == Timed::observe ? told : recording.decisions.size());
  }
  state.counters["each"] =
      benchmark::Counter(static_cast<double>(done), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void observe_per_frame(benchmark::State& state) {
  replay(state, Timed::observe);
}
void decide_per_tick(benchmark::State& state) {
  replay(state, Timed::decide);
}

// 4 modules are 48 cells, 16 are 192, 63 are the largest pack.
BENCHMARK(observe_per_frame)->Arg(4)->Arg(16)->Arg(63)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(decide_per_tick)->Arg(4)->Arg(16)->Arg(63)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
