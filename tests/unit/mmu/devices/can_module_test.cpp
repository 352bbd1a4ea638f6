// Emulated modules of other manufacturers, tested with their driver: times, start, bleeding, silence, and the faults of
// their frames.
#include "mmu/devices/can_module.hpp"

#include <vector>

#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

const ModuleDriver& driver_of(std::string_view name) {
  return *find_device(name)->modules;
}

/// Measurements with each cell a millivolt above the previous one, and each sensor a degree.
ModuleMeasurements measured_by(const ModuleDriver& driver, std::int32_t first_uV = 3'700'000) {
  ModuleMeasurements measured;
  for (std::size_t cell = 0; cell < driver.cell_count_max; ++cell) {
    measured.cell_voltage_uV[cell] = known(first_uV + static_cast<std::int32_t>(cell) * 1'000);
    measured.stack_voltage_mV += first_uV / 1'000 + static_cast<std::int32_t>(cell);
  }
  for (std::size_t sensor = 0; sensor < driver.temperature_count_max; ++sensor) {
    measured.cell_temperature_dC[sensor] = known(200 + static_cast<std::int64_t>(sensor) * 10);
  }
  measured.board_temperature_dC = known(310);
  return measured;
}

/// One module, polled by its driver.
struct ModuleBench {
  explicit ModuleBench(std::string_view name, std::uint8_t node_asked = 3, std::size_t place = 0)
      : driver(driver_of(name)),
        node(node_asked),
        config{.driver = &driver},
        module(config, node, place, power_up),
        measured(measured_by(driver)) {}

  CanFrame question(const ModuleQuestion& question) { return driver.ask(question, round++, config.options); }
  void ask(std::optional<std::int32_t> bleed_above_uV = std::nullopt) {
    module.observe(question({.node = asked(), .bleed_above_uV = bleed_above_uV}), now);
  }
  std::vector<TimedFrame> run(Duration duration) {
    std::vector<TimedFrame> sent;
    for (const TimePoint end = now + duration; now < end;) {
      now += 1ms;
      if (module.is_sample_due(now)) module.sample(measured, now);
      module.tick(faults, now);
      while (const auto frame = module.pop(now)) sent.push_back({now, *frame});
    }
    return sent;
  }
  /// Polls the module once per round of the car.
  std::vector<TimedFrame> run_asked(Duration duration, std::optional<std::int32_t> bleed_above_uV = std::nullopt) {
    std::vector<TimedFrame> all;
    for (Duration done{}; done < duration; done += driver.round_min) {
      ask(bleed_above_uV);
      const std::vector<TimedFrame> sent = run(driver.round_min);
      all.insert(all.end(), sent.begin(), sent.end());
    }
    return all;
  }
  [[nodiscard]] std::uint8_t asked() const { return driver.asks_each ? node : std::uint8_t{0}; }
  [[nodiscard]] ModuleReport read(const CanFrame& frame) const { return driver.take(frame, config.options); }
  /// Parts that the frames contain together.
  [[nodiscard]] ModuleParts parts_of(const std::vector<TimedFrame>& sent) const {
    ModuleParts parts = 0;
    for (const TimedFrame& one : sent) parts |= read(one.frame).parts;
    return parts;
  }
  [[nodiscard]] ModuleReport status_in(const std::vector<TimedFrame>& sent) const {
    ModuleReport last;
    for (const TimedFrame& one : sent) {
      if ((read(one.frame).parts & bit_of(ModulePart::status)) != 0) last = read(one.frame);
    }
    return last;
  }

  const ModuleDriver& driver;
  std::uint8_t node;
  CanModuleConfig config;
  CanModule module;
  ModuleMeasurements measured;
  ModuleWireFaults faults;
  TimePoint now = power_up;
  std::uint32_t round = 0;
};

std::vector<const ModuleDriver*> drivers() {
  std::vector<const ModuleDriver*> all;
  for (const Device* device : all_devices()) {
    if (device->modules != nullptr) all.push_back(device->modules);
  }
  return all;
}

/// Counters of the frames that have one.
std::vector<int> counters_in(const ModuleBench& bench, const std::vector<TimedFrame>& sent) {
  std::vector<int> counters;
  for (const TimedFrame& one : sent) {
    if ((bench.read(one.frame).parts & bit_of(ModulePart::status)) != 0) counters.push_back(one.frame.data[6] >> 4);
  }
  return counters;
}

TEST_CASE("a question brings everything a module has, as it measured it, and nothing else does", "[unit][can_module]") {
  REQUIRE(drivers().size() >= 2);
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    CHECK(bench.run(1s).empty());
    bench.ask();
    const auto sent = bench.run(200ms);
    CHECK(bench.parts_of(sent) == driver->parts_of(driver->cell_count_max));
    CHECK(sent.size() >= driver->frames_per_answer);
    for (const TimedFrame& one : sent) {
      const ModuleReport report = bench.read(one.frame);
      CHECK((report.parts == 0 || report.node == 3));
      CHECK(values_out_of_range(report, driver->cell_count_max, driver->temperature_count_max) == 0);
      CHECK_FALSE(content_fault(*find_device(driver->name)->catalogue->find(one.frame).message, one.frame));
      for (std::size_t slot = 0; slot < report.cell_voltage_uV.size(); ++slot) {
        const std::size_t cell = report.first_cell + slot;
        CHECK(report.cell_voltage_uV[slot] == bench.measured.cell_voltage_uV[cell]);
      }
      for (std::size_t sensor = 0; sensor < report.cell_temperature_dC.size(); ++sensor) {
        CHECK(report.cell_temperature_dC[sensor] == bench.measured.cell_temperature_dC[sensor]);
      }
      if (report.board_temperature_dC) CHECK(*report.board_temperature_dC == known(310));
      if (report.stack_voltage_mV.is_valid()) CHECK(report.stack_voltage_mV.value == bench.measured.stack_voltage_mV);
    }
    CHECK(bench.run(1s).empty());
  }
}

