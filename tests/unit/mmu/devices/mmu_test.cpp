// Emulated module unit against the protocol.
#include <algorithm>

#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;
using namespace internal_bus;

constexpr std::int64_t done = static_cast<std::int64_t>(CommandResult::done);
constexpr std::int64_t unknown_operation = static_cast<std::int64_t>(CommandResult::unknown_operation);
constexpr std::int64_t bad_argument = static_cast<std::int64_t>(CommandResult::bad_argument);
constexpr std::int64_t refused = static_cast<std::int64_t>(CommandResult::refused_in_this_mode);

std::vector<std::uint32_t> ids(const std::vector<TimedFrame>& frames) {
  std::vector<std::uint32_t> list;
  list.reserve(frames.size());
  for (const TimedFrame& one : frames) list.push_back(one.frame.id);
  return list;
}

using Ids = std::vector<std::uint32_t>;

// --- answering ------------------------------------------------------------------------------------------------------

TEST_CASE("STATUS follows its POLL within 2 ms, then come CELLS, TEMP, MODULE and IDENT in turn",
          "[unit][mmu][MMU_1][MMU_6]") {
  MmuBench bench;
  bench.settle();
  const TimePoint polled_at = bench.now;
  const auto answer = bench.ask(want_all | want_sync);
  CHECK(ids(answer) == Ids{0x103, 0x143, 0x183, 0x1C3, 0x203, 0x243, 0x283, 0x2C3, 0x303});
  REQUIRE(!answer.empty());
  CHECK(answer.front().at - polled_at <= 2ms);
  for (const TimedFrame& one : answer) CHECK(one.frame.data[6] == bench.poll_counter);
}

TEST_CASE("an answer is what the worked frames of the protocol are", "[unit][mmu][MMU_1][MMU_4][MMU_16]") {
  MmuBench bench({.node = 3, .board_sensor_count = 3, .serial_number = 1234567});
  auto& measured = bench.measured;
  measured.cell_voltage_uV = {3'651'200, 3'649'800, 3'653'000, 3'651'200, 3'650'000, 3'650'000,
                              3'650'000, 3'650'000, 3'650'000, 3'650'000, 3'650'000, 3'650'000};
  measured.converted_cells = static_cast<CellMask>(first_cells(12) & ~cell_bit(4));
  measured.cell_temperature_dC = {known(251), known(-53), not_known(Validity::open_circuit), known(253)};
  measured.board_temperature_dC = {known(310), known(330), known(300), not_known(Validity::not_fitted)};
  measured.module_mV = 43'812;
  bench.settle();
  bench.poll_counter = 41;
  const auto answer = bench.ask(want_all);
  REQUIRE(answer.size() == 9);
  const auto bytes_of = [&answer](std::uint32_t id) {
    return std::find_if(answer.begin(), answer.end(), [id](const TimedFrame& one) { return one.frame.id == id; })
        ->frame.data;
  };
  CHECK(bytes_of(0x143) == FrameBytes{0x8E, 0xA0, 0x8E, 0x92, 0x8E, 0xB2, 0x2A, 0xB2});
  CHECK(bytes_of(0x183) == FrameBytes{0x8E, 0xA0, 0xFF, 0xFF, 0x8E, 0x94, 0x2A, 0x66});
  CHECK(bytes_of(0x243) == FrameBytes{0x00, 0xFB, 0xFF, 0xCB, 0x80, 0x01, 0x2A, 0xC7});
  CHECK(bytes_of(0x283) == FrameBytes{0x00, 0xFD, 0x1F, 0x21, 0x1E, 0x80, 0x2A, 0xD4});
  CHECK(bytes_of(0x303) == FrameBytes{0x01, 0xC4, 0x00, 0x12, 0xD6, 0x87, 0x2A, 0x8D});
  const CanFrame status_frame = answer.front().frame;
  CHECK(read_raw<status, "mode">(status_frame) == static_cast<std::int64_t>(Mode::normal));
  CHECK(read_raw<status, "supply">(status_frame) == 0);
  CHECK(read_raw<status, "cell_count">(status_frame) == 12);
  CHECK(read_raw<status, "temperature_sensor_fault">(status_frame) == 1);
}

TEST_CASE("a module sends only the CELLS frames it has cells for", "[unit][mmu][MMU_1]") {
  const std::vector<std::pair<std::uint8_t, std::size_t>> frames_of_cells{{1, 1}, {3, 1}, {4, 2},  {6, 2},
                                                                          {7, 3}, {9, 3}, {10, 4}, {12, 4}};
  for (const auto& [cells, frames] : frames_of_cells) {
    MmuBench bench({.node = 1, .cell_count = cells, .temperature_sensor_count = 1});
    bench.settle();
    const auto answer = bench.ask(want_cells);
    INFO("cells: " << int{cells});
    REQUIRE(answer.size() == frames);
    const CanFrame& last = answer.back().frame;
    const SignalSpec* const signals = cells_rows[frames - 1]->signals.data();
    for (std::size_t slot = 0; slot < cells_per_frame; ++slot) {
      const bool is_fitted = (frames - 1) * cells_per_frame + slot < cells;
      CHECK(decode_signal(signals[slot], last.data).is_valid() == is_fitted);
    }
  }
}

TEST_CASE("a POLL to another module is not answered, but shows that the master lives", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  CHECK(bench.ask(want_all, 4).empty());
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5})) == done);
  for (int second = 0; second < 3; ++second) {
    bench.ask(want_status, 4);
    bench.run(900ms);
  }
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));
}

