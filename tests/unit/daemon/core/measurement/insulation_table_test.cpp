// Evaluation of the reports of an insulation monitor on a bus, and of their absence.
#include "daemon/core/measurement/insulation_table.hpp"

#include <cstdint>
#include <vector>

#include "daemon/core/faults/fault_table.hpp"
#include "devices/device_list.hpp"
#include "protocol/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fault_world.hpp"

using namespace bmu;

namespace {

const InsulationDriver& bender() {
  return *find_device("iso165c")->insulation;
}

struct Bench {
  InsulationTable table;
  TimePoint now{100s};

  Bench() { table.init({.monitoring = InsulationMonitoring::measured, .driver = &bender()}); }
  void hear(const MonitorReport& report) { REQUIRE(table.observe(bender().report(report), now)); }
  [[nodiscard]] InsulationWord word() const { return table.word(now); }
};

constexpr MonitorReport good{.resistance_Ohm = known(800'000)};

}  // namespace

TEST_CASE("without a monitor on a bus nothing is heard", "[unit][insulation]") {
  InsulationTable table;
  table.init({});
  CHECK_FALSE(table.is_there());
  CHECK_FALSE(table.is_talking(TimePoint{1s}));
  CHECK_FALSE(table.observe(bender().report(good), TimePoint{1s}));
  CHECK_FALSE(table.is_untested(TimePoint{1s}));
}

TEST_CASE("the protocol of a monitor is its driver's on a bus, and that of the pulses on a line",
          "[unit][insulation]") {
  CHECK(Bench{}.table.protocol() == bender().name);
  InsulationTable table;
  table.init({.monitoring = InsulationMonitoring::measured, .has_pulse_line = true});
  CHECK(table.protocol() == "ir155");
}

TEST_CASE("before its first word a monitor is starting, and its word is no fault", "[unit][insulation]") {
  Bench bench;
  CHECK(bench.word().state == InsulationState::speed_start);
  CHECK(bench.word().is_ok);
  CHECK(bench.word().taken_at == TimePoint{});
  CHECK_FALSE(bench.word().resistance_Ohm.is_valid());
  CHECK_FALSE(bench.table.is_talking(bench.now));
}

TEST_CASE(
    "in the first seconds of the clock, too, a monitor that was not heard is silent, and a value that was not told is "
    "none",
    "[unit][insulation]") {
  Bench bench;
  bench.now = TimePoint{1s};
  CHECK_FALSE(bench.table.is_talking(bench.now));
  CHECK(bench.word().state == InsulationState::speed_start);
  bench.hear({});
  CHECK(bench.table.is_talking(bench.now));
  CHECK(bench.word().state == InsulationState::speed_start);
}

TEST_CASE("a pack file without a monitor has none, whatever a recording of another one has heard",
          "[unit][insulation][image]") {
  Bench bench;
  bench.hear(good);
  std::vector<std::uint8_t> bytes(image_size(bench.table));
  write_image(bench.table, bytes);
  InsulationTable other;
  other.init({});
  REQUIRE_FALSE(read_image(bytes, other));
  CHECK_FALSE(other.is_talking(bench.now));
  CHECK(other.word(bench.now).state == InsulationState::speed_start);
  CHECK_FALSE(other.word(bench.now).resistance_Ohm.is_valid());
}

TEST_CASE("a resistance counts from its word on, until a report and two fifths of the time to the next are missing",
          "[unit][insulation]") {
  Bench bench;
  bench.hear(good);
  CHECK(bench.word().state == InsulationState::normal);
  CHECK(bench.word().resistance_Ohm == known(800'000));
  CHECK(bench.word().taken_at == bench.now);
  bench.now += 1'400ms;
  CHECK(bench.word().state == InsulationState::normal);
  CHECK(bench.table.is_talking(bench.now));
  bench.now += 1ms;
  CHECK(bench.word().state == InsulationState::no_signal);
  CHECK_FALSE(bench.word().resistance_Ohm.is_valid());
  CHECK_FALSE(bench.table.is_talking(bench.now));
  bench.hear(good);
  bench.table.forget_values();
  CHECK(bench.word().state == InsulationState::speed_start);
}

TEST_CASE("what a monitor says of itself counts at once", "[unit][insulation]") {
  struct Case {
    MonitorReport report;
    InsulationState state;
    bool is_ok;
  };
  const Case cases[] = {
      {{.resistance_Ohm = known(800'000), .is_earth_lost = true}, InsulationState::earth_fault, true},
      {{.resistance_Ohm = known(800'000), .is_faulty = true}, InsulationState::device_error, true},
      {{.is_off = true}, InsulationState::device_error, true},
      {{.resistance_Ohm = known(20'000), .is_low = true}, InsulationState::normal, false},
      {{.resistance_Ohm = known(150'000), .is_warning = true}, InsulationState::normal, true},
      {{}, InsulationState::normal, true},  // outdated: the last value still applies
  };
  for (const Case& one : cases) {
    Bench bench;
    bench.hear(good);
    bench.hear(one.report);
    CHECK(bench.word().state == one.state);
    CHECK(bench.word().is_ok == one.is_ok);
  }
}

TEST_CASE("while a monitor tests itself its last value counts, for ten seconds", "[unit][insulation]") {
  Bench bench;
  bench.hear(good);
  const TimePoint measured_at = bench.now;
  for (int second = 1; second <= 10; ++second) {
    bench.now += 1s;
    bench.hear({.is_testing = true});
    CHECK(bench.word().state == InsulationState::normal);
    CHECK(bench.word().taken_at == measured_at);
  }
  bench.hear({.is_low = true, .is_testing = true});
  CHECK_FALSE(bench.word().is_ok);
  bench.now += 1ms;
  CHECK(bench.word().state == InsulationState::speed_start);
  CHECK_FALSE(bench.word().resistance_Ohm.is_valid());
  bench.hear(good);
  CHECK(bench.word().state == InsulationState::normal);
}

TEST_CASE("a self-test that never comes keeps a pack open for twenty seconds, not for ever", "[unit][insulation]") {
  Bench bench;
  MonitorReport pending = good;
  pending.is_test_pending = true;
  for (int second = 0; second < 20; ++second) {
    bench.hear(pending);
    CHECK(bench.word().state == InsulationState::speed_start);
    CHECK_FALSE(bench.table.is_untested(bench.now));
    bench.now += 1s;
  }
  bench.hear(pending);
  CHECK(bench.word().state == InsulationState::normal);
  CHECK(bench.table.is_untested(bench.now));
  bench.hear(good);
  CHECK_FALSE(bench.table.is_untested(bench.now));
  bench.now += 1s;
  bench.hear(pending);  // switched off momentarily: no new waiting time
  CHECK(bench.word().state == InsulationState::normal);
  CHECK(bench.table.is_untested(bench.now));
  bench.now += 3s;
  CHECK_FALSE(bench.table.is_untested(bench.now));  // it is silent
}

TEST_CASE("a monitor that was switched off and on again is waited for anew, and shows no value meanwhile",
          "[unit][insulation]") {
  MonitorReport pending = good;
  pending.is_test_pending = true;
  Bench bench;
  bench.hear(good);
  SECTION("silent for as long as it may be, it only lost some words") {
    bench.now += bench.table.silence_max();
    bench.hear(pending);
    CHECK(bench.word().state == InsulationState::speed_start);
    bench.now += InsulationTable::test_wait - bench.table.silence_max();
    bench.hear(pending);
    CHECK(bench.word().state == InsulationState::speed_start);  // silent for longer than permitted by then
  }
  SECTION("silent for longer") {
    bench.now += InsulationTable::test_wait;
    bench.hear(pending);
    const TimePoint back_at = bench.now;
    for (; bench.now < back_at + InsulationTable::test_wait; bench.now += 1s) {
      bench.hear(pending);
      CHECK(bench.word().state == InsulationState::speed_start);
      CHECK_FALSE(bench.word().resistance_Ohm.is_valid());
      CHECK(bench.word().taken_at == TimePoint{});
      CHECK_FALSE(bench.word().awaits_first_test);  // not the first start
      CHECK_FALSE(bench.table.is_untested(bench.now));
    }
    bench.hear(pending);
    CHECK(bench.word().state == InsulationState::normal);
    CHECK(bench.table.is_untested(bench.now));
  }
  SECTION("that has tested itself") {
    bench.now += InsulationTable::test_wait;
    bench.hear(good);
    CHECK(bench.word().state == InsulationState::normal);
  }
}

TEST_CASE("the first test of all is waited for as long as the monitor talks, and once", "[unit][insulation]") {
  MonitorReport pending = good;
  pending.is_test_pending = true;
  Bench bench;
  CHECK_FALSE(bench.word().awaits_first_test);  // no report yet
  bench.hear(pending);
  CHECK(bench.word().awaits_first_test);
  bench.now += bench.table.silence_max();  // not yet silent
  bench.hear(pending);
  CHECK(bench.word().awaits_first_test);
  bench.hear({.is_earth_lost = true, .is_test_pending = true});
  CHECK_FALSE(bench.word().awaits_first_test);  // its own error report has priority
  bench.hear(pending);
  bench.now += bench.table.silence_max() + 1ms;
  CHECK_FALSE(bench.word().awaits_first_test);
  bench.hear(pending);
  CHECK(bench.word().state == InsulationState::speed_start);
  CHECK_FALSE(bench.word().awaits_first_test);
  bench.table.forget_values();
  bench.hear(pending);
  CHECK(bench.word().awaits_first_test);
}

TEST_CASE("the first test is waited for in the first second of the clock, too", "[unit][insulation]") {
  MonitorReport pending = good;
  pending.is_test_pending = true;
  Bench bench;
  bench.now = TimePoint{100ms};
  bench.hear(pending);
  CHECK(bench.word().awaits_first_test);
}

TEST_CASE("pulses tell of no test, whatever a recording of a monitor on a bus has heard", "[unit][insulation][image]") {
  MonitorReport pending = good;
  pending.is_test_pending = true;
  Bench bench;
  bench.hear(pending);
  std::vector<std::uint8_t> bytes(image_size(bench.table));
  write_image(bench.table, bytes);
  InsulationTable pulsing;
  pulsing.init({.monitoring = InsulationMonitoring::measured, .has_pulse_line = true});
  REQUIRE_FALSE(read_image(bytes, pulsing));
  const TimePoint later = bench.now + InsulationTable::test_wait + 1s;
  pulsing.observe(ir155::Pwm{.frequency_mHz = 10'000, .duty_permille = 500}, later);
  CHECK(pulsing.is_talking(later));
  CHECK_FALSE(pulsing.is_untested(later));
}

TEST_CASE("frames of the wrong form take nothing and are counted", "[unit][insulation]") {
  Bench bench;
  CHECK(bench.table.observe(data_frame(0x037, 5), bench.now));
  CHECK(bench.table.frames_refused() == 1);
  CHECK(bench.table.heard_at() == TimePoint{});
  CHECK_FALSE(bench.table.observe(data_frame(0x038, 6), bench.now));
  CHECK(bench.table.frames_refused() == 1);
  CHECK(bench.table.report() == MonitorReport{});
}

TEST_CASE("each state of a monitor has its name", "[unit][insulation]") {
  CHECK(to_text(InsulationState::no_signal) == "no signal");
  CHECK(to_text(InsulationState::normal) == "normal");
  CHECK(to_text(InsulationState::undervoltage) == "undervoltage");
  CHECK(to_text(InsulationState::speed_start) == "speed start");
  CHECK(to_text(InsulationState::device_error) == "device error");
  CHECK(to_text(InsulationState::earth_fault) == "earth fault");
  CHECK(to_text(InsulationState::undefined) == "undefined");
}

TEST_CASE("a low resistance from a bus is as old as the monitor's word", "[unit][faults][insulation]") {
  test::FaultWorld world;
  world.config.insulation = {.monitoring = InsulationMonitoring::measured, .driver = &bender()};
  world.sensors.pdu.value.insulation_state = InsulationState::normal;
  world.sensors.pdu.value.insulation_resistance_Ohm = known(40'000);
  world.sensors.insulation.taken_at = test::start - 1s;
  CHECK(world.read(FaultId::insulation_low).value == 40'000);
  CHECK(world.read(FaultId::insulation_low).taken_at == test::start - 1s);
  world.config.insulation.driver = nullptr;
  CHECK(world.read(FaultId::insulation_low).taken_at == test::start);
}

TEST_CASE("rows of the sensor's set-up and of an untested monitor read their flags", "[unit][faults][sensors]") {
  test::FaultWorld world;
  CHECK_FALSE(world.is_true(FaultId::sensor_not_set_up));
  CHECK_FALSE(world.is_true(FaultId::insulation_monitor_untested));
  world.flags.sensor_not_set_up = true;
  CHECK(world.is_true(FaultId::sensor_not_set_up));
  world.flags.insulation_untested = true;
  CHECK(world.is_true(FaultId::insulation_monitor_untested));
}
