// Emulated power distribution unit: it follows commands that are valid and new, and opens by itself.
#include "mmu/devices/pdu.hpp"

#include <optional>

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using namespace internal_bus;

constexpr TimePoint power_up{50s};

CanFrame command_of(std::uint8_t outputs, std::uint8_t counter) {
  CanFrame frame = make_frame(contactor_command);
  frame.data[0] = outputs;
  seal(contactor_command, counter, frame);
  return frame;
}

ir155::Pwm insulation_of(ir155::State state, std::int64_t resistance_Ohm = 0) {
  return ir155::encode({state, known(resistance_Ohm)});
}

class PduBench {
 public:
  PduBench() {
    measured.insulation = insulation_of(ir155::State::normal, 1'200'000);
    (void)pdu.tick(now, measured);
  }
  Pdu pdu{power_up};
  PduMeasurements measured;
  TimePoint now = power_up;

  std::vector<std::pair<TimePoint, CanFrame>> run(Duration duration) {
    std::vector<std::pair<TimePoint, CanFrame>> sent;
    for (const TimePoint end = now + duration; now < end;) {
      now += 1ms;
      for (const CanFrame& frame : pdu.tick(now, measured)) sent.emplace_back(now, frame);
    }
    return sent;
  }
  void tick_at(TimePoint at) {
    now = at;
    (void)pdu.tick(at, measured);
  }
};

TEST_CASE("a valid command drives exactly its outputs", "[unit][pdu]") {
  for (unsigned outputs = 0; outputs < 0x80; ++outputs) {
    PduBench bench;
    bench.pdu.observe(command_of(static_cast<std::uint8_t>(outputs), 1), bench.now);
    const PduOutputs& driven = bench.pdu.outputs();
    const unsigned seen = (driven.contactors[0] ? 0x01U : 0U) | (driven.contactors[1] ? 0x02U : 0U) |
                          (driven.contactors[2] ? 0x04U : 0U) | (driven.contactors[3] ? 0x08U : 0U) |
                          (driven.auxiliary ? 0x10U : 0U) | (driven.fan ? 0x20U : 0U) | (driven.heater ? 0x40U : 0U);
    REQUIRE(seen == outputs);
  }
}

TEST_CASE("without a new command everything opens after 200 ms, not before", "[unit][pdu]") {
  PduBench bench;
  const TimePoint commanded_at = bench.now;
  bench.pdu.observe(command_of(0x7F, 1), commanded_at);
  bench.tick_at(commanded_at + 200ms - 1ns);
  CHECK(bench.pdu.outputs().any());
  bench.tick_at(commanded_at + 200ms);
  CHECK_FALSE(bench.pdu.outputs().any());
  CHECK(bench.pdu.counts().timeouts == 1);

  SECTION("which is said until the next command") {
    bench.run(1s);
    auto sent = bench.run(50ms);
    REQUIRE(!sent.empty());
    CHECK(read_raw<pdu_status, "opened_by_timeout">(sent.back().second) == 1);
    bench.pdu.observe(command_of(0, 2), bench.now);
    sent = bench.run(50ms);
    REQUIRE(!sent.empty());
    CHECK(read_raw<pdu_status, "opened_by_timeout">(sent.back().second) == 0);
    CHECK(bench.pdu.counts().timeouts == 1);
  }
}

TEST_CASE("an open alarm loop opens at once, whatever is commanded, and is reported", "[unit][pdu][SEC_1]") {
  PduBench bench;
  std::uint8_t counter = 0;
  const auto command = [&](std::uint8_t outputs) { bench.pdu.observe(command_of(outputs, ++counter), bench.now); };
  const auto tick = [&] {
    bench.now += 1ms;
    return bench.pdu.tick(bench.now, bench.measured);
  };
  command(0x7F);
  tick();
  bench.measured.alarm_loop_open = true;
  const PduFrames frames = tick();
  CHECK(bench.pdu.outputs() == PduOutputs{.fan = true});
  REQUIRE(frames.size() == 1);  // at once
  CHECK(read_raw<pdu_status, "alarm_loop_open">(frames[0]) == 1);
  CHECK(read_raw<pdu_status, "opened_by_timeout">(frames[0]) == 1);
  CHECK(read_raw<pdu_status, "resume_button">(frames[0]) == 0);
  CHECK(bench.pdu.counts().alarms == 1);
  CHECK(bench.pdu.counts().timeouts == 0);

  for (int more = 0; more < 20; ++more) {
    command(0x7F);
    CHECK(bench.pdu.outputs() == PduOutputs{.fan = true});
    tick();
    CHECK(bench.pdu.outputs() == PduOutputs{.fan = true});
  }
  CHECK(bench.pdu.counts().alarms == 1);

  SECTION("the loop closes again while the command is to close: nothing closes") {
    bench.measured.alarm_loop_open = false;
    for (int more = 0; more < 20; ++more) {
      tick();
      command(0x13);
      CHECK_FALSE(bench.pdu.outputs().any());
    }
    CHECK(bench.pdu.counts().alarms == 1);
    command(0);
    tick();
    command(0x13);
    CHECK(bench.pdu.outputs().contactors == ContactorFlags{true, true, false, false});
  }
  SECTION("a command to open while the loop is open changes nothing for the next one to close") {
    command(0);
    const PduFrames told = tick();
    REQUIRE(told.size() == 1);
    CHECK(read_raw<pdu_status, "opened_by_timeout">(told[0]) == 0);
    CHECK(read_raw<pdu_status, "alarm_loop_open">(told[0]) == 1);
    command(0x03);
    CHECK_FALSE(bench.pdu.outputs().any());
    bench.measured.alarm_loop_open = false;
    tick();
    command(0x03);
    CHECK_FALSE(bench.pdu.outputs().any());
  }
}