TEST_CASE("a POLL amid an answer cuts off the rest", "[unit][mmu]") {
  MmuBench bench({.node = 3, .frame_spacing = 1ms});
  bench.settle();
  bench.poll(want_all);
  const auto first = bench.run(3ms);
  CHECK(ids(first) == Ids{0x103, 0x143, 0x183});
  const auto second = bench.ask(want_status | want_ident);
  CHECK(ids(second) == Ids{0x103, 0x303});
  CHECK(second.front().frame.data[6] == first.front().frame.data[6] + 1);
  CHECK(bench.mmu.counts().answers_cut_short == 1);

  SECTION("even one that asks for nothing") {
    bench.poll(want_all);
    bench.run(2ms);
    CHECK(bench.ask(0).empty());
  }
  SECTION("but not one to another module") {
    bench.poll(want_all);
    bench.run(2ms);
    CHECK(bench.ask(want_all, 4).size() == 7);
  }
}

TEST_CASE("a module without a pause between its frames gives all of an answer with one tick", "[unit][mmu]") {
  MmuBench bench({.node = 3, .frame_spacing = 0us});
  bench.settle();
  const auto answer = bench.ask(want_all);
  REQUIRE(answer.size() == 9);
  CHECK(answer.front().at == answer.back().at);
}

TEST_CASE("a damaged or repeated POLL is not answered", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  CanFrame frame = poll_frame(0, want_status, 77);
  SECTION("wrong checksum") {
    frame.data[7] ^= 1;
  }
  SECTION("wrong length") {
    frame.length = 7;
  }
  SECTION("extended") {
    frame.is_extended = true;
  }
  SECTION("remote") {
    frame.is_remote = true;
  }
  SECTION("repeated counter") {
    bench.mmu.observe(frame, bench.now);
    REQUIRE(bench.run(10ms).size() == 1);
  }
  bench.mmu.observe(frame, bench.now);
  CHECK(bench.run(10ms).empty());
  CHECK(bench.mmu.receive_counts().rejected_total() == 1);
}

TEST_CASE("SYNC gets the newest voltage sample, any other POLL the mean of the finished 100 ms block",
          "[unit][mmu][MMU_SCHED]") {
  MmuBench bench;
  bench.settle();
  bench.run(200ms - (bench.now - power_up) % 100ms + 1ms);  // 1 ms after an average and its newest sample
  bench.measured.cell_voltage_uV.fill(3'600'000);
  bench.run(50ms);
  const auto volts = [](const std::vector<TimedFrame>& answer) {
    return read<cells_1, "cell_voltage_1_uV">(answer.at(1).frame).value;
  };
  const auto momentary = bench.ask(want_status | want_cells | want_sync);
  CHECK(volts(momentary) == 3'600'000);
  CHECK(read<status, "cell_voltage_age_ms">(momentary.at(0).frame).value <= 10);
  const auto averaged = bench.ask(want_status | want_cells);
  CHECK(volts(averaged) == 3'700'000);
  CHECK(read<status, "cell_voltage_age_ms">(averaged.at(0).frame).value > 140);
}

TEST_CASE("the age of a mean is that of its oldest sample", "[unit][mmu][MMU_SCHED]") {
  for (int later_ms = 0; later_ms < 100; later_ms += 7) {
    MmuBench bench;
    const auto run_rising = [&bench](int ms) {  // 0.1 mV for each millisecond since it started
      std::vector<TimedFrame> sent;
      for (int each = 0; each < ms; ++each) {
        bench.measured.cell_voltage_uV.fill(3'000'000 +
                                            100 * static_cast<std::int32_t>(to_ms(bench.now + 1ms - power_up)));
        for (const TimedFrame& one : bench.run(1ms)) sent.push_back(one);
      }
      return sent;
    };
    run_rising(500 + later_ms);
    bench.poll(want_status | want_cells);
    const auto answer = run_rising(5);
    REQUIRE(answer.size() == 5);
    const std::int64_t said_at_ms = to_ms(answer[0].at - power_up);
    const std::int64_t age_ms = read<status, "cell_voltage_age_ms">(answer[0].frame).value;
    const std::int64_t mean_at_ms = (read<cells_1, "cell_voltage_1_uV">(answer[1].frame).value - 3'000'000) / 100;
    INFO("asked " << later_ms << " ms later");
    CHECK(said_at_ms - age_ms == mean_at_ms - 45);  // ten samples: the oldest is 45 ms before their middle
  }
}

TEST_CASE("what has not been measured yet is no voltage", "[unit][mmu]") {
  MmuBench bench;
  bench.run(15ms);
  const auto early = bench.ask(want_status | want_cells);
  CHECK(read<cells_1, "cell_voltage_1_uV">(early.at(1).frame).validity == Validity::not_fitted);
  CHECK_FALSE(read<status, "cell_voltage_age_ms">(early.at(0).frame).is_valid());
  CHECK(read_raw<status, "mode">(early.at(0).frame) == static_cast<std::int64_t>(Mode::starting));
  bench.run(90ms);
  CHECK(read_raw<status, "mode">(bench.status()) == static_cast<std::int64_t>(Mode::normal));
}

// --- flags ----------------------------------------------------------------------------------------------------------

TEST_CASE("the restarted flag is told once", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  CHECK(read_raw<status, "restarted">(bench.status()) == 1);
  CHECK(read_raw<status, "restarted">(bench.status()) == 0);
  bench.mmu.restart(bench.now);
  CHECK(read_raw<status, "restarted">(bench.status()) == 1);
}