TEST_CASE("answers come within the window their driver names, and as old as it says", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    const std::size_t last = driver->node_max - 1U;
    for (const std::size_t place : {std::size_t{0}, last}) {
      ModuleBench bench(driver->name, 1, place);
      bench.run(100ms);
      const TimePoint asked_at = bench.now;
      bench.ask();
      const auto sent = bench.run(100ms);
      REQUIRE_FALSE(sent.empty());
      CHECK(sent.front().at - asked_at > driver->answer_after);
      CHECK(sent.back().at - asked_at <= driver->answer_within);
    }
  }
}

TEST_CASE("an answer says what was measured last, up to a round of the car ago", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    const auto first_cell_said = [&] {
      bench.ask();
      for (const TimedFrame& one : bench.run(driver->sample_age_max - 1ms)) {
        const ModuleReport report = bench.read(one.frame);
        if (!report.cell_voltage_uV.empty() && report.first_cell == 0) return report.cell_voltage_uV[0];
      }
      return not_known();
    };
    while (!bench.module.is_sample_due(bench.now + 1ms)) bench.run(1ms);
    bench.run(1ms);
    bench.measured = measured_by(*driver, 3'900'000);
    CHECK(first_cell_said() == known(3'700'000));
    bench.run(1ms);
    CHECK(first_cell_said() == known(3'900'000));
  }
}

TEST_CASE("the burst of an Outlander's modules begins 30 ms after their question and takes 10 ms",
          "[unit][can_module]") {
  for (const int place : {0, 9}) {
    ModuleBench bench("outlander_cmu", 1, static_cast<std::size_t>(place));
    bench.run(100ms);
    const TimePoint asked_at = bench.now;
    bench.ask();
    const auto sent = bench.run(80ms);
    REQUIRE(sent.size() == 4);
    CHECK(sent.front().at == asked_at + 30ms + place * 1ms);
    CHECK(sent.back().at == asked_at + 31ms + place * 1ms);
  }
}

TEST_CASE("an Outlander's module is silent until its master says something else than zeros", "[unit][can_module]") {
  ModuleBench bench("outlander_cmu");
  std::vector<TimedFrame> sent;
  for (int start = 0; start < 4; ++start) {
    bench.module.observe(bench.question({.is_start = true}), bench.now);
    for (const TimedFrame& one : bench.run(40ms)) sent.push_back(one);
  }
  CHECK(sent.empty());
  CHECK(bench.module.answers_given() == 0);
  CHECK(bench.run_asked(400ms).size() == 40);
  CHECK(bench.module.answers_given() == 10);
}