TEST_CASE("an alarm loop that opens while nothing is driven is no opening", "[unit][pdu][SEC_1]") {
  PduBench bench;
  bench.measured.alarm_loop_open = true;
  bench.run(100ms);
  CHECK(bench.pdu.counts().alarms == 0);
  bench.measured.alarm_loop_open = false;
  bench.run(100ms);
  bench.pdu.observe(command_of(0, 1), bench.now);
  bench.pdu.observe(command_of(0x03, 2), bench.now);
  CHECK(bench.pdu.outputs().contactors == ContactorFlags{true, true, false, false});
}

TEST_CASE("a command that fails any check changes nothing and buys no time", "[unit][pdu]") {
  PduBench bench;
  const TimePoint commanded_at = bench.now;
  bench.pdu.observe(command_of(0x03, 7), commanded_at);
  CanFrame bad = command_of(0x07, 8);
  SECTION("repeated counter") {
    bad = command_of(0x03, 7);
  }
  SECTION("repeated counter, other content") {
    bad = command_of(0x07, 7);
  }
  SECTION("wrong complement, checksum right") {
    bad.data[1] = 0xF0;
    bad.data[7] = frame_crc(bad);
  }
  SECTION("wrong checksum") {
    bad.data[7] ^= 0x01;
  }
  SECTION("wrong length") {
    bad.length = 7;
  }
  SECTION("extended") {
    bad.is_extended = true;
  }
  SECTION("remote") {
    bad.is_remote = true;
  }
  SECTION("error frame") {
    bad.is_error = true;
  }
  bench.run(199ms);
  bench.pdu.observe(bad, bench.now);
  CHECK(bench.pdu.outputs().contactors == ContactorFlags{true, true, false, false});
  CHECK(bench.pdu.receive_counts().rejected_total() == 1);
  bench.run(1ms);
  CHECK_FALSE(bench.pdu.outputs().any());
}

TEST_CASE("new commands keep it closed", "[unit][pdu]") {
  PduBench bench;
  for (unsigned counter = 0; counter < 600; ++counter) {
    bench.pdu.observe(command_of(0x03, static_cast<std::uint8_t>(counter)), bench.now);
    bench.run(199ms);
  }
  CHECK(bench.pdu.outputs().any());
  CHECK(bench.pdu.counts().timeouts == 0);
}

TEST_CASE("a unit that idles does not call silence a time-out", "[unit][pdu]") {
  PduBench bench;
  bench.run(1s);
  bench.pdu.observe(command_of(0, 1), bench.now);
  const auto sent = bench.run(1s);
  for (const auto& [at, frame] : sent) CHECK(read_raw<pdu_status, "opened_by_timeout">(frame) == 0);
}

TEST_CASE("PDU_STATUS comes every 50 ms with a running counter", "[unit][pdu]") {
  PduBench bench;
  const auto sent = bench.run(1s);
  REQUIRE(sent.size() == 20);
  for (std::size_t index = 1; index < sent.size(); ++index) {
    CHECK(sent[index].first - sent[index - 1].first == 50ms);
    CHECK(sent[index].second.data[6] == static_cast<std::uint8_t>(sent[index - 1].second.data[6] + 1));
  }
}

TEST_CASE("PDU_STATUS comes at once when a contact, an output or an input changes", "[unit][pdu]") {
  PduBench bench;
  bench.run(60ms);
  SECTION("contact") {
    bench.measured.feedback[2] = true;
  }
  SECTION("output") {
    bench.pdu.observe(command_of(0x10, 1), bench.now);
  }
  SECTION("contactor output") {
    bench.pdu.observe(command_of(0x01, 1), bench.now);
  }
  SECTION("key") {
    bench.measured.inputs.vehicle_on = true;
  }
  SECTION("emergency stop") {
    bench.measured.inputs.estop_2_released = false;
  }
  SECTION("insulation monitor") {
    bench.measured.insulation = insulation_of(ir155::State::earth_fault);
  }
  CHECK(bench.run(1ms).size() == 1);
  CHECK(bench.run(35ms).empty());
}

