// Packs with modules of another maker, from the pack file to the emulated cells: they close, and open for faults.
#include <algorithm>
#include <optional>
#include <string>

#include "config/pack_config.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;
using test::SimRun;

namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/") + name);
  REQUIRE(pack.has_value());
  return pack->core;
}
/// Balances with open contactors, too, and after a shorter rest.
CoreConfig balancing_soon(const std::string& name) {
  CoreConfig config = shipped(name);
  config.balancing.requires_closed = false;
  config.balancing.settle = 2s;
  return config;
}
constexpr const char* packs[] = {"outlander-80s.json", "i3-96s.json"};

/// Closed, with a load, at 5.5 s.
SimRun closed(const CoreConfig& config) {
  SimRun run(config);
  run.apply("pack soc_permille 700");
  run.run_to(2.5);  // the state of charge requires a second of rest with all cells valid
  run.apply("vehicle on");
  run.run_to(4.5);
  run.apply("load current_A 5");
  run.run_to(5.5);
  INFO("blockers " << run.core().permission().blockers.size());
  REQUIRE(run.core().sequence().phase == Phase::closed);
  return run;
}

bool is_present(const SimRun& run, FaultId fault) {
  return run.core().faults().state(fault).is_present();
}
/// The pack is open for this fault after `within_s`.
void check_opens(SimRun& run, FaultId fault, double within_s) {
  const double before_s = run.seconds();
  run.run_to(before_s + within_s);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().cause == OpeningCause::fault);
  CHECK(row_of(run.core().last_opening().fault).name == row_of(fault).name);
}

/// The last question to the modules before the core was shut down.
class LastWords final : public CoreTap {
 public:
  explicit LastWords(const ModuleDriver& driver) : driver_(&driver) {}
  void observed(const Observation&) override {}
  void decided(TimePoint, const Decisions& decisions) override {
    if (is_over_) return;
    for (const OutgoingFrame& sent : decisions.frames) {
      const auto question =
          sent.port == Port::internal ? driver_->question_of(sent.frame) : std::optional<ModuleQuestion>();
      if (!question) continue;
      bleed_above_uV_ = question->bleed_above_uV;
      last_ = sent.frame;
      ++count_;
    }
    is_over_ = decisions.is_shut_down;
  }
  [[nodiscard]] bool is_over() const { return is_over_; }
  [[nodiscard]] std::optional<std::int32_t> bleed_above_uV() const { return bleed_above_uV_; }
  [[nodiscard]] const CanFrame& last() const { return last_; }
  [[nodiscard]] int count() const { return count_; }

 private:
  const ModuleDriver* driver_;
  bool is_over_ = false;
  CanFrame last_;
  int count_ = 0;
  std::optional<std::int32_t> bleed_above_uV_;
};

/// A pack that is bleeding, and then receives the command to shut down.
struct ShutDownBleeding {
  CoreConfig config;
  LastWords words;
  VirtualRun run;
  TimePoint asked_at{};

  explicit ShutDownBleeding(const char* name)
      : config(balancing_soon(name)), words(*config.foreign.driver), run(config, simulator_config(config), {}) {
    run.set_tap(&words);
    REQUIRE(run.simulator().apply("pack soc_permille 850"));
    REQUIRE(run.simulator().apply("cell 2.3 soc_permille 995"));
    while (!words.bleed_above_uV() && run.elapsed() < 60s) run.step();
    REQUIRE(words.bleed_above_uV().has_value());
    run.observe(CommandGiven{.command = Command::shut_down});
    asked_at = run.now();
  }
  ShutDownBleeding(const ShutDownBleeding&) = delete;
  ShutDownBleeding& operator=(const ShutDownBleeding&) = delete;

  void check_ends_with_stop() {
    while (!words.is_over() && run.now() - asked_at < 2s) run.step();
    CHECK(words.is_over());
    CHECK(run.now() - asked_at < 500ms);
    CHECK_FALSE(words.bleed_above_uV().has_value());
  }
};

/// Receives a frame of another node now.
void send(SimRun& run, const CanFrame& frame) {
  run.observe(FrameReceived{Port::internal, frame});
}

}  // namespace

TEST_CASE("a pack with another maker's modules closes, drives and opens", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      const CoreConfig config = shipped(name);
      SimRun run = closed(config);
      CHECK(run.core().pack().is_complete());
      CHECK(run.core().soc_permille().has_value());
      CHECK(run.core().bleed_above_uV() == std::nullopt);
      for (const FaultRow& row : fault_table()) {
        INFO(row.name);
        CHECK_FALSE(is_present(run, row.id));
      }
      for (const ModuleRecord& module : run.core().modules().modules()) {
        CHECK(module.answers_missed == 0);
        CHECK(module.values_out_of_range == 0);
      }
      run.apply("vehicle off");
      run.run_to(6.0);
      CHECK(run.core().sequence().phase == Phase::open);
      CHECK(run.core().last_opening().cause == OpeningCause::request_over);
    }
  }
}

