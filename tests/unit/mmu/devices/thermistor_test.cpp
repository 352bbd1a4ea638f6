// Thermistor conversions in both directions, with both curves.
#include "mmu/devices/thermistor.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

constexpr std::array curves{ThermistorCurve::table, ThermistorCurve::steinhart_hart};
constexpr std::uint16_t reference_raw = 30'000;

std::uint16_t raw_at(ThermistorCurve curve, double temperature_C, std::uint16_t reference = reference_raw) {
  return static_cast<std::uint16_t>(std::lround(divider_share(thermistor_Ohm(curve, temperature_C)) * reference));
}

TEST_CASE("the table gives its 26 resistances, and straight lines between them", "[unit][mmu][MMU_NTC]") {
  constexpr std::array listed_Ohm{26444, 21493, 17586, 14481, 11998, 10000, 8355, 7004, 5891, 4972, 4211, 3579, 3053,
                                  2613,  2244,  1934,  1672,  1451,  1263,  1103, 966,  849,  748,  661,  586,  521};
  for (std::size_t row = 0; row < listed_Ohm.size(); ++row) {
    const double temperature_C = 5.0 * static_cast<double>(row);
    CHECK(thermistor_Ohm(ThermistorCurve::table, temperature_C) == Approx(listed_Ohm[row]));
    CHECK(thermistor_C(ThermistorCurve::table, listed_Ohm[row]) == Approx(temperature_C).margin(1e-9));
    if (row == 0) continue;
    const double middle_Ohm = (listed_Ohm[row - 1] + listed_Ohm[row]) / 2.0;
    CHECK(thermistor_C(ThermistorCurve::table, middle_Ohm) == Approx(temperature_C - 2.5));
    CHECK(thermistor_Ohm(ThermistorCurve::table, temperature_C - 2.5) == Approx(middle_Ohm));
  }
}

TEST_CASE("Steinhart-Hart with the four coefficients", "[unit][mmu][RR_5]") {
  // 1/T = a + b L + c L^2 + d L^3 calculated by hand for L = 0, 1 and -1.
  CHECK(thermistor_C(ThermistorCurve::steinhart_hart, 10'000.0) == Approx(25.018).margin(0.001));
  CHECK(thermistor_C(ThermistorCurve::steinhart_hart, 10'000.0 * std::exp(1.0)) ==
        Approx(1.0 / 3.65818785e-3 - 273.15).margin(0.001));
  CHECK(thermistor_C(ThermistorCurve::steinhart_hart, 10'000.0 / std::exp(1.0)) ==
        Approx(1.0 / 3.05838913e-3 - 273.15).margin(0.001));
}

TEST_CASE("from a temperature to a resistance and back is where it began", "[unit][mmu][MMU_NTC][RR_5]") {
  for (const ThermistorCurve curve : curves) {
    for (int dC = -600; dC <= 2'500; dC += 7) {
      const double temperature_C = dC / 10.0;
      INFO(temperature_C << " C");
      CHECK(thermistor_C(curve, thermistor_Ohm(curve, temperature_C)) == Approx(temperature_C).margin(1e-6));
    }
  }
}

TEST_CASE("warmer is less resistance, over the ends of the table as well", "[unit][mmu][MMU_NTC]") {
  for (const ThermistorCurve curve : curves) {
    double colder_Ohm = thermistor_Ohm(curve, -60.0);
    for (int dC = -599; dC <= 2'500; ++dC) {
      const double temperature_C = dC / 10.0;
      const double warmer_Ohm = thermistor_Ohm(curve, temperature_C);
      INFO(temperature_C << " C");
      CHECK(warmer_Ohm < colder_Ohm);
      CHECK(warmer_Ohm > colder_Ohm * 0.98);  // and no jump
      colder_Ohm = warmer_Ohm;
    }
  }
}

/// Largest difference between the two curves, between two temperatures of the table.
double worst_difference_K(int from_C, int to_C) {
  double worst_K = 0.0;
  for (int step = 20 * from_C; step <= 20 * to_C; ++step) {
    const double temperature_C = step / 20.0;
    const double resistance_Ohm = thermistor_Ohm(ThermistorCurve::table, temperature_C);
    worst_K =
        std::max(worst_K, std::abs(thermistor_C(ThermistorCurve::steinhart_hart, resistance_Ohm) - temperature_C));
  }
  return worst_K;
}

TEST_CASE("how far the two curves are apart is what the header says", "[unit][mmu][MMU_NTC][RR_5]") {
  CHECK(worst_difference_K(0, 100) == Approx(0.85).margin(0.005));
  CHECK(worst_difference_K(20, 90) == Approx(0.46).margin(0.005));
  CHECK(worst_difference_K(99, 100) == Approx(0.42).margin(0.01));
  CHECK(worst_difference_K(124, 125) == Approx(0.92).margin(0.01));
}

TEST_CASE("below the table a module still sees the cold, to 1 K at -20 C", "[unit][mmu][MMU_NTC][BMS_NF.2]") {
  const double resistance_Ohm = thermistor_Ohm(ThermistorCurve::steinhart_hart, -20.0);
  CHECK(thermistor_C(ThermistorCurve::table, resistance_Ohm) == Approx(-20.0).margin(1.0));
  CHECK(temperature_dC(ThermistorCurve::table, raw_at(ThermistorCurve::table, -20.0), reference_raw) == known(-200));
}

TEST_CASE("the converter resolves tenths of a degree from -40 to 100 C, whatever its reference",
          "[unit][mmu][MMU_NTC][BMS_NF.2]") {
  for (const ThermistorCurve curve : curves) {
    for (const std::uint16_t reference : std::array<std::uint16_t, 3>{30'000, 27'000, 65'534}) {
      for (int dC = -400; dC <= 1'000; dC += 3) {
        INFO(dC << " dC against " << reference);
        CHECK(temperature_dC(curve, raw_at(curve, dC / 10.0, reference), reference) == known(dC));
      }
    }
  }
}

TEST_CASE("an open and a shorted thermistor are told from any temperature", "[unit][mmu][MMU_NTC]") {
  for (const ThermistorCurve curve : curves) {
    CHECK(temperature_dC(curve, reference_raw, reference_raw).validity == Validity::open_circuit);
    CHECK(temperature_dC(curve, 0xFFFF, reference_raw).validity == Validity::open_circuit);
    CHECK(temperature_dC(curve, 0, reference_raw).validity == Validity::short_circuit);
    CHECK(temperature_dC(curve, raw_at(curve, -60.0), reference_raw).is_valid());
    CHECK(temperature_dC(curve, raw_at(curve, 250.0), reference_raw).is_valid());
  }
  SECTION("at exactly these readings") {
    const auto open_raw = static_cast<std::uint16_t>(std::ceil(divider_share(thermistor_open_above_Ohm) * 30'000));
    const auto short_raw = static_cast<std::uint16_t>(divider_share(thermistor_short_below_Ohm) * 30'000);
    const auto validity = [](unsigned raw) {
      return temperature_dC(ThermistorCurve::table, static_cast<std::uint16_t>(raw), reference_raw).validity;
    };
    CHECK(validity(open_raw) == Validity::open_circuit);
    CHECK(validity(open_raw - 1U) == Validity::valid);
    CHECK(validity(short_raw) == Validity::short_circuit);
    CHECK(validity(short_raw + 1U) == Validity::valid);
  }
}

TEST_CASE("without a reference there is no temperature", "[unit][mmu][MMU_NTC]") {
  CHECK(temperature_dC(ThermistorCurve::table, 100, 0).validity == Validity::unknown);
}

}  // namespace
}  // namespace bmu
