// Traction-pack messages in each dialect: worked frames, and the differences between dialects.
#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "daemon/core/vehicle/report_vehicle.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

using Bytes = std::vector<int>;

Bytes bytes_of(const CanFrame& frame) {
  return {frame.data.begin(), frame.data.begin() + frame.length};
}

/// Pack in driving mode, as in the worked frames.
struct World {
  PackState pack;
  CurrentLimits limits;
  VehicleView view{.mode = {.phase = Phase::closed,
                            .may_discharge = true,
                            .vehicle_on = true,
                            .current_mA = 85'000,
                            .outputs = {.main_positive = true, .main_negative = true}},
                   .uptime = 3725s,
                   .close_requested = true,
                   .soc_permille = 720,
                   .depth_of_discharge_uAs = 28 * uAs_per_Ah,
                   .capacity_uAs = 100 * uAs_per_Ah,
                   .totals = PackTotals{.energy_out_mWh = 1'200'000'400, .energy_in_mWh = 1'234'567'000}};

  World() {
    const TimePoint now{1s};
    pack.current_mA = {85'000, now, Validity::valid};
    pack.cell_temperature_dC = {
        .min = 180, .max = 250, .average = 210, .min_at = {1, 3, 3}, .max_at = {4, 2, 41}, .count = 48, .expected = 48};
    limits.charge.limit_mA = 40'999;
    limits.discharge.limit_mA = 200'000;
    view.pack = &pack;
    view.limits = &limits;
  }
  [[nodiscard]] Bytes message(unsigned id, const VehicleConfig& config) const {
    const CanFrame frame = vehicle_frame(id - 0x620, view, config);
    CHECK(frame.id == id);
    return bytes_of(frame);
  }
};

constexpr VehicleConfig in_dialect(VehicleDialect dialect) {
  return {.dialect = dialect};
}

}  // namespace

TEST_CASE("622h of each dialect is the worked frame", "[unit][vehicle][dialects][BMS_F.8][BMU_10]") {
  World world;
  CHECK(world.message(0x622, in_dialect(VehicleDialect::iha)) == Bytes{0x02, 0x0E, 0x8D, 0x04, 0, 0});
  CHECK(world.message(0x622, in_dialect(VehicleDialect::original)) == Bytes{0x04, 0x0E, 0x8D, 0, 0, 0});
  // K1 and K3 on; the load's power, and a request by wire; a warning of low voltage.
  world.view.faults.warnings = 0x01;
  CHECK(world.message(0x622, in_dialect(VehicleDialect::elithion)) == Bytes{0x0A, 0x0E, 0x8D, 0x0A, 0, 0, 0x01});
  world.view.codes = {1, 3};
  world.view.faults = {.stored_code = 8, .level_faults = 0x80, .warnings = 0x02};
  CHECK(world.message(0x622, in_dialect(VehicleDialect::iha)) == Bytes{0x02, 0x0E, 0x8D, 0x04, 1, 3});
  CHECK(world.message(0x622, in_dialect(VehicleDialect::original)) == Bytes{0x04, 0x0E, 0x8D, 0, 1, 3});
  CHECK(world.message(0x622, in_dialect(VehicleDialect::elithion)) == Bytes{0x0A, 0x0E, 0x8D, 0x0A, 8, 0x80, 0x02});
}