TEST_CASE("10 ms times its node number after power-up a module says who it is, with counter 0", "[unit][mmu]") {
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 7, 63}) {
    MmuBench bench({.node = node, .serial_number = 99});
    const auto sent = bench.run(1s);
    REQUIRE(sent.size() == 1);
    CHECK(sent[0].frame.id == ident.base_id + node);
    CHECK(sent[0].frame.data[6] == 0);
    CHECK(read_raw<ident, "serial_number">(sent[0].frame) == 99);
    CHECK(sent[0].at == power_up + 10ms * node);
  }
}

TEST_CASE("a damaged transfer from the front end is dropped, reported once, and lets the voltages age",
          "[unit][mmu][MMU_PEC]") {
  MmuBench bench;
  bench.settle();
  bench.status();
  bench.measured.front_end_crc_ok = false;
  bench.measured.cell_voltage_uV.fill(1);
  bench.run(100ms);
  CHECK(read_raw<status, "front_end_crc_errors">(bench.status()) == 1);
  const auto answer = bench.ask(want_status | want_cells | want_sync);
  CHECK(read<cells_1, "cell_voltage_1_uV">(answer.at(1).frame).value == 3'700'000);
  CHECK(read<status, "cell_voltage_age_ms">(answer.at(0).frame).value > 100);

  SECTION("until their age cannot be said: then there is no voltage") {
    bench.run(250ms);
    const auto late = bench.ask(want_status | want_cells | want_sync);
    CHECK_FALSE(read<status, "cell_voltage_age_ms">(late.at(0).frame).is_valid());
    CHECK_FALSE(read<cells_1, "cell_voltage_1_uV">(late.at(1).frame).is_valid());
  }
  SECTION("and the flag goes with the STATUS after the last error") {
    bench.measured.front_end_crc_ok = true;
    bench.measured.cell_voltage_uV.fill(3'700'000);
    bench.run(20ms);
    bench.status();
    CHECK(read_raw<status, "front_end_crc_errors">(bench.status()) == 0);
  }
}

void damage_group(FrontEndTransfer& transfer, RegisterGroup group) {
  transfer.groups[static_cast<std::size_t>(group)][2] ^= 0x04;
}

TEST_CASE("one damaged group costs its three cells one sample, and their age is told", "[unit][mmu][MMU_PEC]") {
  MmuBench bench;
  bench.settle();
  bench.measured.cell_voltage_uV.fill(3'600'000);
  bench.on_transfer = [](FrontEndTransfer& transfer) { damage_group(transfer, RegisterGroup::cells_2); };
  bench.run(200ms);
  const auto answer = bench.ask(want_status | want_cells | want_sync);
  CHECK(read_raw<status, "front_end_crc_errors">(answer.at(0).frame) == 1);
  CHECK(read<status, "cell_voltage_age_ms">(answer.at(0).frame).value >= 200);
  CHECK(read<cells_1, "cell_voltage_3_uV">(answer.at(1).frame) == known(3'600'000));
  CHECK(read<cells_2, "cell_voltage_4_uV">(answer.at(2).frame) == known(3'700'000));
  CHECK(read<cells_3, "cell_voltage_7_uV">(answer.at(3).frame) == known(3'600'000));
  bench.run(100ms);
  const auto later = bench.ask(want_status | want_cells);
  CHECK(read<status, "cell_voltage_age_ms">(later.at(0).frame).value < 210);  // of the cells that have one
  CHECK_FALSE(read<cells_2, "cell_voltage_4_uV">(later.at(2).frame).is_valid());
  CHECK(read<cells_3, "cell_voltage_9_uV">(later.at(3).frame) == known(3'600'000));
}