TEST_CASE("an Outlander's modules that do not balance are told the lowest cell as soon as all cells are known",
          "[scenario][foreign_modules]") {
  const CoreConfig config = shipped("outlander-80s.json");
  LastWords words(*config.foreign.driver);
  VirtualRun run(config, simulator_config(config), {});
  run.set_tap(&words);
  REQUIRE(run.simulator().apply("pack soc_permille 700"));
  REQUIRE(run.simulator().apply("cell 2.7 soc_permille 600"));
  const auto next = [&]() -> const CanFrame& {
    const int before = words.count();
    for (const TimePoint until = run.now() + 1s; words.count() == before && run.now() < until;) run.step();
    REQUIRE(words.count() == before + 1);
    return words.last();
  };
  const auto target_mV = [](const CanFrame& frame) { return frame.data[0] * 256 + frame.data[1]; };
  const auto lowest = [&]() -> const auto& {
    return run.core().pack().cell_voltage_uV;
  };
  // Without cell voltages there is no target: 2510 mV after the zeros of the start, as in the car.
  constexpr int start_mV = 2'510;
  int rounds_of_start = 0;
  while (target_mV(next()) == 0) ++rounds_of_start;
  CHECK(rounds_of_start > 0);
  CHECK(target_mV(words.last()) == start_mV);
  bool has_all_cells = false;
  for (int round = 0; round < 100; ++round) {
    const CanFrame frame = next();
    INFO("round " << round << ", lowest cell " << lowest().min << " uV");
    CHECK(frame.data[2] == 0);  // balancing off
    CHECK(frame.data[4] == 3);
    has_all_cells = lowest().is_complete();
    CHECK(target_mV(frame) == (has_all_cells ? (lowest().min + 500) / 1'000 : start_mV));
  }
  CHECK(has_all_cells);
  CHECK(run.simulator().plant().cell(8 + 6).voltage_V == Approx(target_mV(words.last()) * 1e-3).margin(0.01));
  // The target follows the lowest cell, and there is none if a cell is unknown.
  const int before_mV = target_mV(words.last());
  REQUIRE(run.simulator().apply("cell 4.1 soc_permille 300"));
  for (int round = 0; round < 25; ++round) next();
  CHECK(target_mV(words.last()) < before_mV - 20);
  CHECK(target_mV(words.last()) == (lowest().min + 500) / 1'000);
  REQUIRE(run.simulator().apply("module 3 silent"));
  for (int round = 0; round < 50; ++round) next();
  CHECK(target_mV(words.last()) == start_mV);
}

TEST_CASE("another maker's module that falls silent opens the pack", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      SimRun run = closed(shipped(name));
      run.apply("module 3 silent");
      check_opens(run, FaultId::module_lost, 0.8);
      run.apply("module 3 talking");
      run.run_to(run.seconds() + 3.0);
      CHECK(run.core().pack().is_complete());
    }
  }
}

TEST_CASE("a cell that leaves its limits opens a pack of another maker's modules", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      SimRun run = closed(shipped(name));
      run.apply("cell 2.3 voltage_mV 4190");
      check_opens(run, FaultId::cell_overvoltage, 0.5);
    }
  }
}

TEST_CASE("a number that no cell can have is a cell that is not measured", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      SimRun run = closed(shipped(name));
      run.apply("cell 2.3 out_of_range on");
      check_opens(run, FaultId::cell_not_measured, 0.6);
      CHECK(run.core().modules().find(2)->values_out_of_range > 3);
      CHECK(run.core().modules().find(2)->cell_voltage_uV[2].validity == Validity::out_of_range);
    }
  }
}

TEST_CASE("answers that come too late are too old", "[scenario][foreign_modules]") {
  SimRun run = closed(shipped("outlander-80s.json"));
  run.apply("module 5 delay_ms 500");
  run.run_to(run.seconds() + 1.2);
  CHECK(run.core().sequence().phase == Phase::open);
}

TEST_CASE("an Outlander's module that repeats its old frames is found by the next step of the current",
          "[scenario][foreign_modules][F27]") {
  SimRun run = closed(shipped("outlander-80s.json"));
  run.apply("load current_A 20");
  run.run_to(run.seconds() + 2.0);
  run.apply("module 5 replay on");  // no counter shows that they are old
  run.run_to(run.seconds() + 1.0);
  CHECK(run.core().pack().is_complete());
  run.apply("load current_A 60");
  run.run_to(run.seconds() + 7.5);
  CHECK(run.core().sequence().phase == Phase::closed);
  run.run_to(run.seconds() + 1.5);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().last_opening().fault == FaultId::stuck_values);
}