TEST_CASE("a value that never stands still waits for its period", "[unit][pdu]") {
  PduBench bench;
  bench.run(60ms);
  bench.measured.insulation = insulation_of(ir155::State::normal, 300'000);
  bench.measured.throttle_permille = known(500);
  CHECK(bench.run(35ms).empty());
  const auto sent = bench.run(10ms);
  REQUIRE(sent.size() == 1);
  CHECK(read<pdu_status, "insulation_resistance_Ohm">(sent[0].second) == known(300'000));
  CHECK(read<pdu_status, "throttle_permille">(sent[0].second) == known(500));
}

TEST_CASE("a unit with a sensor in the intake air reports it once a second", "[unit][pdu][AIR_1]") {
  PduBench bench;
  const auto temperatures = [&bench] {
    std::vector<CanFrame> frames;
    for (const auto& [at, frame] : bench.run(3s)) {
      if (frame.id == pdu_temperature.base_id) frames.push_back(frame);
    }
    return frames;
  };
  CHECK(temperatures().empty());
  bench.measured.intake_air_dC = known(215);
  const std::vector<CanFrame> frames = temperatures();
  REQUIRE(frames.size() == 3);
  CHECK(read<pdu_temperature, "intake_air_temperature_dC">(frames[0]) == known(215));
  CHECK(frames[1].data[6] == frames[0].data[6] + 1);
}

TEST_CASE("PDU_STATUS tells what the insulation monitor's signal means", "[unit][pdu][FS_3]") {
  struct Case {
    ir155::State state;
    std::int64_t told;
    SignalValue told_Ohm;
  };
  const Case cases[] = {
      {ir155::State::no_signal_low, 0, not_known()},    {ir155::State::no_signal_high, 0, not_known()},
      {ir155::State::normal, 1, known(300'000)},        {ir155::State::undervoltage, 2, known(300'000)},
      {ir155::State::speed_start_good, 3, not_known()}, {ir155::State::speed_start_bad, 3, not_known()},
      {ir155::State::device_error, 4, not_known()},     {ir155::State::earth_fault, 5, not_known()},
      {ir155::State::undefined, 0, not_known()},
  };
  for (const Case& one : cases) {
    INFO(ir155::to_text(one.state));
    PduBench bench;
    bench.measured.insulation = insulation_of(one.state, 300'000);
    const auto sent = bench.run(50ms);
    REQUIRE(!sent.empty());
    CHECK(read_raw<pdu_status, "insulation_monitor_state">(sent.back().second) == one.told);
    CHECK(read<pdu_status, "insulation_resistance_Ohm">(sent.back().second) == one.told_Ohm);
  }
  PduBench bench;
  bench.measured.insulation = insulation_of(ir155::State::normal, 80'000'000);
  const auto sent = bench.run(50ms);
  REQUIRE(!sent.empty());
  CHECK(read<pdu_status, "insulation_resistance_Ohm">(sent.back().second) == not_known(Validity::above_range));
}

TEST_CASE("PDU_STATUS is what the worked frame of the protocol is", "[unit][pdu]") {
  PduBench bench;
  bench.measured.inputs.vehicle_on = true;
  bench.measured.feedback = {false, true, true, false};
  std::optional<CanFrame> frame;
  for (int count = 0; count < 5; ++count) {
    const auto sent = bench.run(50ms);
    REQUIRE(!sent.empty());
    frame = sent.back().second;
    if (frame->data[6] == 5) break;
  }
  CHECK(frame->data == FrameBytes{0x06, 0x3D, 0x04, 0xB0, 0x01, 0xFF, 0x05, 0x2E});
}

TEST_CASE("a contactor follows its coil after its delay and fails in its ways", "[unit][pdu][plant]") {
  Contactor one({.closing = 20ms, .opening = 10ms});
  TimePoint now = power_up;
  one.update(true, now);
  one.update(true, now + 20ms - 1ns);
  CHECK_FALSE(one.is_closed());
  one.update(true, now + 20ms);
  CHECK(one.is_closed());
  now += 1s;
  one.update(false, now);
  one.update(false, now + 10ms - 1ns);
  CHECK(one.is_closed());
  one.update(false, now + 10ms);
  CHECK_FALSE(one.is_closed());

  one.set_fault(ContactorFault::welded);
  CHECK(one.is_closed());
  CHECK(one.feedback());
  one.set_auxiliary(AuxiliaryContact::stays_open);
  CHECK_FALSE(one.feedback());
  one.set_fault(ContactorFault::stuck_open);
  now += 1s;
  one.update(true, now);
  one.update(true, now + 1s);
  CHECK_FALSE(one.is_closed());
}

}  // namespace
}  // namespace bmu