TEST_CASE("elithion's flags tell inputs and limits, each by its bit", "[unit][vehicle][dialects][BMS_F.8]") {
  struct Row {
    void (*change)(World& world);
    unsigned flags;
  };
  const std::vector<Row> rows{
      {[](World&) {}, 0b0000'1010},
      {[](World& world) { world.view.mode.charger_connected = true; }, 0b0000'1011},
      {[](World& world) { world.view.mode.vehicle_on = false; }, 0b0000'1000},
      {[](World& world) { world.view.interlock_tripped = true; }, 0b0000'1110},
      {[](World& world) { world.view.close_requested = false; }, 0b0000'0010},
      {[](World& world) { world.limits.charge.limit_mA = 0; }, 0b0010'1010},
      {[](World& world) { world.limits.discharge.limit_mA = 0; }, 0b0100'1010},
      {[](World& world) { world.view.mode.outputs.fan = true; }, 0b1000'1010},
  };
  for (const Row& row : rows) {
    World world;
    row.change(world);
    CHECK(elithion_flags(world.view) == row.flags);
  }
}

TEST_CASE("energy, second pack and air are told as each dialect has them", "[unit][vehicle][dialects][BMS_F.8]") {
  World world;
  const VehicleConfig iha = in_dialect(VehicleDialect::iha);
  const VehicleConfig elithion = in_dialect(VehicleDialect::elithion);
  const Bytes energy_Wh{0x00, 0x12, 0xD6, 0x87, 0x00, 0x12, 0x4F, 0x80};
  CHECK(world.message(0x625, iha) == energy_Wh);
  CHECK(world.message(0x625, elithion) == energy_Wh);
  VehicleConfig in_kWh = elithion;
  in_kWh.is_energy_in_kWh = true;
  CHECK(world.message(0x625, in_kWh) == Bytes{0, 0, 0x04, 0xD3, 0, 0, 0x04, 0xB0});
  world.view.totals = std::nullopt;
  CHECK(world.message(0x625, in_kWh) == Bytes(8, 0xFF));

  CHECK(world.message(0x626, iha) == Bytes{0x48, 0, 0x1C, 0, 0x64, 0xFF, 0xFF});
  CHECK(world.message(0x626, elithion) == Bytes{0x48, 0, 0x1C, 0, 0x64, 0x00, 0xFF});
  world.view.soc_2_permille = 405;
  CHECK(world.message(0x626, iha)[5] == 41);
  CHECK(world.message(0x626, in_dialect(VehicleDialect::original))[5] == 41);
  CHECK(world.message(0x626, elithion)[5] == 0);

  CHECK(world.message(0x627, iha) == Bytes{0x15, 0x80, 0x12, 0x03, 0x19, 0x29});
  CHECK(world.message(0x627, in_dialect(VehicleDialect::original)) == Bytes{0x15, 0x80, 0x12, 0x03, 0x19, 0x29});
  CHECK(world.message(0x627, elithion) == Bytes{0x15, 0x00, 0x12, 0x03, 0x19, 0x29});
}

TEST_CASE("624h counts out of the pack unless it is to be the other way round", "[unit][vehicle][dialects][BMS_F.8]") {
  World world;
  VehicleConfig config;
  CHECK(world.message(0x624, config) == Bytes{0x00, 0x55, 0x00, 0x28, 0x00, 0xC8});
  config.is_charge_positive = true;
  CHECK(world.message(0x624, config) == Bytes{0xFF, 0xAB, 0x00, 0x28, 0x00, 0xC8});
  world.pack.current_mA = {};
  CHECK(world.message(0x624, config) == Bytes{0x80, 0x00, 0x00, 0x28, 0x00, 0xC8});
}

TEST_CASE("what the core reports is in its dialect, and passes the gate", "[unit][core][vehicle][dialects][BMS_F.8]") {
  for (const VehicleDialectRow& row : vehicle_dialects) {
    INFO(row.name);
    CoreConfig config = test::small_pack();
    config.vehicle.dialect = row.dialect;
    test::CoreBench bench(config);
    REQUIRE(bench.close());
    bench.run(2s);
    CHECK(bench.core().gate_refusals() == 0);
    std::set<std::uint32_t> told;
    for (const OutgoingFrame& sent : bench.sent()) {
      if (sent.port != Port::vehicle) continue;
      told.insert(sent.frame.id);
      const MessageSpec& message = *row.catalogue->find(sent.frame.id).message;
      CHECK(sent.frame.length == message.length);
    }
    CHECK(told.size() == vehicle_message_count);
    const auto last = std::find_if(bench.sent().rbegin(), bench.sent().rend(), [](const OutgoingFrame& sent) {
      return sent.port == Port::vehicle && sent.frame.id == 0x622;
    });
    REQUIRE(last != bench.sent().rend());
    const std::vector<unsigned> state_of_dialect{2, 4, 0b01010};
    CHECK(last->frame.data[0] == state_of_dialect[static_cast<std::size_t>(row.dialect)]);
  }
}

TEST_CASE("an interlock that nobody tells of counts as tripped", "[unit][core][vehicle][dialects][BMS_F.8]") {
  CoreConfig config = test::small_pack();
  config.vehicle.dialect = VehicleDialect::elithion;
  test::CoreBench bench(config);
  const auto flags = [&bench] {
    unsigned last = 0;
    for (const OutgoingFrame& sent : bench.sent()) {
      if (sent.port == Port::vehicle && sent.frame.id == 0x622) last = sent.frame.data[3];
    }
    return last;
  };
  constexpr unsigned tripped = 1U << 2U;
  bench.run(2500ms);
  CHECK((flags() & tripped) == 0);
  bench.inputs.interlock_closed = false;
  bench.run(1500ms);
  CHECK((flags() & tripped) != 0);
  bench.inputs.interlock_closed = true;
  bench.run(1500ms);
  CHECK((flags() & tripped) == 0);
  bench.pdu_talks = false;
  bench.run(1500ms);
  CHECK((flags() & tripped) != 0);
}
