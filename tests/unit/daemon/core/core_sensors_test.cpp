// Core with sensors of other manufacturers: which current counts, when it is unknown, and what opens.
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

const CurrentSensorDriver& lem() {
  return *find_device("lem_cab")->current;
}
const SensorSetUpDriver& ivt() {
  return *find_device("ivt_s")->set_up;
}
const InsulationDriver& bender() {
  return *find_device("iso165c")->insulation;
}

CoreConfig one_bus(CoreConfig config) {
  config.served_by = {Port::internal, Port::internal, Port::internal, Port::internal};
  return config;
}

/// Bench with an IVT-S that answers each request at once.
struct IvtBench {
  std::array<SensorSetting, sensor_channels_max> settings{};
  bool answers = true;
  test::CoreBench bench;
  std::size_t seen = 0;

  explicit IvtBench(const CoreConfig& config) : bench(config) {
    for (std::uint8_t channel = 0; channel < sensor_channels_used; ++channel) {
      settings.at(channel) = wanted_setting(channel, config.sensor);
    }
    bench.each_ms = [this] { answer_new(); };
  }
  void answer_new() {
    for (; seen < bench.sent().size(); ++seen) {
      const std::optional<SetUpOrder> order = ivt().order_of(bench.sent()[seen].frame);
      if (order && answers) bench.deliver(ivt().answer(answer_to(*order)));
    }
  }
  [[nodiscard]] SetUpAnswer answer_to(const SetUpOrder& order) {
    switch (order.kind) {
      case SetUpOrderKind::read: return {SetUpWord::setting, order.channel, settings.at(order.channel)};
      case SetUpOrderKind::set:
        settings.at(order.channel) = order.setting;
        return {SetUpWord::setting, order.channel, order.setting};
      case SetUpOrderKind::stop: return {.word = SetUpWord::stopped};
      case SetUpOrderKind::run: return {.word = SetUpWord::running};
      case SetUpOrderKind::store: break;
    }
    return {.word = SetUpWord::stored};
  }
  [[nodiscard]] int count(EventId id) const {
    return static_cast<int>(std::count_if(bench.events().begin(), bench.events().end(),
                                          [id](const Event& event) { return event.id == id; }));
  }
};

CoreConfig ivt_pack() {
  CoreConfig config = one_bus(test::small_pack());
  config.sensor.set_up = &ivt();
  return config;
}

}  // namespace

TEST_CASE("a verified sensor closes a pack, and until then its current is not known", "[unit][core][sensors]") {
  IvtBench ivt_bench(ivt_pack());
  test::CoreBench& bench = ivt_bench.bench;
  ivt_bench.answers = false;
  bench.run(400ms);
  CHECK_FALSE(bench.core().sensors().current_mA.is_valid());
  CHECK_FALSE(bench.core().sensors().pack_voltage_mV.is_valid());
  CHECK_FALSE(bench.core().pack().current_mA.is_valid());
  ivt_bench.answers = true;
  REQUIRE(bench.close());
  CHECK(bench.core().sensors().current_mA.is_valid());
  CHECK(ivt_bench.count(EventId::sensor_set_up) == 1);
  CHECK_FALSE(bench.is_active(FaultId::sensor_not_set_up));
}

