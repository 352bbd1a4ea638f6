// Assignment of an answer of another manufacturer's module to its request, and of a frame that fails its checks to a
// module.
#include "daemon/core/core.hpp"
#include "daemon/core/faults/fault_readers.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

const ModuleDriver& driver_of(std::string_view name) {
  return *find_device(name)->modules;
}

CoreConfig pack_of(const ModuleDriver& driver, std::size_t modules = 2) {
  CoreConfig config = test::pack_of(modules);
  config.foreign.driver = &driver;
  for (ModuleConfig& module : config.modules) module.cell_count = driver.cell_count_max;
  return config;
}

/// Two modules of one manufacturer, polled every 80 ms from `start` on.
struct Rounds {
  static constexpr TimePoint start{100s};
  static constexpr Duration period = 80ms;

  const ModuleDriver* driver;
  ModuleTable table;
  TimePoint now = start;
  TimePoint asked_at{};

  explicit Rounds(std::string_view name) : driver(&driver_of(name)) { table.init(pack_of(*driver)); }

  void ask(bool is_start = false) {
    now = asked_at = asked_at == TimePoint{} ? start : asked_at + period;
    table.begin_round(now, is_start);
  }
  /// Delivers the module's whole answer, or all but `omitted`.
  void answer(std::uint8_t node, Duration after, ModuleParts omitted = 0) {
    now = asked_at + after;
    ModuleMeasurements measured;
    measured.cell_voltage_uV.fill(known(3'700'000));
    measured.cell_temperature_dC.fill(known(250));
    for (const CanFrame& frame : driver->answers(node, {.node = node}, measured, 1, {})) {
      const ModuleReport report = driver->take(frame, {});
      if (report.node != 0 && (report.parts & omitted) == 0) table.observe(report, now);
    }
  }
  void answer_all(Duration after) {
    answer(1, after);
    answer(2, after);
  }
  [[nodiscard]] TimePoint cells_asked_at(std::uint8_t node, std::size_t cell = 0) const {
    return table.find(node)->cell_voltage_uV[cell].taken_at + driver->sample_age_max;
  }
};

std::uint32_t rejected(const Core& core, std::uint8_t node) {
  std::uint32_t sum = 0;
  for (const std::uint32_t count : core.modules().find(node)->rejected) sum += count;
  return sum;
}
std::uint32_t rejected_of_all(const Core& core) {
  std::uint32_t sum = 0;
  for (const ModuleRecord& module : core.modules().modules()) sum += rejected(core, module.config.node);
  return sum;
}

}  // namespace

TEST_CASE("an answer belongs to the last question if it owes none to the one before", "[unit][modules][foreign]") {
  Rounds rounds(GENERATE("outlander_cmu", "i3_csc"));
  for (int round = 0; round < 3; ++round) {
    rounds.ask();
    rounds.answer_all(30ms);
    CHECK(rounds.cells_asked_at(1) == rounds.asked_at);
    CHECK(rounds.table.find(1)->cell_temperature_dC[0].taken_at == rounds.asked_at);
    CHECK(rounds.table.find(1)->status.taken_at == rounds.asked_at);
    CHECK(rounds.table.completed_at() == rounds.asked_at);
  }
  CHECK(rounds.table.complete_cycles() == 3);
}

TEST_CASE("a module that measures no voltage of its own leaves the comparison with its cells whole",
          "[unit][modules][foreign][faults]") {
  Rounds rounds("outlander_cmu");
  rounds.ask();
  rounds.answer_all(30ms);
  const CoreConfig config = pack_of(*rounds.driver);
  const auto read = [&] {
    return fault_readers::module_voltage_mismatch_mV({.now = rounds.now, .config = &config, .modules = &rounds.table});
  };
  CHECK_FALSE(read().is_partial);
  rounds.table.forget_values();
  CHECK(read().is_partial);
}

TEST_CASE("what may be the answer that the question before is still owed counts as of then, for a round",
          "[unit][modules][foreign]") {
  Rounds rounds(GENERATE("outlander_cmu", "i3_csc"));
  rounds.ask();
  rounds.answer_all(30ms);
  rounds.ask();
  const TimePoint unanswered_at = rounds.asked_at;
  rounds.answer(2, 30ms);
  rounds.ask();
  rounds.answer_all(20ms);
  CHECK(rounds.cells_asked_at(1) == unanswered_at);
  CHECK(rounds.table.find(1)->cell_temperature_dC[0].taken_at == unanswered_at);
  CHECK(rounds.table.find(1)->status.taken_at == unanswered_at);
  CHECK(rounds.cells_asked_at(2) == rounds.asked_at);  // it has no open request
  rounds.answer(1, 50ms);                              // which of the two is late is unknown
  CHECK(rounds.cells_asked_at(1) == unanswered_at);
  rounds.ask();
  rounds.answer_all(30ms);
  CHECK(rounds.cells_asked_at(1) == rounds.asked_at);
}

TEST_CASE("only the part of an answer that was missing is doubted", "[unit][modules][foreign]") {
  Rounds rounds("i3_csc");
  rounds.ask();
  const TimePoint incomplete_at = rounds.asked_at;
  rounds.answer(1, 10ms, bit_of(ModulePart::cells_2));
  rounds.ask();
  rounds.answer(1, 10ms);
  CHECK(rounds.cells_asked_at(1, 0) == rounds.asked_at);
  CHECK(rounds.cells_asked_at(1, 3) == incomplete_at);
}

