// Cyclic cell voltages and temperatures on the vehicle bus: the frames, their times, and unknown values.
#include "daemon/core/vehicle/cell_reporter.hpp"

#include <map>
#include <vector>

#include "daemon/core/contactors/output_gate.hpp"
#include "devices/cell_data/cell_data.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using test::CoreBench;

namespace {

constexpr std::uint32_t voltages_id = 0x650;
constexpr std::uint32_t temperatures_id = 0x651;

/// Eight cells and four sensors: three frames and two.
CoreConfig pack_with_cell_data(Duration period = 1s) {
  CoreConfig config = test::small_pack();
  config.vehicle.cell_voltages_id = voltages_id;
  config.vehicle.cell_temperatures_id = temperatures_id;
  config.vehicle.cell_data_period = period;
  return config;
}

struct Sent {
  TimePoint at;
  CanFrame frame;
};

/// Cell data frames sent after `since`.
std::vector<Sent> cell_data_of(const CoreBench& bench, TimePoint since = {}) {
  std::vector<Sent> frames;
  for (std::size_t index = 0; index < bench.sent().size(); ++index) {
    const OutgoingFrame& sent = bench.sent()[index];
    const bool is_one = sent.frame.id == voltages_id || sent.frame.id == temperatures_id;
    if (is_one && bench.sent_at()[index] > since) {
      CHECK(sent.port == Port::vehicle);
      frames.push_back({bench.sent_at()[index], sent.frame});
    }
  }
  return frames;
}

/// Values of the latest frames of each block, by pack number from 1.
struct Heard {
  std::map<int, SignalValue> voltage_uV;
  std::map<int, SignalValue> temperature_dC;

  explicit Heard(const std::vector<Sent>& frames) {
    for (const Sent& sent : frames) {
      const bool is_voltage = sent.frame.id == voltages_id;
      const MessageSpec& row = is_voltage ? cell_data::voltages : cell_data::temperatures;
      CHECK(sent.frame.data[1] == (is_voltage ? 2 : 1));
      for (int slot = 0; slot < 3; ++slot) {
        const SignalSpec& signal = row.signals[cell_data::first_value + static_cast<std::size_t>(slot)];
        (is_voltage ? voltage_uV : temperature_dC)[3 * sent.frame.data[0] + slot + 1] =
            decode_signal(signal, sent.frame.data);
      }
    }
  }
};

}  // namespace

TEST_CASE("without identifiers no cell data is sent", "[unit][vehicle][VEH_1]") {
  CoreBench bench(test::small_pack());
  bench.run(3s);
  CHECK(cell_data_of(bench).empty());
  CHECK(cell_data_blocks(bench.core().config()).count() == 0);
}

TEST_CASE("every cell and every sensor leaves once a period, spread over it", "[unit][vehicle][VEH_1]") {
  CoreBench bench(pack_with_cell_data());
  bench.modules[1].cell_voltage_uV[2] = known(3'651'200);
  bench.modules[1].cell_temperature_dC[0] = known(-53);
  bench.run(4s);
  const auto frames = cell_data_of(bench, bench.now() - 2s);
  REQUIRE(frames.size() == 10);
  for (std::size_t index = 1; index < frames.size(); ++index) {
    const Duration apart = frames[index].at - frames[index - 1].at;
    CHECK(apart >= 190ms);
    CHECK(apart <= 210ms);
  }
  const Heard heard(frames);
  REQUIRE(heard.voltage_uV.size() == 9);
  REQUIRE(heard.temperature_dC.size() == 6);
  for (int cell = 1; cell <= 8; ++cell) CHECK(heard.voltage_uV.at(cell).is_valid());
  CHECK(heard.voltage_uV.at(7) == known(3'651'200));
  CHECK_FALSE(heard.voltage_uV.at(9).is_valid());  // no such cell
  for (int sensor = 1; sensor <= 4; ++sensor) CHECK(heard.temperature_dC.at(sensor).is_valid());
  CHECK(heard.temperature_dC.at(3) == known(-53));
  CHECK_FALSE(heard.temperature_dC.at(5).is_valid());
  CHECK(bench.core().gate_refusals() == 0);
}