TEST_CASE("an i3's module whose frames are damaged, or whose counter stands still, opens the pack",
          "[scenario][foreign_modules]") {
  // One for all sections: each takes megabytes of the stack.
  SimRun run = closed(shipped("i3-96s.json"));
  SECTION("checksums") {
    run.apply("module 4 damaged_frames on");
    run.run_to(run.seconds() + 0.8);
    CHECK(run.core().sequence().phase == Phase::open);
    CHECK(is_present(run, FaultId::module_lost));
    CHECK(is_present(run, FaultId::module_disturbed));
    CHECK(run.core().modules().find(4)->rejected[static_cast<std::size_t>(RejectReason::wrong_crc)] > 10);
    CHECK(run.core().receive_counts().rejected[static_cast<std::size_t>(RejectReason::wrong_crc)] > 10);
  }
  SECTION("a counter that stands still, as the voltages do: the same answer again is no answer") {
    run.apply("module 4 frozen_counter on");
    run.run_to(run.seconds() + 0.8);
    CHECK(run.core().sequence().phase == Phase::open);
    CHECK(run.core().last_opening().fault == FaultId::module_lost);
  }
  SECTION("a counter that stands still while the voltages change: two answers that contradict an accepted one") {
    run.apply("module 4 frozen_counter on");
    run.apply("load current_A ..80 over 0.6");
    run.run_to(run.seconds() + 0.8);
    CHECK(run.core().sequence().phase == Phase::open);
    CHECK(run.core().last_opening().fault == FaultId::duplicate_node);
  }
  SECTION("errors that nobody can read are a warning") {
    run.apply("module 4 errors 5");
    run.run_to(run.seconds() + 1.0);
    CHECK(run.core().sequence().phase == Phase::closed);
    CHECK(is_present(run, FaultId::module_warning));
    CHECK(run.core().modules().find(4)->status.value.maker_errors == 5);
  }
}

TEST_CASE("a second master of another maker's modules is a fault", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      const CoreConfig config = shipped(name);
      SimRun run = closed(config);
      send(run, config.foreign.driver->ask({.node = 1}, 6, {}));
      run.run_to(run.seconds() + 0.5);
      CHECK(is_present(run, FaultId::foreign_master));
    }
  }
}

TEST_CASE("a second master of another maker's modules is noticed whatever is wrong with its questions",
          "[scenario][foreign_modules][F39]") {
  for (const char* const name : packs) {
    const CoreConfig config = shipped(name);
    const CanFrame question = config.foreign.driver->ask({.node = 1}, 6, {});
    CanFrame shorter = question;
    shorter.length = 3;
    CanFrame damaged = question;
    damaged.data[7] ^= 0x55U;
    for (const CanFrame& frame : {shorter, damaged}) {
      DYNAMIC_SECTION(name << ", " << int{frame.length} << " bytes") {
        SimRun run = closed(config);
        send(run, frame);
        run.run_to(run.seconds() + 0.1);
        CHECK(is_present(run, FaultId::foreign_master));
        CHECK(run.core().sequence().phase == Phase::open);
      }
    }
  }
}