TEST_CASE("a round with something of the question before it is no picture of one moment", "[unit][modules][foreign]") {
  Rounds rounds("outlander_cmu");
  rounds.ask();
  rounds.answer_all(30ms);
  const TimePoint whole_at = rounds.asked_at;
  rounds.ask();
  rounds.answer(2, 30ms);
  rounds.ask();
  rounds.answer_all(30ms);
  CHECK(rounds.table.completed_at() == whole_at);
  CHECK(rounds.table.complete_cycles() == 0);
  CHECK(rounds.table.find(1)->answers_missed == 1);
  CHECK(rounds.table.find(1)->answers_complete == 2);
  CHECK(rounds.table.find(1)->answer_times.count() == 1);  // the duration of the ambiguous answer is unknown
  rounds.ask();
  rounds.answer_all(30ms);
  CHECK(rounds.table.completed_at() == rounds.asked_at);
  CHECK(rounds.table.complete_cycles() == 1);
}

TEST_CASE("what comes too soon for an answer is one to the question before", "[unit][modules][foreign]") {
  Rounds rounds("outlander_cmu");
  rounds.ask();
  const TimePoint before_at = rounds.asked_at;
  rounds.answer_all(30ms);
  rounds.ask();
  rounds.answer(1, rounds.driver->answer_after - 1ms);
  CHECK(rounds.cells_asked_at(1) == before_at);
  rounds.answer(1, rounds.driver->answer_after);
  CHECK(rounds.cells_asked_at(1) == rounds.asked_at);
}

TEST_CASE("what comes before a question for values was asked is of nobody knows when", "[unit][modules][foreign]") {
  Rounds rounds(GENERATE("outlander_cmu", "i3_csc"));
  rounds.ask();
  rounds.answer_all(30ms);
  rounds.table.forget_values();
  const auto is_anything_known = [&rounds] {
    const ModuleRecord& module = *rounds.table.find(1);
    return module.cell_voltage_uV[0].is_valid() || module.cell_temperature_dC[0].is_valid() || module.status.is_valid();
  };
  rounds.answer(1, 40ms);  // queued in the module while the bus was down
  CHECK_FALSE(is_anything_known());
  rounds.ask(true);
  rounds.answer(1, 30ms);
  CHECK_FALSE(is_anything_known());
  CHECK(rounds.table.find(1)->last_answer_at == rounds.now);
  rounds.ask();
  if (rounds.driver->answer_after > Duration{}) {
    rounds.answer(1, rounds.driver->answer_after - 1ms);
    CHECK_FALSE(is_anything_known());
  }
  rounds.answer(1, 30ms);
  CHECK(rounds.cells_asked_at(1) == rounds.asked_at);
}

TEST_CASE("a refused frame is laid to the module whose identifier it has, or to nobody", "[unit][core][foreign][F34]") {
  Core core(pack_of(driver_of("i3_csc"), 8), TimePoint{1s});
  const auto hear = [&core](const CanFrame& frame) {
    static_cast<void>(core.observe({TimePoint{2s}, FrameReceived{Port::internal, frame}}));
  };
  const auto refused = [&core](RejectReason reason) {
    return core.receive_counts().rejected[static_cast<std::size_t>(reason)];
  };
  constexpr std::uint32_t status_of_4 = 0x103;
  SECTION("a remote frame") {
    hear({.id = status_of_4, .is_remote = true, .length = 8});
    CHECK(refused(RejectReason::wrong_form) == 1);
    CHECK(rejected(core, 4) == 1);
    CHECK(rejected_of_all(core) == 1);
  }
  SECTION("a wrong length") {
    hear({.id = status_of_4, .length = 7});
    CHECK(refused(RejectReason::wrong_length) == 1);
    CHECK(rejected(core, 4) == 1);
    CHECK(rejected_of_all(core) == 1);
  }
  SECTION("a counter that no module has, under a right checksum") {
    CanFrame frame = make_frame(*driver_of("i3_csc").catalogue->find(status_of_4).message, 3);
    frame.data[6] = 0xF0;
    frame.data[7] = frame_crc_1d(frame);
    hear(frame);
    CHECK(refused(RejectReason::wrong_counter) == 1);
    CHECK(rejected(core, 4) == 1);
    CHECK(rejected_of_all(core) == 1);
    CHECK_FALSE(core.modules().find(4)->status.is_valid());
  }
  SECTION("identifiers of no module: the master's, and who has no number yet") {
    hear({.id = 0x081, .is_remote = true, .length = 8});
    hear({.id = 0x081, .length = 7});
    hear({.id = 0x081, .length = 8, .data = {1, 2, 3}});
    hear({.id = 0x0F0, .is_remote = true, .length = 8});
    hear({.id = 0x0F0, .length = 7});
    hear({.id = 0x4A0, .length = 7});
    CHECK(core.receive_counts().rejected_total() == 6);
    CHECK(rejected_of_all(core) == 0);
    for (const ModuleRecord& module : core.modules().modules()) CHECK(module.damaged_frames == 0);
  }
  SECTION("an error frame, whose number is no identifier") {
    hear({.id = status_of_4, .is_error = true, .length = 8});
    hear({.id = 0x080, .is_error = true, .length = 8});
    CHECK(refused(RejectReason::wrong_form) == 2);
    CHECK(rejected_of_all(core) == 0);
  }
  SECTION("a frame of 29 bits") {
    hear({.id = status_of_4, .is_extended = true, .length = 8});
    CHECK(refused(RejectReason::wrong_form) == 1);
    CHECK(rejected_of_all(core) == 0);
  }
}
