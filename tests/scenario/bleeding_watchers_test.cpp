// Effect of bleeding cells on the other monitors. A resistor's current flows through the two wires that measure its
// cell: the cell reads lower by twice a wire's drop, each neighbour higher by one.
#include <algorithm>
#include <array>
#include <string>

#include "config/pack_config.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

constexpr double wire_Ohm = 0.1;  // 0.1 A through two of them: 20 mV at the cell, 10 mV at its neighbours
constexpr std::uint32_t cell_frames = 2;

/// Six cells of 80 mAh: a resistor removes their surplus in minutes.
CoreConfig small_cells() {
  auto pack = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
  REQUIRE(pack.has_value());
  pack->core.cell.capacity_uAs /= 40;
  pack->core.balancing.is_enabled = true;
  pack->core.balancing.method = BalancingMethod::ocv;
  pack->core.balancing.dead_band_uV = 3'000;
  pack->core.balancing.settle = 2s;
  return pack->core;
}

/// Voltage drop in uV that lowers the reading of a cell, counted from 0, with the present switches.
double drop_uV(const WiredPack& pack, std::size_t cell) {
  const unsigned on = pack.simulator().mmu(0).balancing_cells();
  const double bleed_A = 4.0 / pack.config().balancing.bleed_resistance_Ohm;
  const auto is_on = [on](std::size_t one) { return (on >> one & 1U) != 0; };
  // Currents in the wires at its lower and its upper end: its own, less that of the cell on the wire's other side.
  const double lower = (is_on(cell) ? 1.0 : 0.0) - (cell > 0 && is_on(cell - 1) ? 1.0 : 0.0);
  const double upper = (is_on(cell) ? 1.0 : 0.0) - (is_on(cell + 1) ? 1.0 : 0.0);
  return (lower + upper) * wire_Ohm * bleed_A * 1e6;
}

/// The module's CELLS frames with the drops of its wires.
test::Fate through_wires(CanFrame& frame, const WiredPack& pack) {
  for (std::size_t block = 0; block < cell_frames; ++block) {
    const MessageSpec& row = *internal_bus::cells_rows[block];
    if (frame.id != row.base_id + 1U) continue;
    for (std::size_t slot = 0; slot < internal_bus::cells_per_frame; ++slot) {
      const SignalValue value = decode_signal(row.signals[slot], frame.data);
      if (!value.is_valid()) continue;
      const std::size_t cell = block * internal_bus::cells_per_frame + slot;
      const std::int64_t read_uV = value.value - static_cast<std::int64_t>(drop_uV(pack, cell));
      encode_signal(row.signals[slot], known(read_uV / 100 * 100), frame.data);
    }
    seal(row, frame.data[6], frame);
  }
  return {};
}

bool is_bleeding(const WiredPack& pack) {
  return pack.simulator().mmu(0).balancing_cells() != 0;
}
std::int64_t count_of(const WiredPack& pack, FaultId id) {
  return pack.core().faults().state(id).count;
}

/// Closes on a charger's small current, with five cells bleeding.
void make_bleed(WiredPack& pack, const char* more = "") {
  pack.on_sent = through_wires;
  pack.apply("pack soc_permille 500; cell 1.3 soc_permille 300");
  pack.run(2s);
  pack.apply("charger connected");
  REQUIRE(pack.run_until([](const WiredPack& now) { return now.phase() == Phase::closed; }, 20s));
  if (*more != '\0') pack.apply(more);
  REQUIRE(pack.run_until(is_bleeding, 30s));
  pack.run(3s);
}

/// Voltage as the core has received it.
std::int32_t read_uV(const WiredPack& pack, std::size_t cell) {
  return pack.core().modules().modules()[0].cell_voltage_uV[cell].value;
}

}  // namespace

