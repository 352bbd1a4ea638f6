// The emulated pack with modules of other makers in place of MMUs, polled by their driver: their measurements, what a
// script can and cannot change in them, and the effect of their bleeding on the pack.
#include <algorithm>

#include "devices/device_list.hpp"
#include "mmu/scenario/simulator.hpp"
#include "protocol/receive_check.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

const std::string_view makers[] = {"i3_csc", "outlander_cmu"};

/// Three modules, as many cells and sensors on each as there can be.
CoreConfig pack_of(std::string_view maker) {
  CoreConfig pack;
  pack.foreign.driver = find_device(maker)->modules;
  for (std::uint8_t node = 1; node <= 3; ++node) {
    pack.modules.push_back({.node = node,
                            .cell_count = pack.foreign.driver->cell_count_max,
                            .temperature_sensor_count = pack.foreign.driver->temperature_count_max});
  }
  pack.cell.ocv.push_back({0, 3'000'000});
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

/// An emulated pack and a minimal master: it polls in every round of the car, and stores all received frames.
class ForeignWorld {
 public:
  explicit ForeignWorld(std::string_view maker, std::string_view script = "", std::uint64_t seed = 0)
      : driver(*find_device(maker)->modules),
        device(*find_device(maker)),
        simulator(config_of(maker, seed), *parse_scenario(script), power_up) {}

  void run(Duration duration, std::optional<std::int32_t> bleed_above_uV = std::nullopt) {
    for (const TimePoint end = simulator.now() + duration; simulator.now() < end;) {
      ask(bleed_above_uV);
      hear(driver.round_min);
    }
  }
  void hear(Duration duration) {
    for (const TimePoint end = simulator.now() + duration; simulator.now() < end;) {
      for (const SentFrame& sent : simulator.advance(simulator.now() + 1ms)) heard.push_back(sent);
    }
  }
  void ask(std::optional<std::int32_t> bleed_above_uV) {
    for (std::uint8_t node = driver.asks_each ? 1 : 0; node <= (driver.asks_each ? 3 : 0); ++node) {
      const ModuleQuestion question{.node = node, .bleed_above_uV = bleed_above_uV};
      simulator.observe(driver.ask(question, round, {}), simulator.now());
    }
    ++round;
  }
  /// Latest measurements of the module, combined from its frames.
  [[nodiscard]] ModuleMeasurements last(std::uint8_t node) const {
    ModuleMeasurements all;
    for (const SentFrame& sent : heard) {
      const ModuleReport report = driver.take(sent.frame, {});
      if (report.node != node) continue;
      if ((report.parts & bit_of(ModulePart::status)) != 0) {
        all.bleeding_cells = report.bleeding_cells;
        all.errors = report.errors;
      }
      std::copy(report.cell_voltage_uV.begin(), report.cell_voltage_uV.end(),
                all.cell_voltage_uV.begin() + report.first_cell);
      std::copy(report.cell_temperature_dC.begin(), report.cell_temperature_dC.end(), all.cell_temperature_dC.begin());
      if (report.board_temperature_dC) all.board_temperature_dC = *report.board_temperature_dC;
    }
    return all;
  }
  [[nodiscard]] std::size_t count_of(std::uint8_t node) const {
    return static_cast<std::size_t>(std::count_if(heard.begin(), heard.end(), [&](const SentFrame& sent) {
      const ModuleReport report = driver.take(sent.frame, {});
      return report.node == node && (report.parts & bit_of(ModulePart::status)) != 0;
    }));
  }
  void apply(std::string_view event) {
    INFO(event);
    REQUIRE(simulator.apply(event));
  }

  const ModuleDriver& driver;
  const Device& device;
  Simulator simulator;
  std::vector<SentFrame> heard;
  std::uint32_t round = 0;

 private:
  static SimulatorConfig config_of(std::string_view maker, std::uint64_t seed) {
    SimulatorConfig config = simulator_config(pack_of(maker));
    config.seed = seed;
    config.cell_noise_uV = seed == 0 ? 0 : 200;
    return config;
  }
};

std::string wanted_by(std::string_view maker, std::string_view line) {
  const ScenarioProblems problems = check_against(*parse_scenario(line), simulator_config(pack_of(maker)));
  return problems.empty() ? "" : problems.front().wanted;
}

bool has(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

TEST_CASE("the emulated modules are those of the pack's maker", "[scenario][simulator][foreign]") {
  CoreConfig pack = pack_of("outlander_cmu");
  pack.foreign.options.swaps_cell_frames = true;
  const SimulatorConfig config = simulator_config(pack);
  CHECK(config.foreign.driver == find_device("outlander_cmu")->modules);
  CHECK(config.foreign.options.swaps_cell_frames);
  REQUIRE(config.modules.size() == 3);
  CHECK(config.modules[0].temperature_sensor_count == 5);
  CHECK(config.modules[0].board_sensor_count == 0);
  CHECK(simulator_config(pack_of("i3_csc")).modules[0].board_sensor_count == 1);
  pack.foreign.driver = nullptr;
  CHECK(simulator_config(pack).foreign.driver == nullptr);
  CHECK(simulator_config(pack).modules[0].board_sensor_count == 4);
}

TEST_CASE("each module says what its cells and sensors have, in whole frames, and nobody answers a POLL",
          "[scenario][simulator][foreign]") {
  for (const std::string_view maker : makers) {
    INFO(maker);
    ForeignWorld world(maker, "0 pack soc_permille 500\n0 cell 2.7 soc_permille 600\n0 cell 3.1 temperature_dC 450");
    world.simulator.observe(poll_frame(0, want_all, 1), world.simulator.now());
    world.hear(500ms);
    for (std::uint8_t node = 1; node <= 3; ++node) CHECK(world.count_of(node) == 0);
    CHECK(world.simulator.counts().polls_answered == 0);
    world.run(1s);
    for (const SentFrame& sent : world.heard) {
      const MessageMatch match = world.device.catalogue->find(sent.frame);
      if (match.message != nullptr) CHECK_FALSE(content_fault(*match.message, sent.frame));
    }
    for (std::uint8_t node = 1; node <= 3; ++node) {
      CHECK(world.count_of(node) > 20);
      for (std::size_t cell = 0; cell < world.driver.cell_count_max; ++cell) {
        const std::int64_t wanted_mV = node == 2 && cell == 6 ? 3'720 : 3'600;
        CHECK(world.last(node).cell_voltage_uV[cell] == known(wanted_mV * 1'000));
      }
    }
    CHECK(world.simulator.counts().polls_answered > 20);
    CHECK(world.last(3).cell_temperature_dC[0] == known(450));
    CHECK(world.last(3).cell_temperature_dC[world.driver.temperature_count_max - 1U] == known(250));
    if (world.driver.has_board_temperature) CHECK(world.last(1).board_temperature_dC.is_valid());
  }
}

TEST_CASE("what such a module bleeds flows, and is told, a cell reads a little low the while",
          "[scenario][simulator][foreign]") {
  for (const std::string_view maker : makers) {
    INFO(maker);
    ForeignWorld world(maker, "0 pack soc_permille 500\n0 cell 2.3 soc_permille 520");
    world.run(500ms, 3'610'000);
    CHECK(world.last(2).bleeding_cells == 0b100);
    CHECK(world.last(1).bleeding_cells == 0);
    CHECK(world.simulator.can_module(1).bleeding_cells() == 0b100);
    const std::size_t cell = world.simulator.plant().first_cell(1) + 2;
    CHECK(world.simulator.plant().cell(cell).balancing_siemens > 0.0);
    CHECK(world.last(2).cell_voltage_uV[2] == known(3'622'000));
    const double charge = world.simulator.plant().cell(cell).soc;
    world.run(10s, 3'610'000);
    CHECK(world.simulator.plant().cell(cell).soc < charge);
    // Without a master it goes on for about ten seconds.
    world.hear(9s);
    CHECK(world.simulator.plant().cell(cell).balancing_siemens > 0.0);
    world.hear(2s);
    CHECK(world.simulator.plant().cell(cell).balancing_siemens == 0.0);
  }
}

TEST_CASE("switches that are stuck bleed or do not, and the module says how they stand",
          "[scenario][simulator][foreign]") {
  for (const std::string_view maker : makers) {
    INFO(maker);
    ForeignWorld world(maker, "0 pack soc_permille 500\n0 cell 2.3 soc_permille 520");
    world.apply("cell 2.3 balancing_switch stays_off");
    world.apply("cell 2.5 balancing_switch stays_on");
    world.run(500ms, 3'610'000);
    CHECK(world.simulator.can_module(1).bleeding_cells() == 0b100);
    CHECK(world.last(2).bleeding_cells == 0b10000);
    const std::size_t first = world.simulator.plant().first_cell(1);
    CHECK(world.simulator.plant().cell(first + 2).balancing_siemens == 0.0);
    CHECK(world.simulator.plant().cell(first + 4).balancing_siemens > 0.0);
  }
}

TEST_CASE("faults of a channel reach modules of other makers like ours", "[scenario][simulator][foreign]") {
  for (const std::string_view maker : makers) {
    INFO(maker);
    ForeignWorld world(maker, "0 pack soc_permille 500");
    world.apply("cell 1.1 voltage_mV 2700");
    world.apply("cell 1.2 offset_mV 30");
    world.apply("cell 1.5 wire open");
    world.apply("cell 2.4 out_of_range on");
    world.apply("cell 3.4 wire open_silent");
    world.apply("thermistor 1.1 state open");
    world.apply("thermistor 1.2 state shorted");
    world.apply("thermistor 2." + std::to_string(world.driver.temperature_count_max) + " state open");
    world.run(200ms);
    world.apply("cell 2.6 stuck on");
    world.apply("cell 2.6 soc_permille 900");
    world.run(8s);
    const ModuleMeasurements one = world.last(1);
    CHECK(one.cell_voltage_uV[0] == known(2'700'000));
    CHECK(one.cell_voltage_uV[1] == known(3'630'000));
    CHECK(one.cell_voltage_uV[3] == known(3'600'000));
    CHECK(one.cell_voltage_uV[4].validity == Validity::out_of_range);
    CHECK(one.cell_voltage_uV[5].validity == Validity::out_of_range);
    CHECK(one.cell_voltage_uV[6] == known(3'600'000));
    CHECK_FALSE(one.cell_temperature_dC[0].is_valid());
    CHECK_FALSE(one.cell_temperature_dC[1].is_valid());
    CHECK(one.cell_temperature_dC[2] == known(250));
    CHECK_FALSE(world.last(2).cell_temperature_dC[world.driver.temperature_count_max - 1U].is_valid());
    CHECK(world.last(2).cell_voltage_uV[3].validity == Validity::out_of_range);
    CHECK(world.last(2).cell_voltage_uV[5] == known(3'600'000));
    CHECK(world.last(3).cell_voltage_uV[3].value < 100'000);
    CHECK(world.last(3).cell_voltage_uV[4] == known(5'000'000));
    world.apply("cell 2.4 out_of_range off");
    world.apply("cell 1.5 wire closed");
    world.run(200ms);
    CHECK(world.last(2).cell_voltage_uV[3] == known(3'600'000));
    CHECK(world.last(1).cell_voltage_uV[5] == known(3'600'000));
  }
}

TEST_CASE("modules of other makers fall silent, stand still and complain as a script wants",
          "[scenario][simulator][foreign]") {
  ForeignWorld world("i3_csc", "0 pack soc_permille 500");
  world.apply("module 1 silent");
  world.apply("module 2 errors 305419896");
  world.apply("module 2 board_temperature_dC 800");
  world.apply("module 3 frozen_counter on");
  world.run(200ms);
  CHECK(world.count_of(1) == 0);
  CHECK(world.last(2).errors == 0x1234'5678);
  CHECK(world.last(2).board_temperature_dC == known(800));
  std::size_t distinct = 0;
  std::array<bool, 16> seen{};
  for (const SentFrame& sent : world.heard) {
    if (sent.frame.id == 0x102) distinct += std::exchange(seen[sent.frame.data[6] >> 4U], true) ? 0U : 1U;
  }
  CHECK(distinct == 1);
  world.apply("module 1 talking");
  world.apply("module 3 damaged_frames on");
  world.heard.clear();
  world.run(200ms);
  CHECK(world.count_of(1) > 5);
  for (const SentFrame& sent : world.heard) {
    const MessageMatch match = world.device.catalogue->find(sent.frame);
    if (match.message == nullptr || !has_crc(*match.message)) continue;
    CHECK(content_fault(*match.message, sent.frame).has_value() == (match.node == 2));
  }
  ForeignWorld other("outlander_cmu");
  other.apply("module 2 sends_as_node 9");
  other.apply("module 1 delay_ms 100");
  other.apply("module 3 omits cells");
  other.run(80ms);
  CHECK(other.count_of(9) > 0);
  CHECK(other.count_of(2) == 0);
  CHECK(other.count_of(1) == 0);
  CHECK_FALSE(other.last(3).cell_voltage_uV[0].is_valid());
  other.run(200ms);
  CHECK(other.count_of(1) > 0);
}

TEST_CASE("the script's conditions look at modules of other makers, too", "[scenario][script][foreign]") {
  ForeignWorld world("i3_csc",
                     "0 pack soc_permille 500\n0 cell 2.3 soc_permille 520\n"
                     "0 wait module 2 mode = normal within 0.1\n"
                     "wait frame 0x101 within 1\n"  // as long as an MMU's, but with another checksum
                     "wait cell 2.3 balancing within 1\n"
                     "+0 never frame 0x107 for 0.2\n"
                     "+0.3 expect cell 2.3 voltage_mV > 3620\n"
                     "pass");
  world.run(1s, 3'610'000);
  world.simulator.script().conclude(world.simulator.now());
  INFO(world.simulator.script().failure());
  CHECK(world.simulator.script().verdict() == ScriptVerdict::passed);
}

TEST_CASE("what cannot be of such modules is refused, with whose it is", "[scenario][simulator][foreign]") {
  struct Case {
    const char* line;
    const char* i3;  // part of the expected text; empty: accepted
    const char* outlander;
  };
  const Case cases[] = {
      {"1 module 2 silent", "", ""},
      {"1 module 2 restart", "(i3_csc): only our own modules have this one", "(outlander_cmu): only our own modules"},
      {"1 module 2 damaged_frames on", "", "only modules whose frames have a checksum"},
      {"1 module 2 frozen_counter on", "", "only modules whose frames have a checksum"},
      {"1 module 2 errors 1", "", "only modules of other makers that report errors"},
      {"1 module 2 board_temperature_dC 10", "", "only modules with a sensor on their board"},
      {"1 board_thermistor 2.1 state open", "", "only modules with a sensor on their board"},
      {"1 board_thermistor 2.2 state open", "sensor 1 to 1 on that module's board", "a sensor on their board"},
      {"1 thermistor 2.5 state open", "sensor 1 to 4 of that module", ""},
      {"1 stranger 2 connected", "only our own modules", "only our own modules"},
      {"1 module 2 sends_as_node 8", "", ""},
      {"1 module 2 sends_as_node 9", "a node 1 to 8, which modules of i3_csc can have", ""},
      {"1 module 2 sends_as_node random 1..12", "a node 1 to 8", "a node 1 to 11"},
      {"1 module 2 sends_as_node auto", "", ""},
      {"1 module 2 omits nothing", "", ""},
      {"1 module 2 omits status", "", ""},
      {"1 module 2 omits module", "", "these have none of that kind"},
      {"1 module 2 omits ident", "these have none of that kind", "these have none of that kind"},
      {"1 cell 2.9 stuck on", "", "cell 1 to 8 of that module"},
      {"1 cell 2.8 out_of_range on", "", ""},
      {"1 module 4 silent", "it has no node 4", "it has no node 4"},
      {"1 wait frame STATUS 3 within 1", "a frame by its identifier, as in frame 0x103",
       "modules of outlander_cmu have none"},
      {"1 wait frame POLL within 1", "a frame by its identifier", "a frame by its identifier"},
      {"1 wait frame 0x103 within 1", "", ""},
      {"1 wait frame 0x103 cell_count = 1 within 1", "a frame by its identifier", "a frame by its identifier"},
      {"1 wait frame CONTACTOR_COMMAND within 1", "", ""},
      {"1 expect module 2 mode = normal", "", ""},
  };
  for (const Case& one : cases) {
    INFO(one.line);
    for (const bool is_i3 : {true, false}) {
      const std::string_view wanted = is_i3 ? one.i3 : one.outlander;
      const std::string found = wanted_by(is_i3 ? "i3_csc" : "outlander_cmu", one.line);
      INFO(found);
      CHECK((wanted.empty() ? found.empty() : has(found, wanted)));
    }
  }
}

TEST_CASE("at once a script can do to modules of other makers what it could in a file, and no more",
          "[scenario][simulator][foreign]") {
  const std::string address_of[] = {"", " 3", " 3.1", " 3.1", ""};
  for (const std::string_view maker : makers) {
    ForeignWorld world(maker);
    for (const PropertySpec& row : property_table()) {
      const bool is_of_modules = row.target == TargetKind::cell || row.target == TargetKind::module ||
                                 row.target == TargetKind::thermistor || row.target == TargetKind::board_thermistor ||
                                 row.target == TargetKind::stranger;
      if (!is_of_modules) continue;
      const TargetSpec& target = target_table()[static_cast<std::size_t>(row.target)];
      std::string event =
          std::string(target.name) + address_of[static_cast<std::size_t>(target.address)] + " " + std::string(row.name);
      if (row.kind == ValueKind::word) event += " " + std::string(row.words[0]);
      if (row.kind != ValueKind::word && row.kind != ValueKind::none)
        event += " " + std::to_string(row.max > 8 && row.property == Property::module_sends_as_node ? 8.0 : row.max);
      INFO(maker << ": " << event);
      const bool is_possible = wanted_by(maker, "1 " + event).empty();
      CHECK(world.simulator.apply(event).has_value() == is_possible);
      if (row.need == ModuleNeed::ours) CHECK_FALSE(is_possible);
      if (row.need == ModuleNeed::any || row.need == ModuleNeed::foreign) CHECK(is_possible);
      world.run(50ms);
    }
  }
  // This project's own modules have none of their properties.
  CoreConfig ours = pack_of("i3_csc");
  ours.foreign.driver = nullptr;
  Simulator simulator(simulator_config(ours), {}, power_up);
  for (const std::string_view event : {"cell 1.1 out_of_range on", "module 1 errors 1"}) {
    const auto applied = simulator.apply(event);
    REQUIRE_FALSE(applied);
    CHECK(has(applied.error().wanted, "(ours): only modules of other makers"));
  }
}

TEST_CASE("the same seed gives the same frames of such modules, another seed others",
          "[scenario][simulator][foreign]") {
  const auto frames_of = [](std::string_view maker, std::uint64_t seed) {
    ForeignWorld world(maker, "0 pack soc_permille random 300..700", seed);
    world.run(500ms, 3'600'000);
    std::vector<CanFrame> frames;
    for (const SentFrame& sent : world.heard) frames.push_back(sent.frame);
    return frames;
  };
  for (const std::string_view maker : makers) {
    CHECK(frames_of(maker, 7) == frames_of(maker, 7));
    CHECK(frames_of(maker, 7) != frames_of(maker, 8));
  }
}

TEST_CASE("a world of such modules at work allocates nothing", "[scenario][simulator][foreign]") {
  for (const std::string_view maker : makers) {
    ForeignWorld world(maker, "0 module 1 delay_ms 500\n0.1 cell 2.3 wire open\n0.2 module 2 replay on");
    world.heard.reserve(20'000);
    const std::uint64_t before = allocation_count();
    world.run(3s, 3'000'000);
    CHECK(allocation_count() == before);
    CHECK(world.heard.size() > 500);
  }
}

}  // namespace
}  // namespace bmu
