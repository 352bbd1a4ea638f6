// State of charge by counting: current, losses, and the growth of the uncertainty.
#include "daemon/core/estimation/soc/soc_coulomb.hpp"

#include <cmath>
#include <limits>

#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr CurrentSensorError sensor{.gain = 0.01, .offset_A = 0.02, .unknown_current_A = 3.0};

CellSample flowing(double passed_s, double mean_current_A) {
  return {.passed_s = passed_s, .mean_current_A = mean_current_A, .temperature_C = 25.0};
}

/// 36000 As without losses.
struct Counting {
  CellDynamics cell = test::sloped_cell();
  SocCoulomb count;

  explicit Counting(double soc = 0.5, double sigma = 0.1) { begin(soc, sigma); }
  void begin(double soc, double sigma) { count.begin(cell, sensor, {.soc = soc, .sigma = sigma}, 25.0); }
  [[nodiscard]] double soc() const { return count.estimate().soc; }
  [[nodiscard]] double sigma() const { return count.estimate().sigma; }
};

}  // namespace

TEST_CASE("counting takes what flows as a share of the capacity", "[unit][estimators][FS_4]") {
  Counting book;
  for (int second = 0; second < 600; ++second) book.count.update(flowing(1.0, 6.0));
  CHECK(book.soc() == Approx(0.5 - 3600.0 / 36'000.0));
  for (int second = 0; second < 300; ++second) book.count.update(flowing(2.0, -12.0));
  CHECK(book.soc() == Approx(0.4 + 7200.0 / 36'000.0));
}

TEST_CASE("of a charging current arrives what the efficiency says, of a discharging one all",
          "[unit][estimators][FS_4]") {
  Counting book;
  book.cell.charge_efficiency = 0.95;
  book.count.update(flowing(360.0, -10.0));
  CHECK(book.soc() == Approx(0.5 + 0.095));
  book.count.update(flowing(360.0, 10.0));
  CHECK(book.soc() == Approx(0.5 + 0.095 - 0.1));
}

TEST_CASE("a cell that lies loses charge, twice as much ten degrees warmer", "[unit][estimators][FS_4]") {
  Counting book;
  book.cell.self_discharge_per_month = 0.04;
  const double day_s = 86'400.0;
  for (int day = 0; day < 30; ++day) book.count.update(flowing(day_s, 0.0));
  CHECK(book.soc() == Approx(0.5 - 0.04));
  CellSample warm = flowing(30.0 * day_s, 0.0);
  warm.temperature_C = 35.0;
  book.count.update(warm);
  CHECK(book.soc() == Approx(0.5 - 0.04 - 0.08));
  warm.temperature_C = not_measured;  // the last temperature applies
  book.count.update(warm);
  CHECK(book.soc() == Approx(0.5 - 0.04 - 0.16));
}

TEST_CASE("the temperature of the begin holds until another is measured", "[unit][estimators][FS_4]") {
  Counting book;
  book.cell.self_discharge_per_month = 0.04;
  book.count.begin(book.cell, sensor, {.soc = 0.5, .sigma = 0.1}, 45.0);
  book.count.update({.passed_s = 30.0 * 86'400.0, .mean_current_A = 0.0});
  CHECK(book.soc() == Approx(0.5 - 0.16));
}

TEST_CASE("the doubt of a count grows by gain, by offset and by silence, each by itself", "[unit][estimators][FS_4]") {
  Counting gain;
  for (int second = 0; second < 100; ++second) gain.count.update(flowing(1.0, 100.0));
  const double by_gain = 0.01 * 10'000.0 / 36'000.0;
  CHECK(gain.sigma() == Approx(std::hypot(0.1, by_gain, 0.02 * 100.0 / 36'000.0)));

  Counting offset(0.5, 0.001);
  for (int hour = 0; hour < 50; ++hour) offset.count.update(flowing(3600.0, 0.0));
  CHECK(offset.sigma() == Approx(std::hypot(0.001, 0.02 * 50.0 / 10.0)));

  Counting silence(0.5, 0.001);
  for (int minute = 0; minute < 60; ++minute) silence.count.update(flowing(60.0, not_measured));
  CHECK(silence.soc() == 0.5);
  CHECK(silence.sigma() == Approx(std::hypot(0.001, 3.0 / 10.0, 0.02 / 10.0)));
}

TEST_CASE("what flows out and back in again leaves no doubt of the gain", "[unit][estimators][FS_4]") {
  Counting book(0.9, 0.001);
  book.count.update(flowing(1.0, 20'000.0));
  CHECK(book.sigma() == Approx(std::hypot(0.001, 200.0 / 36'000.0)).epsilon(1e-3));
  book.count.update(flowing(1.0, -20'000.0));
  CHECK(book.sigma() == Approx(std::hypot(0.001, 0.02 * 2.0 / 36'000.0)).epsilon(1e-6));
}

TEST_CASE("a count never leaves empty and full", "[unit][estimators][FS_4]") {
  Counting book;
  book.count.update(flowing(3600.0, 100.0));
  CHECK(book.soc() == 0.0);
  book.count.update(flowing(360.0, -10.0));
  CHECK(book.soc() == Approx(0.1));
  book.count.update(flowing(3600.0, -100.0));
  CHECK(book.soc() == 1.0);
  book.begin(1.7, 0.1);
  CHECK(book.soc() == 1.0);
  book.begin(-0.7, 0.1);
  CHECK(book.soc() == 0.0);
}

TEST_CASE("an anchor sets a count, and the doubt begins anew", "[unit][estimators][FS_4]") {
  Counting book;
  book.count.update(flowing(3600.0, 1.0));
  book.count.update(flowing(3600.0, not_measured));
  book.count.set(0.8, 0.02);
  CHECK(book.soc() == 0.8);
  CHECK(book.sigma() == 0.02);
}

TEST_CASE("nothing is counted before the begin, and nothing is known", "[unit][estimators][FS_4]") {
  SocCoulomb count;
  count.update(flowing(1.0, 10.0));
  CHECK_FALSE(count.estimate().is_known);
  CHECK(std::isfinite(count.estimate().soc));
  Counting book;
  CHECK(book.count.estimate().is_known);
  CHECK(book.soc() == 0.5);
}

TEST_CASE("time that does not pass, or all of it, is no sample for a count", "[unit][estimators][FS_4]") {
  for (const double passed_s : {0.0, -1.0, -infinite, infinite, not_measured}) {
    CAPTURE(passed_s);
    Counting book;
    book.cell.self_discharge_per_month = 0.04;
    book.count.update(flowing(passed_s, 10.0));
    book.count.update(flowing(passed_s, not_measured));
    CHECK(book.soc() == 0.5);
    CHECK(book.sigma() == Approx(0.1));
  }
}

TEST_CASE("no value makes a count forget itself", "[unit][estimators][FS_4]") {
  for (const double bad : {not_measured, infinite, -infinite, 1e308, -1e308, 1e12}) {
    for (const double loss : {0.0, 0.04}) {
      CAPTURE(bad, loss);
      Counting book;
      book.cell.self_discharge_per_month = loss;
      CellSample current = flowing(1.0, bad);
      book.count.update(current);
      book.count.update(flowing(1e9, bad));
      CellSample temperature = flowing(1.0, 1.0);
      temperature.temperature_C = bad;
      book.count.update(temperature);
      current.mean_current_A = -bad;
      book.count.update(current);
      book.count.update(flowing(1.0, 1.0));
      CHECK((book.soc() >= 0.0 && book.soc() <= 1.0));
      CHECK((book.sigma() >= 0.1 && std::isfinite(book.sigma())));
    }
  }
}

TEST_CASE("a current that cannot be one is not counted", "[unit][estimators][FS_4]") {
  Counting book;
  book.count.update(flowing(1.0, 1e12));
  CHECK(book.soc() == 0.5);
  book.count.update(flowing(1.0, -1e12));
  CHECK(book.soc() == 0.5);
}

TEST_CASE("what may have flowed while nobody counted is the sample's word, or the sensor's",
          "[unit][estimators][FS_4]") {
  const auto doubt_after = [](double unseen_A) {
    Counting book;
    CellSample sample{.passed_s = 3600.0};
    sample.unseen_current_A = unseen_A;
    book.count.update(sample);
    return book.count.estimate().sigma;
  };
  CHECK(doubt_after(0.0) < doubt_after(0.5));
  CHECK(doubt_after(0.5) == doubt_after(-0.5));
  CHECK(doubt_after(0.5) < doubt_after(5.0));
}
