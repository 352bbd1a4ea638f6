// The whole emulated pack without a master: the tests send the master's frames.
#include "mmu/scenario/simulator.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/processor_time.hpp"

namespace bmu {
namespace {

using namespace bmu::test;
using namespace internal_bus;

CoreConfig pack_of(std::uint8_t modules) {
  CoreConfig pack;
  for (std::uint8_t node = 1; node <= modules; ++node) pack.modules.push_back({.node = node});
  pack.cell.ocv.push_back({0, 3'000'000});
  pack.cell.ocv.push_back({500, 3'600'000});
  pack.cell.ocv.push_back({1000, 4'200'000});
  pack.cell.capacity_uAs = 30 * uAs_per_Ah;
  pack.cell.series_resistance_Ohm = 0.002;
  pack.cell.rc_resistance_Ohm = 0.001;
  pack.cell.rc_time_constant_s = 20.0;
  pack.cell.heat_capacity_J_per_K = 500.0;
  pack.cell.heat_transfer_W_per_K = 0.5;
  pack.cell.voltage_max_uV = 4'250'000;
  return pack;
}

/// A simulator and a minimal master: it polls and commands on request, and stores all received frames.
class SmallWorld {
 public:
  explicit SmallWorld(std::string_view script = "", std::uint8_t modules = 3, const SimulatorConfig& config = {})
      : simulator(with_pack(config, modules), *parse_scenario(script), power_up) {}

  void run(Duration duration) {
    for (const TimePoint end = simulator.now() + duration; simulator.now() < end;) {
      const TimePoint now = simulator.now() + 1ms;
      for (const SentFrame& sent : simulator.advance(now)) heard.push_back(sent);
    }
  }
  /// A CONTACTOR_COMMAND every 50 ms and a POLL every 100 ms.
  void run_with_master(Duration duration, std::uint8_t outputs) {
    for (Duration done{}; done < duration; done += 50ms) {
      CanFrame frame = make_frame(contactor_command);
      frame.data[0] = outputs;
      seal(contactor_command, ++counter, frame);
      simulator.observe(frame, simulator.now());
      if (done % 100ms == 0s) simulator.observe(poll_frame(0, want_all | want_sync, ++poll_counter), simulator.now());
      run(50ms);
    }
  }
  [[nodiscard]] const CanFrame* last(std::uint32_t id) const {
    const auto found =
        std::find_if(heard.rbegin(), heard.rend(), [id](const SentFrame& s) { return s.frame.id == id; });
    return found == heard.rend() ? nullptr : &found->frame;
  }
  [[nodiscard]] std::size_t count(std::uint32_t id) const {
    return static_cast<std::size_t>(
        std::count_if(heard.begin(), heard.end(), [id](const SentFrame& s) { return s.frame.id == id; }));
  }

  Simulator simulator;
  std::vector<SentFrame> heard;
  std::uint8_t counter = 0;
  std::uint8_t poll_counter = 0;

