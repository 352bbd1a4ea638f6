// Ageing of one cell: how its capacity and its resistance are learned, and which records persist over restarts.
#include "daemon/core/estimation/health/cell_health.hpp"

#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double warm_C = 25.0;
constexpr double capacity_As = 36'000.0;  // of the sloped cell

HealthModel model() {
  static const CellDynamics cell = test::sloped_cell();
  return {.expected = ExpectedResistance(cell),
          .sensor = {.gain = 0.01, .offset_A = 0.01, .unknown_current_A = 10.0},
          .rated_As = cell.capacity_As,
          .charge_efficiency = 1.0};
}

/// Discharges the cell by this charge (negative: charges it) within an hour, one sample per second.
void flow(CellHealth& health, double charge_As) {
  constexpr int hour_s = 3'600;
  for (int second = 0; second < hour_s; ++second) {
    health.take({.passed_s = 1.0, .mean_current_A = charge_As / hour_s, .temperature_C = warm_C});
  }
}
void anchor(CellHealth& health, double soc, double sigma = 0.01) {
  health.take({.passed_s = 1.0, .mean_current_A = 0.0, .temperature_C = warm_C}, ChargeAnchor{soc, sigma});
}

}  // namespace

TEST_CASE("a new cell has the capacity of its file, and no health is told", "[unit][estimators][FS_5]") {
  const HealthModel kind = model();
  CellHealth health;
  CHECK_FALSE(health.is_begun());
  CHECK_FALSE(health.health().by_capacity.is_known);
  CHECK(health.record() == CellHealthRecord{});
  health.begin(kind);
  CHECK(health.is_begun());
  CHECK(health.capacity_As() == capacity_As);
  CHECK_FALSE(health.is_capacity_known());
  CHECK_FALSE(health.health().by_capacity.is_known);
  CHECK_FALSE(health.health().by_resistance.is_known);
  CHECK_FALSE(health.resistance(warm_C).is_known);
  CHECK(health.record() == CellHealthRecord{});
}

TEST_CASE("two anchors and what flowed between them make a capacity", "[unit][estimators][FS_5]") {
  const HealthModel kind = model();
  CellHealth health;
  health.begin(kind);
  anchor(health, 0.9);
  flow(health, 0.7 * 0.85 * capacity_As);
  CHECK_FALSE(health.is_capacity_known());
  anchor(health, 0.2);
  REQUIRE(health.is_capacity_known());
  CHECK(health.capacity_pairs() == 1);
  // The capacity of the cell file, with a sigma of 5 %, still has an effect.
  CHECK(health.capacity_As() / capacity_As == Approx(0.87).margin(0.02));
  for (int turn = 0; turn < 4; ++turn) {
    flow(health, -0.7 * 0.85 * capacity_As);
    anchor(health, 0.9);
    flow(health, 0.7 * 0.85 * capacity_As);
    anchor(health, 0.2);
  }
  CHECK(health.capacity_As() / capacity_As == Approx(0.85).margin(0.01));
  const HealthFigure figure = health.health().by_capacity;
  REQUIRE(figure.is_known);
  CHECK(std::abs(figure.permille - 850) <= 10);
  CHECK(std::abs(figure.permille - 850) <= 2 * figure.sigma_permille);
  CHECK(figure.sigma_permille >= 8);  // the gain error of the sensor is in all pairs
}

TEST_CASE("a charge counts as what arrives of it", "[unit][estimators][FS_5]") {
  HealthModel kind = model();
  kind.charge_efficiency = 0.9;
  CellHealth health;
  health.begin(kind);
  anchor(health, 0.2, 0.001);
  flow(health, -0.7 * capacity_As / 0.9);
  anchor(health, 0.9, 0.001);
  REQUIRE(health.is_capacity_known());
  CHECK(health.capacity_As() / capacity_As == Approx(1.0).margin(0.002));
}

TEST_CASE("what flows uncounted between two anchors costs the pair", "[unit][estimators][FS_5]") {
  const HealthModel kind = model();
  CellHealth health;
  health.begin(kind);
  anchor(health, 0.9);
  flow(health, 0.7 * 0.85 * capacity_As);
  health.take({.passed_s = 1.0, .temperature_C = warm_C});
  anchor(health, 0.2);
  CHECK_FALSE(health.is_capacity_known());
  flow(health, -0.7 * 0.85 * capacity_As);
  anchor(health, 0.9);
  CHECK(health.is_capacity_known());
}

TEST_CASE("an absurd pair is counted and not learned", "[unit][estimators][FS_5]") {
  const HealthModel kind = model();
  CellHealth health;
  health.begin(kind);
  anchor(health, 0.2);
  flow(health, 0.5 * capacity_As);  // discharged, yet fuller afterwards: the sensor direction is inverted
  anchor(health, 0.9);
  CHECK_FALSE(health.is_capacity_known());
  CHECK(health.capacity_refused() == 1);
  CHECK(health.capacity_As() == capacity_As);
}

