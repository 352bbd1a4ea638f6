// Acceptance test of MMU_CB (distributed system). Procedure of the authors: cells 2, 5, 8 and 11 of a module are
// commanded to balance for two minutes. Their figure: exactly these four switches are on, and off again after two
// minutes.
#include "daemon/core/balancing/balancing_control.hpp"
#include "mmu/scenario/simulator.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/patched_pack.hpp"

using namespace bmu;

TEST_CASE("of a module with twelve cells 2, 5, 8 and 11 are bled for two minutes, and no other",
          "[scenario][accept][MMU_CB]") {
  constexpr std::uint8_t node = 2;
  constexpr CellMask four = cell_bit(1) | cell_bit(4) | cell_bit(7) | cell_bit(10);
  Simulator simulator(simulator_config(test::patched_pack("{}")), *parse_scenario("0 pack soc_permille 700"),
                      test::power_up);
  const Mmu& unit = simulator.mmu(node - 1);
  std::uint8_t polls = 0;
  Duration on_for{};
  Duration reported_for{};
  const auto run = [&](Duration duration) {
    for (const TimePoint end = simulator.now() + duration; simulator.now() < end;) {
      simulator.observe(test::poll_frame(node, test::want_all, ++polls), simulator.now());
      for (const SentFrame& sent : simulator.advance(simulator.now() + 100ms)) {
        if (sent.frame.id != internal_bus::module.base_id + node) continue;
        const std::int64_t reported = read_raw<internal_bus::module, "balancing_cells">(sent.frame);
        REQUIRE((reported == 0 || reported == four));
        if (reported != 0) reported_for += 100ms;
      }
      REQUIRE((unit.balancing_cells() == 0 || unit.balancing_cells() == four));
      if (unit.balancing_cells() != 0) on_for += 100ms;
    }
  };
  run(1s);
  REQUIRE(on_for == 0s);
  const BalancingOrder order{
      .module_index = node - 1, .is_stop = false, .minutes = {0, 2, 0, 0, 2, 0, 0, 2, 0, 0, 2, 0}};
  simulator.observe(balancing_frame(order, node, 1), simulator.now());
  run(123s);
  CHECK(on_for >= 119'900ms);
  CHECK(on_for <= 120'100ms);
  CHECK(reported_for >= 119'900ms);
  CHECK(reported_for <= 120'100ms);
  run(130s);
  CHECK(on_for <= 120'100ms);  // and none is on again
}
