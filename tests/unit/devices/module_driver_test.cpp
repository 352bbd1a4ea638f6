// Requests to modules of other manufacturers and their answers, compared with frames from cars; and the round trip of
// each driver.
#include <algorithm>
#include <array>
#include <vector>

#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

const ModuleDriver& outlander() {
  return *find_device("outlander_cmu")->modules;
}
const ModuleDriver& i3() {
  return *find_device("i3_csc")->modules;
}

CanFrame frame_of(std::uint32_t id, const FrameBytes& data) {
  return {.id = id, .length = 8, .data = data};
}

ModuleMeasurements measurements() {
  ModuleMeasurements measured{.stack_voltage_mV = 48'060, .bleeding_cells = 0b1010};
  for (std::size_t cell = 0; cell < measured.cell_voltage_uV.size(); ++cell) {
    measured.cell_voltage_uV[cell] = known(4'000'000 + static_cast<std::int64_t>(cell) * 1'000);
  }
  for (std::size_t sensor = 0; sensor < measured.cell_temperature_dC.size(); ++sensor) {
    measured.cell_temperature_dC[sensor] = known(150 + static_cast<std::int64_t>(sensor) * 10);
  }
  measured.board_temperature_dC = known(350);
  return measured;
}

/// All values from the frames of an answer together.
struct Heard {
  ModuleParts parts = 0;
  std::uint16_t bleeding_cells = 0;
  std::uint32_t errors = 0;
  std::array<SignalValue, foreign_cells_max> cell_voltage_uV{};
  std::vector<SignalValue> cell_temperature_dC;
  std::optional<SignalValue> board_temperature_dC;
  SignalValue stack_voltage_mV;
};
Heard hear(const ModuleDriver& driver, std::uint8_t node, const ModuleFrames& frames, const ModuleOptions& options) {
  Heard heard;
  ReceiveCheck check(*driver.catalogue, ReceiveCheck::Role::master);
  for (const CanFrame& frame : frames) {
    CHECK(check.check(frame).is_accepted);
    const ModuleReport report = driver.take(frame, options);
    if (report.parts == 0) continue;
    CHECK(report.node == node);
    CHECK((heard.parts & report.parts) == 0);
    heard.parts = static_cast<ModuleParts>(heard.parts | report.parts);
    if ((report.parts & bit_of(ModulePart::status)) != 0) {
      heard.bleeding_cells = report.bleeding_cells;
      heard.errors = report.errors;
    }
    for (std::size_t slot = 0; slot < report.cell_voltage_uV.size(); ++slot) {
      heard.cell_voltage_uV.at(report.first_cell + slot) = report.cell_voltage_uV[slot];
    }
    for (const SignalValue& value : report.cell_temperature_dC) heard.cell_temperature_dC.push_back(value);
    if (report.board_temperature_dC) heard.board_temperature_dC = report.board_temperature_dC;
    if ((report.parts & bit_of(ModulePart::voltage)) != 0) heard.stack_voltage_mV = report.stack_voltage_mV;
  }
  return heard;
}

}  // namespace

TEST_CASE("an Outlander's modules are asked as the car asks them", "[unit][foreign_modules]") {
  CHECK(outlander().ask({.is_start = true}, 0, {}) == frame_of(0x3C3, {}));
  CHECK(outlander().ask({}, 4, {}) == frame_of(0x3C3, {0x09, 0xCE, 0, 0, 3, 0, 0, 0}));
  // From a capture, 10 s after the start: the lowest cell, and balancing off.
  CHECK(outlander().ask({.idle_target_uV = 3'964'000}, 250, {}) == frame_of(0x3C3, {0x0F, 0x7C, 0, 0, 3, 0, 0, 0}));
  // As others request it, except for the bit that may cause modules to be renumbered.
  CHECK(outlander().ask({.bleed_above_uV = 3'950'000}, 4, {}) == frame_of(0x3C3, {0x0F, 0x6E, 1, 0, 3, 0, 0, 0}));
}

TEST_CASE("an i3's modules are asked as the car asks them, each with its checksum", "[unit][foreign_modules]") {
  constexpr std::uint8_t crcs_of_start[] = {0xE8, 0x8D, 0x22, 0x47, 0x61, 0x04, 0xAB, 0xCE};
  constexpr std::uint8_t crcs_of_third[] = {0x1B, 0x7E, 0xD1, 0xB4, 0x92, 0xF7, 0x58, 0x3D};
  constexpr std::uint8_t crcs_of_both[] = {0x4A, 0x2F, 0x80, 0xE5, 0xC3, 0xA6, 0x09, 0x6C};
  for (std::uint8_t node = 1; node <= 8; ++node) {
    const std::uint32_t id = 0x080U + node - 1U;
    CHECK(i3().ask({.node = node, .is_start = true}, 0, {}) ==
          frame_of(id, {0xC7, 0x10, 0, 0, 0x20, 0, 0x10, crcs_of_start[node - 1]}));
    CHECK(i3().ask({.node = node, .is_start = true}, 2, {}) ==
          frame_of(id, {0xC7, 0x10, 0, 0, 0x20, 0, 0x34, crcs_of_third[node - 1]}));
    CHECK(i3().ask({.node = node}, 4, {}) ==
          frame_of(id, {0xC7, 0x10, 0, 0x50, 0x20, 0, 0x50, crcs_of_both[node - 1]}));
  }
  // From a log: bleed cells above 4.034 V; and an idle request as sent by others.
  CHECK(i3().ask({.node = 1, .bleed_above_uV = 4'034'000}, 13, {}) ==
        frame_of(0x080, {0xC2, 0x0F, 0, 0x50, 0x08, 0, 0xE0, 0xFF}));
  CHECK(i3().ask({.node = 1}, 2, {.idle_as_others = true}) == frame_of(0x080, {0x68, 0x10, 0, 0x50, 0, 0, 0x30, 0x7C}));
}

TEST_CASE("the counter of an i3's commands goes from 0 to 14 and never to 15", "[unit][foreign_modules]") {
  for (std::uint32_t round = 0; round < 64; ++round) {
    CHECK((i3().ask({.node = 3}, round, {}).data[6] >> 4U) == (round + 1) % 15);
  }
}

TEST_CASE("what is asked is read back as it was asked", "[unit][foreign_modules]") {
  for (const ModuleDriver* driver : {&outlander(), &i3()}) {
    for (std::uint8_t node = 1; node <= driver->node_max; ++node) {
      for (const ModuleQuestion& question :
           {ModuleQuestion{}, ModuleQuestion{.bleed_above_uV = 4'034'000},
            ModuleQuestion{.wants_voltages = false, .wants_temperatures = false, .is_start = true}}) {
        ModuleQuestion asked = question;
        asked.node = driver->asks_each ? node : std::uint8_t{0};
        CHECK(driver->question_of(driver->ask(asked, 0, {})) == asked);
      }
    }
    CHECK_FALSE(driver->question_of(frame_of(0x7FF, {})));
  }
  const ModuleQuestion idle{.idle_target_uV = 3'964'000};
  CHECK(outlander().question_of(outlander().ask(idle, 0, {})) == idle);
  CHECK(i3().question_of(i3().ask({.node = 1, .idle_target_uV = 3'964'000}, 0, {})) == ModuleQuestion{.node = 1});
  CanFrame damaged = i3().ask({.node = 2}, 0, {});
  damaged.data[0] ^= 1U;
  CHECK_FALSE(i3().question_of(damaged));
}

TEST_CASE("frames of a car's modules say what they are known to say", "[unit][foreign_modules]") {
  const ModuleReport status = outlander().take(frame_of(0x621, {0, 0x30, 0x42, 0x43, 0x42, 0x42, 0x42, 0xFF}), {});
  CHECK(status.node == 2);
  CHECK(status.bleeding_cells == 0);
  REQUIRE(status.cell_temperature_dC.size() == 5);
  CHECK(status.cell_temperature_dC[0] == known(160));
  CHECK(status.cell_temperature_dC[1] == known(170));
  const ModuleReport cells = outlander().take(frame_of(0x673, {0x0F, 0x7E, 0x0F, 0x82, 0x0F, 0x82, 0x0F, 0x7E}), {});
  CHECK(cells.node == 7);
  CHECK(cells.first_cell == 4);
  CHECK(cells.cell_voltage_uV[0] == known(3'966'000));
  CHECK(cells.cell_voltage_uV[3] == known(3'966'000));

  const ModuleReport last = i3().take(frame_of(0x153, {0xDD, 0x8F, 0xDE, 0x8F, 0xB4, 0x8F, 0xA0, 0xEF}), {});
  CHECK(last.node == 4);
  CHECK(last.first_cell == 9);
  CHECK(last.cell_voltage_uV[2] == known(4'020'000));  // while it is bled
  const ModuleReport bled = i3().take(frame_of(0x107, {0, 0, 0, 0, 0xFF, 0x0E, 0xB0, 0xF4}), {});
  CHECK(bled.node == 8);
  CHECK(bled.bleeding_cells == 0xEFF);
  CHECK(i3().take(frame_of(0x163, {0x38, 0xBE, 0, 0, 0, 0, 0xA0, 0x0E}), {}).stack_voltage_mV == known(48'696));
  const ModuleReport warm = i3().take(frame_of(0x173, {0x2B, 0x2B, 0x2B, 0x2B, 0x4B, 0, 0x90, 0x77}), {});
  CHECK(warm.cell_temperature_dC[3] == known(30));
  CHECK(warm.board_temperature_dC == known(350));
  CHECK(i3().take(frame_of(0x100, {4, 0, 0, 1, 0, 0, 0, 0}), {}).errors == 0x0100'0004);
}

TEST_CASE("frames that say nothing anybody reads are no module's word", "[unit][foreign_modules]") {
  CHECK(outlander().take(frame_of(0x614, {}), {}).node == 0);
  CHECK(outlander().take(frame_of(0x3C3, {}), {}).node == 0);
  CHECK(i3().take(frame_of(0x113, {0x11}), {}).node == 0);
  CHECK(i3().take(frame_of(0x0F0, {}), {}).node == 0);
}

TEST_CASE("what a module of another maker answers is what its driver reads", "[unit][foreign_modules]") {
  const ModuleMeasurements measured = measurements();
  for (const ModuleDriver* driver : {&outlander(), &i3()}) {
    for (std::uint8_t node = 1; node <= driver->node_max; ++node) {
      const ModuleFrames frames = driver->answers(node, {}, measured, 7, {});
      CHECK(frames.size() == driver->frames_per_answer);
      const Heard heard = hear(*driver, node, frames, {});
      CHECK(heard.parts == driver->parts_of(driver->cell_count_max));
      CHECK(heard.bleeding_cells == measured.bleeding_cells);
      for (std::size_t cell = 0; cell < driver->cell_count_max; ++cell) {
        CHECK(heard.cell_voltage_uV[cell] == measured.cell_voltage_uV[cell]);
      }
      REQUIRE(heard.cell_temperature_dC.size() == driver->temperature_count_max);
      for (std::size_t sensor = 0; sensor < heard.cell_temperature_dC.size(); ++sensor) {
        CHECK(heard.cell_temperature_dC[sensor] == measured.cell_temperature_dC[sensor]);
      }
      CHECK(heard.board_temperature_dC.has_value() == driver->has_board_temperature);
      if (driver->tells_stack_voltage) CHECK(heard.stack_voltage_mV == known(48'060));
    }
    CHECK(((driver->parts_of(driver->cell_count_max) & bit_of(ModulePart::voltage)) != 0) ==
          driver->tells_stack_voltage);
  }
}

TEST_CASE("an answer has every frame that the rows of a module have", "[unit][foreign_modules]") {
  for (const ModuleDriver* driver : {&outlander(), &i3()}) {
    INFO(driver->name);
    std::vector<std::uint32_t> of_rows;
    for (const MessageSpec* message : driver->catalogue->messages()) {
      const bool is_answer = message->sender == Sender::module && message->has_node();
      if (is_answer) of_rows.push_back(message->id_of(2U - driver->maker_less));
    }
    std::vector<std::uint32_t> of_answer;
    for (const CanFrame& frame : driver->answers(2, {}, measurements(), 7, {})) of_answer.push_back(frame.id);
    std::sort(of_rows.begin(), of_rows.end());
    std::sort(of_answer.begin(), of_answer.end());
    CHECK(of_answer == of_rows);
    CHECK(of_rows.size() == driver->frames_per_answer);
  }
}

TEST_CASE("the bitmap of an i3's module says which cells are bled, and the flags only that it balances",
          "[unit][foreign_modules]") {
  const auto flags_of = [](const CanFrame& frame, std::size_t slot) { return frame.data.at(2 * slot + 1) >> 6U; };
  for (const int bleeding : {0x000, 0x001, 0xEFF, 0xFFF}) {
    ModuleMeasurements measured = measurements();
    measured.bleeding_cells = static_cast<std::uint16_t>(bleeding);
    const ModuleFrames frames = i3().answers(8, {}, measured, 3, {});
    CHECK(hear(i3(), 8, frames, {}).bleeding_cells == bleeding);
    for (const CanFrame& frame : frames) {
      const bool has_cells = frame.id >= 0x120 && frame.id < 0x160;
      for (std::size_t slot = 0; has_cells && slot < 3; ++slot) CHECK(flags_of(frame, slot) == (bleeding != 0 ? 2 : 0));
    }
  }
  // From a capture: the flags are not part of the voltage, and mark no cell as bleeding that the bitmap does not
  // contain.
  const ModuleReport cells = i3().take(frame_of(0x147, {0x0E, 0x90, 0x0E, 0x90, 0x0F, 0x90, 0xB0, 0x25}), {});
  CHECK(cells.cell_voltage_uV[0] == known(4'110'000));
  CHECK(cells.cell_voltage_uV[2] == known(4'111'000));
  CHECK(cells.bleeding_cells == 0);
  CHECK(i3().take(frame_of(0x107, {0, 0, 0, 0, 0xFF, 0x0E, 0xB0, 0xF4}), {}).bleeding_cells == 0xEFF);
}

TEST_CASE("a module with fewer cells owes fewer frames", "[unit][foreign_modules]") {
  CHECK((outlander().parts_of(4) & bit_of(ModulePart::cells_2)) == 0);
  CHECK((outlander().parts_of(5) & bit_of(ModulePart::cells_2)) != 0);
  CHECK((i3().parts_of(9) & bit_of(ModulePart::cells_4)) == 0);
  CHECK((i3().parts_of(10) & bit_of(ModulePart::cells_4)) != 0);
}

TEST_CASE("what sources do not agree on is how the pack file says it is", "[unit][foreign_modules]") {
  const ModuleMeasurements measured = measurements();
  const ModuleOptions other{.temperature_offset_dC = -400, .swaps_cell_frames = true};
  const ModuleFrames frames = outlander().answers(3, {}, measured, 0, other);
  const Heard heard = hear(outlander(), 3, frames, other);
  CHECK(heard.cell_voltage_uV[0] == measured.cell_voltage_uV[0]);
  CHECK(heard.cell_temperature_dC[0] == measured.cell_temperature_dC[0]);
  // Read with the default options it would be this:
  const Heard wrong = hear(outlander(), 3, frames, {});
  CHECK(wrong.cell_voltage_uV[0] == measured.cell_voltage_uV[4]);
  CHECK(wrong.cell_temperature_dC[0].value == measured.cell_temperature_dC[0].value - 100);
}

TEST_CASE("modules answer the rounds of a start with nothing that is measured", "[unit][foreign_modules]") {
  const ModuleQuestion start{.wants_voltages = false, .wants_temperatures = false, .is_start = true};
  CHECK(outlander().answers(1, start, measurements(), 0, {}).empty());
  CHECK(hear(i3(), 1, i3().answers(1, start, measurements(), 0, {}), {}).parts == bit_of(ModulePart::status));
}

TEST_CASE("a number that no cell can have is none, and is counted", "[unit][foreign_modules]") {
  const ModuleReport cells = outlander().take(frame_of(0x612, {0x13, 0x89, 0, 0, 0xFF, 0xFF, 0x0F, 0x82}), {});
  CHECK(cells.cell_voltage_uV[0].validity == Validity::out_of_range);  // 5.001 V
  CHECK(cells.cell_voltage_uV[1].validity == Validity::out_of_range);  // 0 V
  CHECK(cells.cell_voltage_uV[2].validity == Validity::not_fitted);
  CHECK(cells.cell_voltage_uV[3] == known(3'970'000));
  CHECK(values_out_of_range(cells, 8, 5) == 2);
  CHECK(values_out_of_range(cells, 1, 5) == 1);
  CHECK(values_out_of_range(outlander().take(frame_of(0x613, {}), {}), 4, 5) == 0);  // cells that it does not have
  const ModuleReport warm = i3().take(frame_of(0x170, {0xA1, 0x2B, 0x2B, 0x2B, 0xFE, 0, 0, 0}), {});
  CHECK(warm.cell_temperature_dC[0].validity == Validity::out_of_range);
  CHECK(values_out_of_range(warm, 12, 4) == 2);
  CHECK(values_out_of_range(warm, 12, 0) == 1);
  CHECK(values_out_of_range({}, 12, 4) == 0);
  CHECK(values_out_of_range({.stack_voltage_mV = {0, Validity::out_of_range}}, 12, 4) == 1);
}