TEST_CASE("the stack's voltage is unknown when it is as old as no cell's may be", "[unit][mmu][MMU_PEC]") {
  MmuBench bench;
  const auto told = [&bench] { return read<module, "module_voltage_mV">(bench.ask(want_module).at(0).frame); };
  bench.settle();
  CHECK(told() == known(44'400));
  bench.on_transfer = [](FrontEndTransfer& transfer) {
    transfer.groups[static_cast<std::size_t>(RegisterGroup::supplies)][0] ^= 0x10;
  };
  bench.run(230ms);
  CHECK(told() == known(44'400));
  bench.run(30ms);
  CHECK(told() == not_known());
  bench.on_transfer = nullptr;
  bench.run(10ms);
  CHECK(told() == known(44'400));
}

TEST_CASE("an average is of the samples that arrived", "[unit][mmu][MMU_PEC][MMU_SCHED]") {
  MmuBench bench;
  bench.settle();
  int transfers = 0;
  bench.on_transfer = [&transfers](FrontEndTransfer& transfer) {
    if (++transfers % 2 == 0) damage_group(transfer, RegisterGroup::cells_1);
  };
  for (int sample = 0; sample < 30; ++sample) {  // 3.6 V whenever the group will be damaged, 3.8 V whenever not
    bench.measured.cell_voltage_uV[0] = transfers % 2 == 1 ? 3'600'000 : 3'800'000;
    bench.run(10ms);
  }
  CHECK(read<cells_1, "cell_voltage_1_uV">(bench.ask(want_cells).at(0).frame) == known(3'800'000));
}

TEST_CASE("damaged thermistor readings are read again at once, and are unknown after three periods",
          "[unit][mmu][MMU_PEC][MMU_4]") {
  MmuBench bench;
  bench.settle();
  bench.run(500ms - (bench.now - power_up) % 500ms - 1ms);  // the next tick reads temperatures
  REQUIRE(bench.mmu.wants(bench.now + 1ms) == TransferWanted::everything);
  bench.measured.cell_temperature_dC[0] = known(400);
  bench.on_transfer = [](FrontEndTransfer& transfer) { damage_group(transfer, RegisterGroup::cell_sensors_2); };
  const auto first_sensor = [&bench] {
    return read<temp_1, "cell_temperature_1_dC">(bench.ask(want_temp).at(0).frame);
  };
  bench.run(5ms);
  CHECK(first_sensor() == known(250));
  SECTION("again with the next transfer") {
    bench.on_transfer = nullptr;
    bench.run(10ms);
    CHECK(first_sensor() == known(400));
  }
  SECTION("for ever") {
    bench.run(900ms);
    CHECK(first_sensor() == known(250));
    bench.run(200ms);
    CHECK(first_sensor() == not_known(Validity::open_circuit));
    CHECK(read_raw<status, "temperature_sensor_fault">(bench.status()) == 1);
  }
}

TEST_CASE("both curves give the temperature that is there", "[unit][mmu][MMU_NTC][RR_5]") {
  for (const ThermistorCurve curve : {ThermistorCurve::table, ThermistorCurve::steinhart_hart}) {
    MmuBench bench({.node = 3, .thermistor_curve = curve});
    bench.measured.cell_temperature_dC = {known(-200), known(0), known(451), known(999)};
    bench.measured.board_temperature_dC = {known(-100), known(20), known(700), known(1'200)};
    bench.settle();
    const auto answer = bench.ask(want_temp);
    CHECK(read<temp_1, "cell_temperature_1_dC">(answer.at(0).frame) == known(-200));
    CHECK(read<temp_1, "cell_temperature_2_dC">(answer.at(0).frame) == known(0));
    CHECK(read<temp_1, "cell_temperature_3_dC">(answer.at(0).frame) == known(451));
    CHECK(read<temp_2, "cell_temperature_4_dC">(answer.at(1).frame) == known(999));
    CHECK(read<temp_2, "board_temperature_1_dC">(answer.at(1).frame) == known(-100));
    CHECK(read<temp_2, "board_temperature_4_dC">(answer.at(1).frame) == known(1'200));
  }
}

TEST_CASE("a second holds 100 transfers, 2 of them with temperatures", "[unit][mmu][MMU_SCHED]") {
  MmuBench bench;
  bench.settle();
  int transfers = 0;
  int with_temperatures = 0;
  bench.on_transfer = [&](FrontEndTransfer& transfer) {
    ++transfers;
    if (transfer.contents == TransferWanted::everything) ++with_temperatures;
  };
  bench.run(1s);
  CHECK(transfers == 100);
  CHECK(with_temperatures == 2);
}

TEST_CASE("an open wire takes the voltages of both its cells", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  bench.measured.open_wires = cell_bit(2);
  bench.run(100ms);
  const auto answer = bench.ask(want_cells | want_sync);
  CHECK(read<cells_1, "cell_voltage_2_uV">(answer.at(0).frame).is_valid());
  CHECK_FALSE(read<cells_1, "cell_voltage_3_uV">(answer.at(0).frame).is_valid());
  CHECK_FALSE(read<cells_2, "cell_voltage_4_uV">(answer.at(1).frame).is_valid());
  CHECK(read<cells_2, "cell_voltage_5_uV">(answer.at(1).frame).is_valid());
  bench.measured.open_wires = 0;
  bench.run(200ms);
  CHECK(read<cells_1, "cell_voltage_3_uV">(bench.ask(want_cells).at(0).frame).is_valid());
}

TEST_CASE("an open wire and a failed self-test are reported", "[unit][mmu]") {
  MmuBench bench;
  bench.measured.open_wires = cell_bit(6);
  bench.measured.self_test_ok = false;
  bench.settle();
  const auto answer = bench.ask(want_status | want_module);
  CHECK(read_raw<status, "open_cell_wire">(answer.at(0).frame) == 1);
  CHECK(read_raw<status, "self_test_failed">(answer.at(0).frame) == 1);
  CHECK(read_raw<module, "open_wire_cells">(answer.at(1).frame) == cell_bit(6));
}

// --- limits and protection ------------------------------------------------------------------------------------------

std::int64_t undervoltage_mask(MmuBench& bench) {
  return read_raw<status, "undervoltage_cells">(bench.status());
}

/// Runs to just after a complete average, so that whole 100 ms checks follow.
void align_to_check(MmuBench& bench) {
  bench.run(100ms - (bench.now - power_up) % 100ms + 91ms);
}

TEST_CASE("a cell fails after more than 30 consecutive checks beyond its limit", "[unit][mmu][MMU_2][MMU_UV]") {
  MmuBench bench;
  bench.settle();
  align_to_check(bench);
  bench.measured.cell_voltage_uV[4] = 3'000'000;  // the limit itself counts
  bench.run(3000ms);                              // 30 checks
  CHECK(bench.status().data[2] == 0);
  bench.run(90ms);  // the 31st
  CHECK(undervoltage_mask(bench) == cell_bit(4));

  SECTION("and stays failed until it is cleared") {
    bench.measured.cell_voltage_uV[4] = 3'700'000;
    bench.run(1s);
    CHECK(undervoltage_mask(bench) == cell_bit(4));
    CHECK(bench.command(command_frame(3, bench.next_command(), {5})) == done);
    CHECK(undervoltage_mask(bench) == 0);
  }
  SECTION("cleared while still low it fails again after as many checks") {
    CHECK(bench.command(command_frame(3, bench.next_command(), {5})) == done);
    bench.run(2900ms);
    CHECK(undervoltage_mask(bench) == 0);
    bench.run(300ms);
    CHECK(undervoltage_mask(bench) == cell_bit(4));
  }
}

TEST_CASE("one good check begins the count anew", "[unit][mmu][MMU_UV]") {
  MmuBench bench;
  bench.settle();
  for (int round = 0; round < 3; ++round) {
    align_to_check(bench);
    bench.measured.cell_voltage_uV[0] = 4'300'000;
    bench.run(3000ms);
    bench.measured.cell_voltage_uV[0] = 4'199'900;
    bench.run(100ms);
  }
  CHECK(read_raw<status, "overvoltage_cells">(bench.status()) == 0);
}

TEST_CASE("just inside its limits a cell never fails", "[unit][mmu][MMU_UV]") {
  MmuBench bench;
  bench.measured.cell_voltage_uV[0] = 3'000'100;
  bench.measured.cell_voltage_uV[1] = 4'199'900;
  bench.run(10s);
  const CanFrame frame = bench.status();
  CHECK(read_raw<status, "undervoltage_cells">(frame) == 0);
  CHECK(read_raw<status, "overvoltage_cells">(frame) == 0);
}

TEST_CASE("limits start at 3.0 and 4.2 V, marked as not set, and can be set", "[unit][mmu][MMU_2]") {
  MmuBench bench;
  bench.settle();
  CHECK(bench.mmu.limits().undervoltage_uV == 3'000'000);
  CHECK(bench.mmu.limits().overvoltage_uV == 4'200'000);
  CHECK(read_raw<status, "limits_not_set">(bench.status()) == 1);

  SECTION("done") {
    CHECK(bench.command(command_frame(3, bench.next_command(), {2, 0x6D, 0x60, 0xA2, 0x1C})) == done);
    CHECK(bench.mmu.limits().undervoltage_uV == 2'800'000);
    CHECK(bench.mmu.limits().overvoltage_uV == 4'150'000);
    CHECK(read_raw<status, "limits_not_set">(bench.status()) == 0);
    bench.mmu.restart(bench.now);
    CHECK(bench.mmu.limits().undervoltage_uV == 3'000'000);
    CHECK(read_raw<status, "limits_not_set">(bench.status()) == 1);
  }
  SECTION("refused when they cross, are equal, or cannot be measured") {
    CHECK(bench.command(command_frame(3, bench.next_command(), {2, 0xA2, 0x1C, 0x6D, 0x60})) == bad_argument);
    CHECK(bench.command(command_frame(3, bench.next_command(), {2, 0x6D, 0x60, 0x6D, 0x60})) == bad_argument);
    CHECK(bench.command(command_frame(3, bench.next_command(), {2, 0x6D, 0x60, 0xC3, 0x51})) == bad_argument);
    CHECK(bench.command(command_frame(3, bench.next_command(), {2, 0x6D, 0x60, 0xC3, 0x50})) == done);
  }
  SECTION("a refused command changes nothing") {
    bench.command(command_frame(3, bench.next_command(), {2, 0xA2, 0x1C, 0x6D, 0x60}));
    CHECK(bench.mmu.limits().undervoltage_uV == 3'000'000);
    CHECK(read_raw<status, "limits_not_set">(bench.status()) == 1);
  }
}

// --- commands -------------------------------------------------------------------------------------------------------

TEST_CASE("a command is answered within 10 ms with its operation and counter", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  const TimePoint at = bench.now;
  bench.mmu.observe(command_frame(3, 0x11, {4}), bench.now);
  const auto sent = bench.run(20ms);
  REQUIRE(sent.size() == 1);
  CHECK(sent[0].frame.id == 0x383);
  CHECK(sent[0].frame.data[0] == 4);
  CHECK(sent[0].frame.data[6] == 0x11);
  CHECK(sent[0].at - at <= 10ms);
}

TEST_CASE("of more COMMANDs than a millisecond can answer, those not answered are not done either", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  bench.run_polled(1s);
  std::vector<CanFrame> orders;  // each sets another lower limit
  for (std::uint8_t order = 0; order < 10; ++order) {
    orders.push_back(command_frame(3, bench.next_command(), {2, 0x60, order, 0xA2, 0x1C}));
    bench.mmu.observe(orders.back(), bench.now);
  }
  const auto answered = bench.run(10ms);
  REQUIRE(!answered.empty());
  REQUIRE(answered.size() < orders.size());
  const std::size_t lost = orders.size() - answered.size();
  CHECK(bench.mmu.counts().commands_lost == lost);
  CHECK(bench.mmu.limits().undervoltage_uV == 100 * (0x6000 + static_cast<std::int32_t>(answered.size()) - 1));
  for (std::size_t order = 0; order < answered.size(); ++order) {
    CHECK(answered[order].frame.data[6] == orders[order].data[6]);
  }
  CHECK(bench.command(orders.back()) == done);  // lost, not repeated: the same frame is accepted
  CHECK(bench.mmu.limits().undervoltage_uV == 100 * 0x6009);
}

TEST_CASE("a broadcast command is obeyed and not answered, one to another module neither", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  CHECK(bench.command(command_frame(0, 1, {2, 0x6D, 0x60, 0xA2, 0x1C})) == -1);
  CHECK(bench.mmu.limits().undervoltage_uV == 2'800'000);
  CHECK(bench.command(command_frame(4, 1, {2, 0x6D, 0x61, 0xA2, 0x1C})) == -1);
  CHECK(bench.mmu.limits().undervoltage_uV == 2'800'000);
}

TEST_CASE("a repeated or damaged command is ignored", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  const CanFrame frame = command_frame(3, 9, {4});
  CHECK(bench.command(frame) == done);
  CHECK(bench.command(frame) == -1);
  CanFrame damaged = command_frame(3, 10, {4});
  damaged.data[3] ^= 0x10;
  CHECK(bench.command(damaged) == -1);
}

TEST_CASE("unknown operations and wrong arguments are refused with their reason", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  const auto result = [&bench](std::initializer_list<std::uint8_t> bytes) {
    return bench.command(command_frame(3, bench.next_command(), bytes));
  };
  CHECK(result({0}) == unknown_operation);
  CHECK(result({8}) == unknown_operation);
  CHECK(result({0xFF}) == unknown_operation);
  CHECK(result({1, 0}) == bad_argument);  // mode "starting" cannot be commanded
  CHECK(result({1, 2}) == bad_argument);  // nor autonomous
  CHECK(result({1, 4}) == bad_argument);
  CHECK(result({1, 1, 1}) == done);
  CHECK(result({6, 9, 0x00, 0x12, 0xD6, 0x87}) == bad_argument);  // set node is valid as a broadcast only
  CHECK(result({7, 0}) == bad_argument);
  CHECK(result({7, 126}) == bad_argument);
  CHECK(result({7, 125}) == done);
  CHECK(bench.mmu.is_autonomous_balancing_allowed());
}

TEST_CASE("a new node number is taken by the serial number meant, announced, and kept over a restart", "[unit][mmu]") {
  MmuBench bench;
  bench.settle();
  bench.mmu.observe(command_frame(0, 1, {6, 9, 0, 0, 0, 1}), bench.now);
  bench.run(10ms);
  CHECK(bench.mmu.node() == 3);
  bench.mmu.observe(command_frame(0, 2, {6, 64, 0x00, 0x12, 0xD6, 0x87}), bench.now);
  CHECK(bench.mmu.node() == 3);
  bench.mmu.observe(command_frame(0, 3, {6, 9, 0x00, 0x12, 0xD6, 0x87}), bench.now);
  const auto sent = bench.run(100ms);
  CHECK(bench.mmu.node() == 9);
  REQUIRE(sent.size() == 1);
  CHECK(sent[0].frame.id == 0x309);
  bench.mmu.restart(bench.now);
  CHECK(bench.mmu.node() == 9);
  CHECK(bench.command(command_frame(9, 1, {4})) == done);
}

// --- balancing ------------------------------------------------------------------------------------------------------

TEST_CASE("commanded balancing runs for its minutes and ends", "[unit][mmu][MMU_CB]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {7, 7, 7, 7, 2, 1})) == done);
  bench.run_polled(1s);
  CHECK(bench.mmu.balancing_cells() == (cell_bit(4) | cell_bit(5)));
  const auto answer = bench.ask(want_status | want_module);
  CHECK(read_raw<status, "balancing">(answer.at(0).frame) == 1);
  CHECK(read_raw<module, "balancing_cells">(answer.at(1).frame) == (cell_bit(4) | cell_bit(5)));
  CHECK(read<module, "balancing_time_left_s">(answer.at(1).frame).value == 120);
  bench.run_polled(60s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(4));
  CHECK(read<module, "balancing_time_left_s">(bench.ask(want_module).at(0).frame).value == 60);
  bench.run_polled(60s);
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("every cell's minutes take effect, 0 ends, 7 leaves, 6 refuses the whole command", "[unit][mmu][MMU_CB]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5, 5, 5})) == done);
  bench.run_polled(1s);
  REQUIRE(bench.mmu.balancing_cells() == first_cells(3));
  SECTION("0 and 7") {
    CHECK(bench.command(balance_frame(3, bench.next_command(), {0, 7, 7, 1})) == done);
    CHECK(bench.mmu.balancing_cells() == (cell_bit(1) | cell_bit(2)));
    bench.run_polled(1s);
    CHECK(bench.mmu.balancing_cells() == (cell_bit(1) | cell_bit(2) | cell_bit(3)));
  }
  SECTION("6 in any place") {
    for (std::size_t cell = 0; cell < 12; ++cell) {
      CanFrame frame = balance_frame(3, bench.next_command(), {0, 0, 0});
      insert_bits(frame.data, static_cast<unsigned>(8 + 3 * cell), 3, 6);
      seal(command, bench.command_counter, frame);
      CHECK(bench.command(frame) == bad_argument);
    }
    CHECK(bench.mmu.balancing_cells() == first_cells(3));
  }
  SECTION("stop all") {
    CHECK(bench.command(command_frame(3, bench.next_command(), {4})) == done);
    CHECK(bench.mmu.balancing_cells() == 0);
    bench.run_polled(2s);
    CHECK(bench.mmu.balancing_cells() == 0);
  }
}

TEST_CASE("the same minutes said again do not prolong, after the end they start anew", "[unit][mmu][MMU_CB]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {1})) == done);
  bench.run_polled(40s);
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {1})) == done);
  bench.run_polled(25s);
  CHECK(bench.mmu.balancing_cells() == 0);
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {1})) == done);
  bench.run_polled(1s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));
}

TEST_CASE("minutes for a cell that is not there are refused", "[unit][mmu][MMU_CB]") {
  MmuBench bench({.node = 3, .cell_count = 2, .temperature_sensor_count = 1});
  bench.settle();
  CHECK(bench.command(balance_frame(3, bench.next_command(), {1, 1, 1})) == bad_argument);
  CHECK(bench.command(balance_frame(3, bench.next_command(), {1, 1, 0})) == done);
}

TEST_CASE("without a POLL for 1 s balancing stops, and does not come back by itself", "[unit][mmu][MMU_N]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5, 5})) == done);
  bench.run_polled(2s);
  bench.poll(0);
  bench.run(999ms);
  CHECK(bench.mmu.balancing_cells() == first_cells(2));
  bench.run(1ms);
  CHECK(bench.mmu.balancing_cells() == 0);
  bench.run_polled(3s);
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("a cell that fails stops balancing, and cannot be balanced while failed", "[unit][mmu][MMU_UV]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5, 5})) == done);
  bench.measured.cell_voltage_uV[0] = 2'500'000;
  bench.run_polled(4s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(1));
  CHECK(bench.command(balance_frame(3, bench.next_command(), {1, 7})) == refused);
  CHECK(bench.mmu.balancing_cells() == cell_bit(1));
}

TEST_CASE("balancing pauses while a board is too hot and goes on afterwards", "[unit][mmu][MMU_16][MMU_17]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(command_frame(3, bench.next_command(), {7, 60})) == done);
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {2, 1})) == done);
  bench.run_polled(10s);
  REQUIRE(bench.mmu.balancing_cells() == first_cells(2));
  bench.measured.board_temperature_dC[2] = known(601);
  bench.run_polled(60s);
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK(read_raw<status, "board_too_hot">(bench.status()) == 1);
  bench.measured.board_temperature_dC[2] = known(560);  // within the hysteresis: still
  bench.run_polled(2s);
  CHECK(read_raw<status, "board_too_hot">(bench.status()) == 1);
  bench.measured.board_temperature_dC[2] = known(540);
  bench.run_polled(3s);
  CHECK(read_raw<status, "board_too_hot">(bench.status()) == 0);
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));  // the minute of the other has elapsed meanwhile
  bench.run_polled(40s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));
  bench.run_polled(6s);
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("minutes told to a hot board are over with the minutes", "[unit][mmu][MMU_17][MMU_CB]") {
  MmuBench bench;
  bench.measured.board_temperature_dC[0] = known(900);
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {1})) == done);
  bench.run_polled(62s);
  CHECK(read<module, "balancing_time_left_s">(bench.ask(want_module).at(0).frame).value == 0);
  bench.measured.board_temperature_dC[0] = known(300);
  bench.run_polled(10s);
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("balancing is refused before anything is measured", "[unit][mmu]") {
  MmuBench bench;
  bench.run(20ms);
  CHECK(bench.command(balance_frame(3, bench.next_command(), {1})) == refused);
}

