// The core uses no heap after its start. This test counts every operator new of the program.
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::allocation_count;
using bmu::test::CoreBench;
using bmu::test::pack_of;

namespace {

/// Observations and decision times of a core, from a real run on the bench, to be fed into another core.
struct Script {
  std::vector<Observation> observations;
  std::vector<std::size_t> decide_after;  // number of observations before each decision
  std::vector<TimePoint> decide_at;
};

Script record_run() {
  CoreBench bench(pack_of(16));
  Script script;
  for (const Port port : {Port::internal, Port::vehicle}) {  // the bench observed them before the hooks were set
    script.observations.push_back({bench.now(), PortChanged{port, true}});
  }
  script.decide_after.push_back(1);  // and decided at once when the first was up
  script.decide_at.push_back(bench.now());
  bench.on_observe = [&](const Observation& observation) { script.observations.push_back(observation); };
  bench.on_decide = [&](TimePoint at) {
    script.decide_after.push_back(script.observations.size());
    script.decide_at.push_back(at);
  };
  bench.link_rise_mV_per_ms = 2'000;
  (void)bench.close();
  bench.current_mA = 40'000;
  bench.run(500ms);
  bench.modules[7].cell_voltage_uV[3] = known(2'000'000);
  bench.run(1s);
  bench.modules[3].talks = false;
  bench.run(1s);
  bench.give(Command::clear_faults);
  bench.give(Command::shut_down);
  bench.run(300ms);
  return script;
}

}  // namespace

TEST_CASE("observe and decide never touch the heap, from start to fault to shutdown", "[unit][core][allocation][F66]") {
  const Script script = record_run();
  Core core(pack_of(16), TimePoint{1s});
  REQUIRE(script.observations.size() > 5'000);
  const std::uint64_t before = allocation_count();
  std::size_t told = 0;
  bool opened_by_fault = false;
  bool was_closed = false;
  for (std::size_t index = 0; index < script.decide_at.size(); ++index) {
    while (told < script.decide_after[index]) core.observe(script.observations[told++]);
    const Decisions decisions = core.decide(script.decide_at[index]);
    was_closed = was_closed || core.sequence().phase == Phase::closed;
    opened_by_fault = opened_by_fault || core.last_opening().cause == OpeningCause::fault;
    if (decisions.is_shut_down) break;
  }
  const std::uint64_t after = allocation_count();
  CHECK(after == before);
  CHECK(was_closed);  // the run covered a closed pack
  CHECK(opened_by_fault);
}

TEST_CASE("the counter of this test does count", "[unit][allocation]") {
  const std::uint64_t before = allocation_count();
  ::operator delete(::operator new(10));  // not a vector: the compiler may remove an unused one
  CHECK(allocation_count() == before + 1);
}
