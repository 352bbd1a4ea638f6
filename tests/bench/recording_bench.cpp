// Cost of a recording for the control loop: a line for each observation, the lines of each decision, and the copy of a
// core once per part; and the cost of processing that copy in the recorder's thread.
#include <benchmark/benchmark.h>

#include "daemon/recording/record_lines.hpp"
#include "daemon/recording/record_writer.hpp"
#include "tests/support/core_bench.hpp"

namespace {

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::pack_of;

const RecordBuses buses{.internal = "can0", .vehicle = "can1"};

void record_observation_line(benchmark::State& state) {
  RecordLines lines(buses);
  const Observation observation{
      .at = TimePoint{5s},
      .what = FrameReceived{.frame = {.id = 0x143, .length = 8, .data = {0x8E, 0xA0, 0x8E, 0x92, 0x8E, 0xB2, 1, 2}}}};
  std::string text;
  text.reserve(1 << 20);
  while (state.KeepRunning()) {
    if (text.size() > (1 << 20) - record_line_max) text.clear();
    lines.observed(observation, text);
  }
}
BENCHMARK(record_observation_line);

/// The lines of a tick with a command and a poll.
void record_decision_lines(benchmark::State& state) {
  RecordLines lines(buses);
  Decisions decisions;
  decisions.frames.push_back({.frame = {.id = 0x40, .length = 8, .data = {3, 0, 0, 0, 0, 0, 1, 2}}});
  decisions.frames.push_back({.frame = {.id = 0x80, .length = 8, .data = {0, 1, 0, 0, 0, 0, 1, 2}}});
  std::string text;
  text.reserve(1 << 20);
  while (state.KeepRunning()) {
    if (text.size() > (1 << 20) - 10 * record_line_max) text.clear();
    lines.decided(TimePoint{5s}, decisions, text);
  }
}
BENCHMARK(record_decision_lines);

/// A core after some seconds of driving.
std::unique_ptr<CoreBench> driven(std::size_t modules) {
  auto bench = std::make_unique<CoreBench>(pack_of(modules));
  bench->link_rise_mV_per_ms = 2'000;
  (void)bench->close();
  bench->run(5s);
  return bench;
}

void copy_core(benchmark::State& state) {
  const auto bench = driven(static_cast<std::size_t>(state.range(0)));
  auto copy = std::make_unique<Core>(bench->core());
  while (state.KeepRunning()) {
    *copy = bench->core();
    benchmark::DoNotOptimize(copy.get());
  }
}
BENCHMARK(copy_core)->Arg(8)->Arg(63)->Unit(benchmark::kMicrosecond);

/// Runs in the recorder's thread.
void record_head(benchmark::State& state) {
  const auto bench = driven(static_cast<std::size_t>(state.range(0)));
  std::string text;
  while (state.KeepRunning()) {
    text.clear();
    append_record_head({.version = "0.1.0", .buses = buses}, bench->core(), RecordClock{}, text);
  }
  state.counters["bytes"] = static_cast<double>(text.size());
}
BENCHMARK(record_head)->Arg(8)->Arg(63)->Unit(benchmark::kMillisecond);

}  // namespace