// --- sleep ----------------------------------------------------------------------------------------------------------

TEST_CASE("a module sent to sleep answers, then sleeps, and any frame wakes it", "[unit][mmu][MMU_S]") {
  MmuBench bench;
  bench.settle();
  bench.command(command_frame(3, bench.next_command(), {2, 0x6D, 0x60, 0xA2, 0x1C}));
  bench.status();
  CHECK(bench.command(command_frame(3, bench.next_command(), {1, 3, 0})) == done);
  bench.run(20ms);
  REQUIRE(bench.mmu.is_asleep());
  CHECK(bench.run(5s).empty());

  bench.mmu.observe(data_frame(0x123, 0), bench.now);
  CHECK_FALSE(bench.mmu.is_asleep());
  const TimePoint woken_at = bench.now;
  const auto announced = bench.run(49ms);
  REQUIRE(announced.size() == 1);
  CHECK(announced[0].frame.id == 0x303);
  CHECK(announced[0].at == woken_at + 30ms);
  CHECK(bench.ask(want_status).empty());  // too early, but a master is present
  const auto answer = bench.ask(want_status);
  REQUIRE(answer.size() == 1);
  CHECK(read_raw<status, "restarted">(answer[0].frame) == 0);
  CHECK(read_raw<status, "limits_not_set">(answer[0].frame) == 0);
  bench.run(100ms);
  CHECK(read_raw<status, "mode">(bench.status()) == static_cast<std::int64_t>(Mode::normal));
  bench.run(10s);
  CHECK_FALSE(bench.mmu.is_asleep());  // a master that falls silent later is no reason to sleep
}

