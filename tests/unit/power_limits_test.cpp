// Permissible power: the current limits at the voltage that is left of the pack, and a power that no current may
// exceed.
#include "daemon/core/power_limits.hpp"

#include "daemon/core/limit_ramp.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::LivingPack;

namespace {

Measured<std::int32_t> measured(std::int32_t value) {
  return {value, TimePoint{1s}, Validity::valid};
}

/// 600 V, and nothing flows.
PackState pack_at(std::int32_t voltage_mV, std::int32_t current_mA = 0) {
  PackState pack;
  pack.pack_voltage_mV = measured(voltage_mV);
  pack.current_mA = measured(current_mA);
  return pack;
}

CurrentLimits limits_of(std::int32_t discharge_mA, std::int32_t charge_mA) {
  return {.discharge = {.limit_mA = discharge_mA, .cause = LimitCause::peak},
          .charge = {.limit_mA = charge_mA, .cause = LimitCause::full},
          .discharge_continuous = {.limit_mA = discharge_mA / 2, .cause = LimitCause::continuous},
          .charge_continuous = {.limit_mA = charge_mA / 2, .cause = LimitCause::continuous}};
}

constexpr LoadResistance resistance{.peak_Ohm = 0.2, .continuous_Ohm = 0.5};

void is(const PowerLimit& power, std::int32_t limit_W, LimitCause cause) {
  CHECK(power.limit_W == limit_W);
  CHECK(to_text(power.cause) == to_text(cause));
}

void is(const CurrentLimit& limit, std::int32_t limit_mA, LimitCause cause) {
  CHECK(limit.limit_mA == limit_mA);
  CHECK(to_text(limit.cause) == to_text(cause));
}

}  // namespace