TEST_CASE("steps of the current show a resistance, and that its health", "[unit][estimators][BMS_F.6]") {
  const HealthModel kind = model();
  CellHealth health;
  health.begin(kind);
  const double resistance_Ohm = 1.4 * kind.expected.at_reference_Ohm();
  for (int second = 0; second < 400; ++second) {
    const double current_A = second / 20 % 2 == 0 ? 0.0 : 10.0;
    health.take({.passed_s = 1.0,
                 .mean_current_A = current_A,
                 .current_A = current_A,
                 .voltage_V = 3.7 - resistance_Ohm * current_A,
                 .temperature_C = warm_C});
  }
  const ResistanceEstimate told = health.resistance(warm_C);
  REQUIRE(told.is_known);
  CHECK(told.resistance_Ohm == Approx(resistance_Ohm).epsilon(0.03));
  const HealthFigure figure = health.health().by_resistance;
  REQUIRE(figure.is_known);
  CHECK(std::abs(figure.permille - 600) <= 40);
  CHECK_FALSE(health.health().by_capacity.is_known);
}

TEST_CASE("a record gives the next life what this one learned", "[unit][estimators][FS_5]") {
  const HealthModel kind = model();
  const CellHealthRecord kept{.capacity_ppm = 850'000,
                              .capacity_sigma_ppm = 9'000,
                              .resistance_ppm = 1'400'000,
                              .resistance_sigma_ppm = 30'000};
  CellHealth health;
  health.begin(kind, kept);
  REQUIRE(health.is_capacity_known());
  CHECK(health.capacity_pairs() == 0);
  CHECK(health.capacity_As() / capacity_As == Approx(0.85).margin(1e-4));
  CHECK(health.resistance(warm_C).resistance_Ohm == Approx(1.4 * kind.expected.at_reference_Ohm()));
  SECTION("and again the next, without losing certainty by being kept") {
    CellHealthRecord again = health.record();
    for (int life = 0; life < 50; ++life) {
      health.begin(kind, again);
      again = health.record();
    }
    CHECK(again.capacity_ppm == Approx(850'000).margin(200));
    CHECK(again.capacity_sigma_ppm == Approx(9'000).margin(500));
    CHECK(again.resistance_ppm == Approx(1'400'000).margin(100));
    CHECK(again.resistance_sigma_ppm == Approx(30'000).margin(100));
  }
}

TEST_CASE("a record that no cell can have is none", "[unit][estimators][FS_5]") {
  const HealthModel kind = model();
  for (const CellHealthRecord& kept : {CellHealthRecord{.capacity_ppm = 850'000},
                                       CellHealthRecord{.capacity_ppm = 250'000, .capacity_sigma_ppm = 9'000},
                                       CellHealthRecord{.capacity_ppm = 1'400'000, .capacity_sigma_ppm = 9'000},
                                       CellHealthRecord{.resistance_ppm = 1'400'000},
                                       CellHealthRecord{.resistance_ppm = 90'000'000, .resistance_sigma_ppm = 1'000},
                                       CellHealthRecord{.resistance_ppm = 40'000, .resistance_sigma_ppm = 1'000}}) {
    CellHealth health;
    health.begin(kind, kept);
    CHECK_FALSE(health.is_capacity_known());
    CHECK(health.capacity_As() == capacity_As);
    CHECK_FALSE(health.resistance(warm_C).is_known);
  }
}

TEST_CASE("a whole charge shows a capacity where the cell file says how", "[unit][estimators][FS_5]") {
  HealthModel kind = model();
  kind.plateau = ChargePlateauModel{.plateau_weight = 2.0,
                                    .above_weight = 1.0,
                                    .sigma_As = 300.0,
                                    .current_A = 5.0,
                                    .full_voltage_V = 4.2,
                                    .end_current_A = 0.5};
  // Plateau around 3.7 V, formed by a smooth step in the slope; then the taper.
  const auto charge = [](CellHealth& health) {
    double voltage_V = 3.4;
    while (voltage_V < 4.2) {
      const double off = (voltage_V - 3.7) / 0.06;
      voltage_V += 5.0 / (20'000.0 + 100'000.0 * std::exp(-off * off));
      health.take({.passed_s = 1.0,
                   .mean_current_A = -5.0,
                   .current_A = -5.0,
                   .voltage_V = voltage_V,
                   .temperature_C = warm_C});
    }
    for (double current_A = 5.0; current_A > 0.4; current_A *= 0.999) {
      health.take({.passed_s = 1.0,
                   .mean_current_A = -current_A,
                   .current_A = -current_A,
                   .voltage_V = 4.2,
                   .temperature_C = warm_C});
    }
  };
  CellHealth with;
  with.begin(kind);
  charge(with);
  CHECK(with.capacity_pairs() + with.capacity_refused() == 1);
  HealthModel plain = kind;
  plain.plateau.reset();
  CellHealth without;
  without.begin(plain);
  charge(without);
  CHECK(without.capacity_pairs() + without.capacity_refused() == 0);
}

TEST_CASE("samples before it is begun say nothing", "[unit][estimators]") {
  CellHealth health;
  anchor(health, 0.9);
  flow(health, 20'000.0);
  anchor(health, 0.2);
  CHECK_FALSE(health.is_capacity_known());
  health.move_to(model());
  CHECK_FALSE(health.is_begun());
}