TEST_CASE("a module that is asked for itself answers its own valid question alone, and counts its answers to 14",
          "[unit][can_module]") {
  ModuleBench bench("i3_csc");
  bench.run(100ms);
  bench.module.observe(bench.question({.node = 4}), bench.now);
  CanFrame damaged = bench.question({.node = 3});
  damaged.data[0] ^= 1U;
  bench.module.observe(damaged, bench.now);
  bench.module.observe(make_frame(internal_bus::poll), bench.now);
  CHECK(bench.run(100ms).empty());
  const std::vector<int> counters = counters_in(bench, bench.run_asked(16 * 24ms));
  REQUIRE(counters.size() == 16);
  CHECK(counters[0] == 1);
  CHECK(counters[13] == 14);
  CHECK(counters[14] == 0);
  CHECK(counters[15] == 1);
  // Parts that are not requested are omitted.
  bench.module.observe(bench.question({.node = 3, .wants_voltages = false}), bench.now);
  CHECK(bench.parts_of(bench.run(24ms)) == (bit_of(ModulePart::status) | bit_of(ModulePart::temperatures)));
  bench.module.observe(bench.question({.node = 3, .is_start = true}), bench.now);
  CHECK(bench.parts_of(bench.run(24ms)) == bit_of(ModulePart::status));
}

TEST_CASE("before its first sample it says nothing", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    const CanModuleConfig config{.driver = driver};
    CanModule module(config, 1, 0, power_up);
    CHECK(module.mode() == UnitMode::starting);
    module.observe(driver->ask({.node = static_cast<std::uint8_t>(driver->asks_each ? 1 : 0)}, 0, {}), power_up);
    module.tick({}, power_up + 100ms);
    CHECK_FALSE(module.pop(power_up + 200ms));
    module.sample(measured_by(*driver), power_up + 200ms);
    CHECK(module.mode() == UnitMode::normal);
    CHECK(module.bleeding_cells() == 0);
  }
}

TEST_CASE("it bleeds the cells above what it is told, by its own samples, until it is told not to",
          "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    bench.run_asked(200ms);
    CHECK(bench.module.bleeding_cells() == 0);
    bench.run_asked(200ms, 3'705'000);
    const auto above = static_cast<CellMask>(first_cells(driver->cell_count_max) & ~first_cells(6));
    CHECK(bench.module.bleeding_cells() == above);
    CHECK(bench.status_in(bench.run_asked(200ms, 3'705'000)).bleeding_cells == above);
    // A cell without a valid voltage is not bled.
    bench.measured.cell_voltage_uV[7] = not_known(Validity::out_of_range);
    bench.run_asked(200ms, 3'705'000);
    CHECK(bench.module.bleeding_cells() == (above & ~cell_bit(7)));
    bench.ask();
    CHECK(bench.module.bleeding_cells() == 0);
    bench.run_asked(200ms);
    CHECK(bench.module.bleeding_cells() == 0);
  }
}

TEST_CASE("a cell that reads low while it is bled is not switched on and off for ever", "[unit][can_module]") {
  ModuleBench bench("i3_csc");
  bench.run_asked(100ms, 3'710'000);
  REQUIRE(bench.module.bleeding_cells() == cell_bit(11));
  bench.measured.cell_voltage_uV[11].value = 3'710'001 - bench.config.bled_reads_low_uV;
  bench.run_asked(100ms, 3'710'000);
  CHECK(bench.module.bleeding_cells() == cell_bit(11));
  bench.measured.cell_voltage_uV[11].value -= 1;
  bench.run_asked(100ms, 3'710'000);
  CHECK(bench.module.bleeding_cells() == 0);
}

TEST_CASE("when its master falls silent it goes on bleeding for a while and then stops", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    bench.run_asked(200ms, 3'000'000);
    bench.ask(3'000'000);
    bench.run(10s);
    CHECK(bench.module.bleeding_cells() == first_cells(driver->cell_count_max));
    bench.run(1ms);
    CHECK(bench.module.bleeding_cells() == 0);
    bench.run_asked(200ms);
    CHECK(bench.module.bleeding_cells() == 0);
    bench.run_asked(200ms, 3'000'000);
    CHECK(bench.module.bleeding_cells() != 0);
  }
}

TEST_CASE("what is no number is told as none, whatever the field can say", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    for (const Validity why : {Validity::unknown, Validity::open_circuit, Validity::out_of_range}) {
      INFO(driver->name << ", " << to_text(why));
      ModuleBench bench(driver->name);
      bench.measured.cell_voltage_uV[1] = not_known(why);
      bench.measured.cell_temperature_dC[2] = not_known(why);
      bench.measured.board_temperature_dC = not_known(why);
      int without = 0;
      std::size_t out_of_range = 0;
      bench.run(100ms);
      bench.ask();
      for (const TimedFrame& one : bench.run(100ms)) {
        const ModuleReport report = bench.read(one.frame);
        for (const SignalValue& value : report.cell_voltage_uV) without += value.is_valid() ? 0 : 1;
        for (const SignalValue& value : report.cell_temperature_dC) without += value.is_valid() ? 0 : 1;
        if (report.board_temperature_dC) without += report.board_temperature_dC->is_valid() ? 0 : 1;
        out_of_range += values_out_of_range(report, driver->cell_count_max, driver->temperature_count_max);
      }
      const int wanted = driver->has_board_temperature ? 3 : 2;
      CHECK(without == wanted);
      if (why == Validity::out_of_range) CHECK(out_of_range == static_cast<std::size_t>(wanted));
    }
  }
}