TEST_CASE("the power is the current limit at the voltage that its sag leaves", "[unit][limits][POW_1]") {
  const PowerLimits at_rest = power_limits(limits_of(100'000, 40'000), pack_at(600'000), resistance);
  is(at_rest.discharge, 58'000, LimitCause::peak);                   // 100 A at 580 V
  is(at_rest.discharge_continuous, 28'750, LimitCause::continuous);  // 50 A at 575 V
  is(at_rest.charge, 24'000, LimitCause::full);                      // 40 A: the voltage only rises
  is(at_rest.charge_continuous, 12'000, LimitCause::continuous);
  // 50 A flow already: 590 V are left of it.
  is(power_limits(limits_of(100'000, 40'000), pack_at(600'000, 50'000), resistance).discharge, 59'000,
     LimitCause::peak);
  // More flows than is allowed: it is not the higher voltage of then that counts.
  is(power_limits(limits_of(100'000, 40'000), pack_at(600'000, 200'000), resistance).discharge, 60'000,
     LimitCause::peak);
  // Charged with 60 A of 40: the voltage falls with the current.
  is(power_limits(limits_of(100'000, 40'000), pack_at(600'000, -60'000), resistance).charge, 23'840, LimitCause::full);
}

TEST_CASE("a voltage or current that is not measured permits no power", "[unit][limits][POW_1]") {
  PackState pack = pack_at(600'000);
  pack.pack_voltage_mV.validity = Validity::unknown;
  is(power_limits(limits_of(100'000, 40'000), pack, resistance).discharge, 0, LimitCause::not_sensed);
  is(power_limits(limits_of(100'000, 40'000), pack, resistance).charge_continuous, 0, LimitCause::not_sensed);
  pack = pack_at(600'000);
  pack.current_mA.validity = Validity::unknown;
  is(power_limits(limits_of(100'000, 40'000), pack, resistance).charge, 0, LimitCause::not_sensed);
  is(power_limits({}, pack, resistance).discharge, 0, LimitCause::not_connected);
  // So large a sag leaves nothing, and no negative power.
  is(power_limits(limits_of(100'000, 40'000), pack_at(10'000), resistance).discharge, 0, LimitCause::peak);
}

TEST_CASE("a power of the whole pack bounds both currents by the measured voltage", "[unit][limits][POW_1]") {
  CurrentLimits limits = limits_of(200'000, 40'000);
  lower_to_power(limits, pack_at(600'000), {.power_max_W = 80'000});
  is(limits.discharge, 133'333, LimitCause::power);
  CHECK(limits.discharge.value == 600'000);
  CHECK(limits.discharge.threshold == 80'000);
  CHECK(limits.discharge.unhindered_mA == 200'000);
  is(limits.discharge_continuous, 100'000, LimitCause::continuous);
  is(limits.charge, 40'000, LimitCause::full);
  limits = limits_of(200'000, 240'000);
  lower_to_power(limits, pack_at(400'000), {.power_max_W = 80'000});
  is(limits.discharge, 200'000, LimitCause::peak);  // exactly 80 kW
  is(limits.charge, 200'000, LimitCause::power);
  limits = limits_of(200'000, 40'000);
  lower_to_power(limits, pack_at(1), {.power_max_W = 1});  // the lowest voltage that counts: 1 MA
  is(limits.discharge, 200'000, LimitCause::peak);
  limits = limits_of(200'000, 40'000);
  lower_to_power(limits, pack_at(600'000), {});  // no such rule
  is(limits.discharge, 200'000, LimitCause::peak);
}

TEST_CASE("with a power of the pack and no voltage nothing may flow", "[unit][limits][POW_1]") {
  PackState pack = pack_at(600'000);
  SECTION("missing") {
    pack.pack_voltage_mV.validity = Validity::unknown;
  }
  SECTION("zero") {
    pack.pack_voltage_mV.value = 0;
  }
  SECTION("negative") {
    pack.pack_voltage_mV.value = -1'000;
  }
  CurrentLimits limits = limits_of(200'000, 40'000);
  lower_to_power(limits, pack, {.power_max_W = 80'000});
  is(limits.discharge, 0, LimitCause::not_sensed);
  is(limits.charge_continuous, 0, LimitCause::not_sensed);
  CHECK(limits.discharge.value == 0);
}

TEST_CASE("the core holds the power of the pack at once, and its power limits are those of its currents",
          "[unit][limits][POW_1]") {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = 36'000'000'000;
  config.limits.cell_undervoltage = {.warn = 2'600'000, .open = 2'500'000, .hysteresis = 10'000};
  config.limit_ramp = {.discharge_fall_mA_per_s = 8'000, .discharge_rise_mA_per_s = 1'000};
  config.pack_limits.power_max_W = 600;
  LivingPack pack(config, 0.5);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.run(5s);
  const auto holds = [&pack] {
    const std::int64_t pack_mV = pack.core().pack().pack_voltage_mV.value;
    const CurrentLimit& limit = pack.core().limits().discharge;
    CHECK(limit.cause == LimitCause::power);
    CHECK(limit.limit_mA == 600'000'000 / pack_mV);
  };
  holds();
  const PowerLimits powers = pack.core().power_limits();
  CHECK(powers.discharge.cause == LimitCause::power);
  CHECK(powers.discharge.limit_W <= 600);
  CHECK(powers.discharge.limit_W > 450);
  CHECK(powers.charge.limit_W > 0);
  pack.current_A = 15.0;
  pack.run(20s);
  holds();  // with the sag of 15 A there may be more
}

TEST_CASE("a pack without tables of its cells has no resistance to predict with", "[unit][limits][POW_1]") {
  CoreConfig config = test::small_pack();
  config.dynamics = {};
  test::CoreBench bench(config);
  bench.run(3s);
  REQUIRE(bench.core().estimate().size() == 8);
  const LoadResistance whole = load_resistance(bench.core().estimate());
  CHECK(whole.peak_Ohm == 0.0);
  CHECK(whole.continuous_Ohm == 0.0);
}

TEST_CASE("the resistance over ten seconds and a minute is that of all cells, taken the bad way",
          "[unit][limits][POW_1]") {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = 36'000'000'000;
  for (CellDynamics::Row& row : config.dynamics->rows) row.series_Ohm.front() = 0.030;  // of an empty cell
  LivingPack pack(config, 0.5);
  pack.run(3s);
  const LoadResistance whole = load_resistance(pack.estimate());
  // Eight cells: 3 milliohm at once, 2 of charge transfer, and of each pair of 1 what settles within the time.
  const auto cells_Ohm = [](double s) {
    return 8.0 * (0.005 + 0.001 * (3.0 - std::exp(-s / 10.0) - std::exp(-s / 100.0) - std::exp(-s / 1000.0)));
  };
  CHECK(whole.peak_Ohm >= cells_Ohm(10.0) * 0.999);
  const CellForecastInput cell = pack.estimate().forecast_input(0);
  CHECK(cell.resistance_sigma <= 0.5);
  CHECK(whole.peak_Ohm == Approx(cells_Ohm(10.0) * (1.0 + 2.0 * cell.resistance_sigma)).epsilon(0.01));
  CHECK(whole.continuous_Ohm / whole.peak_Ohm == Approx(cells_Ohm(60.0) / cells_Ohm(10.0)));
}

TEST_CASE("before anything is measured each cell counts as empty, and as cold as its coldest table",
          "[unit][limits][POW_1]") {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  CellDynamics::Row& coldest = config.dynamics->rows[0];
  coldest.series_Ohm.front() = 0.030;
  const LivingPack pack(config, 0.5);
  REQUIRE(pack.estimate().size() == 8);
  REQUIRE_FALSE(is_measured(pack.estimate().forecast_input(0).temperature_C));
  double settled_Ohm = 0.030 + coldest.kinetic_Ohm.front();
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    settled_Ohm +=
        coldest.pair_Ohm[pair].front() * (1.0 - std::exp(-10.0 / config.dynamics->pair_time_constant_s[pair]));
  }
  CHECK(load_resistance(pack.estimate()).peak_Ohm == Approx(8.0 * settled_Ohm));
}

TEST_CASE("a cell counts with the resistance that it has learned, and twice the uncertainty of that",
          "[unit][limits][POW_1]") {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = 36'000'000'000;
  LivingPack pack(config, 0.5, {{}, {}, {.resistance_share = 0.4}});
  pack.run(3s);
  REQUIRE(pack.bench().close());
  for (int pulse = 0; pulse < 60; ++pulse) {
    pack.current_A = pulse % 2 == 0 ? 15.0 : -15.0;
    pack.run(10s);
  }
  REQUIRE(pack.estimate().forecast_input(2).resistance_share > 0.1);
  double shares = 0.0;
  for (std::size_t number = 0; number < pack.size(); ++number) {
    const CellForecastInput cell = pack.estimate().forecast_input(number);
    shares += 1.0 + cell.resistance_share + 2.0 * cell.resistance_sigma;
  }
  const double settled_Ohm = 0.005 + 0.001 * (3.0 - std::exp(-1.0) - std::exp(-0.1) - std::exp(-0.01));
  CHECK(load_resistance(pack.estimate()).peak_Ohm == Approx(shares * settled_Ohm).epsilon(1e-9));
}