 private:
  static SimulatorConfig with_pack(const SimulatorConfig& config, std::uint8_t modules) {
    SimulatorConfig full = simulator_config(pack_of(modules));
    full.seed = config.seed;
    full.cell_noise_uV = config.cell_noise_uV;
    full.current_noise_mA = config.current_noise_mA;
    full.sensor.has_second = config.sensor.has_second;
    full.request_id = config.request_id;
    full.plant.has_charge_contactor = config.plant.has_charge_contactor;
    full.report_base_id = config.report_base_id;
    full.second_pack = config.second_pack;
    full.charger = config.charger;
    full.charger_units = config.charger_units;
    full.served_by = config.served_by;
    full.inverter = config.inverter;
    return full;
  }
};

TEST_CASE("a world is busy from a POLL until its answers have left, and what is periodic keeps to the calm step",
          "[scenario][simulator]") {
  SmallWorld world;
  world.run(2s);  // awake, and received for the first time
  world.heard.clear();
  for (int step = 0; step < 400; ++step) {
    CHECK_FALSE(world.simulator.is_busy());
    world.run(Simulator::calm_step);
  }
  REQUIRE(world.heard.size() > 100);
  for (const SentFrame& sent : world.heard) CHECK((sent.at - power_up) % Simulator::calm_step == Duration{});

  world.heard.clear();
  world.simulator.observe(poll_frame(0, want_all | want_sync, 1), world.simulator.now());
  const auto is_answer = [](const SentFrame& sent) {
    return sent.frame.id > status.base_id && sent.frame.id < command.base_id;
  };
  const auto answers = [&] { return std::count_if(world.heard.begin(), world.heard.end(), is_answer); };
  while (world.simulator.is_busy()) world.run(1ms);
  const auto while_busy = answers();
  CHECK(while_busy >= 3 * 8);
  world.run(50ms);
  CHECK(answers() == while_busy);
}

TEST_CASE("a world is busy for as long as an answer is delayed, or a sensor is faster than the calm step",
          "[scenario][simulator]") {
  SmallWorld delayed("0 module 2 delay_ms 300");
  delayed.run(2s);
  delayed.simulator.observe(poll_frame(0, want_all | want_sync, 1), delayed.simulator.now());
  delayed.run(299ms);
  CHECK(delayed.simulator.is_busy());
  delayed.run(20ms);
  CHECK_FALSE(delayed.simulator.is_busy());

  SimulatorConfig fast = simulator_config(pack_of(1));
  fast.sensor.periods = {2ms, 60ms, 60ms, 0ms, 0ms};
  CHECK(Simulator(fast, *parse_scenario(""), power_up).is_busy());
}

TEST_CASE("the emulated pack follows the pack file", "[scenario][simulator][BMS_F.2]") {
  const SimulatorConfig config = simulator_config(pack_of(3));
  CHECK(config.modules.size() == 3);
  CHECK(config.modules[2].serial_number == 1003);
  CHECK(config.plant.cell.ocv_V[0] == Approx(3.0));
  CHECK(config.plant.cell.ocv_V[250] == Approx(3.3));
  CHECK(config.plant.cell.ocv_V[500] == Approx(3.6));
  CHECK(config.plant.cell.ocv_V[1000] == Approx(4.2));
  CHECK(config.plant.cell.capacity_As == Approx(108'000.0));
}

TEST_CASE("all modules answer a POLL to all, STATUS of every module before any voltage in the same instant",
          "[scenario][simulator][MMU_1]") {
  SmallWorld world;
  world.run(500ms);
  world.heard.clear();
  world.simulator.observe(poll_frame(0, want_all, 1), world.simulator.now());
  world.run(10ms);
  for (std::uint32_t node = 1; node <= 3; ++node) {
    for (const std::uint32_t base : {0x100U, 0x140U, 0x180U, 0x1C0U, 0x200U, 0x240U, 0x280U, 0x2C0U, 0x300U}) {
      CHECK(world.count(base + node) == 1);
    }
  }
  const auto same_instant_sorted = [&](std::size_t index) {
    const SentFrame& one = world.heard[index - 1];
    const SentFrame& next = world.heard[index];
    return one.at < next.at || one.frame.id <= next.frame.id;
  };
  for (std::size_t index = 1; index < world.heard.size(); ++index) CHECK(same_instant_sorted(index));
}

TEST_CASE("everything the world sends passes the master's receive check", "[scenario][simulator]") {
  SmallWorld world("0 pack soc_permille 500");
  world.run_with_master(5s, 0x06);
  ReceiveCheck check(catalogue, ReceiveCheck::Role::master);
  for (const SentFrame& sent : world.heard) CHECK(check.check(sent.frame).is_accepted);
  CHECK(check.counts().accepted > 1000);
}

TEST_CASE("the same seed gives the same frames, another seed others", "[scenario][simulator]") {
  const auto frames_of = [](std::uint64_t seed) {
    SimulatorConfig config;
    config.seed = seed;
    config.cell_noise_uV = 300;
    config.current_noise_mA = 20;
    SmallWorld world("0 vehicle on\n1 load profile drive\n2 cell 2.7 voltage_mV ..2500 over 1", 3, config);
    world.run_with_master(4s, 0x03);
    return world.heard;
  };
  const auto same = [](const std::vector<SentFrame>& one, const std::vector<SentFrame>& other) {
    return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                      [](const SentFrame& a, const SentFrame& b) { return a.at == b.at && a.frame == b.frame; });
  };
  const auto first = frames_of(1);
  CHECK(same(first, frames_of(1)));
  CHECK_FALSE(same(first, frames_of(2)));
}

TEST_CASE("without a master the contactors open, in the world as well", "[scenario][simulator][BMS_F.3]") {
  SmallWorld world;
  world.run_with_master(1s, 0x03);
  REQUIRE(world.simulator.plant().is_connected());
  world.run(149ms);  // 199 ms since the last command
  CHECK(world.simulator.plant().is_connected());
  world.run(15ms);
  CHECK_FALSE(world.simulator.plant().is_connected());
  CHECK(world.simulator.counts().contactor_timeouts == 1);
}

TEST_CASE("events happen at their time and once", "[scenario][simulator]") {
  SmallWorld world("0.5 vehicle on\n0.7 estop 1 pressed\n0.9 vehicle off");
  world.run(499ms);
  CHECK(read_raw<pdu_status, "vehicle_on">(*world.last(0x041)) == 0);
  world.run(3ms);
  CHECK(read_raw<pdu_status, "vehicle_on">(*world.last(0x041)) == 1);
  world.run(200ms);
  CHECK(read_raw<pdu_status, "estop_1_released">(*world.last(0x041)) == 0);
  CHECK(read_raw<pdu_status, "estop_2_released">(*world.last(0x041)) == 1);
  world.run(200ms);
  CHECK(read_raw<pdu_status, "vehicle_on">(*world.last(0x041)) == 0);
  CHECK(world.simulator.script().is_over());
}

TEST_CASE("a cell's voltage can be said, ramped, and given back to the plant", "[scenario][simulator]") {
  SmallWorld world;
  const auto cell_uV = [&world] {
    world.run_with_master(200ms, 0);
    return read<cells_3, "cell_voltage_7_uV">(*world.last(0x1C2)).value;
  };
  const std::int64_t real_uV = cell_uV();
  REQUIRE(world.simulator.apply("cell 2.7 voltage_mV 2700"));
  CHECK(cell_uV() == 2'700'000);
  REQUIRE(world.simulator.apply("cell 2.7 voltage_mV ..3700 over 1"));
  world.run_with_master(300ms, 0);
  const std::int64_t on_the_way_uV = cell_uV();
  CHECK(on_the_way_uV > 2'900'000);
  CHECK(on_the_way_uV < 3'300'000);
  world.run_with_master(1s, 0);
  CHECK(cell_uV() == 3'700'000);
  REQUIRE(world.simulator.apply("cell 2.7 voltage_mV auto"));
  CHECK(cell_uV() == real_uV);
  REQUIRE(world.simulator.apply("cell 2.7 offset_mV -15"));
  CHECK(cell_uV() == real_uV - 15'000);
}

TEST_CASE("modules fall silent, damage their frames, restart", "[scenario][simulator]") {
  SmallWorld world;
  world.run_with_master(1s, 0);
  const auto answers_in_1s = [&world](std::uint32_t id) {
    world.heard.clear();
    world.run_with_master(1s, 0);
    return world.count(id);
  };
  REQUIRE(world.simulator.apply("module 3 silent"));
  CHECK(answers_in_1s(0x103) == 0);
  CHECK(world.count(0x102) == 10);
  REQUIRE(world.simulator.apply("module 3 talking"));
  CHECK(answers_in_1s(0x103) == 10);
  CHECK(read_raw<status, "restarted">(*world.last(0x103)) == 0);
  REQUIRE(world.simulator.apply("module 3 damaged_frames on"));
  CHECK(answers_in_1s(0x103) == 10);
  CHECK(world.last(0x103)->data[7] != frame_crc(*world.last(0x103)));
  REQUIRE(world.simulator.apply("module 3 damaged_frames off"));
  world.heard.clear();
  REQUIRE(world.simulator.apply("module 3 restart"));
  world.run(40ms);
  CHECK(world.count(0x303) == 1);
}

TEST_CASE("a hot cell is felt by the sensor next to it, and sensors break", "[scenario][simulator][MMU_4]") {
  SmallWorld world("0 cell 3.1 temperature_dC 610\n0 thermistor 3.2 state open\n0 thermistor 3.4 state shorted");
  world.run(600ms);
  world.run_with_master(200ms, 0);
  CHECK(read<temp_1, "cell_temperature_1_dC">(*world.last(0x243)).value == 610);
  CHECK(read<temp_1, "cell_temperature_2_dC">(*world.last(0x243)).validity == Validity::open_circuit);
  CHECK(read<temp_1, "cell_temperature_3_dC">(*world.last(0x243)).value == 250);
  CHECK(read<temp_2, "cell_temperature_4_dC">(*world.last(0x283)).validity == Validity::short_circuit);
}

TEST_CASE("sensor and insulation do as they are told", "[scenario][simulator]") {
  SmallWorld world;
  world.run_with_master(500ms, 0x03);
  REQUIRE(world.simulator.apply("sensor current offset_mA 700"));
  REQUIRE(world.simulator.apply("sensor link_voltage silent"));
  REQUIRE(world.simulator.apply("sensor pack_voltage value_mV 12345"));
  REQUIRE(world.simulator.apply("insulation resistance_kOhm 40"));
  world.heard.clear();
  world.run_with_master(500ms, 0x03);
  CHECK(read<sensor_current, "pack_current_mA">(*world.last(0x521)).value == Approx(713).margin(5));  // and the bleed
  CHECK(read<sensor_u1, "pack_voltage_mV">(*world.last(0x522)).value == 12'345);
  CHECK(world.count(0x523) == 0);
}

std::int64_t insulation_state(const SmallWorld& world) {
  return read_raw<pdu_status, "insulation_monitor_state">(*world.last(0x041));
}
SignalValue insulation_Ohm(const SmallWorld& world) {
  return read<pdu_status, "insulation_resistance_Ohm">(*world.last(0x041));
}
bool is_insulation_ok(const SmallWorld& world) {
  return read_raw<pdu_status, "insulation_monitor_ok">(*world.last(0x041)) != 0;
}

TEST_CASE("the insulation monitor starts with 2 s of speed start, then has a value", "[scenario][simulator][FS_3]") {
  SmallWorld good;
  good.run(1'999ms);
  CHECK(insulation_state(good) == 3);
  CHECK(is_insulation_ok(good));
  CHECK(insulation_Ohm(good) == not_known());
  good.run(51ms);
  CHECK(insulation_state(good) == 1);
  CHECK(insulation_Ohm(good) == known(1'200'000));
  CHECK(is_insulation_ok(good));
  SmallWorld bad("0 insulation resistance_kOhm 40");
  bad.run(1s);
  CHECK(insulation_state(bad) == 3);
  CHECK_FALSE(is_insulation_ok(bad));
  bad.run(2s);
  CHECK(insulation_Ohm(bad) == known(40'000));
  CHECK_FALSE(is_insulation_ok(bad));

  REQUIRE(good.simulator.apply("insulation monitor no_signal"));
  good.run(1s);
  REQUIRE(good.simulator.apply("insulation monitor normal"));
  good.run(1s);
  CHECK(insulation_state(good) == 3);
  good.run(1'050ms);
  CHECK(insulation_state(good) == 1);
}

TEST_CASE("the status line falls below 500 Ohm for each volt of the full pack", "[scenario][simulator][FS_3]") {
  SmallWorld world;  // 36 cells of 4.25 V: 153 V, 76.5 kOhm
  world.run(3s);
  REQUIRE(world.simulator.apply("insulation resistance_kOhm 76.5"));
  world.run(50ms);
  CHECK(is_insulation_ok(world));
  REQUIRE(world.simulator.apply("insulation resistance_kOhm 76.4"));
  world.run(50ms);
  CHECK_FALSE(is_insulation_ok(world));
}

TEST_CASE("the states of the insulation monitor and faults of its signal arrive in PDU_STATUS",
          "[scenario][simulator][FS_3]") {
  struct Case {
    const char* event;
    std::int64_t state;
    SignalValue resistance_Ohm;
    bool is_ok;
  };
  const Case cases[] = {
      {"insulation monitor normal", 1, known(1'200'000), true},
      {"insulation monitor undervoltage", 2, known(1'200'000), false},
      {"insulation monitor speed_start", 3, not_known(), true},
      {"insulation monitor device_error", 4, not_known(), false},
      {"insulation monitor earth_fault", 5, not_known(), false},
      {"insulation monitor no_signal", 0, not_known(), false},
      {"insulation wire open", 0, not_known(), true},
      {"insulation wire shorted", 0, not_known(), true},
      {"insulation resistance_kOhm 60000", 1, not_known(Validity::above_range), true},
      {"insulation pwm_frequency_Hz 11", 1, known(1'200'000), true},
      {"insulation pwm_frequency_Hz 11.1", 0, not_known(), true},
      {"insulation pwm_frequency_Hz 20", 2, known(1'200'000), true},
      {"insulation pwm_frequency_Hz 0", 0, not_known(), true},
      {"insulation pwm_duty_permille 770", 1, known(300'000), true},
      {"insulation pwm_duty_permille 970", 0, not_known(), true},
      {"insulation pwm_duty_permille 0", 0, not_known(), true},
      {"insulation pwm_duty_permille 1000", 0, not_known(), true},
  };
  for (const Case& one : cases) {
    INFO(one.event);
    SmallWorld world;
    world.run(3s);
    REQUIRE(world.simulator.apply(one.event));
    world.run(260ms);
    CHECK(insulation_state(world) == one.state);
    CHECK(insulation_Ohm(world) == one.resistance_Ohm);
    CHECK(is_insulation_ok(world) == one.is_ok);
  }
}

TEST_CASE("a lost signal is told 200 ms after its last edge, with the level it was lost at", "[scenario][simulator]") {
  SmallWorld world;
  world.run(3s);
  REQUIRE(world.simulator.apply("insulation wire shorted"));
  world.run(200ms);
  CHECK(insulation_state(world) == 1);
  world.run(1ms);
  CHECK(insulation_state(world) == 0);
  CHECK(world.simulator.world().insulation.pwm.is_high);
  REQUIRE(world.simulator.apply("insulation wire open"));
  world.run(1ms);
  CHECK_FALSE(world.simulator.world().insulation.pwm.is_high);
  REQUIRE(world.simulator.apply("insulation wire closed"));
  world.run(1ms);
  CHECK(insulation_state(world) == 1);
}

std::int64_t current_mA(const SmallWorld& world) {
  return read<sensor_current, "pack_current_mA">(*world.last(0x521)).value;
}
std::int64_t second_current_mA(const SmallWorld& world) {
  return read<sensor_current_2, "pack_current_2_mA">(*world.last(0x531)).value;
}

TEST_CASE("a second current sensor measures the same and fails on its own", "[scenario][simulator]") {
  SimulatorConfig config;
  config.sensor.has_second = true;
  SmallWorld world("0 load current_A 20", 3, config);
  world.run_with_master(500ms, 0x03);
  CHECK(current_mA(world) == Approx(20'013).margin(5));
  CHECK(second_current_mA(world) == current_mA(world));
  REQUIRE(world.simulator.apply("sensor current_2 offset_mA 300"));
  REQUIRE(world.simulator.apply("sensor current_2 error on"));
  world.run_with_master(100ms, 0x03);
  CHECK(second_current_mA(world) == current_mA(world) + 300);
  CHECK(read_raw<sensor_current_2, "measurement_error">(*world.last(0x531)) == 1);
  CHECK(read_raw<sensor_current, "any_measurement_error">(*world.last(0x521)) == 0);
  REQUIRE(world.simulator.apply("sensor current_2 value_mA -5"));
  world.run_with_master(100ms, 0x03);
  CHECK(second_current_mA(world) == -5);
  REQUIRE(world.simulator.apply("sensor current_2 silent"));
  world.heard.clear();
  world.run_with_master(200ms, 0x03);
  CHECK(world.count(0x531) == 0);
  CHECK(world.count(0x521) == 10);
}

TEST_CASE("without a second current sensor there is nothing at 531h and nothing to script", "[scenario][simulator]") {
  SmallWorld world;
  world.run(1s);
  CHECK(world.count(0x531) == 0);
  const auto refused = world.simulator.apply("sensor current_2 stuck on");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().wanted.find("no second current sensor") != std::string::npos);
}

TEST_CASE("a stuck result repeats its value to the last digit while its counter goes on", "[scenario][simulator]") {
  SimulatorConfig config;
  config.current_noise_mA = 40;
  SmallWorld world("0 load current_A 20", 3, config);
  world.run_with_master(500ms, 0x03);
  const CanFrame current = *world.last(0x521);
  const CanFrame pack = *world.last(0x522);
  REQUIRE(world.simulator.apply("sensor current stuck on"));
  REQUIRE(world.simulator.apply("sensor pack_voltage stuck on"));
  REQUIRE(world.simulator.apply("load current_A 0"));
  world.heard.clear();
  world.run_with_master(400ms, 0x03);
  REQUIRE(world.count(0x521) == 20);
  std::uint8_t counter = current.data[1];
  for (const SentFrame& sent : world.heard) {
    if (sent.frame.id != 0x521) continue;
    counter = static_cast<std::uint8_t>((counter + 1) & 0x0F);
    CHECK(sent.frame.data[1] == counter);
    CHECK(std::equal(sent.frame.data.begin() + 2, sent.frame.data.begin() + 6, current.data.begin() + 2));
  }
  CHECK(std::equal(pack.data.begin() + 2, pack.data.begin() + 6, world.last(0x522)->data.begin() + 2));
  REQUIRE(world.simulator.apply("sensor current stuck off"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(13).margin(45));
}

TEST_CASE("an inverted sensor counts the other way", "[scenario][simulator]") {
  SmallWorld world("0 load current_A 20");
  world.run_with_master(500ms, 0x03);
  REQUIRE(world.simulator.apply("sensor current inverted on"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(-20'013).margin(5));
  REQUIRE(world.simulator.apply("sensor current offset_mA 100"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(-19'913).margin(5));
}

TEST_CASE("the charger of a pack with a charge contactor waits for it", "[scenario][simulator]") {
  SimulatorConfig config;
  config.plant.has_charge_contactor = true;
  SmallWorld world("0 charger connected\n0 charger current_A 8", 3, config);
  world.run_with_master(500ms, 0x03);
  CHECK(current_mA(world) == Approx(13).margin(5));
  world.run_with_master(500ms, 0x0B);
  CHECK(current_mA(world) == Approx(-7'987).margin(5));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(13).margin(5));
  REQUIRE(world.simulator.apply("contactor charge welded"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(-7'987).margin(5));
  world.run_with_master(100ms, 0x00);
  CHECK(current_mA(world) == 0);
}

TEST_CASE("a charger that cannot be stopped goes on until a contactor opens", "[scenario][simulator]") {
  SmallWorld world("0 charger connected\n0 charger current_A 8");
  world.run_with_master(500ms, 0x03);
  REQUIRE(world.simulator.apply("charger unstoppable on"));
  REQUIRE(world.simulator.apply("charger current_A 2"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(-7'987).margin(5));
  REQUIRE(world.simulator.apply("charger disconnected"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) == Approx(-7'987).margin(5));
  CHECK(read_raw<pdu_status, "charger_connected">(*world.last(0x041)) == 0);
  world.run_with_master(100ms, 0x00);
  CHECK(current_mA(world) == 0);
  REQUIRE(world.simulator.apply("charger unstoppable off"));
  world.run_with_master(100ms, 0x03);
  CHECK(current_mA(world) >= 0);
}

CanFrame charge_limit(std::int64_t limit_A, std::uint32_t base_id = vehicle_bus::default_base_id) {
  CanFrame frame = make_frame(vehicle_bus::pack_current);
  frame.id += base_id - vehicle_bus::default_base_id;
  write<vehicle_bus::pack_current, "charge_limit_mA">(frame, limit_A * 1'000);
  return frame;
}

TEST_CASE("a charger gives no more than the vehicle is told, and nothing when nobody says so any more",
          "[scenario][simulator][charger]") {
  SmallWorld world("0 charger connected\n0 charger current_A 8");
  const auto charged_A = [&world](Duration duration) {
    world.run_with_master(duration, 0x03);
    return world.simulator.plant().charger_A();
  };
  CHECK(charged_A(500ms) == 8.0);  // no limit received: as set by hand
  world.simulator.observe_elsewhere(Port::vehicle, charge_limit(5), world.simulator.now());
  CHECK(charged_A(50ms) == 5.0);
  world.simulator.observe(charge_limit(20), world.simulator.now());  // the buses may share one interface
  CHECK(charged_A(50ms) == 8.0);
  CanFrame damaged = charge_limit(1);
  damaged.length = 5;
  world.simulator.observe_elsewhere(Port::vehicle, damaged, world.simulator.now());
  CHECK(charged_A(2'900ms) == 8.0);
  CHECK(charged_A(100ms) == 0.0);
  world.simulator.observe_elsewhere(Port::vehicle, charge_limit(0), world.simulator.now());
  CHECK(charged_A(50ms) == 0.0);
  SECTION("unless it obeys nobody") {
    REQUIRE(world.simulator.apply("charger obeys nobody"));
    CHECK(charged_A(50ms) == 8.0);
    REQUIRE(world.simulator.apply("charger obeys master"));
    CHECK(charged_A(50ms) == 0.0);
  }
  SECTION("or has run away") {
    REQUIRE(world.simulator.apply("charger runaway on"));
    CHECK(charged_A(50ms) == 8.0);
  }
  SECTION("or cannot be stopped") {
    world.simulator.observe_elsewhere(Port::vehicle, charge_limit(6), world.simulator.now());
    CHECK(charged_A(50ms) == 6.0);
    REQUIRE(world.simulator.apply("charger unstoppable on"));
    world.simulator.observe_elsewhere(Port::vehicle, charge_limit(0), world.simulator.now());
    CHECK(charged_A(50ms) == 6.0);
  }
}

TEST_CASE("a charger hears the master where that reports to", "[scenario][simulator][charger]") {
  SimulatorConfig config;
  config.report_base_id = 0x640;
  SmallWorld world("0 charger connected\n0 charger current_A 8", 3, config);
  world.simulator.observe_elsewhere(Port::vehicle, charge_limit(5), world.simulator.now());
  world.run_with_master(100ms, 0x03);
  CHECK(world.simulator.plant().charger_A() == 8.0);
  world.simulator.observe_elsewhere(Port::vehicle, charge_limit(5, 0x640), world.simulator.now());
  world.run_with_master(50ms, 0x03);
  CHECK(world.simulator.plant().charger_A() == 5.0);
}

TEST_CASE("a runaway charger fills the cells beyond their maximum", "[scenario][simulator]") {
  SmallWorld world(
      "0 pack soc_permille 1000\n0 cell 1.1 soc_permille 1000\n0 charger connected\n0 charger current_A 900");
  const auto pack_mV = [&world] { return read<sensor_u1, "pack_voltage_mV">(*world.last(0x522)).value; };
  world.run_with_master(10s, 0x03);
  CHECK(pack_mV() <= 153'000);  // 36 cells of 4.25 V
  REQUIRE(world.simulator.apply("charger runaway on"));
  world.run_with_master(10s, 0x03);
  CHECK(current_mA(world) < -899'000);
  CHECK(pack_mV() > 160'000);
}

TEST_CASE("a stuck temperature sensor stands still while its cells warm", "[scenario][simulator]") {
  SmallWorld world("", 3);
  world.run_with_master(1s, 0x03);
  const auto sensor_1_dC = [&world](std::uint8_t node) {
    return read<temp_1, "cell_temperature_1_dC">(*world.last(temp_1.base_id + node)).value;
  };
  const std::int64_t before_dC = sensor_1_dC(2);
  REQUIRE(world.simulator.apply("thermistor 2.1 stuck on"));
  world.run_with_master(1s, 0x03);
  REQUIRE(world.simulator.apply("pack temperature_dC 450"));
  world.run_with_master(1s, 0x03);
  CHECK(sensor_1_dC(2) == before_dC);
  CHECK(sensor_1_dC(3) > before_dC + 150);
  REQUIRE(world.simulator.apply("thermistor 2.1 state open"));  // its wire can break nevertheless
  world.run_with_master(1s, 0x03);
  CHECK(read<temp_1, "cell_temperature_1_dC">(*world.last(temp_1.base_id + 2)).validity == Validity::open_circuit);
  REQUIRE(world.simulator.apply("thermistor 2.1 state ok"));
  world.run_with_master(1s, 0x03);
  CHECK(sensor_1_dC(2) == before_dC);
  REQUIRE(world.simulator.apply("thermistor 2.1 stuck off"));
  world.run_with_master(1s, 0x03);
  CHECK(sensor_1_dC(2) == sensor_1_dC(3));
}

TEST_CASE("a stuck board sensor stands still while its board warms", "[scenario][simulator]") {
  SmallWorld world("1 board_thermistor 2.4 stuck on\n2 module 2 board_temperature_dC 700");
  world.run_with_master(1s, 0x03);
  const auto frame = [&world] { return *world.last(temp_2.base_id + 2); };
  const std::int64_t before_dC = read<temp_2, "board_temperature_4_dC">(frame()).value;
  world.run_with_master(3s, 0x03);
  CHECK(read<temp_2, "board_temperature_4_dC">(frame()).value == before_dC);
  CHECK(read<temp_2, "board_temperature_3_dC">(frame()).value >= 690);
}

TEST_CASE("a balancing switch that is stuck does what it likes, and its module says so", "[scenario][simulator]") {
  SmallWorld world("0.5 cell 2.3 balancing_switch stays_on");
  const auto told = [&world] { return read_raw<module, "balancing_cells">(*world.last(module.base_id + 2)); };
  const auto is_on = [&world](std::size_t cell) { return world.simulator.plant().cell(cell).balancing_siemens > 0.0; };
  world.run_with_master(400ms, 0x03);
  CHECK(told() == 0);
  world.run_with_master(400ms, 0x03);
  CHECK(told() == 0b100);
  CHECK(read_raw<status, "balancing">(*world.last(status.base_id + 2)) == 1);
  CHECK(is_on(14));  // the third of the second module
  REQUIRE(world.simulator.apply("cell 2.3 balancing_switch stays_off"));
  CanFrame frame = make_frame(command, 2);
  write<command, "operation">(frame, static_cast<std::int64_t>(Operation::balance));
  write<command, "balancing_time_3_s">(frame, 60);
  write<command, "balancing_time_5_s">(frame, 60);
  seal(command, 1, frame);
  world.simulator.observe(frame, world.simulator.now());
  world.run_with_master(2s, 0x03);
  CHECK(told() == 0b10000);
  CHECK_FALSE(is_on(14));
  CHECK(is_on(16));
  REQUIRE(world.simulator.apply("cell 2.3 balancing_switch auto"));
  world.run_with_master(200ms, 0x03);
  CHECK(told() == 0b10100);
  CHECK(is_on(14));
}

TEST_CASE("a module that ignores COMMANDs does none and answers none", "[scenario][simulator]") {
  SmallWorld world("0 module 2 commands ignored");
  const auto give = [&world](std::uint8_t node) {
    CanFrame frame = make_frame(command, node);
    write<command, "operation">(frame, static_cast<std::int64_t>(Operation::set_limits));
    write<command, "undervoltage_limit_uV">(frame, 2'800'000);
    write<command, "overvoltage_limit_uV">(frame, 4'200'000);
    seal(command, ++world.counter, frame);
    world.simulator.observe(frame, world.simulator.now());
    world.run_with_master(200ms, 0);
  };
  const auto has_limits = [&world](std::uint8_t node) {
    return read_raw<status, "limits_not_set">(*world.last(status.base_id + node)) == 0;
  };
  world.run_with_master(100ms, 0);
  give(2);
  CHECK_FALSE(has_limits(2));
  CHECK(world.count(response.base_id + 2) == 0);
  CHECK(world.count(status.base_id + 2) > 0);  // it answers POLLs
  give(0);
  CHECK_FALSE(has_limits(2));
  CHECK(has_limits(3));
  REQUIRE(world.simulator.apply("module 2 commands obeyed"));
  give(2);
  CHECK(has_limits(2));
  CHECK(world.count(response.base_id + 2) == 1);
}

TEST_CASE("a module says how many temperature sensors the script wants it to have", "[scenario][simulator]") {
  SmallWorld world("0 module 2 temperature_sensor_count 5");
  world.run_with_master(200ms, 0);
  const auto told = [&world](std::uint8_t node) {
    return read_raw<ident, "temperature_sensor_count">(*world.last(ident.base_id + node));
  };
  const auto real = told(3);
  CHECK(told(2) == 5);
  REQUIRE(world.simulator.apply("module 2 temperature_sensor_count auto"));
  world.run_with_master(200ms, 0);
  CHECK(told(2) == real);
}

TEST_CASE("a stuck cell says for ever the same, whatever it does and however noisy the rest is",
          "[scenario][simulator]") {
  SimulatorConfig config;
  config.cell_noise_uV = 500;
  SmallWorld world("", 3, config);
  world.run_with_master(1s, 0x03);
  const auto voltages = [&world] {
    world.run_with_master(200ms, 0x03);
    return std::pair{read<cells_3, "cell_voltage_7_uV">(*world.last(0x1C2)).value,
                     read<cells_3, "cell_voltage_8_uV">(*world.last(0x1C2)).value};
  };
  REQUIRE(world.simulator.apply("cell 2.7 stuck on"));
  const auto [stuck_uV, free_uV] = voltages();
  REQUIRE(world.simulator.apply("pack soc_permille 100"));
  for (int again = 0; again < 5; ++again) {
    const auto [seven_uV, eight_uV] = voltages();
    CHECK(seven_uV == stuck_uV);
    CHECK(eight_uV < free_uV - 100'000);
  }
  REQUIRE(world.simulator.apply("cell 2.7 stuck off"));
  CHECK(voltages().first < stuck_uV - 100'000);
}

TEST_CASE("an open wire nobody notices: one cell reads low, its neighbour as much high, nothing is flagged",
          "[scenario][simulator]") {
  SmallWorld world;
  const auto read_uV = [&world] {
    world.run_with_master(100ms, 0);
    return std::array{read<cells_2, "cell_voltage_6_uV">(*world.last(0x182)).value,
                      read<cells_3, "cell_voltage_7_uV">(*world.last(0x1C2)).value,
                      read<cells_3, "cell_voltage_8_uV">(*world.last(0x1C2)).value,
                      read<cells_3, "cell_voltage_9_uV">(*world.last(0x1C2)).value,
                      read<module, "module_voltage_mV">(*world.last(0x2C2)).value};
  };
  world.run_with_master(1s, 0);
  const auto before = read_uV();
  REQUIRE(world.simulator.apply("cell 2.7 wire open_silent"));
  world.run_with_master(200ms, 0);
  const auto drifting = read_uV();
  CHECK(drifting[1] < before[1] - 500'000);
  CHECK(drifting[1] + drifting[2] == Approx(before[1] + before[2]).margin(400));
  CHECK(drifting[0] == before[0]);
  CHECK(drifting[3] == before[3]);
  CHECK(drifting[4] == before[4]);
  world.run_with_master(10s, 0);
  const auto open = read_uV();
  CHECK(open[1] < 2'000);
  CHECK(open[2] == 5'000'000);  // the end of the front end's range
  CHECK(read_raw<status, "open_cell_wire">(*world.last(0x102)) == 0);
  CHECK(read_raw<module, "open_wire_cells">(*world.last(0x2C2)) == 0);
  REQUIRE(world.simulator.apply("cell 2.7 wire closed"));
  world.run_with_master(200ms, 0);
  CHECK(read_uV() == before);
  REQUIRE(world.simulator.apply("cell 2.12 wire open_silent"));  // the top wire has no cell above
  world.run_with_master(10s, 0);
  (void)read_uV();
  CHECK(read<cells_4, "cell_voltage_12_uV">(*world.last(0x202)).value < 2'000);
  CHECK(read<cells_1, "cell_voltage_1_uV">(*world.last(0x143)).value == before[0]);
}

TEST_CASE("faults of a module's transmitter can be scripted", "[scenario][simulator]") {
  SmallWorld world;
  world.run_with_master(1s, 0);
  const auto apply = [&world](std::string_view event) {
    REQUIRE(world.simulator.apply(event));
    world.heard.clear();
    world.run_with_master(1s, 0);
  };
  apply("module 3 sends_as_node 2");
  CHECK(world.count(0x103) == 0);
  CHECK(world.count(0x102) == 20);
  apply("module 3 sends_as_node auto");
  CHECK(world.count(0x103) == 10);
  CHECK(world.count(0x102) == 10);
  apply("module 3 omits cells");
  CHECK(world.count(0x143) == 0);
  CHECK(world.count(0x103) == 10);
  apply("module 3 omits nothing");
  CHECK(world.count(0x143) == 10);
  apply("module 3 cell_count 11");
  CHECK(read_raw<status, "cell_count">(*world.last(0x103)) == 11);
  apply("module 3 cell_count auto");
  CHECK(read_raw<status, "cell_count">(*world.last(0x103)) == 12);
  apply("module 3 protocol_version 2");
  CHECK(read_raw<ident, "protocol_version">(*world.last(0x303)) == 2);
  apply("module 3 serial_number 4294967295");
  CHECK(read_raw<ident, "serial_number">(*world.last(0x303)) == 4'294'967'295);
  CHECK(read_raw<ident, "serial_number">(*world.last(0x302)) == 1002);
  apply("module 3 frozen_counter on");
  CHECK(world.last(0x103)->data[6] != world.poll_counter);
  CHECK(world.last(0x102)->data[6] == world.poll_counter);
  apply("module 3 frozen_counter off");
  CHECK(world.last(0x103)->data[6] == world.poll_counter);
  REQUIRE(world.simulator.apply("module 3 stuck on"));
  REQUIRE(world.simulator.apply("module 2 replay on"));
  apply("pack soc_permille 100");
  const auto first_cell_uV = [&world](std::uint32_t id) {
    return read<cells_1, "cell_voltage_1_uV">(*world.last(id)).value;
  };
  CHECK(first_cell_uV(0x143) > first_cell_uV(0x141) + 100'000);
  CHECK(first_cell_uV(0x142) > first_cell_uV(0x141) + 100'000);
  CHECK(world.last(0x103)->data[6] == world.poll_counter);
  CHECK(world.last(0x102)->data[6] != world.poll_counter);
}

TEST_CASE("a slow module answers late by its delay", "[scenario][simulator]") {
  SmallWorld world;
  world.run(1s);
  const auto answer_after = [&world](std::uint8_t counter) {
    const TimePoint polled_at = world.simulator.now();
    world.heard.clear();
    world.simulator.observe(poll_frame(0, want_status, counter), polled_at);
    world.run(400ms);
    const auto answer = std::find_if(world.heard.begin(), world.heard.end(),
                                     [](const SentFrame& sent) { return sent.frame.id == 0x103; });
    REQUIRE(answer != world.heard.end());
    return answer->at - polled_at;
  };
  CHECK(answer_after(1) == 1ms);
  REQUIRE(world.simulator.apply("module 3 delay_ms 250"));
  CHECK(answer_after(2) == 251ms);
}

TEST_CASE("a stranger answers beside the module whose node it took, or where nobody is", "[scenario][simulator]") {
  SmallWorld world("1 stranger 3 connected\n1 stranger 9 connected");
  world.run_with_master(1s, 0);
  CHECK(world.count(0x109) == 0);
  world.heard.clear();
  world.run(1ms);
  world.run_with_master(1s, 0);
  CHECK(world.count(0x109) == 10);
  CHECK(world.count(0x103) == 20);
  CHECK(read_raw<ident, "serial_number">(*world.last(0x309)) == 900'009);
  CHECK(read<cells_1, "cell_voltage_1_uV">(*world.last(0x149)).value == 3'600'000);
  bool is_interleaved = false;
  std::vector<std::int64_t> serials;
  for (std::size_t index = 1; index < world.heard.size(); ++index) {
    const CanFrame& frame = world.heard[index].frame;
    is_interleaved = is_interleaved || (frame.id == 0x143 && world.heard[index - 1].frame.id == 0x143);
    if (frame.id == 0x303) serials.push_back(read_raw<ident, "serial_number">(frame));
  }
  CHECK(is_interleaved);
  CHECK(std::count(serials.begin(), serials.end(), 1003) == 10);
  CHECK(std::count(serials.begin(), serials.end(), 900'003) == 11);  // and the unsolicited one

  ReceiveCheck check(catalogue, ReceiveCheck::Role::listener);
  std::size_t conflicting = 0;
  for (const SentFrame& sent : world.heard) {
    const CheckedFrame checked = check.check(sent.frame);
    if (!checked.is_accepted && checked.reason == RejectReason::conflicting) ++conflicting;
  }
  CHECK(conflicting > 20);

  REQUIRE(world.simulator.apply("stranger 3 disconnected"));
  REQUIRE(world.simulator.apply("stranger 9 disconnected"));
  world.heard.clear();
  world.run_with_master(1s, 0);
  CHECK(world.count(0x109) == 0);
  CHECK(world.count(0x103) == 10);
}

TEST_CASE("sleeping modules rest on a quiet bus, wake by any frame, and do not keep each other awake",
          "[scenario][simulator][MMU_S]") {
  SmallWorld world("0 pdu silent\n0 sensor current silent\n0 sensor pack_voltage silent\n0 sensor link_voltage silent");
  const auto asleep = [&world] {
    int count = 0;
    for (std::size_t module = 0; module < 3; ++module) count += world.simulator.mmu(module).is_asleep() ? 1 : 0;
    return count;
  };
  world.run(1s);
  world.simulator.observe(command_frame(0, 1, {1, 3, 0}), world.simulator.now());
  world.run(20ms);
  REQUIRE(asleep() == 3);
  world.heard.clear();
  world.run(5s);
  CHECK(asleep() == 3);
  CHECK(world.heard.empty());

  REQUIRE(world.simulator.apply("pdu talking"));
  world.run(60ms);
  REQUIRE(asleep() == 0);
  REQUIRE(world.simulator.apply("pdu silent"));
  world.run(100ms);
  for (std::uint32_t node = 1; node <= 3; ++node) CHECK(world.count(0x300 + node) == 1);
  world.heard.clear();
  world.run(1s);
  CHECK(asleep() == 3);
  world.run(5s);
  CHECK(asleep() == 3);
  CHECK(world.heard.empty());

  world.simulator.observe(poll_frame(0, want_status, 200), world.simulator.now());
  world.run(100ms);
  CHECK(asleep() == 0);
  CHECK(world.heard.size() == 3);  // the frame that wakes is lost; each sends its IDENT
  world.simulator.observe(poll_frame(0, want_status, 201), world.simulator.now());
  world.run(100ms);
  for (std::uint32_t node = 1; node <= 3; ++node) {
    CHECK(world.count(0x100 + node) == 1);
    CHECK(world.count(0x300 + node) == 1);
  }
}

TEST_CASE("every property can be applied, ramped from the present, and released", "[scenario][simulator]") {
  const std::string address_of[] = {"", " 3", " 3.2", " 3.2", ""};
  SimulatorConfig config;
  config.second_pack.base_id = 0x640;
  config.charger = find_device("brusa_nlg5")->charger;  // it can report every trouble
  config.charger_units = charger_units_max;
  config.inverter = find_device("sma")->inverter;
  config.request_id = 0x745;
  SmallWorld world("", 3, config);
  world.run(100ms);
  for (const PropertySpec& row : property_table()) {
    if (row.target == TargetKind::master) continue;                                   // there is none
    if (row.need == ModuleNeed::foreign || row.need == ModuleNeed::errors) continue;  // foreign_modules_test.cpp
    // For devices that only some packs have on a bus: foreign_sensors_test.cpp.
    if (row.target == TargetKind::sensor_unit || row.property == Property::insulation_self_test) continue;
    const TargetSpec& target = target_table()[static_cast<std::size_t>(row.target)];
    std::string start = std::string(target.name) + address_of[static_cast<std::size_t>(target.address)];
    if (target.address == Address::word) {
      const std::string only(row.only_for.substr(0, row.only_for.find(' ')));
      start += " " + (only.empty() ? std::string(target.words[0]) : only);
    }
    start += " " + std::string(row.name);
    std::vector<std::string> values;
    if (row.kind == ValueKind::none) values = {""};
    if (row.kind == ValueKind::number || row.kind == ValueKind::number_or_auto) {
      values = {" " + std::to_string(row.min), " .." + std::to_string(row.max) + " over 0.01"};
    }
    if (is_count(row.kind)) values = {" " + std::to_string(row.min), " " + std::to_string(row.max)};
    if (may_be_auto(row.kind)) values.emplace_back(" auto");
    for (const std::string_view word : row.words) values.push_back(" " + std::string(word));
    for (const std::string& value : values) {
      const auto applied = world.simulator.apply(start + value);
      INFO(start + value +
           (applied ? "" : ": found '" + applied.error().found + "', expected " + applied.error().wanted));
      REQUIRE(applied);
      world.run(12ms);
    }
  }
  world.run_with_master(1s, 0x03);
  CHECK(std::isfinite(world.simulator.plant().link_V()));
}

TEST_CASE("63 modules of 12 cells with a master are simulated faster than real time",
          "[scenario][simulator][performance]") {
  SimulatorConfig config;
  config.cell_noise_uV = 200;
  SmallWorld world("0 stranger 5 connected\n0 module 7 delay_ms 500\n0 cell 9.3 wire open_silent", 63, config);
  world.heard.reserve(30'000);
  const double before_s = test::processor_time_s();
  world.run_with_master(2s, 0x03);
  const double took_s = test::processor_time_s() - before_s;
  std::printf("simulator: 63 modules, 2 s in %.1f ms of processor time: %.0f times real time\n", took_s * 1e3,
              2.0 / took_s);
  CHECK(took_s < 2.0);
  CHECK(world.heard.size() > 10'000);
}

TEST_CASE("a charger that obeys nobody says what flows, and into open contactors nothing does",
          "[scenario][simulator]") {
  const ChargerDriver& elcon = *find_device("elcon_tc")->charger;
  SimulatorConfig config;
  config.charger = &elcon;
  SmallWorld world("0 charger current_A 24\n0 charger connected\n0 charger obeys nobody", 3, config);
  const auto told_mA = [&]() -> std::int64_t {
    std::array<ChargerReport, charger_units_max> reports{};
    for (const SentFrame& sent : world.heard) static_cast<void>(elcon.take(sent.frame, reports));
    REQUIRE(reports[0].current_mA.is_valid());
    return reports[0].current_mA.value;
  };
  world.run_with_master(5s, 0x00);
  CHECK(world.simulator.plant().charger_A() == 0.0);
  CHECK(told_mA() == 0);
  world.run_with_master(5s, 0x03);
  CHECK(world.simulator.plant().charger_A() == Approx(24.0));
  CHECK(told_mA() == 24'000);
}

TEST_CASE("an event for what this pack does not have is refused with its place", "[scenario][simulator]") {
  const SimulatorConfig config = simulator_config(pack_of(2));
  const Scenario scenario = *parse_scenario("1 cell 2.7 voltage_mV 1\n2   module 3 silent\n");
  const ScenarioProblems problems = check_against(scenario, config);
  REQUIRE(problems.size() == 1);
  CHECK(problems[0].line == 2);
  CHECK(problems[0].column == 5);
  const Scenario others = *parse_scenario(
      "1 inverter silent\n2 charger mains off\n3 charger post on\n4 charger obeys nobody\n"
      "wait inverter current_A > 1 within 5\n");
  const ScenarioProblems of_others = check_against(others, config);
  REQUIRE(of_others.size() == 4);
  CHECK(to_text(of_others[0], "s.scn") ==
        "s.scn:1:3: found 'inverter silent', expected an inverter: the pack file names none in inverter/protocol");
  CHECK(of_others[1].line == 2);
  CHECK(of_others[1].wanted.find("charger/protocol") != std::string::npos);
  CHECK(of_others[2].line == 3);
  CHECK(of_others[3].line == 5);
  SimulatorConfig with_both = config;
  with_both.charger = find_device("elcon_tc")->charger;
  with_both.inverter = find_device("sma")->inverter;
  CHECK(check_against(others, with_both).empty());
  with_both.charger_units = 2;
  const Scenario of_chargers = *parse_scenario(
      "1 charger units 2\n2 charger units 3\n3 charger trouble no_battery\n4 charger trouble output_overvoltage\n");
  const ScenarioProblems beyond = check_against(of_chargers, with_both);
  REQUIRE(beyond.size() == 2);
  CHECK(to_text(beyond[0], "s.scn") ==
        "s.scn:2:3: found 'charger units 3', expected units this pack has: 0 to 2 (charger/units)");
  CHECK(to_text(beyond[1], "s.scn") ==
        "s.scn:4:3: found 'charger trouble output_overvoltage', expected a trouble that elcon_tc has a word for: none, "
        "hardware, too_hot, mains, no_command, no_battery");
  with_both.charger = find_device("brusa_nlg5")->charger;
  CHECK(check_against(of_chargers, with_both).size() == 1);
  SmallWorld world("", 2);
  CHECK_FALSE(world.simulator.apply("inverter failed on"));
  CHECK_FALSE(world.simulator.apply("module 3 silent"));
  CHECK_FALSE(world.simulator.apply("module 3 sielnt"));
}

}  // namespace
}  // namespace bmu
