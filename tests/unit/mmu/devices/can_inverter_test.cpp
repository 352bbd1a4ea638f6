// Emulated inverter: it follows its limits as long as they are valid, and reports its presence.
#include "mmu/devices/can_inverter.hpp"

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};
constexpr double link_V = 52.0;

struct Bench {
  const InverterDriver& driver = *find_device("pylontech")->inverter;
  CanInverter inverter{&driver, start};
  TimePoint now = start;
  BatteryReport report{.charge_voltage_limit_mV = 56'000,
                       .charge_limit_mA = 50'000,
                       .discharge_limit_mA = 100'000,
                       .may_charge = true,
                       .may_discharge = true};

  void tell() {
    for (std::size_t index = 0; index < 2; ++index) inverter.observe(*driver.frame(index, report, {}), now);
  }
  /// Current after this time at this voltage, with limits sent every 100 ms.
  double after(Duration span, double at_V = link_V, bool is_told = true) {
    for (const TimePoint end = now + span; now < end; now += 100ms) {
      if (is_told) tell();
      static_cast<void>(inverter.step(now, at_V));
    }
    return inverter.current_A();
  }
};

}  // namespace

TEST_CASE("an inverter that is none does nothing", "[unit][mmu][inverter]") {
  CanInverter none(nullptr, start);
  none.demand_A = 10.0;
  none.observe(data_frame(0x351, 8), start);
  CHECK(none.step(start, link_V) == 0.0);
  CHECK(none.words(start, link_V).empty());
}

TEST_CASE("it takes no more than it is told, either way, and nothing untold", "[unit][mmu][inverter]") {
  Bench bench;
  bench.inverter.demand_A = 200.0;
  CHECK(bench.after(2s, link_V, false) == 0.0);
  CHECK(bench.after(10s) == Approx(100.0));
  bench.inverter.demand_A = -200.0;
  CHECK(bench.after(10s) == Approx(-50.0));
  bench.report.may_charge = false;
  CHECK(bench.after(2s) == Approx(0.0));
  bench.report.may_charge = true;
  CHECK(bench.after(10s) == Approx(-50.0));
  CHECK(bench.after(10s, link_V, false) == Approx(0.0));  // its limits have expired
}

TEST_CASE("one of SMA stops while an alarm of the battery is raised, and goes on when it is cleared",
          "[unit][mmu][inverter]") {
  const InverterDriver& sma = *find_device("sma")->inverter;
  CanInverter inverter(&sma, start);
  inverter.demand_A = 20.0;
  BatteryReport report{.charge_voltage_limit_mV = 56'000, .discharge_limit_mA = 100'000, .may_discharge = true};
  TimePoint now = start;
  const auto after_5s = [&] {
    for (const TimePoint end = now + 5s; now < end; now += 100ms) {
      for (std::size_t index = 0; index < sma.frame_count; ++index) {
        if (const auto frame = sma.frame(index, report, {})) inverter.observe(*frame, now);
      }
      static_cast<void>(inverter.step(now, link_V));
    }
    return inverter.current_A();
  };
  report.warnings = bit_of(BatteryAlarm::cold_to_charge);
  CHECK(after_5s() == Approx(20.0));
  CHECK(inverter.told().warnings == bit_of(BatteryAlarm::cold_to_charge));
  report.alarms = bit_of(BatteryAlarm::hot);
  CHECK(after_5s() == Approx(0.0));
  CHECK(inverter.told().alarms == bit_of(BatteryAlarm::hot));
  report.alarms = report.warnings = 0;
  CHECK(after_5s() == Approx(20.0));
  CHECK(inverter.told().warnings == 0);
}

TEST_CASE("it fades towards its voltages, and ignores all of it where a script wants so", "[unit][mmu][inverter]") {
  Bench bench;
  bench.inverter.demand_A = -200.0;
  CHECK(bench.after(10s, 55.86) == Approx(-25.0).margin(0.5));
  CHECK(bench.after(2s, 56.0) == Approx(0.0));
  bench.inverter.obeys = false;
  CHECK(bench.after(20s, 56.0) == Approx(-200.0));
}

TEST_CASE("it shows once a second that it is there, unless it is silent", "[unit][mmu][inverter]") {
  Bench bench;
  CHECK(bench.inverter.words(start, link_V).size() == 1);
  CHECK(bench.inverter.words(start + 999ms, link_V).empty());
  CHECK(bench.inverter.words(start + 1s, link_V).size() == 1);
  bench.inverter.is_silent = true;
  CHECK(bench.inverter.words(start + 2s, link_V).empty());
  bench.inverter.is_silent = false;
  CHECK(bench.inverter.words(start + 3s, link_V).size() == 1);
}
