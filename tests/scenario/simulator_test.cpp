// The emulated world as a whole, without a master: the master's frames are sent by hand.
#include "mmu/simulator.hpp"

#include <algorithm>

#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

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

/// A simulator and the least master: it polls and commands when told to, and keeps what it hears.
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
    return full;
  }
};

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
  CHECK(world.simulator.is_script_over());
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
  CHECK(read<pdu_status, "insulation_resistance_Ohm">(*world.last(0x041)).value == 40'000);
  CHECK(read_raw<pdu_status, "insulation_monitor_ok">(*world.last(0x041)) == 0);
  REQUIRE(world.simulator.apply("insulation monitor no_signal"));
  world.run(1ms);
  CHECK_FALSE(read<pdu_status, "insulation_resistance_Ohm">(*world.last(0x041)).is_valid());
}

TEST_CASE("every property can be applied, ramped from the present, and released", "[scenario][simulator]") {
  const std::string address_of[] = {"", " 3", " 3.2", " 3.2", ""};
  SmallWorld world;
  world.run(100ms);
  for (const PropertySpec& row : property_table()) {
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
    if (row.kind == ValueKind::number_or_auto) values.emplace_back(" auto");
    for (const std::string_view word : row.words) values.push_back(" " + std::string(word));
    for (const std::string& value : values) {
      INFO(start + value);
      REQUIRE(world.simulator.apply(start + value));
      world.run(12ms);
    }
  }
  world.run_with_master(1s, 0x03);
  CHECK(std::isfinite(world.simulator.plant().link_V()));
}

TEST_CASE("an event for what this pack does not have is refused with its place", "[scenario][simulator]") {
  const SimulatorConfig config = simulator_config(pack_of(2));
  const Scenario scenario = *parse_scenario("1 cell 2.7 voltage_mV 1\n2   module 3 silent\n");
  const ScenarioProblems problems = check_against(scenario, config);
  REQUIRE(problems.size() == 1);
  CHECK(problems[0].line == 2);
  CHECK(problems[0].column == 5);
  SmallWorld world("", 2);
  CHECK_FALSE(world.simulator.apply("module 3 silent"));
  CHECK_FALSE(world.simulator.apply("module 3 sielnt"));
}

}  // namespace
}  // namespace bmu