TEST_CASE("cells that bleed through their wires raise no alarm, at rest or while the current changes",
          "[scenario][balancing][faults]") {
  WiredPack pack(small_cells());
  make_bleed(pack);
  const double wrong_uV = drop_uV(pack, 1);
  REQUIRE(drop_uV(pack, 2) < -15'000.0);  // between two that bleed
  REQUIRE(wrong_uV > 5'000.0);
  for (int turn = 0; turn < 8; ++turn) {
    pack.apply(turn % 2 == 0 ? "charger current_A 0.3" : "charger current_A 0");
    pack.run(45s);
  }
  CHECK(pack.core().watchers().switches.bled_uAs(0) > 0);
  for (const FaultRow& row : fault_table()) {
    CAPTURE(row.name);
    CHECK(count_of(pack, row.id) == 0);
    CHECK_FALSE(pack.core().faults().state(row.id).is_warning);
  }
  CHECK(pack.phase() == Phase::closed);
}

namespace {

/// Time from a step of the current until repeated values of the module are detected.
Duration until_stuck_is_found(const char* charger, bool bleeds) {
  CoreConfig config = small_cells();
  config.balancing.is_enabled = bleeds;
  WiredPack pack(config);
  pack.on_sent = through_wires;
  pack.apply("pack soc_permille 500; cell 1.3 soc_permille 300");
  pack.run(2s);
  pack.apply("charger connected");
  REQUIRE(pack.run_until([](const WiredPack& now) { return now.phase() == Phase::closed; }, 20s));
  if (bleeds) REQUIRE(pack.run_until(is_bleeding, 30s));
  pack.run(3s);
  REQUIRE(is_bleeding(pack) == bleeds);
  std::array<std::array<std::uint8_t, 6>, cell_frames> kept{};
  for (std::uint32_t block = 0; block < cell_frames; ++block) {
    const CanFrame& last = pack.last_sent().at(internal_bus::cells_rows[block]->base_id + 1U);
    std::copy_n(last.data.begin(), kept[block].size(), kept[block].begin());
  }
  pack.on_sent = [kept](CanFrame& frame, const WiredPack&) {
    for (std::uint32_t block = 0; block < cell_frames; ++block) {
      const MessageSpec& row = *internal_bus::cells_rows[block];
      if (frame.id != row.base_id + 1U) continue;
      std::copy(kept[block].begin(), kept[block].end(), frame.data.begin());
      seal(row, frame.data[6], frame);
    }
    return test::Fate{};
  };
  const TimePoint began_at = pack.now();
  pack.apply(charger);
  const auto is_found = [](const WiredPack& now) { return count_of(now, FaultId::stuck_values) > 0; };
  REQUIRE(pack.run_until(is_found, 60s));
  return pack.now() - began_at;
}

}  // namespace

TEST_CASE("values that stand still are found as soon with cells bleeding as without", "[scenario][balancing][faults]") {
  const Duration quiet = until_stuck_is_found("charger current_A 3", false);
  const Duration bleeding = until_stuck_is_found("charger current_A 3", true);
  CAPTURE(to_ms(quiet), to_ms(bleeding));
  CHECK(bleeding <= quiet + 500ms);
}

TEST_CASE("a cell far below the others is seen while they bleed", "[scenario][balancing][faults]") {
  CoreConfig config = small_cells();
  config.limits.cell_imbalance = {
      .warn = 300'000, .limit = 400'000, .open = 500'000, .hysteresis = 50'000, .confirm = 300ms, .clear = 5s};
  WiredPack pack(config);
  make_bleed(pack);
  REQUIRE(count_of(pack, FaultId::cell_imbalance) == 0);
  pack.apply("cell 1.3 voltage_mV 3150");
  pack.run(1s);
  CHECK(count_of(pack, FaultId::cell_imbalance) == 1);
}

TEST_CASE("a bleeding cell's overvoltage is seen as soon as it stands above its limit by the drop of its wires",
          "[scenario][balancing][faults]") {
  WiredPack pack(small_cells());
  make_bleed(pack);
  const double wires_uV = 2.0 * wire_Ohm * 0.1 * 1e6;
  REQUIRE((pack.simulator().mmu(0).balancing_cells() & 0b10'0000U) != 0);
  const std::int32_t open_uV = static_cast<std::int32_t>(pack.config().limits.cell_overvoltage.open);
  const std::int32_t beyond_mV = open_uV / 1'000 + static_cast<std::int32_t>(wires_uV / 1'000) + 3;
  pack.apply("cell 1.6 voltage_mV " + std::to_string(beyond_mV));
  REQUIRE(pack.run_until([](const WiredPack& now) { return now.phase() == Phase::open; }, 500ms));
  CHECK(count_of(pack, FaultId::cell_overvoltage) == 1);
}

TEST_CASE("what the wires hide of an overvoltage comes out when the switches go off, in five minutes at most",
          "[scenario][balancing][faults]") {
  WiredPack pack(small_cells());
  make_bleed(pack);
  const std::int32_t open_uV = static_cast<std::int32_t>(pack.config().limits.cell_overvoltage.open);
  pack.apply("cell 1.6 voltage_mV " + std::to_string(open_uV / 1'000 + 3));
  const TimePoint began_at = pack.now();
  pack.run(1s);
  REQUIRE(is_bleeding(pack));
  CHECK(read_uV(pack, 5) < open_uV);
  CHECK(count_of(pack, FaultId::cell_overvoltage) == 0);
  // It is visible: the warning stands meanwhile, and the charge limit is reduced.
  CHECK(pack.core().faults().state(FaultId::cell_overvoltage).is_warning);
  REQUIRE(pack.run_until([](const WiredPack& now) { return now.phase() == Phase::open; }, 301s));
  CHECK(count_of(pack, FaultId::cell_overvoltage) == 1);
  CHECK(pack.now() - began_at <= 301s);
}