TEST_CASE("an inverter on the bus of another maker's modules is heard, and its frames are no strangers'",
          "[scenario][foreign_modules][inverter]") {
  CoreConfig config = shipped("i3-96s.json");
  config.inverter.driver = find_device("sma")->inverter;
  config.served_by[static_cast<std::size_t>(Port::inverter)] = Port::internal;
  SimRun run = closed(config);
  const std::uint64_t rejected = run.core().receive_counts().rejected_total();
  for (const CanFrame& frame : config.inverter.driver->words({.voltage_mV = known(350'000)})) send(run, frame);
  CHECK(run.core().inverter().is_talking(run.core().decided_at()));
  CHECK_FALSE(is_present(run, FaultId::foreign_battery));
  send(run, *config.inverter.driver->frame(0, {}, {}));
  run.run_to(run.seconds() + 0.2);
  CHECK(is_present(run, FaultId::foreign_battery));
  CHECK_FALSE(is_present(run, FaultId::foreign_master));
  CHECK(run.core().receive_counts().rejected_total() == rejected);
}

TEST_CASE("a module that the pack does not have is told of, and is no measurement", "[scenario][foreign_modules]") {
  CoreConfig config = shipped("i3-96s.json");
  SimRun run = closed(config);
  CoreConfig smaller = config;
  smaller.modules.clear();
  for (const ModuleConfig& module : config.modules) {
    if (module.node != 8) smaller.modules.push_back(module);
  }
  SimRun with_stranger(smaller);
  with_stranger.run_to(3.0);
  // Received once, it could be a frame made by noise.
  for (std::uint8_t counter = 3; counter < 6; ++counter) {
    const ModuleFrames frames = config.foreign.driver->answers(8, {}, {}, counter, {});
    for (const CanFrame& frame : frames) send(with_stranger, frame);
    with_stranger.run_to(with_stranger.seconds() + 0.1);
  }
  CHECK(is_present(with_stranger, FaultId::unknown_module));
  CHECK(with_stranger.core().pack().is_complete());
}

TEST_CASE("what our own modules would say is nobody's word among another maker's", "[scenario][foreign_modules]") {
  SimRun run = closed(shipped("outlander-80s.json"));
  const std::uint64_t before = run.core().receive_counts().rejected[static_cast<std::size_t>(RejectReason::unknown_id)];
  send(run, {.id = 0x101, .length = 8});
  CHECK(run.core().receive_counts().rejected[static_cast<std::size_t>(RejectReason::unknown_id)] == before + 1);
}

TEST_CASE("another maker's modules are told what to bleed, and stop", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      SimRun run(balancing_soon(name));
      run.apply("pack soc_permille 850");
      run.apply("cell 2.3 soc_permille 995");
      run.run_to(60.0);
      REQUIRE(run.core().balancing().state() == BalancingState::bleeding);
      const auto target_uV = run.core().bleed_above_uV();
      REQUIRE(target_uV.has_value());
      CHECK(*target_uV % 1'000 == 0);
      CHECK(*target_uV >= run.core().pack().cell_voltage_uV.min + run.core().config().balancing.dead_band_uV - 1'000);
      CHECK((run.core().modules().find(2)->balancing_cells & 0b100) != 0);
      CHECK(run.core().watchers().switches.is_any_told());
      CHECK_FALSE(is_present(run, FaultId::balancing_stays_on));
      run.give(Command::balancing_off);
      run.run_to(63.0);
      CHECK_FALSE(run.core().bleed_above_uV().has_value());
      CHECK(run.core().modules().find(2)->balancing_cells == 0);
      CHECK_FALSE(run.core().watchers().switches.is_any_told());
      CHECK_FALSE(is_present(run, FaultId::balancing_stays_on));
    }
  }
}

TEST_CASE("the lowest cell is not bled because others read low while they are", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      CoreConfig config = balancing_soon(name);
      config.balancing.dead_band_uV = 10'000;  // less than a bled cell reads low
      SimulatorConfig world = simulator_config(config);
      world.foreign.bled_reads_low_uV = 40'000;
      VirtualRun run(config, world, {});
      REQUIRE(run.simulator().apply("pack soc_permille 900"));
      REQUIRE(run.simulator().apply("cell 2.3 soc_permille 945"));
      std::optional<std::int32_t> first_uV;
      while (run.elapsed() < 90s) {
        run.step();
        const std::optional<std::int32_t> target_uV = run.core().bleed_above_uV();
        if (!target_uV) continue;
        if (!first_uV) first_uV = target_uV;
        REQUIRE(*target_uV >= *first_uV);
        REQUIRE((run.core().modules().find(2)->balancing_cells & ~0b100U) == 0);
        REQUIRE(run.core().modules().find(1)->balancing_cells == 0);
      }
      CHECK(first_uV.has_value());
    }
  }
}

TEST_CASE("the last that another maker's modules hear is not that they bleed", "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      ShutDownBleeding(name).check_ends_with_stop();
    }
  }
}

TEST_CASE("a last word to another maker's modules that the bus did not take is said again",
          "[scenario][foreign_modules]") {
  for (const char* const name : packs) {
    DYNAMIC_SECTION(name) {
      ShutDownBleeding bench(name);
      while (bench.words.bleed_above_uV() && !bench.words.is_over()) bench.run.step();
      bench.run.observe(SendFailed{.port = Port::internal, .frame = bench.words.last()});
      const int count = bench.words.count();
      bench.check_ends_with_stop();
      CHECK(bench.words.count() > count);
    }
  }
}

TEST_CASE("a switch of another maker's module that goes on bleeding is a fault", "[scenario][foreign_modules]") {
  SimRun run = closed(shipped("i3-96s.json"));
  run.apply("cell 2.3 balancing_switch stays_on");
  run.run_to(run.seconds() + 6.0);
  CHECK(is_present(run, FaultId::balancing_stays_on));
}

TEST_CASE("another maker's modules take no node number", "[scenario][foreign_modules]") {
  SimRun run(shipped("i3-96s.json"));
  run.run_to(3.0);
  run.observe(
      CommandGiven{.command = Command::assign_node, .authority = Authority::service, .node = 3, .serial_number = 4711});
  run.run_to(3.1);
  CHECK(run.core().assignment().refusal() == AssignmentRefusal::foreign_modules);
}