TEST_CASE("a sensor that is set up otherwise is not used, and is told of", "[unit][core][sensors]") {
  IvtBench ivt_bench(ivt_pack());
  ivt_bench.settings[1].period_ms = 100;
  test::CoreBench& bench = ivt_bench.bench;
  bench.run(2'500ms);
  CHECK(bench.is_active(FaultId::sensor_not_set_up));
  CHECK(bench.is_active(FaultId::current_sensor_lost));
  CHECK(ivt_bench.count(EventId::sensor_set_up_failed) == 1);
  CHECK_FALSE(bench.close());
  bench.run(20s);
  CHECK(ivt_bench.count(EventId::sensor_set_up_failed) == 1);  // reported once
  ivt_bench.settings[1].period_ms = 60;
  bench.run(7s);
  CHECK_FALSE(bench.is_active(FaultId::sensor_not_set_up));
}

TEST_CASE("a sensor is configured where the pack file says so, and the pack closes", "[unit][core][sensors]") {
  CoreConfig config = ivt_pack();
  config.sensor.is_configured = true;
  IvtBench ivt_bench(config);
  ivt_bench.settings[0].is_little_endian = true;
  REQUIRE(ivt_bench.bench.close());
  CHECK_FALSE(ivt_bench.settings[0].is_little_endian);
  CHECK(ivt_bench.bench.core().gate_refusals() == 0);
}

TEST_CASE("a sensor that starts anew in a closed pack and is as it was opens nothing", "[unit][core][sensors]") {
  IvtBench ivt_bench(ivt_pack());
  test::CoreBench& bench = ivt_bench.bench;
  REQUIRE(bench.close());
  bench.sensor_talks = false;
  bench.run(100ms);
  bench.deliver(ivt().answer({.word = SetUpWord::alive}));
  bench.sensor_talks = true;
  bench.run(2s);
  CHECK(bench.core().sequence().phase == Phase::closed);
  CHECK(ivt_bench.count(EventId::sensor_restarted) == 1);
}

TEST_CASE("one that comes back otherwise opens the pack", "[unit][core][sensors]") {
  IvtBench ivt_bench(ivt_pack());
  test::CoreBench& bench = ivt_bench.bench;
  REQUIRE(bench.close());
  ivt_bench.settings[0].is_little_endian = true;
  bench.deliver(ivt().answer({.word = SetUpWord::alive}));
  bench.run(1s);
  CHECK(bench.core().sequence().phase == Phase::open);
  CHECK(bench.is_active(FaultId::current_sensor_lost));
}

TEST_CASE("and one that does not answer again opens it after the trust", "[unit][core][sensors]") {
  IvtBench ivt_bench(ivt_pack());
  test::CoreBench& bench = ivt_bench.bench;
  REQUIRE(bench.close());
  ivt_bench.answers = false;
  bench.deliver(ivt().answer({.word = SetUpWord::alive}));
  bench.run(900ms);
  CHECK(bench.core().sequence().phase == Phase::closed);
  bench.run(600ms);
  CHECK(bench.core().sequence().phase == Phase::open);
}

namespace {

/// Bench with a LEM CAB that reports the current every ten milliseconds.
struct LemBench {
  test::CoreBench bench;
  std::int32_t told_mA = 0;
  std::optional<SignalValue> told{};
  bool talks = true;
  int ms = 0;

  explicit LemBench(const CoreConfig& config) : bench(config) {
    bench.each_ms = [this] {
      if (talks && ++ms % 10 == 0) bench.deliver(lem().report(told.value_or(known(told_mA))));
    };
  }
};

CoreConfig lem_first() {
  CoreConfig config = one_bus(test::small_pack());
  config.sensor.first = &lem();
  return config;
}
CoreConfig lem_second() {
  CoreConfig config = one_bus(test::small_pack());
  config.sensor.has_second_current = true;
  config.sensor.second = &lem();
  config.limits.current_sensors_disagree = {
      .warn = 2'000, .open = 5'000, .hysteresis = 500, .confirm = 200ms, .clear = 2s};
  return config;
}

}  // namespace

TEST_CASE("a LEM CAB can be the one that tells the current", "[unit][core][sensors]") {
  LemBench lem_bench(lem_first());
  test::CoreBench& bench = lem_bench.bench;
  REQUIRE(bench.close());
  lem_bench.told_mA = 7'000;
  bench.current_mA = 90'000;  // of a sensor that provides only voltages in this pack
  bench.run(100ms);
  CHECK(bench.core().pack().current_mA.value == 7'000);
  lem_bench.talks = false;
  bench.run(400ms);
  CHECK(bench.core().sequence().phase == Phase::open);
  CHECK(bench.is_active(FaultId::current_sensor_lost));
}

TEST_CASE("too much current by a LEM CAB opens without waiting for the tick", "[unit][core][sensors]") {
  LemBench lem_bench(lem_first());
  test::CoreBench& bench = lem_bench.bench;
  REQUIRE(bench.close());
  lem_bench.told_mA = 900'000;
  bench.run(200ms);
  CHECK(bench.is_active(FaultId::discharge_overcurrent));
}

TEST_CASE("what a LEM CAB marks as wrong is no current, and counted by why", "[unit][core][sensors]") {
  LemBench lem_bench(lem_first());
  test::CoreBench& bench = lem_bench.bench;
  REQUIRE(bench.close());
  lem_bench.told = not_known();
  bench.run(50ms);
  const RefusedResults& refused = bench.core().sensors().refused;
  CHECK(refused.last == ResultRefusal::sensor_fault);
  CHECK(refused.of(ResultRefusal::sensor_fault) >= 4);
  CHECK(refused.of(ResultRefusal::sensor_fault) == refused.count());
  bench.run(400ms);
  CHECK(bench.core().sequence().phase == Phase::open);
  const auto count = refused.of(ResultRefusal::sensor_fault);
  bench.deliver(data_frame(0x3C2, 3));
  CHECK(refused.of(ResultRefusal::wrong_frame) == 1);
  CHECK(refused.of(ResultRefusal::sensor_fault) == count);
  CHECK(refused.last == ResultRefusal::wrong_frame);
}

TEST_CASE("of a sensor and a LEM CAB the worse counts, and apart they open", "[unit][core][sensors]") {
  LemBench lem_bench(lem_second());
  test::CoreBench& bench = lem_bench.bench;
  REQUIRE(bench.close());
  bench.current_mA = 10'000;
  lem_bench.told_mA = 11'000;
  bench.run(200ms);
  CHECK(bench.core().pack().current_mA.value == 11'000);
  CHECK(bench.core().sequence().phase == Phase::closed);
  lem_bench.told_mA = 16'000;
  bench.run(1s);
  CHECK(bench.is_active(FaultId::current_sensors_disagree));
  CHECK(bench.core().sequence().phase == Phase::open);
}

TEST_CASE("a second sensor may be mounted the other way round", "[unit][core][sensors]") {
  CoreConfig config = lem_second();
  config.sensor.is_second_reversed = true;
  LemBench lem_bench(config);
  test::CoreBench& bench = lem_bench.bench;
  bench.current_mA = 10'000;
  lem_bench.told_mA = -10'000;
  bench.run(300ms);
  CHECK(bench.core().sensors().current_2_mA.value == 10'000);
  CHECK(bench.core().sensors().current_mA.value == 10'000);
}

TEST_CASE("where a LEM CAB tells the first current, 521h is the second", "[unit][core][sensors]") {
  CoreConfig config = lem_first();
  config.sensor.has_second_current = true;
  LemBench lem_bench(config);
  test::CoreBench& bench = lem_bench.bench;
  bench.current_mA = 4'000;
  lem_bench.told_mA = 3'000;
  bench.run(300ms);
  CHECK(bench.core().sensors().current_mA.value == 3'000);
  CHECK(bench.core().sensors().current_2_mA.value == 4'000);
}

TEST_CASE("the discharge that an Outlander's sensor counts below zero leaves the pack", "[unit][core][sensors]") {
  CoreConfig config = one_bus(test::small_pack());
  config.sensor.first = find_device("outlander_current")->current;
  test::CoreBench bench(config);
  CanFrame precharge = data_frame(0x3C2, 8);
  precharge.data = {0x7F, 0xFF, 0xE1, 0xEC, 0xC8, 0, 0, 0};
  bench.deliver(precharge);
  bench.run(10ms);
  CHECK(bench.core().sensors().current_mA.value == 7'700);
}

TEST_CASE("an IVT-S whose current was moved to 624h is missing, and a second reporter on the vehicle's bus",
          "[unit][core][sensors]") {
  test::CoreBench bench(test::small_pack());
  bench.sensor_talks = false;
  CanFrame moved = data_frame(0x624, 6);
  moved.data = {0, 0, 0, 0, 0x27, 0x10};
  for (const Port port : {Port::internal, Port::vehicle}) bench.observe(FrameReceived{port, moved});
  bench.run(200ms);
  CHECK_FALSE(bench.core().sensors().current_mA.is_valid());
  CHECK(bench.is_active(FaultId::foreign_reporter));
  CHECK(bench.core().sequence().phase == Phase::open);
}

TEST_CASE("two sensors of other makers are heard, each as what it is", "[unit][core][sensors]") {
  // A LEM CAB that was given another identifier.
  constexpr std::uint32_t moved_id = 0x3C5;
  static const CurrentSensorDriver moved{.name = "moved", .period = 10ms, .take = [](const CanFrame& frame) {
                                           CanFrame at_home = frame;
                                           at_home.id = frame.id == moved_id ? lem().report(known(0)).id : 0;
                                           return lem().take(at_home);
                                         }};
  CoreConfig config = lem_first();
  config.sensor.has_second_current = true;
  config.sensor.second = &moved;
  LemBench lem_bench(config);
  test::CoreBench& bench = lem_bench.bench;
  lem_bench.told_mA = 3'000;
  CanFrame second = lem().report(known(4'000));
  second.id = moved_id;
  bench.run(100ms);
  bench.deliver(second);
  bench.run(10ms);
  CHECK(bench.core().sensors().current_mA.value == 3'000);
  CHECK(bench.core().sensors().current_2_mA.value == 4'000);
}

TEST_CASE("results of a sensor that another has replaced are nobody's", "[unit][sensor_table]") {
  CoreConfig config = lem_first();
  SensorTable sensors;
  CanFrame frame = make_frame(internal_bus::sensor_current_2);
  sensors.observe(internal_bus::sensor_current_2, frame, TimePoint{1s}, config);
  CHECK_FALSE(sensors.current_2_mA.is_valid());
  config.sensor.second = &lem();
  sensors.observe(internal_bus::sensor_current, make_frame(internal_bus::sensor_current), TimePoint{1s}, config);
  CHECK_FALSE(sensors.current_mA.is_valid());
  CHECK_FALSE(sensors.current_2_mA.is_valid());
  config.sensor.first = nullptr;
  sensors.observe(internal_bus::sensor_current_2, frame, TimePoint{1s}, config);
  CHECK_FALSE(sensors.current_2_mA.is_valid());
  sensors.observe(internal_bus::sensor_current, make_frame(internal_bus::sensor_current), TimePoint{1s}, config);
  CHECK(sensors.current_mA.is_valid());
}

TEST_CASE("the least number of a sensor that is turned round is the greatest", "[unit][sensor_table]") {
  CoreConfig config = lem_first();
  config.sensor.invert_current = true;
  SensorTable sensors;
  sensors.observe_current(known(INT32_MIN), true, TimePoint{1s}, config);
  CHECK(sensors.current_mA.value == INT32_MAX);
  sensors.observe_current(known(5), false, TimePoint{1s}, config);
  CHECK(sensors.current_2_mA.value == -5);
}

namespace {

/// Bench with an iso165C that reports once a second.
struct IsoBench {
  test::CoreBench bench;
  MonitorReport report{.resistance_Ohm = known(900'000)};
  bool talks = true;
  int ms = 0;

  explicit IsoBench(const CoreConfig& config) : bench(config) {
    bench.each_ms = [this] {
      if (++ms % 1'000 == 500 && talks) bench.deliver(bender().report(report));
    };
  }
  /// Sends a last report, and nothing afterwards.
  void fall_silent() {
    while (ms % 1'000 != 500) bench.run(1ms);
    talks = false;
  }
};

CoreConfig iso_pack() {
  CoreConfig config = one_bus(test::small_pack());
  config.insulation = {.monitoring = InsulationMonitoring::measured, .driver = &bender()};
  config.limits.insulation_low = {.warn = 100'000, .open = 50'000, .hysteresis = 10'000, .confirm = 500ms, .clear = 2s};
  return config;
}

}  // namespace

TEST_CASE("a pack closes with a monitor on a bus, whatever the unit says of its own", "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.bench.inputs.insulation_monitor_ok = false;
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  CHECK(iso.bench.core().sensors().pdu.value.insulation_monitor_ok);
  CHECK(iso.bench.core().sensors().pdu.value.insulation_resistance_Ohm == known(900'000));
}

TEST_CASE("without a word from it nothing closes, and it is lost after 20 s", "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.talks = false;
  CHECK_FALSE(iso.bench.close());
  CHECK_FALSE(iso.bench.is_active(FaultId::insulation_fault));
  iso.bench.run(23s);
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_lost));
}

TEST_CASE("a monitor that falls silent opens a closed pack within two seconds, whatever the pack file grants it",
          "[unit][core][insulation][F96]") {
  CoreConfig config = iso_pack();
  config.limits.confirm.insulation_monitor_lost = GENERATE(1'500ms, 1'750ms);
  IsoBench iso(config);
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  iso.fall_silent();
  iso.bench.run(1'900ms);
  CHECK_FALSE(iso.bench.is_active(FaultId::insulation_monitor_lost));
  CHECK(iso.bench.core().sequence().phase == Phase::closed);
  iso.bench.run(20ms);  // two ticks
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_lost));
  CHECK(iso.bench.core().sequence().phase != Phase::closed);
  iso.bench.run(60ms);
  CHECK(iso.bench.core().sequence().phase == Phase::open);
}

TEST_CASE("a late report of a monitor keeps a pack closed up to the bound, and one that is lost opens it for good",
          "[unit][core][insulation][F96]") {
  const auto [silence, opens] =
      GENERATE(std::pair{Duration{1'400ms}, false}, std::pair{Duration{1'900ms}, false}, std::pair{Duration{2s}, true});
  CAPTURE(silence.count());
  IsoBench iso(iso_pack());
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  iso.fall_silent();
  iso.bench.run(silence - 1ms);
  CHECK((iso.bench.core().sequence().phase == Phase::open) == opens);
  iso.ms = 499;  // its next report comes now, and one a second from then on
  iso.talks = true;
  iso.bench.run(5s);
  CHECK((iso.bench.core().sequence().phase == Phase::open) == opens);
  const FaultStage stage = iso.bench.core().faults().state(FaultId::insulation_monitor_lost).stage;
  CHECK(stage == (opens ? FaultStage::latched : FaultStage::good));
}

TEST_CASE("a low resistance opens with its second report, and the monitor's own word sooner",
          "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  const bool says_so = GENERATE(false, true);
  iso.report = {.resistance_Ohm = known(20'000), .is_low = says_so};
  iso.bench.run(3s);
  CHECK(iso.bench.is_active(FaultId::insulation_low));
  CHECK(iso.bench.is_active(FaultId::insulation_fault) == says_so);
  CHECK(iso.bench.core().sequence().phase == Phase::open);
}

TEST_CASE("a monitor that tests itself for some seconds opens nothing, for ever it does", "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  iso.report = {.is_testing = true};
  iso.bench.run(8s);
  CHECK(iso.bench.core().sequence().phase == Phase::closed);
  iso.bench.run(6s);
  CHECK(iso.bench.core().sequence().phase == Phase::open);
}

TEST_CASE("a self-test that is still to come keeps a pack open for 20 s, and is warned of then",
          "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.report.is_test_pending = true;
  iso.bench.run(10s);
  CHECK_FALSE(iso.bench.close());
  iso.bench.inputs.vehicle_on = false;
  iso.bench.run(14s);
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_untested));
  CHECK_FALSE(iso.bench.is_active(FaultId::insulation_monitor_lost));
  CHECK(iso.bench.close());
}

TEST_CASE("a monitor that has told a value and then wants its first test opens as if it were lost",
          "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  iso.report.is_test_pending = true;
  iso.bench.run(4s);
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_lost));
  CHECK(iso.bench.core().sequence().phase == Phase::open);
}

TEST_CASE("a monitor that begins to talk late is waited for from its first word on", "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.report.is_test_pending = true;
  iso.talks = false;
  iso.bench.run(10s);
  iso.talks = true;
  iso.bench.run(14s);
  CHECK_FALSE(iso.bench.close());
  iso.bench.inputs.vehicle_on = false;
  iso.bench.run(1s);
  CHECK(iso.bench.core().faults().state(FaultId::insulation_monitor_lost).stage == FaultStage::good);
  iso.bench.run(7s);
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_untested));
  CHECK(iso.bench.core().faults().state(FaultId::insulation_monitor_lost).stage == FaultStage::good);
  CHECK(iso.bench.close());
}

TEST_CASE("a late monitor that comes to no value, or falls silent again, is lost all the same",
          "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.report.is_test_pending = true;
  iso.talks = false;
  iso.bench.run(10s);
  SECTION("no value behind the wait") {
    iso.report.resistance_Ohm = {};
    iso.talks = true;
    iso.bench.run(20s);
    CHECK_FALSE(iso.bench.is_active(FaultId::insulation_monitor_lost));
    iso.bench.run(3s);
  }
  SECTION("words with gaps between them") {
    for (int words = 0; words < 5; ++words) {
      iso.talks = true;
      iso.bench.run(1s);
      iso.talks = false;
      iso.bench.run(3s);
    }
  }
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_lost));
}

TEST_CASE("a monitor that was lost and comes back untested stays lost until its values count",
          "[unit][core][insulation]") {
  IsoBench iso(iso_pack());
  iso.bench.run(1s);
  REQUIRE(iso.bench.close());
  iso.fall_silent();
  SECTION("it had been silent for so long that the pack opened") {
    iso.bench.run(6s);
    REQUIRE(iso.bench.is_active(FaultId::insulation_monitor_lost));
  }
  SECTION("not yet: it had no signal") {
    iso.bench.run(1'600ms);
    REQUIRE_FALSE(iso.bench.is_active(FaultId::insulation_monitor_lost));
    iso.ms += 399;  // its next report comes now
  }
  iso.talks = true;
  iso.report.is_test_pending = true;
  iso.bench.run(3s);
  CHECK(iso.bench.core().sequence().phase == Phase::open);
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_lost));
  iso.bench.inputs.vehicle_on = false;
  iso.bench.run(15s);
  iso.bench.give(Command::clear_faults);
  iso.bench.run(100ms);
  CHECK(iso.bench.is_active(FaultId::insulation_monitor_lost));
  CHECK_FALSE(iso.bench.core().sensors().pdu.value.insulation_resistance_Ohm.is_valid());
  iso.bench.run(5s);
  CHECK(iso.bench.core().sensors().pdu.value.insulation_resistance_Ohm.is_valid());
  CHECK(iso.bench.core().faults().state(FaultId::insulation_monitor_lost).stage == FaultStage::latched);
  iso.bench.give(Command::clear_faults);
  iso.bench.run(100ms);
  CHECK(iso.bench.core().faults().state(FaultId::insulation_monitor_lost).stage == FaultStage::good);
}

TEST_CASE("a line of this machine says no beside a monitor on a bus", "[unit][sensor_table][insulation]") {
  CoreConfig config = iso_pack();
  config.lines = {.are_used = true, .has_insulation_ok = true};
  SensorTable sensors;
  sensors.pdu_word = {{.estop_1_released = true}, TimePoint{1s}, Validity::valid};
  const InsulationWord word{InsulationState::normal, known(900'000), true, TimePoint{1s}};
  for (const bool line : {false, true}) {
    sensors.observe(LineImage{.insulation_ok = line}, TimePoint{1s}, config);
    sensors.take_insulation(word, config);
    CHECK(sensors.pdu.value.insulation_monitor_ok == line);
  }
  InsulationWord low = word;
  low.is_ok = false;
  sensors.take_insulation(low, config);
  CHECK_FALSE(sensors.pdu.value.insulation_monitor_ok);
  config.insulation.driver = nullptr;
  sensors.take_insulation(word, config);
  CHECK_FALSE(sensors.pdu.value.insulation_monitor_ok);  // no monitor has reported it
  SensorTable alone;
  alone.take_insulation(word, config);
  CHECK_FALSE(alone.insulation_told);
  CHECK(alone.insulation_known_at == TimePoint{});
}