TEST_CASE("one kind of cell data may be sent without the other", "[unit][vehicle][VEH_1]") {
  CoreConfig config = pack_with_cell_data();
  SECTION("voltages") {
    config.vehicle.cell_temperatures_id = 0;
    CoreBench bench(config);
    bench.run(3s);
    CHECK(cell_data_of(bench, bench.now() - 1s).size() == 3);
  }
  SECTION("temperatures") {
    config.vehicle.cell_voltages_id = 0;
    CoreBench bench(config);
    bench.run(3s);
    CHECK(cell_data_of(bench, bench.now() - 1s).size() == 2);
  }
}

TEST_CASE("a cell that is not measured and a module that is silent leave as unknown", "[unit][vehicle][VEH_1]") {
  CoreBench bench(pack_with_cell_data());
  bench.run(2s);
  bench.modules[0].cell_voltage_uV[1] = not_known();
  bench.modules[1].talks = false;
  bench.run(3s);
  const auto frames = cell_data_of(bench, bench.now() - 1s);
  const Heard heard(frames);
  CHECK(heard.voltage_uV.at(1).is_valid());
  CHECK_FALSE(heard.voltage_uV.at(2).is_valid());
  for (int cell = 5; cell <= 8; ++cell) CHECK_FALSE(heard.voltage_uV.at(cell).is_valid());
  for (int sensor = 3; sensor <= 4; ++sensor) CHECK_FALSE(heard.temperature_dC.at(sensor).is_valid());
  for (const Sent& sent : frames) {
    if (sent.frame.id != voltages_id || sent.frame.data[0] != 0) continue;
    CHECK(sent.frame.data[4] == 0xFF);
    CHECK(sent.frame.data[5] == 0xFF);
  }
}

TEST_CASE("after a gap a round starts from its beginning, without a burst", "[unit][vehicle][VEH_1]") {
  const CoreConfig config = pack_with_cell_data();
  ModuleTable modules;
  modules.init(config);
  CellReporter reporter;
  TimePoint now{100s};
  reporter.init(config, now);
  CHECK_FALSE(reporter.is_due(now + 999ms));
  std::vector<std::uint8_t> blocks;
  const auto run = [&](Duration duration) {
    for (const TimePoint end = now + duration; now < end; now += 10ms) {
      if (const auto frame = reporter.step(now, modules, config)) blocks.push_back(frame->data[0]);
    }
  };
  run(1500ms);
  CHECK(blocks == std::vector<std::uint8_t>{0, 1, 2});
  now += 1h;
  blocks.clear();
  run(1s);
  CHECK(blocks == std::vector<std::uint8_t>{0, 1, 2, 0, 1});
}

TEST_CASE("the output gate lets cell data out at its identifiers and in its form alone", "[unit][gate][VEH_1]") {
  const GateRules rules{.cell_voltages_id = voltages_id, .cell_temperatures_id = temperatures_id};
  CanFrame frame = make_frame(cell_data::voltages);
  CHECK(judge_output(Port::vehicle, frame, rules) == GateVerdict::pass);
  CHECK(judge_output(Port::internal, frame, rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::vehicle, frame, {}) == GateVerdict::not_ours);
  frame.length = 7;
  CHECK(judge_output(Port::vehicle, frame, rules) == GateVerdict::malformed);
  frame = make_frame(cell_data::temperatures);
  CHECK(judge_output(Port::vehicle, frame, rules) == GateVerdict::pass);
  frame.is_extended = true;
  CHECK(judge_output(Port::vehicle, frame, rules) == GateVerdict::malformed);
  frame = make_frame(cell_data::voltages);
  frame.id = 0;
  CHECK(judge_output(Port::vehicle, frame, {}) == GateVerdict::not_ours);
}

TEST_CASE("another sender of the cell data is a foreign reporter", "[unit][vehicle][VEH_1]") {
  CoreBench bench(pack_with_cell_data());
  bench.run(2s);
  CHECK_FALSE(bench.core().faults().state(FaultId::foreign_reporter).is_warning);
  const auto is_noted = [&bench] {
    const FaultState& state = bench.core().faults().state(FaultId::foreign_reporter);
    return state.is_warning || state.is_present();
  };
  for (int round = 0; round < 10 && !is_noted(); ++round) {
    CanFrame frame = make_frame(cell_data::voltages);
    bench.observe(FrameReceived{Port::vehicle, frame});
    bench.run(100ms);
  }
  CHECK(is_noted());
}
