// Charge and energy throughput of the pack over all sessions.
#include "daemon/core/estimation/health/pack_totals.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr std::int64_t capacity_uAs = 20 * uAs_per_Ah;

}  // namespace

TEST_CASE("a life adds to what its predecessors left", "[unit][totals]") {
  const PackTotals former{.charge_out_uAs = 1, .charge_in_uAs = 2, .energy_out_mWh = 3, .energy_in_mWh = 4};
  const ChargeState life{.flowed_uAs = -10, .out_uAs = 10, .in_uAs = 20, .energy_in_mWh = 40, .energy_out_mWh = 30};
  CHECK(totals_with(former, life) == PackTotals{11, 22, 33, 44});
}

TEST_CASE("a cycle is the whole capacity taken out once", "[unit][totals]") {
  CHECK(cycles_permille({}, capacity_uAs) == 0);
  CHECK(cycles_permille({.charge_out_uAs = 70 * uAs_per_Ah, .charge_in_uAs = 1}, capacity_uAs) == 3'500);
  // Ten thousand cycles of a large pack exceed the range of 64-bit products.
  CHECK(cycles_permille({.charge_out_uAs = 10'000 * (300 * uAs_per_Ah)}, 300 * uAs_per_Ah) == 10'000'000);
}

TEST_CASE("two percent of the capacity, either way, are worth a record", "[unit][totals]") {
  const PackTotals older{.charge_out_uAs = capacity_uAs, .charge_in_uAs = capacity_uAs};
  PackTotals newer = older;
  newer.charge_out_uAs += capacity_uAs / 100;
  CHECK_FALSE(is_worth_recording(older, newer, capacity_uAs));
  newer.charge_in_uAs += capacity_uAs / 100;
  CHECK(is_worth_recording(older, newer, capacity_uAs));
}
