// Effect of each fault of a module on its frames.
#include "mmu/devices/module_wire.hpp"

#include <vector>

#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;
using namespace internal_bus;

/// Module unit that sends over a faulty wire.
class WireBench {
 public:
  WireBench() { unit.settle(); }

  MmuBench unit;
  ModuleWire wire;
  ModuleWireFaults faults;

  /// POLLs for everything and returns the frames of the next `duration`.
  std::vector<TimedFrame> ask(Duration duration = 20ms) {
    unit.poll(want_all);
    return run(duration);
  }
  std::vector<TimedFrame> run(Duration duration) {
    std::vector<TimedFrame> sent;
    for (const TimePoint end = unit.now + duration; unit.now < end;) {
      unit.now += 1ms;
      wire.push(unit.mmu.tick(unit.now, unit.transfer()), faults, unit.now);
      while (const auto frame = wire.pop(unit.now)) sent.push_back({unit.now, *frame});
    }
    return sent;
  }
};

std::vector<FrameBytes> bytes_of(const std::vector<TimedFrame>& frames, std::size_t first, std::size_t last) {
  std::vector<FrameBytes> all;
  for (const TimedFrame& one : frames) {
    FrameBytes part{};
    std::copy(one.frame.data.begin() + static_cast<std::ptrdiff_t>(first),
              one.frame.data.begin() + static_cast<std::ptrdiff_t>(last), part.begin());
    all.push_back(part);
  }
  return all;
}
std::vector<FrameBytes> data_of(const std::vector<TimedFrame>& frames) {
  return bytes_of(frames, 0, 6);
}

bool all_checksums_right(const std::vector<TimedFrame>& frames) {
  return std::all_of(frames.begin(), frames.end(),
                     [](const TimedFrame& one) { return one.frame.data[7] == frame_crc(one.frame); });
}
bool all_have_counter(const std::vector<TimedFrame>& frames, std::uint8_t counter) {
  return std::all_of(frames.begin(), frames.end(),
                     [counter](const TimedFrame& one) { return one.frame.data[6] == counter; });
}

TEST_CASE("a healthy wire changes nothing", "[unit][mmu][wire]") {
  WireBench bench;
  MmuBench alone;
  alone.settle();
  alone.poll(want_all);
  const auto expected = alone.run(20ms);
  const auto sent = bench.ask();
  REQUIRE(sent.size() == 9);
  REQUIRE(expected.size() == 9);
  for (std::size_t index = 0; index < sent.size(); ++index) {
    CHECK(sent[index].at == expected[index].at);
    CHECK(sent[index].frame == expected[index].frame);
  }
}

TEST_CASE("stuck: old data, new counter, frozen counter: new data, old counter, replay: both old",
          "[unit][mmu][wire]") {
  WireBench bench;
  const auto before = bench.ask();
  const std::uint8_t old_counter = bench.unit.poll_counter;
  bool is_data_old = false;
  bool is_counter_old = false;
  SECTION("stuck") {
    bench.faults.is_stuck = true;
    is_data_old = true;
  }
  SECTION("frozen counter") {
    bench.faults.has_frozen_counter = true;
    is_counter_old = true;
  }
  SECTION("replay") {
    bench.faults.is_replaying = true;
    is_data_old = true;
    is_counter_old = true;
  }
  bench.unit.measured.cell_voltage_uV.fill(3'300'000);
  bench.unit.measured.cell_temperature_dC.fill(known(400));
  bench.run(1s);
  for (int again = 0; again < 3; ++again) {
    const auto after = bench.ask();
    REQUIRE(after.size() == before.size());
    CHECK((data_of(after) == data_of(before)) == is_data_old);
    CHECK(all_have_counter(after, is_counter_old ? old_counter : bench.unit.poll_counter));
    CHECK(all_checksums_right(after));
  }
  bench.faults = {};
  const auto healed = bench.ask();
  CHECK(data_of(healed) != data_of(before));
  CHECK(all_have_counter(healed, bench.unit.poll_counter));
}

TEST_CASE("a frozen counter and a replay are late for the master, a stuck module is not", "[unit][mmu][wire]") {
  const auto accepted_with = [](auto set_fault) {
    WireBench bench;
    ReceiveCheck check(catalogue, ReceiveCheck::Role::master);
    bench.ask();
    set_fault(bench.faults);
    std::size_t accepted = 0;
    for (int again = 0; again < 3; ++again) {
      const auto sent = bench.ask();
      check.note_sent(poll_frame(0, want_all, bench.unit.poll_counter));
      for (const TimedFrame& one : sent) accepted += check.check(one.frame).is_accepted ? 1U : 0U;
    }
    return accepted;
  };
  CHECK(accepted_with([](ModuleWireFaults&) {}) == 27);
  CHECK(accepted_with([](ModuleWireFaults& faults) { faults.is_stuck = true; }) == 27);
  CHECK(accepted_with([](ModuleWireFaults& faults) { faults.has_frozen_counter = true; }) == 0);
  CHECK(accepted_with([](ModuleWireFaults& faults) { faults.is_replaying = true; }) == 0);
}