/// Module put to sleep and woken by a frame that it does not use.
MmuBench woken_bench(std::uint8_t node = 3) {
  MmuBench bench({.node = node});
  bench.settle();
  bench.mmu.observe(command_frame(0, bench.next_command(), {1, 3, 0}), bench.now);
  bench.run(20ms);
  REQUIRE(bench.mmu.is_asleep());
  bench.run(1s);
  bench.mmu.observe(data_frame(0x041, 8), bench.now);
  return bench;
}

TEST_CASE("woken by mere traffic a module says once who it is, and sleeps again when the bus was silent for 1 s",
          "[unit][mmu][MMU_S]") {
  MmuBench bench = woken_bench();
  std::vector<TimedFrame> sent;
  for (int frame = 0; frame < 20; ++frame) {
    bench.mmu.observe(data_frame(0x041, 8), bench.now);
    CanFrame damaged = poll_frame(0, want_all, 77);
    damaged.data[7] ^= 0x01;
    bench.mmu.observe(damaged, bench.now);
    bench.mmu.observe(command_frame(4, bench.next_command(), {1, 1, 0}), bench.now);  // to another module
    for (const TimedFrame& one : bench.run(99ms)) sent.push_back(one);
  }
  CHECK_FALSE(bench.mmu.is_asleep());
  for (const TimedFrame& one : bench.run(900ms)) sent.push_back(one);
  CHECK_FALSE(bench.mmu.is_asleep());  // 999 ms
  for (const TimedFrame& one : bench.run(1ms)) sent.push_back(one);
  CHECK(bench.mmu.is_asleep());
  CHECK(ids(sent) == Ids{0x303});

  bench.mmu.observe(data_frame(0x041, 8), bench.now);
  CHECK_FALSE(bench.mmu.is_asleep());
}

