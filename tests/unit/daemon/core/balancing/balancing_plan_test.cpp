// Result of each planner on a steep and on a flat curve, and with missing inputs.
#include "daemon/core/balancing/balancing_plan.hpp"

#include <array>
#include <vector>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr std::int64_t capacity_uAs = 10 * uAs_per_Ah;

/// 1 mV a permille from empty to full: expected values follow directly from the voltages.
CoreConfig straight() {
  CoreConfig config;
  config.cell.ocv.push_back({0, 3'000'000});
  config.cell.ocv.push_back({1'000, 4'000'000});
  config.cell.capacity_uAs = capacity_uAs;
  config.cell.series_resistance_Ohm = 0.002;
  config.balancing.dead_band_uV = 5'000;
  config.balancing.dead_band_permille = 5;
  config.balancing.top_uV = 3'900'000;
  return config;
}

/// Flat from 20 % to 90 %: 10 mV in all.
CoreConfig flat() {
  CoreConfig config = straight();
  config.cell.ocv.clear();
  for (const OcvPoint point :
       {OcvPoint{0, 2'800'000}, OcvPoint{200, 3'290'000}, OcvPoint{900, 3'300'000}, OcvPoint{1'000, 3'450'000}}) {
    config.cell.ocv.push_back(point);
  }
  config.balancing.top_uV = 3'380'000;
  return config;
}

constexpr std::int64_t permille_uAs = capacity_uAs / 1'000;

struct Plan {
  PlanVerdict verdict = PlanVerdict::none;
  std::vector<std::int64_t> remove_uAs;
};

Plan plan_of(CoreConfig config, BalancingMethod method, const std::vector<BalancingCell>& cells,
             std::int32_t current_mA = 0) {
  config.balancing.method = method;
  Plan plan{.remove_uAs = std::vector<std::int64_t>(cells.size(), 99)};
  plan.verdict = plan_balancing({.cells = cells, .current_mA = current_mA}, config, plan.remove_uAs);
  return plan;
}

std::vector<BalancingCell> at(std::initializer_list<std::int32_t> voltages_uV, std::int32_t resistance_uOhm = 0) {
  std::vector<BalancingCell> cells;
  for (const std::int32_t one : voltages_uV) {
    cells.push_back({.voltage_uV = one, .resistance_uOhm = resistance_uOhm});
  }
  return cells;
}

BalancingCell missing(std::int64_t permille, std::int64_t uncertainty_permille = 0) {
  return {.voltage_uV = 3'300'000,
          .charge = {.is_known = true,
                     .missing_uAs = permille * permille_uAs,
                     .uncertainty_uAs = uncertainty_permille * permille_uAs,
                     .capacity_uAs = capacity_uAs}};
}

}  // namespace

TEST_CASE("by terminal voltage: only near the top, and by the steepest slope there", "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::terminal_voltage;
  CHECK(plan_of(straight(), method, at({3'800'000, 3'899'999})).verdict == PlanVerdict::below_top);
  CHECK(plan_of(straight(), method, at({3'800'000, 3'899'999})).remove_uAs == std::vector<std::int64_t>{0, 0});
  const Plan plan = plan_of(straight(), method, at({3'850'000, 3'900'000, 3'855'000, 3'855'100}));
  CHECK(plan.verdict == PlanVerdict::planned);
  CHECK(plan.remove_uAs[0] == 0);
  CHECK(plan.remove_uAs[1] == 45 * permille_uAs);  // 50 mV less the dead band
  CHECK(plan.remove_uAs[2] == 0);                  // just the dead band
  CHECK(plan.remove_uAs[3] == permille_uAs / 10);
  CHECK(plan_of(straight(), method, at({3'900'000, 3'905'000})).verdict == PlanVerdict::balanced);
}

TEST_CASE("cells that are as far apart as balancing by voltages leaves them are not bled, and others are",
          "[unit][balancing][BMS_F.4]") {
  CoreConfig config = straight();
  config.cell.hysteresis_V = 0.004;
  const std::int32_t left_uV = left_by_voltage_uV(config);
  CHECK(left_uV == 13'000);
  for (const auto method : {BalancingMethod::terminal_voltage, BalancingMethod::ocv}) {
    CHECK(plan_of(config, method, at({3'900'000, 3'900'000 + left_uV})).verdict == PlanVerdict::balanced);
    CHECK(plan_of(config, method, at({3'900'000, 3'900'000 + left_uV + 100})).verdict == PlanVerdict::planned);
  }
}

TEST_CASE("by terminal voltage on a flat curve: nothing before the knee, little behind it",
          "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::terminal_voltage;
  // 70 % apart, plus the voltage difference caused by a large current.
  CHECK(plan_of(flat(), method, at({3'290'000, 3'350'000}), -50'000).verdict == PlanVerdict::below_top);
  const Plan plan = plan_of(flat(), method, at({3'400'000, 3'420'000}));
  CHECK(plan.remove_uAs[1] == 10 * permille_uAs);  // 15 mV by 1.5 mV a permille
}

TEST_CASE("by open-circuit voltage: what the current makes of a resistance is taken off",
          "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::ocv;
  const Plan plain = plan_of(straight(), method, at({3'500'000, 3'550'000}));
  CHECK(plain.verdict == PlanVerdict::planned);
  CHECK(plain.remove_uAs[0] == 0);
  CHECK(static_cast<double>(plain.remove_uAs[1]) == Approx(45.0 * permille_uAs));
  // Charged with 10 A, the second has 5 mOhm more: the same open-circuit voltage.
  std::vector<BalancingCell> cells = at({3'520'000, 3'570'000}, 2'000);
  cells[1].resistance_uOhm = 7'000;
  CHECK(plan_of(straight(), method, cells, -10'000).verdict == PlanVerdict::balanced);
  // Discharged with 10 A, the second cell has the higher open-circuit voltage.
  CHECK(static_cast<double>(plan_of(straight(), method, cells, 10'000).remove_uAs[1]) == Approx(95.0 * permille_uAs));
}

TEST_CASE("by open-circuit voltage: what follows the current late is taken off where resistances differ",
          "[unit][balancing][BMS_F.4]") {
  const auto remove = [](std::int32_t resistance_uOhm, double late_uV, std::int32_t coldest_dC = 250) {
    CoreConfig config = straight();
    config.cell.resistance_activation_K = 2'400.0;
    config.balancing.method = BalancingMethod::ocv;
    // Charged with 10 A; the second cell is 50 mV too high after the ohmic drop is subtracted.
    std::vector<BalancingCell> cells = at({3'520'000, 3'570'000 + (resistance_uOhm - 2'000) * 10}, 2'000);
    cells[1].resistance_uOhm = resistance_uOhm;
    std::array<std::int64_t, 2> remove_uAs{};
    const BalancingView view{.cells = cells, .current_mA = -10'000, .late_uV = late_uV, .coldest_dC = coldest_dC};
    static_cast<void>(plan_balancing(view, config, remove_uAs));
    return static_cast<double>(remove_uAs[1]) / static_cast<double>(permille_uAs);
  };
  CHECK(remove(2'000, 10'000.0) == Approx(45.0));
  CHECK(remove(3'000, 0.0) == Approx(45.0));
  CHECK(remove(3'000, 10'000.0) == Approx(35.0));  // half as much again: twice half of the 10 mV
  CHECK(remove(1'000, 10'000.0) == Approx(35.0));  // half of it: the direction of the earlier current is unknown
  CHECK(remove(6'000, 10'000.0) == Approx(5.0));
  CHECK(remove(7'000, 10'000.0) == 0.0);
  // At 15 C a cell has 1.32 times the resistance of one at 25 C: 9.7 mV of 10 mV polarisation and 20 mV ohmic drop.
  CHECK(remove(2'000, 10'000.0, 150) == Approx(45.0 - 30.0 * (resistance_factor(2'400.0, 15.0) - 1.0)));
}

TEST_CASE("by open-circuit voltage: without resistances not in the cold, nor while a current of before shows",
          "[unit][balancing][BMS_F.4]") {
  const auto verdict = [](std::int32_t current_mA, double late_uV, std::int32_t coldest_dC) {
    CoreConfig config = straight();
    config.cell.resistance_activation_K = 2'400.0;
    config.balancing.method = BalancingMethod::ocv;
    const std::vector<BalancingCell> cells = at({3'500'000, 3'550'000});
    std::array<std::int64_t, 2> remove_uAs{};
    return plan_balancing({.cells = cells,
                           .current_mA = current_mA,
                           .late_uV = late_uV,
                           .coldest_dC = coldest_dC,
                           .warmest_dC = coldest_dC},
                          config, remove_uAs);
  };
  CHECK(verdict(-2'000, 1'000.0, 250) == PlanVerdict::planned);  // 4 mV ohmic drop and 1 mV polarisation
  CHECK(verdict(-2'000, 1'001.0, 250) == PlanVerdict::resistance_unknown);
  CHECK(verdict(-2'000, 1'000.0, 249) == PlanVerdict::resistance_unknown);
  CHECK(verdict(0, 5'000.0, 250) == PlanVerdict::planned);
  CHECK(verdict(0, 5'001.0, 250) == PlanVerdict::resistance_unknown);
}

TEST_CASE("by open-circuit voltage: without resistances only while the current does not matter",
          "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::ocv;
  CoreConfig config = straight();
  config.cell.rc_resistance_Ohm = 0.001;
  config.cell.slow_rc_resistance_Ohm = 0.002;  // 5 mOhm in all: 5 mV by 1 A
  const std::vector<BalancingCell> cells = at({3'500'000, 3'550'000});
  for (const std::int32_t sign : {-1, 1}) {
    CHECK(plan_of(config, method, cells, sign * 1'000).verdict == PlanVerdict::planned);
    const Plan unknown = plan_of(config, method, cells, sign * 1'001);
    CHECK(unknown.verdict == PlanVerdict::resistance_unknown);
    CHECK(unknown.remove_uAs == std::vector<std::int64_t>{0, 0});
  }
  std::vector<BalancingCell> measured = at({3'500'000, 3'550'000}, 2'000);
  CHECK(plan_of(config, method, measured, -5'000).verdict == PlanVerdict::planned);
  measured[0].resistance_uOhm = 0;
  CHECK(plan_of(config, method, measured, -5'000).verdict == PlanVerdict::resistance_unknown);
}

TEST_CASE("by open-circuit voltage on a flat curve: nothing is sure, and hysteresis is no charge",
          "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::ocv;
  CoreConfig config = flat();
  // 35 % apart on the flat section: 5 mV, which is within the uncertainty.
  CHECK(plan_of(config, method, at({3'292'000, 3'297'000})).verdict == PlanVerdict::balanced);
  // Of 6 mV, 1 mV is certain, counted from the lowest cell: 7 %.
  const Plan sure = plan_of(config, method, at({3'292'000, 3'298'000}));
  CHECK(static_cast<double>(sure.remove_uAs[1]) == Approx(70.0 * permille_uAs).epsilon(0.001));
  config.cell.hysteresis_V = 0.003;  // each may be 3 mV too high or too low
  CHECK(plan_of(config, method, at({3'292'000, 3'298'000})).verdict == PlanVerdict::balanced);
  // Above the knee the voltage difference is significant.
  CHECK(plan_of(config, method, at({3'330'000, 3'400'000})).verdict == PlanVerdict::planned);
}

TEST_CASE("by open-circuit voltage: of two cells above the end of the curve one may have too much",
          "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::ocv;
  // The curve continues with 1 mV a permille; the dead band is 5 mV.
  CHECK(plan_of(straight(), method, at({3'990'000, 4'020'000})).remove_uAs[1] == 25 * permille_uAs);
  CHECK(plan_of(straight(), method, at({4'005'000, 4'030'000})).remove_uAs[1] == 20 * permille_uAs);
  CHECK(plan_of(straight(), method, at({4'005'000, 4'010'000})).verdict == PlanVerdict::balanced);
  // The last slope, not the mean: 1.5 mV a permille.
  CHECK(plan_of(flat(), method, at({3'450'000, 3'485'000})).remove_uAs[1] == 20 * permille_uAs);
}

TEST_CASE("no voltage method ever takes a cell below the lowest", "[unit][balancing][BMS_F.4]") {
  for (const CoreConfig& config : {straight(), flat()}) {
    for (std::int32_t soc_permille = 0; soc_permille <= 950; soc_permille += 50) {
      std::vector<BalancingCell> cells;
      for (const std::int32_t more : {0, 3, 11, 27, 50}) {
        cells.push_back({.voltage_uV = static_cast<std::int32_t>(ocv_uV(config.cell, soc_permille + more))});
      }
      const Plan plan = plan_of(config, BalancingMethod::ocv, cells);
      const std::array more{0, 3, 11, 27, 50};
      for (std::size_t cell = 0; cell < cells.size(); ++cell) {
        CAPTURE(soc_permille, cell);
        CHECK(plan.remove_uAs[cell] <= more.at(cell) * permille_uAs);
      }
    }
  }
}

TEST_CASE("by charge: all are to be full at once, less what is not sure of either cell", "[unit][balancing][BMS_F.4]") {
  const auto method = BalancingMethod::charge;
  const Plan plan = plan_of(straight(), method, {missing(500), missing(450), missing(495), missing(494)});
  CHECK(plan.verdict == PlanVerdict::planned);
  CHECK(plan.remove_uAs ==
        std::vector<std::int64_t>{0, 45 * permille_uAs, 0, 1 * permille_uAs});  // less 5 permille each
  const Plan unsure = plan_of(straight(), method, {missing(500, 10), missing(450, 3), missing(480, 6)});
  CHECK(unsure.remove_uAs == std::vector<std::int64_t>{0, 32 * permille_uAs, 0});
  CHECK(plan_of(straight(), method, {missing(500, 30), missing(450, 30)}).verdict == PlanVerdict::balanced);
  // An overfull cell misses a negative charge.
  CHECK(plan_of(straight(), method, {missing(10), missing(-20)}).remove_uAs[1] == 25 * permille_uAs);
}

TEST_CASE("by charge: one cell that nobody knows, and nothing is planned", "[unit][balancing][BMS_F.4]") {
  BalancingCell unknown = missing(400);
  unknown.charge.is_known = false;
  const Plan plan = plan_of(straight(), BalancingMethod::charge, {missing(500), unknown, missing(450)});
  CHECK(plan.verdict == PlanVerdict::charge_unknown);
  CHECK(plan.remove_uAs == std::vector<std::int64_t>{0, 0, 0});
}

TEST_CASE("minutes are whole, rounded down, and five at most", "[unit][balancing][BMS_NF.3][MMU_CB]") {
  BalancingConfig config;  // 40 Ohm: 100 mA at 4 V, 6 As a minute
  CHECK(bleed_uA(3'000'000, BalancingConfig{}) == 75'000);
  constexpr std::int64_t a_minute_uAs = 6'000'000;
  CHECK(balancing_minutes(0, 4'000'000, config) == 0);
  CHECK(balancing_minutes(a_minute_uAs - 1, 4'000'000, config) == 0);
  CHECK(balancing_minutes(a_minute_uAs, 4'000'000, config) == 1);
  CHECK(balancing_minutes(5 * a_minute_uAs - 1, 4'000'000, config) == 4);
  CHECK(balancing_minutes(5 * a_minute_uAs, 4'000'000, config) == 5);
  CHECK(balancing_minutes(1'000 * a_minute_uAs, 4'000'000, config) == 5);
  CHECK(balancing_minutes(1'000, 0, config) == 0);
  config.bleed_resistance_Ohm = 80;
  CHECK(balancing_minutes(a_minute_uAs, 4'000'000, config) == 2);
}

TEST_CASE("the charge at a voltage follows the curve to both ends", "[unit][balancing]") {
  const CellModel cell = flat().cell;
  CHECK(charge_at_uAs(cell, 2'000'000.0) == 0.0);
  CHECK(charge_at_uAs(cell, 2'800'000.0) == 0.0);
  CHECK(charge_at_uAs(cell, 3'290'000.0) == Approx(0.2 * capacity_uAs));
  CHECK(charge_at_uAs(cell, 3'295'000.0) == Approx(0.55 * capacity_uAs));
  CHECK(charge_at_uAs(cell, 3'450'000.0) == Approx(1.0 * capacity_uAs));
  CHECK(charge_at_uAs(cell, 4'000'000.0) == Approx(1.0 * capacity_uAs));
}

TEST_CASE("every verdict and method has its words", "[unit][balancing]") {
  for (int verdict = 0; verdict <= static_cast<int>(PlanVerdict::charge_unknown); ++verdict) {
    CHECK(to_text(static_cast<PlanVerdict>(verdict)).size() > 5);
  }
  CHECK(to_text(BalancingMethod::terminal_voltage) == "terminal_voltage");
  CHECK(to_text(BalancingMethod::ocv) == "ocv");
  CHECK(to_text(BalancingMethod::charge) == "charge");
}