TEST_CASE("a module leaves out exactly the frames it omits", "[unit][mmu][wire]") {
  struct Case {
    OmittedFrames omitted;
    std::vector<std::uint32_t> missing;
  };
  const Case cases[] = {
      {OmittedFrames::nothing, {}},
      {OmittedFrames::status, {0x103}},
      {OmittedFrames::cells, {0x143, 0x183, 0x1C3, 0x203}},
      {OmittedFrames::temperatures, {0x243, 0x283}},
      {OmittedFrames::module, {0x2C3}},
      {OmittedFrames::ident, {0x303}},
  };
  for (const Case& one : cases) {
    WireBench bench;
    bench.faults.omitted = one.omitted;
    const auto sent = bench.ask();
    CHECK(sent.size() == 9 - one.missing.size());
    for (const std::uint32_t id : one.missing) {
      CHECK(std::none_of(sent.begin(), sent.end(), [id](const TimedFrame& frame) { return frame.frame.id == id; }));
    }
    bench.unit.mmu.observe(command_frame(3, bench.unit.next_command(), {4}), bench.unit.now);
    CHECK(bench.run(10ms).size() == 1);  // a RESPONSE is no part of an answer
  }
}

TEST_CASE("frames of a slow module leave later, complete and in their order", "[unit][mmu][wire]") {
  WireBench bench;
  const auto prompt = bench.ask(1s);
  bench.faults.delay = 500ms;
  const auto slow = bench.ask(1s);
  REQUIRE(slow.size() == prompt.size());
  for (std::size_t index = 0; index < slow.size(); ++index) {
    CHECK(slow[index].at == prompt[index].at + 1s + 500ms);
    CHECK(slow[index].frame.id == prompt[index].frame.id);
  }
  SECTION("as many as a POLL each 100 ms brings") {
    std::size_t sent = 0;
    for (int poll = 0; poll < 20; ++poll) sent += bench.ask(100ms).size();
    CHECK(sent + bench.run(1s).size() == std::size_t{20} * 9);
  }
  SECTION("more than there is room for is lost, the rest comes") {
    std::size_t sent = 0;
    for (int poll = 0; poll < 20; ++poll) sent += bench.ask(20ms).size();
    CHECK(sent + bench.run(1s).size() == ModuleWire::frames_max);
  }
  SECTION("silence forgets what was on its way") {
    bench.ask(100ms);
    bench.faults.is_silent = true;
    bench.run(1ms);
    bench.faults.is_silent = false;
    CHECK(bench.run(1s).empty());
  }
}

TEST_CASE("a masquerading module carries the other's identifiers with right checksums", "[unit][mmu][wire]") {
  WireBench bench;
  bench.faults.node = 5;
  const auto sent = bench.ask();
  REQUIRE(sent.size() == 9);
  for (const TimedFrame& one : sent) CHECK((one.frame.id & 0x3FU) == 5);
  CHECK(sent[0].frame.id == 0x105);
  CHECK(all_checksums_right(sent));
}

TEST_CASE("what a module says of itself can be wrong, and nothing else changes with it", "[unit][mmu][wire]") {
  WireBench bench;
  const auto before = bench.ask();
  bench.faults.cell_count = 11;
  bench.faults.protocol_version = 2;
  bench.faults.serial_number = 4'294'967'295;
  const auto sent = bench.ask();
  REQUIRE(sent.size() == 9);
  CHECK(read_raw<status, "cell_count">(sent.front().frame) == 11);
  CHECK(read_raw<ident, "cell_count">(sent.back().frame) == 11);
  CHECK(read_raw<ident, "protocol_version">(sent.back().frame) == 2);
  CHECK(read_raw<ident, "serial_number">(sent.back().frame) == 4'294'967'295);
  CHECK(read_raw<ident, "temperature_sensor_count">(sent.back().frame) == 4);
  CHECK(std::equal(sent.begin() + 1, sent.end() - 1, before.begin() + 1, [](const auto& one, const auto& other) {
    return std::equal(one.frame.data.begin(), one.frame.data.begin() + 6, other.frame.data.begin());
  }));
  CHECK(all_checksums_right(sent));
}

TEST_CASE("damaged frames have a wrong checksum and are otherwise whole", "[unit][mmu][wire]") {
  WireBench bench;
  bench.faults.has_damaged_frames = true;
  for (const TimedFrame& one : bench.ask()) CHECK(one.frame.data[7] == (frame_crc(one.frame) ^ 0x55));
}

}  // namespace
}  // namespace bmu
