// Ageing of a whole pack: estimates learned in use, values reported to the vehicle, and state kept over restarts.
#include "daemon/core/estimation/pack_health.hpp"

#include <cmath>
#include <memory>
#include <vector>

#include "daemon/core/estimation/energy_left.hpp"
#include "daemon/history/history_row.hpp"
#include "daemon/history/minute_averager.hpp"
#include "daemon/shell/status/health_json.hpp"
#include "daemon/shell/status/why_limits.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::BenchModule;
using test::LivingPack;
using test::SimulatedCellOptions;

namespace {

constexpr std::size_t weak_cell = 5;
constexpr std::size_t worn_cell = 2;

/// Two modules of four cells with tables of their own, 10 Ah each.
CoreConfig sloped_pack() {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = std::llround(config.dynamics->capacity_As * 1e6);
  config.limits.cell_undervoltage = {.warn = 2'600'000, .open = 2'500'000, .hysteresis = 10'000};
  config.soc.current_gain_error_permille = 10;
  return config;
}

/// All cells have lost a tenth of their capacity, one a fifth; and one has 40 % more resistance.
std::vector<SimulatedCellOptions> worn(double soc) {
  std::vector<SimulatedCellOptions> cells(8, {.soc = soc, .capacity_share = -0.1});
  cells[weak_cell].capacity_share = -0.2;
  cells[worn_cell].resistance_share = 0.4;
  return cells;
}

void rest(LivingPack& pack, Duration duration = 720s) {
  pack.current_A = 0.0;
  pack.bench().inputs.vehicle_on = false;
  pack.run(duration);
  REQUIRE(pack.core().sequence().phase == Phase::open);
}

/// Drives in cycles of fifteen seconds, 10 A on average.
void drive(LivingPack& pack, int turns) {
  REQUIRE(pack.bench().close());
  for (int turn = 0; turn < turns; ++turn) {
    pack.current_A = turn % 2 == 0 ? 20.0 : 0.0;
    pack.run(15s);
  }
}

/// The last frame with this identifier.
CanFrame last_sent(LivingPack& pack, std::uint32_t id) {
  CanFrame found{};
  for (const OutgoingFrame& sent : pack.bench().sent()) {
    if (sent.frame.id == id) found = sent.frame;
  }
  return found;
}

}  // namespace

TEST_CASE("a pack that is driven from rest to rest learns how its cells have aged",
          "[unit][estimators][slow][FS_5][BMS_F.6][BMU_7]") {
  const CoreConfig config = sloped_pack();
  LivingPack pack(config, 0.9, worn(0.9));
  pack.bench().restore({});
  pack.bench().observe(WallClockSeen{1'700'000'000'000});
  rest(pack);
  CHECK_FALSE(pack_health(pack.estimate()).by_capacity.is_known);
  CHECK_FALSE(pack_health(pack.estimate()).resistance.is_known);
  const Json unknown = health_json({.core = pack.core(), .now = pack.bench().now()});
  for (const char* key : {"by_capacity_permille", "weakest_cell", "by_resistance_permille", "worst_cell",
                          "pack_resistance_uOhm", "cell_resistance_max_uOhm", "cell_resistance_max_permille"}) {
    CHECK(unknown.at(key).is_null());
  }
  CHECK(unknown.at("modules").at(0).at("capacity_uAs").at(0).is_null());
  CHECK(unknown.at("modules").at(0).at("resistance_uOhm").at(0).is_null());
  CHECK(read<vehicle_bus::pack_charge, "soh_permille">(last_sent(pack, 0x626)) == not_known());
  CHECK(read<vehicle_bus::pack_resistance, "pack_resistance_uOhm">(last_sent(pack, 0x628)) == not_known());
  drive(pack, 120);
  const PackHealth driven = pack_health(pack.estimate());
  REQUIRE(driven.resistance.is_known);
  const double new_Ohm = ExpectedResistance(*config.dynamics).at_reference_Ohm();
  CHECK(driven.resistance.worst_cell == worn_cell);
  CHECK(static_cast<double>(driven.resistance.worst_permille) == Approx(1.4 / 1.05 * 1e3).epsilon(0.05));
  CHECK(driven.cell_resistance_max_Ohm == Approx(1.4 * new_Ohm).epsilon(0.1));
  CHECK(driven.resistance.resistance_Ohm == Approx(8.4 * new_Ohm).epsilon(0.08));
  CHECK(std::abs(driven.resistance.resistance_Ohm - 8.4 * new_Ohm) <= 2.0 * driven.resistance.sigma_Ohm);
  REQUIRE(driven.by_resistance.is_known);
  CHECK(driven.worst_cell == worn_cell);
  CHECK(std::abs(driven.by_resistance.permille - 600) <= 2 * driven.by_resistance.sigma_permille);
  rest(pack, anchor_rest - 5s);
  for (std::size_t cell = 0; cell < pack.size(); ++cell) CHECK(pack.estimate().cell_health(cell).capacity_pairs() == 0);
  rest(pack, 2 * 5s + anchor_every);

  const PackHealth rested = pack_health(pack.estimate());
  REQUIRE(rested.by_capacity.is_known);
  CHECK(rested.weakest_cell == weak_cell);
  for (std::size_t cell = 0; cell < pack.size(); ++cell) {
    const CellHealth& health = pack.estimate().cell_health(cell);
    const double truth_As = config.dynamics->capacity_As * (cell == weak_cell ? 0.8 : 0.9);
    CHECK(health.capacity_pairs() == 1);
    CHECK(std::abs(health.capacity_As() - truth_As) <= 2.0 * health.capacity_sigma_As());
    CHECK(health.capacity_As() == Approx(truth_As).epsilon(0.06));
  }
  const SignalValue told = read<vehicle_bus::pack_charge, "soh_permille">(last_sent(pack, 0x626));
  REQUIRE(told.is_valid());
  CHECK(std::abs(told.value - rested.by_capacity.permille) <= 5);
  const CanFrame resistances = last_sent(pack, 0x628);
  const PackHealth now = pack_health(pack.estimate());
  CHECK(read<vehicle_bus::pack_resistance, "pack_resistance_uOhm">(resistances).value ==
        Approx(now.resistance.resistance_Ohm * 1e6).margin(600.0));
  CHECK(read<vehicle_bus::pack_resistance, "cell_resistance_max_uOhm">(resistances).value ==
        Approx(now.cell_resistance_max_Ohm * 1e6).margin(60.0));
  CHECK(read<vehicle_bus::pack_resistance, "cell_resistance_min_uOhm">(resistances).value ==
        Approx(now.cell_resistance_min_Ohm * 1e6).margin(60.0));
  CHECK(read<vehicle_bus::pack_resistance, "cell_resistance_max_cell">(resistances) == known(worn_cell + 1));
  // The status socket reports the same values.
  const Json json = health_json({.core = pack.core(), .now = pack.bench().now()});
  CHECK(json.at("by_capacity_permille") == now.by_capacity.permille);
  CHECK(json.at("weakest_cell").at("pack_number") == weak_cell + 1);
  CHECK(json.at("worst_cell").at("pack_number") == worn_cell + 1);
  CHECK(json.at("rated_capacity_uAs") == config.cell.capacity_uAs);
  CHECK(json.at("totals").at("charge_out_uAs") == pack.core().totals()->charge_out_uAs);
  REQUIRE(json.at("modules").size() == 2);
  const Json& module = json.at("modules").at(1);
  CHECK(module.at("node") == 2);
  CHECK(module.at("first_pack_number") == 5);
  CHECK(module.at("capacity_uAs").at(1) == std::llround(pack.estimate().cell_health(weak_cell).capacity_As() * 1e6));
  CHECK(module.at("resistance_uOhm").at(1) ==
        std::llround(pack.estimate().cell_resistance(weak_cell).resistance_Ohm * 1e6));
  CHECK(module.at("capacity_pairs").at(1) == 1);
  CHECK(module.at("health_by_capacity_permille").size() == 4);
  // The pack capacity follows from the learned cell capacities.
  CHECK(pack.estimate().pack().capacity_As() < 0.87 * config.dynamics->capacity_As);

  // The next session restores it.
  pack.bench().give(Command::shut_down);
  pack.run(1s);
  const PersistentState kept = pack.core().persistent();
  LivingPack next(config, pack.cell(0).soc(), worn(pack.cell(0).soc()), kept);
  next.run(5s);
  REQUIRE(next.estimate().origin() == SocOrigin::former);
  const PackHealth after = pack_health(next.estimate());
  REQUIRE(after.by_capacity.is_known);
  CHECK(std::abs(after.by_capacity.permille - rested.by_capacity.permille) <= 3);
  CHECK(after.resistance.resistance_Ohm == Approx(now.resistance.resistance_Ohm).epsilon(0.01));
}

TEST_CASE("what flowed adds up over lives, if somebody keeps it", "[unit][totals]") {
  const CoreConfig config = sloped_pack();
  const auto forgetful = std::make_unique<Core>(config, TimePoint{1s});
  CHECK_FALSE(forgetful->totals());
  const PackState nothing;
  const CurrentLimits limits;
  const CanFrame energy = vehicle_frame(5, {.pack = &nothing, .limits = &limits}, {});
  CHECK(read<vehicle_bus::pack_energy, "energy_out_mWh">(energy) == not_known());
  CHECK(read<vehicle_bus::pack_energy, "energy_in_mWh">(energy) == not_known());

  LivingPack pack(config, 0.6, {}, {.totals = {.charge_out_uAs = 5 * uAs_per_Ah, .energy_out_mWh = 40'000}});
  pack.run(3s);
  drive(pack, 48);
  REQUIRE(pack.core().totals());
  const double out_Ah = Ah_from_uAs(pack.core().totals()->charge_out_uAs);
  CHECK(out_Ah == Approx(5.0 + 10.0 * 720.0 / 3'600.0).margin(0.05));
  CHECK(pack.core().totals()->charge_in_uAs == 0);
  CHECK(pack.core().totals()->energy_out_mWh > 40'000 + 48'000);
  pack.run(1s);
  CHECK(read<vehicle_bus::pack_energy, "energy_out_mWh">(last_sent(pack, 0x625)).value ==
        Approx(pack.core().totals()->energy_out_mWh).margin(1'500));
  // Recorded periodically, not only at the end.
  CHECK(pack.core().persistent().totals.charge_out_uAs > 6 * uAs_per_Ah);
  pack.bench().give(Command::shut_down);
  pack.run(1s);
  // Except for the charge that flowed during opening.
  const std::int64_t kept_uAs = pack.core().persistent().totals.charge_out_uAs;
  CHECK(Ah_from_uAs(pack.core().totals()->charge_out_uAs - kept_uAs) < 0.01);
}

TEST_CASE("how long it lasts follows from what flows", "[unit][estimators]") {
  LivingPack pack(sloped_pack(), 0.5);
  pack.run(3s);
  CHECK_FALSE(pack.estimate().empty_in());
  CHECK_FALSE(pack.estimate().full_in());
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(300s);
  REQUIRE(pack.estimate().empty_in());
  CHECK_FALSE(pack.estimate().full_in());
  const double left_s = pack.estimate().pack().out_As / 10.0;
  CHECK(to_s(*pack.estimate().empty_in()) == Approx(left_s).epsilon(0.03));
  pack.current_A = -5.0;
  pack.run(300s);
  CHECK_FALSE(pack.estimate().empty_in());
  REQUIRE(pack.estimate().full_in());
  CHECK(to_s(*pack.estimate().full_in()) == Approx(pack.estimate().pack().in_As / 5.0).epsilon(0.03));
  pack.current_A = 0.0;
  pack.run(600s);
  CHECK_FALSE(pack.estimate().empty_in());
  CHECK_FALSE(pack.estimate().full_in());
}

TEST_CASE("the energy left is what the pack delivers until it opens, if the load stays",
          "[unit][energy][SOE_1][POW_1]") {
  LivingPack pack(sloped_pack(), 0.3);
  const auto left = [&pack] { return energy_left(pack.estimate(), pack.core().config()); };
  CHECK_FALSE(left().is_known);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(300s);
  const EnergyLeft before = left();
  REQUIRE(before.is_known);
  CHECK(before.load_A == Approx(10.0).epsilon(0.02));
  CHECK(before.sigma_Wh > 0.0);
  // The history contains the same value.
  MinuteAverager averager(pack.core(), 60s);
  static_cast<void>(averager.update(pack.bench().now()));
  pack.run(1s);
  REQUIRE(averager.finish(pack.bench().now()));
  const HistoryRow row = row_of(averager.minute(), layout_of(pack.core().config()));
  CHECK(row.energy_left_mWh == in_mWh(left().energy_Wh));
  CHECK(row.energy_left_sigma_mWh == in_mWh(left().sigma_Wh));
  const PowerLimits powers = pack.core().power_limits();
  REQUIRE(powers.discharge.limit_W != powers.charge.limit_W);
  CHECK(row.discharge_power_W == powers.discharge.limit_W);
  CHECK(row.charge_power_W == powers.charge.limit_W);
  CHECK(row.discharge_continuous_power_W == powers.discharge_continuous.limit_W);
  CHECK(row.charge_continuous_power_W == powers.charge_continuous.limit_W);
  CHECK(row.discharge_power_cause == to_text(powers.discharge.cause));
  CHECK(row.charge_power_cause == to_text(powers.charge.cause));
  CHECK(row.discharge_continuous_power_cause == to_text(powers.discharge_continuous.cause));
  CHECK(row.charge_continuous_power_cause == to_text(powers.charge_continuous.cause));

  double delivered_Wh = 0.0;
  const double expected_Wh = left().energy_Wh;
  for (int second = 0; second < 1'500 && pack.core().sequence().phase == Phase::closed; ++second) {
    if (pack.estimate().pack().out_As < 36.0) break;  // a thousandth of its charge
    pack.run(1s);
    for (const BenchModule& module : pack.bench().modules) {
      for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
        delivered_Wh += 10.0 * static_cast<double>(module.cell_voltage_uV[cell].value) / 1e6 / 3600.0;
      }
    }
  }
  CHECK(std::abs(delivered_Wh - expected_Wh) < 2.0 * before.sigma_Wh + 0.01 * expected_Wh);
  CHECK(left().energy_Wh < 0.02 * expected_Wh);
}

TEST_CASE("an open pack has no outlook", "[unit][estimators]") {
  LivingPack pack(sloped_pack(), 0.5);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(300s);
  REQUIRE(pack.estimate().empty_in());
  pack.current_A = 0.0;
  pack.bench().inputs.vehicle_on = false;
  pack.run(2s);
  CHECK_FALSE(pack.estimate().empty_in());
}

TEST_CASE("a sensor that says nothing leaves no outlook", "[unit][estimators]") {
  LivingPack pack(sloped_pack(), 0.5);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(60s);
  REQUIRE(pack.estimate().empty_in());
  pack.bench().sensor_talks = false;
  pack.run(5s);
  CHECK_FALSE(pack.estimate().empty_in());
  CHECK_FALSE(pack.estimate().full_in());
}

TEST_CASE("a charge is paused where the pack file says, and the limit names it", "[unit][charge_pause][BMS_F.6]") {
  CoreConfig config = sloped_pack();
  config.soc.resistance_pause_permille = 560;
  config.soc.resistance_pause = 4s;
  const bool is_at_charger = GENERATE(true, false);
  LivingPack pack(config, 0.5);
  pack.run(3s);
  pack.bench().inputs.charger_connected = is_at_charger;
  REQUIRE(pack.bench().close());
  bool was_paused = false;
  for (int second = 0; second < 400; ++second) {
    const CurrentLimit& limit = pack.core().limits().charge;
    pack.current_A = -std::min(10.0, limit.limit_mA / 1e3);
    pack.run(1s);
    if (!pack.core().charge_pause().is_pausing()) continue;
    was_paused = true;
    CHECK(pack.core().limits().charge.cause == LimitCause::measuring);
    CHECK(pack.core().limits().charge.limit_mA == 0);
    CHECK(pack.core().limits().charge_continuous.limit_mA == 0);
    CHECK(pack.core().limits().discharge.limit_mA > 0);
    CHECK(*pack.core().soc_permille() >= 557);
    CHECK(*pack.core().soc_permille() < 560 + pause_span_permille);
    const Json chain = limit_chain(Concerns::charge, {.core = pack.core(), .now = pack.bench().now()});
    CHECK(chain.at("text").get<std::string>() ==
          "Charge limit 0.000 A: paused to measure resistances; soc/resistance_pause_permille: charging paused at 56.0 "
          "% for 4.0 s to measure the resistance.");
  }
  CHECK(was_paused == is_at_charger);  // regenerative braking for minutes is not a charger
  CHECK(pack.core().limits().charge.limit_mA > 0);
}
