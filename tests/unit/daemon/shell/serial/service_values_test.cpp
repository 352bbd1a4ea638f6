// Service mode of the serial console: values measured within a second, only while the mode is on.
#include "daemon/shell/serial/service_values.hpp"

#include <cstdlib>
#include <string>

#include "tests/support/catch.hpp"
#include "tests/support/line_values.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::LivingPack;
using test::values_of;

namespace {

CoreConfig sloped_pack() {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = 36'000'000'000;
  config.limits.cell_undervoltage = {.warn = 2'600'000, .open = 2'500'000, .hysteresis = 10'000};
  return config;
}

/// Pack that forwards its decisions to the service mode.
struct Served {
  LivingPack pack{sloped_pack(), 0.5, {{}, {}, {.resistance_share = 0.4}}};  // cell 3 has more resistance
  ServiceValues values{pack.core()};
  int lines = 0;
  std::string last;

  Served() {
    pack.bench().each_ms = [this] {
      if (pack.core().decided_at() == told_at_) return;
      told_at_ = pack.core().decided_at();
      values.decided(told_at_, {});
      if (auto line = values.take_line()) {
        last = *line;
        ++lines;
      }
    };
  }

 private:
  TimePoint told_at_{};
};

}  // namespace

TEST_CASE("a line of the service mode has the second's cells, current, temperatures, SOC and resistances",
          "[unit][serial][BMS_NF.5b]") {
  ServiceSecond second;
  second.values.cell_count = 2;
  second.values.sensor_count = 1;
  second.values.unix_time_ms = 1'772'384'467'000;
  second.values.current_mA = {.average = 21'350, .min = 21'000, .max = 22'000, .samples = 50};
  second.values.pack_voltage_mV = {.average = 7'960, .min = 7'900, .max = 8'000, .samples = 16};
  second.values.cells[0].voltage_uV = {.average = 3'984'800, .min = 3'984'000, .max = 3'985'000, .samples = 10};
  second.values.temperature_dC[0] = {.average = 251, .min = 250, .max = 252, .samples = 10};
  second.values.soc_permille = 800;
  second.resistance_uOhm[0] = 1'824;
  HistoryLayout layout;
  layout.modules.push_back({.node = 1, .cells = 2, .cell_sensors = 1, .board_sensors = 0});
  CHECK(service_line(second, layout) ==
        "2026-03-01 17:01:07 I:21.350A U:7.96V SOC:80.0% SOH:- C:3.9848,- T:25.1 E:- R:1.82,-");
}

TEST_CASE("measured values come once a second while they are wanted, and not before or after",
          "[unit][serial][BMS_NF.5b]") {
  Served served;
  served.pack.run(5s);
  CHECK(served.lines == 0);
  REQUIRE(served.pack.bench().close());
  for (int turn = 0; turn < 9; ++turn) {  // steps, which show resistances
    served.pack.current_A = turn % 2 == 0 ? 20.0 : 0.0;
    served.pack.run(15s);
  }
  CHECK(served.lines == 0);
  served.values.set_wanted(true);
  served.pack.run(5500ms);
  CHECK(served.lines >= 4);
  CHECK(served.lines <= 6);
  const auto cells = values_of(served.last, "C");
  REQUIRE(cells.size() == 8);
  const double measured_V = static_cast<double>(served.pack.bench().modules[0].cell_voltage_uV[0].value) / 1e6;
  CHECK(std::strtod(cells[0].c_str(), nullptr) == Approx(measured_V).margin(0.003));
  CHECK(served.last.find(" I:20.000A") != std::string::npos);
  CHECK(values_of(served.last, "T")[0] == "25.0");
  CHECK(values_of(served.last, "SOC")[0] != "-");
  const auto resistances = values_of(served.last, "R");
  REQUIRE(resistances.size() == 8);
  for (std::size_t cell = 0; cell < resistances.size(); ++cell) {
    const ResistanceEstimate known = served.pack.estimate().cell_resistance(cell);
    REQUIRE(known.is_known);
    CHECK(std::strtod(resistances[cell].c_str(), nullptr) == Approx(known.resistance_Ohm * 1e3).margin(0.01));
  }
  const auto estimate_Ohm = [&served](std::size_t cell) {
    return served.pack.estimate().cell_resistance(cell).resistance_Ohm;
  };
  CHECK(estimate_Ohm(2) > 1.2 * estimate_Ohm(1));
  served.values.set_wanted(false);
  const int until_here = served.lines;
  served.pack.run(3s);
  CHECK(served.lines == until_here);
}

TEST_CASE("the first second of the service mode has nothing from before it", "[unit][serial][BMS_NF.5b]") {
  Served served;
  served.pack.run(3s);
  REQUIRE(served.pack.bench().close());
  served.pack.current_A = 20.0;
  served.values.set_wanted(true);
  served.pack.run(3s);
  served.values.set_wanted(false);
  served.pack.run(10ms);
  const int until_here = served.lines;
  served.pack.run(5s);
  served.pack.current_A = 0.0;
  served.pack.run(2s);
  served.values.set_wanted(true);
  while (served.lines == until_here) served.pack.run(100ms);
  CHECK(served.last.find(" I:0.000A") != std::string::npos);
}