TEST_CASE("10 ms times its node number after waking a module says who it is, whatever woke it", "[unit][mmu][MMU_S]") {
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 3, 63}) {
    MmuBench bench = woken_bench(node);
    const TimePoint woken_at = bench.now;
    const auto sent = bench.run(3s);
    REQUIRE(sent.size() == 1);
    CHECK(sent[0].at == woken_at + 10ms * node);
    CHECK(sent[0].frame.id == ident.base_id + node);
    CHECK(sent[0].frame.data[6] == 0);
  }
}

TEST_CASE("modules that wake each other by saying who they are come to rest", "[unit][mmu][MMU_S]") {
  std::vector<MmuBench> benches;
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{63, 62, 61}) benches.push_back(woken_bench(node));
  // One after another, so that each wakes while the previous one is about to sleep.
  benches[1].run(3s);
  benches[2].run(3s);
  REQUIRE(benches[1].mmu.is_asleep());
  REQUIRE(benches[2].mmu.is_asleep());
  std::size_t said = 0;
  const auto tick_all = [&] {
    for (MmuBench& one : benches) {
      for (const TimedFrame& sent : one.run(1ms)) {
        ++said;
        for (MmuBench& other : benches) {
          if (&other != &one) other.mmu.observe(sent.frame, other.now);
        }
      }
    }
  };
  for (int ms = 0; ms < 10'000; ++ms) tick_all();
  CHECK(said == 4);  // the first had fallen asleep again before the next one sent
  for (const MmuBench& one : benches) CHECK(one.mmu.is_asleep());
}

