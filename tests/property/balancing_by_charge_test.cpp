// Cells that hold more or less than their file says, a sensor that counts wrongly, rests at random: what balancing by
// charge takes, a cell had above the one that is missing most.
//
// Each run is drawn from a seed that a failure prints; BMUD_SEED=17 runs that one alone.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "mmu/random.hpp"
#include "tests/support/balancing_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu {
namespace {

using test::BalancingBench;

constexpr double capacity_uAs = 10.0 * uAs_per_Ah;
/// Of the capacity: what a sensor's gain makes of a difference between two cells is the same share of that difference.
constexpr double overshoot_max = 0.003;
constexpr std::uint64_t seeds = 40;

/// Steep to 20 %, flat to 90 %, steep again; two modules of four cells.
CoreConfig flat_pack() {
  CoreConfig config = test::small_pack();
  config.cell.ocv.clear();
  for (const OcvPoint point :
       {OcvPoint{0, 2'800'000}, OcvPoint{200, 3'290'000}, OcvPoint{900, 3'300'000}, OcvPoint{1'000, 3'450'000}}) {
    config.cell.ocv.push_back(point);
  }
  config.cell.capacity_uAs = 10 * uAs_per_Ah;
  config.cell.rc_time_constant_s = 60.0;
  config.soc = {.rest_current_mA = 200, .rest = 30s};
  config.balancing = {.is_enabled = true,
                      .method = BalancingMethod::charge,
                      .bleed_resistance_Ohm = 10,
                      .dead_band_permille = 0,
                      .capacity_tolerance_permille = 100,
                      .settle = 2s};
  return config;
}

/// Even from -most to +most.
double within(RandomSource& random, double most) {
  return random.within(1'000'000) * 1e-6 * most;
}

/// Until the first cell that gets there has this much.
void carry(BalancingBench& bench, double to_soc) {
  const auto [low, high] = std::minmax_element(bench.soc.begin(), bench.soc.end());
  const bool is_charge = *high < to_soc;
  if (!is_charge && *low <= to_soc) return;
  bench.current_A = is_charge ? -10.0 : 10.0;
  REQUIRE(bench.run_until(
      [&] {
        const auto [least, most] = std::minmax_element(bench.soc.begin(), bench.soc.end());
        return is_charge ? *most >= to_soc : *least <= to_soc;
      },
      3h));
  bench.current_A = 0.0;
}

void rest(BalancingBench& bench) {
  bench.is_open = true;
  bench.run(200s);
  bench.is_open = false;
}

double most_missing_uAs(const BalancingBench& bench) {
  double most = 0.0;
  for (std::size_t cell = 0; cell < bench.soc.size(); ++cell) most = std::max(most, bench.missing_uAs(cell));
  return most;
}

/// Returns what was bled.
double bleed(BalancingBench& bench, Duration duration) {
  const double most_uAs = most_missing_uAs(bench);
  const std::vector<double> before_uAs = bench.bled_uAs;
  bench.blockers = 0;
  bench.run(duration);
  bench.blockers = 1;
  bench.run(5s);
  double sum_uAs = 0.0;
  for (std::size_t cell = 0; cell < bench.soc.size(); ++cell) {
    const double bled_uAs = bench.bled_uAs[cell] - before_uAs[cell];
    CAPTURE(cell, bench.capacity_share[cell], bench.soc[cell], bled_uAs / capacity_uAs);
    if (bled_uAs > 0.0) CHECK(bench.missing_uAs(cell) <= most_uAs + overshoot_max * capacity_uAs);
    sum_uAs += bled_uAs;
  }
  return sum_uAs;
}

/// Returns what was bled in a life of rests, charges and discharges.
double live(std::uint64_t seed) {
  RandomSource random(seed);
  BalancingBench bench(flat_pack());
  bench.blockers = 1;
  bench.sensor_gain = 1.0 + within(random, 0.02);
  bench.sensor_offset_A = within(random, 0.05);
  const double spread = 0.03 * static_cast<double>(random.next() % 3);
  for (std::size_t cell = 0; cell < bench.soc.size(); ++cell) {
    bench.capacity_share[cell] = 1.0 + within(random, 0.1);
    bench.soc[cell] = 0.5 + within(random, spread);
  }
  double bled_uAs = 0.0;
  for (int turn = 0; turn < 6; ++turn) {
    constexpr double near_empty = 0.03;
    constexpr double middle = 0.6;
    constexpr double near_full = 0.99;
    const std::uint64_t way = random.next() % 4;
    if (way != 0) carry(bench, way == 1 ? near_empty : near_full);
    if (way != 0) rest(bench);
    if (way == 3) carry(bench, near_empty);
    if (way == 3) rest(bench);
    if (random.next() % 2 == 0) carry(bench, middle);
    bled_uAs += bleed(bench, 3h);
  }
  return bled_uAs;
}

}  // namespace

TEST_CASE("no cell is bled below the one that is missing most, whatever cells hold and the sensor counts",
          "[property][balancing][BMS_F.4][slow]") {
  const char* only = std::getenv("BMUD_SEED");
  const std::uint64_t first = only != nullptr ? std::strtoull(only, nullptr, 10) : 1;
  const std::uint64_t last = only != nullptr ? first : seeds;
  std::uint64_t lives_with_bleeding = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("again: BMUD_SEED=" << seed << " test_property \"no cell is bled below*\"");
    if (live(seed) > capacity_uAs * 0.01) ++lives_with_bleeding;
  }
  if (only == nullptr) CHECK(lives_with_bleeding >= seeds / 3);  // or nothing was shown
}

}  // namespace bmu
