// Fits that are rejected, and warnings to the user.
#include "tools/bmucell/fit/fit_check.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace bmu;
using namespace bmu::cell;

namespace {

/// Curve at 25 C from 3 V over `span_V`, and a recording between two SOCs with a residual of 5 mV.
struct Fitted {
  explicit Fitted(double span_V = 1.0, double min_soc = 0.05, double max_soc = 0.95) {
    CellDynamics::Row row{.temperature_C = 25.0};
    for (std::size_t k = 0; k < row.ocv_V.size(); ++k) {
      row.ocv_V[k] = 3.0 + span_V * static_cast<double>(k) / static_cast<double>(row.ocv_V.size() - 1);
    }
    fit.cell.rows.push_back(row);
    fit.quality.push_back({.name = "one.csv", .rmse_V = 0.005, .rows = 2});
    data.push_back({.series = {.name = "one.csv"}});
    data[0].series.rows = {{.soc = min_soc}, {.soc = max_soc}};
    base.voltage_min_uV = 2'500'000;
    base.voltage_max_uV = 4'500'000;
  }
  [[nodiscard]] std::string problem() const { return implausible_fit(fit, data, base, 0.1); }

  Fit fit;
  std::vector<FitSeries> data;
  CellModel base;
};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a fit may miss a recording by no more than the bound, a slow curve by three times that", "[unit][bmucell]") {
  Fitted fitted;
  CHECK(fitted.problem().empty());
  CHECK(remarks_on(fitted.fit, fitted.data).empty());
  fitted.fit.quality[0].rmse_V = 0.1;
  CHECK(fitted.problem().empty());
  fitted.fit.quality[0].rmse_V = 0.101;
  CHECK(has(fitted.problem(), "one.csv: the model misses it by 101 mV RMSE, expected at most 100; another cell"));
  fitted.fit.quality[0].is_slow_curve = true;
  CHECK(fitted.problem().empty());
  fitted.fit.quality[0].rmse_V = 0.301;
  CHECK(has(fitted.problem(), "misses it by 301 mV RMSE, expected at most 300"));
  fitted.fit.quality[0] = {.name = "one.csv", .rows = 0};
  CHECK(has(fitted.problem(), "one.csv: found no row with current, voltage, temperature and charge"));
}

TEST_CASE("a fitted curve spans a part of the cell's window, the more the more of the charge was recorded",
          "[unit][bmucell]") {
  CHECK(Fitted(0.41).problem().empty());
  CHECK(has(Fitted(0.39).problem(),
            "what was fitted: the open-circuit voltage at 25 C goes from 3.000 to 3.390 V, "
            "expected a span of 0.40 V or more of the base's 2.50 to 4.50"));
  CHECK(Fitted(0.11, 0.2, 0.8).problem().empty());
  CHECK(Fitted(3.0).problem().empty());
  CHECK(has(Fitted(3.1).problem(),
            "goes from 3.000 to 6.100 V, expected 0.5 to 6; recordings of a small part of the "
            "charge, or time in minutes or hours?"));
  CHECK(has(Fitted(0.09, 0.2, 0.8).problem(), "expected a span of 0.10 V or more"));
}

TEST_CASE("rows left out, an assumed charge and ends that no recording reached are remarked on", "[unit][bmucell]") {
  Fitted fitted(1.0, 0.2, 0.8);
  fitted.fit.quality[0].rows = 1;
  fitted.data[0].assumed_begin_soc = 1.0;
  const std::vector<std::string> remarks = remarks_on(fitted.fit, fitted.data);
  REQUIRE(remarks.size() == 4);
  CHECK(remarks[0] == "one.csv: 1 of 2 rows left out: without current, voltage, temperature or charge");
  CHECK(has(remarks[1], "warning: one.csv: no column 'ref_soc_pct': its charge is counted from 100 %, an assumption"));
  CHECK(has(remarks[2], "warning: no recording has a charge below 20 %"));
  CHECK(has(remarks[3], "warning: no recording has a charge above 80 %"));
}