TEST_CASE("a silent module goes on working, what was on its way is lost", "[unit][can_module]") {
  ModuleBench bench("i3_csc");
  bench.faults.delay = 50ms;
  bench.run_asked(100ms);
  bench.faults.is_silent = true;
  CHECK(bench.run_asked(200ms, 3'000'000).empty());
  CHECK(bench.module.bleeding_cells() == first_cells(12));
  bench.faults.is_silent = false;
  bench.faults.delay = 0ms;
  CHECK_FALSE(bench.run_asked(24ms).empty());
}

TEST_CASE("a stuck module repeats its data, one whose counter stands still says new data, a replay repeats all",
          "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    bench.run(100ms);
    const auto answer = [&] {
      bench.ask();
      return bench.run(100ms);
    };
    const auto first = answer();
    bench.measured = measured_by(*driver, 3'600'000);
    const auto is_same = [&](const std::vector<TimedFrame>& sent) {
      return std::equal(sent.begin(), sent.end(), first.begin(), first.end(),
                        [](const TimedFrame& one, const TimedFrame& other) { return one.frame == other.frame; });
    };
    bench.faults.is_replaying = true;
    CHECK(is_same(answer()));
    bench.faults = {.is_stuck = true};
    const auto stuck = answer();
    CHECK(is_same(stuck) == !driver->has_checksum);
    CHECK(bench.status_in(stuck).bleeding_cells == 0);
    bench.faults = {.has_frozen_counter = true};
    const auto frozen = answer();
    CHECK_FALSE(is_same(frozen));
    CHECK(counters_in(bench, frozen) == counters_in(bench, stuck));
  }
}

TEST_CASE("frames of a group are left out, those that have a checksum damaged", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    bench.run(100ms);
    const ModuleParts all = driver->parts_of(driver->cell_count_max);
    for (const OmittedFrames group : {OmittedFrames::status, OmittedFrames::cells, OmittedFrames::temperatures}) {
      CHECK(has_frames(*driver, group));
      bench.faults = {.omitted = group};
      bench.ask();
      const ModuleParts said = bench.parts_of(bench.run(100ms));
      CHECK(said != all);
      CHECK(said != 0);
    }
    CHECK(has_frames(*driver, OmittedFrames::module) == driver->tells_stack_voltage);
    CHECK_FALSE(has_frames(*driver, OmittedFrames::ident));
    bench.faults = {.has_damaged_frames = true};
    bench.ask();
    for (const TimedFrame& one : bench.run(100ms)) {
      const MessageSpec& message = *find_device(driver->name)->catalogue->find(one.frame).message;
      CHECK(content_fault(message, one.frame).has_value() == has_crc(message));
    }
  }
}

TEST_CASE("it can send late and as another, and reads back switches that do not obey", "[unit][can_module]") {
  for (const ModuleDriver* driver : drivers()) {
    INFO(driver->name);
    ModuleBench bench(driver->name);
    bench.run(100ms);
    bench.faults = {.node = std::uint8_t{5}, .balancing_cells = CellMask{0b101}, .delay = 200ms};
    const TimePoint asked_at = bench.now;
    bench.ask();
    const auto sent = bench.run(400ms);
    REQUIRE_FALSE(sent.empty());
    CHECK(sent.front().at - asked_at >= 200ms);
    for (const TimedFrame& one : sent) {
      if (bench.read(one.frame).parts != 0) CHECK(bench.read(one.frame).node == 5);
    }
    CHECK(bench.status_in(sent).bleeding_cells == 0b101);
    CHECK(bench.module.bleeding_cells() == 0);
  }
}

TEST_CASE("more questions than it can keep are not heard, more frames than its wire holds are lost",
          "[unit][can_module]") {
  ModuleBench bench("i3_csc");
  bench.run(100ms);
  for (std::size_t question = 0; question < CanModule::questions_max + 3; ++question) bench.ask();
  bench.run(100ms);
  CHECK(bench.module.answers_given() == CanModule::questions_max);
  bench.faults.delay = 10s;
  const auto sent = bench.run_asked(5s);
  CHECK(sent.empty());
  CHECK(bench.run(11s).size() == CanModule::frames_max);
}

}  // namespace
}  // namespace bmu
