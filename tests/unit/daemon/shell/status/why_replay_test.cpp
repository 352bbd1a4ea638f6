// A core that follows a recording gives the same reply to "why" as the core that drove the pack.
#include "daemon/shell/status/why_json.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

/// Core that follows the bench: it receives the same observations, and decides at the same times.
class Follower {
 public:
  explicit Follower(CoreBench& bench) : core_(small_pack(), TimePoint{1s}) {
    // The bench has observed its buses, and decided on them, before its hooks were set.
    core_.observe({bench.now(), PortChanged{Port::internal, true}});
    static_cast<void>(core_.decide(bench.now()));
    core_.observe({bench.now(), PortChanged{Port::vehicle, true}});
    bench.on_observe = [this](const Observation& observation) { core_.observe(observation); };
    bench.on_decide = [this](TimePoint at) { static_cast<void>(core_.decide(at)); };
  }

  [[nodiscard]] std::string why(TimePoint now) const { return why_json({.core = core_, .now = now}).dump(2); }

 private:
  Core core_;
};

}  // namespace

TEST_CASE("a recording gives the same answer to why as the drive did, at every stage", "[unit][why][replay]") {
  CoreBench bench(small_pack());
  Follower follower(bench);
  const auto check = [&](std::string_view part) {
    const std::string told = why_json({.core = bench.core(), .now = bench.now()}).dump(2);
    CHECK(follower.why(bench.now()) == told);
    CHECK(told.find(part) != std::string::npos);
  };
  check("Close inhibit");
  REQUIRE(bench.close());
  bench.run(500ms);
  check("no close inhibit");
  bench.modules[1].cell_voltage_uV[2] = known(3'000'000);
  bench.run(1s);
  check("cell 2.3 (no. 7)");
  bench.modules[1].cell_voltage_uV[2] = known(2'800'000);
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 1s));
  bench.run(3s);
  check("2.8000 V, limit 2.9000 V");
  bench.inputs.vehicle_on = false;
  bench.modules[1].cell_voltage_uV[2] = known(3'700'000);
  bench.run(15s);
  bench.give(Command::clear_faults);
  bench.inputs.estop_2_released = false;
  bench.run(2s);
  check("emergency stop 2");
}
