// Packs with modules of another maker are charged to their end by an emulated charger: differences are balanced by the
// voltage above which the modules are commanded to bleed, until all cells are full.
#include <algorithm>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;
using test::SimRun;

namespace {

/// With a charger, and cells of so little capacity that the last tenth and the differences take half an hour.
CoreConfig soon_charged(const std::string& pack) {
  CoreConfig config =
      test::patched_pack(R"({"charger": {"protocol": "elcon_tc", "units": 4, "current_max_mA": 20000}})", pack);
  config.cell.capacity_uAs /= 40;
  return config;
}

struct VoltageRange {
  double min_uV = 9e6;
  double max_uV = 0.0;
};
VoltageRange range_of(const SimRun& run) {
  VoltageRange range;
  for (std::size_t cell = 0; cell < cell_count(run.core().config()); ++cell) {
    const double cell_uV = run.simulator().plant().cell(cell).voltage_V * 1e6;
    range.min_uV = std::min(range.min_uV, cell_uV);
    range.max_uV = std::max(range.max_uV, cell_uV);
  }
  return range;
}

}  // namespace

TEST_CASE("a charge ends with every cell of another maker's modules in its window",
          "[scenario][foreign_modules][charger][slow]") {
  constexpr double hour_s = 3'600.0;
  constexpr double above_window_uV = 3'000.0;  // effect of the last current on cells of different charge
  for (const char* const name : {"outlander-80s.json", "i3-96s.json"}) {
    DYNAMIC_SECTION(name) {
      SimRun run(soon_charged(name));
      run.apply("pack soc_permille 900");
      run.apply("cell 2.7 soc_permille 970");
      run.apply("cell 4.3 soc_permille 925");
      run.run_to(3.0);
      run.apply("charger current_A 20");
      run.apply("charger connected");
      const Core& core = run.core();
      bool has_balanced = false;
      while (run.seconds() < 4 * hour_s && core.charge_control().stage() != ChargeStage::full) {
        run.run_to(run.seconds() + 10.0);
        has_balanced = has_balanced || core.charge_control().stage() == ChargeStage::balancing;
      }
      const VoltageRange range = range_of(run);
      CAPTURE(run.seconds(), range.min_uV, range.max_uV);
      REQUIRE(core.charge_control().stage() == ChargeStage::full);
      CHECK(has_balanced);
      CHECK(range.max_uV > core.charge_control().cell_full_uV() - 10e3);
      CHECK(range.max_uV - range.min_uV < core.config().charger.balance_window_uV + above_window_uV);
      for (const FaultRow& row : fault_table()) {
        INFO(row.name);
        CHECK_FALSE(core.faults().state(row.id).is_present());
      }
    }
  }
}