TEST_CASE("a woken module stays awake for a master, heard at the last moment", "[unit][mmu][MMU_S]") {
  MmuBench bench = woken_bench();
  bench.run(999ms);
  REQUIRE_FALSE(bench.mmu.is_asleep());
  SECTION("a POLL to all") {
    bench.poll(0);
  }
  SECTION("a POLL to another module") {
    bench.poll(want_all, 9);
  }
  SECTION("a COMMAND to all") {
    bench.mmu.observe(command_frame(0, bench.next_command(), {1, 1, 0}), bench.now);
  }
  CHECK(bench.run(3s).empty());
  CHECK_FALSE(bench.mmu.is_asleep());
}

TEST_CASE("a module sent to sleep before it has announced itself keeps silent", "[unit][mmu][MMU_S]") {
  for (const std::uint8_t node :
       {std::uint8_t{1}, std::uint8_t{2},
        std::uint8_t{63}}) {  // the first would announce itself in the millisecond it falls asleep
    MmuBench bench = woken_bench(node);
    bench.run(5ms);
    bench.mmu.observe(command_frame(0, bench.next_command(), {1, 3, 0}), bench.now);
    CHECK(bench.run(1s).empty());
    CHECK(bench.mmu.is_asleep());
  }
}

TEST_CASE("a module falls asleep after its last frame, never with it", "[unit][mmu][MMU_S]") {
  MmuBench bench;
  bench.settle();
  bench.mmu.observe(command_frame(0, bench.next_command(), {1, 3, 0}), bench.now);
  bench.run(9ms);
  bench.poll(want_all);
  std::size_t sent = 0;
  for (int tick = 0; tick < 20; ++tick) {
    const std::size_t sent_now = bench.run(1ms).size();
    sent += sent_now;
    CHECK_FALSE((sent_now > 0 && bench.mmu.is_asleep()));
  }
  CHECK(sent == 9);
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("a woken module answers from 50 ms on, not before", "[unit][mmu][MMU_S]") {
  MmuBench early = woken_bench();
  early.run(49ms);
  early.poll(want_status);
  CHECK(early.run(10ms).empty());
  MmuBench late = woken_bench();
  late.run(50ms);
  CHECK(late.ask(want_status).size() == 1);
}

TEST_CASE("going to sleep can be called off", "[unit][mmu][MMU_S]") {
  MmuBench bench;
  bench.settle();
  bench.mmu.observe(command_frame(3, bench.next_command(), {1, 3}), bench.now);
  bench.run(2ms);
  CHECK(bench.mmu.mode() == UnitMode::going_to_sleep);
  CHECK(bench.command(command_frame(3, bench.next_command(), {1, 1})) == done);
  bench.run(1s);
  CHECK_FALSE(bench.mmu.is_asleep());
  CHECK(bench.mmu.mode() == UnitMode::normal);
}

}  // namespace
}  // namespace bmu
