// Module unit against the tables of the protocol document, byte by byte: every worked frame of a module, every flag,
// mask, range and special code of the frames it sends, every bit of POLL and every operation of COMMAND. Positions and
// values are those of the document, not of the codec.
#include <algorithm>
#include <numeric>

#include "tests/support/catch.hpp"
#include "tests/support/contracts.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/worked_frames.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

using Bytes = std::vector<unsigned>;

/// The six bytes before counter and checksum.
Bytes content(const CanFrame& frame) {
  return {frame.data.begin(), frame.data.begin() + 6};
}
CanFrame with_id(const std::vector<TimedFrame>& answer, std::uint32_t id) {
  const auto found =
      std::find_if(answer.begin(), answer.end(), [id](const TimedFrame& one) { return one.frame.id == id; });
  INFO("no frame " << id);
  REQUIRE(found != answer.end());
  return found->frame;
}
CanFrame asked(MmuBench& bench, unsigned flags, std::uint32_t id) {
  return with_id(bench.ask(flags), id);
}
unsigned bits_24(const CanFrame& frame) {  // b2 to b4
  return (unsigned{frame.data[2]} << 16U) | (unsigned{frame.data[3]} << 8U) | frame.data[4];
}
unsigned upper_mask(const CanFrame& frame) {
  return bits_24(frame) >> 12U;
}
unsigned lower_mask(const CanFrame& frame) {
  return bits_24(frame) & 0xFFFU;
}

CanFrame command_of(MmuBench& bench, const Bytes& bytes, std::uint8_t node = 3) {
  CanFrame frame = make_frame(internal_bus::command, node);
  for (std::size_t at = 0; at < bytes.size(); ++at) frame.data[at] = static_cast<std::uint8_t>(bytes[at]);
  seal(internal_bus::command, bench.next_command(), frame);
  return frame;
}

/// Module without any flag: limits set, restart reported.
MmuBench quiet_bench(const MmuConfig& config = {.node = 3, .serial_number = 1234567}) {
  MmuBench bench(config);
  bench.settle();
  CHECK(bench.command(command_of(bench, {2, 0x75, 0x30, 0xA4, 0x10}, config.node)) == 0);
  bench.status();
  return bench;
}

const WorkedFrame& worked(const MessageSpec& message, std::uint8_t first_byte) {
  static const std::vector<WorkedFrame> all = internal_worked_frames();
  return *std::find_if(all.begin(), all.end(),
                       [&](const WorkedFrame& one) { return one.message == &message && one.bytes[0] == first_byte; });
}

// --- the worked frames ----------------------------------------------------------------------------------------------

TEST_CASE("worked frame 103: balancing, cell 5 over its limit, voltages 12 ms old", "[unit][mmu][contract][MMU_1]") {
  MmuBench bench = quiet_bench();
  bench.measured.cell_voltage_uV[4] = 4'250'000;
  bench.run_polled(4s);
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {1})) == 0);
  bench.run_polled(2s);
  bench.run(19ms - (bench.now - power_up) % 10ms);  // 1 ms before a sample
  bench.now += 1ms;
  bench.poll_counter = 41;
  bench.poll(0x8F);
  bench.now += 2ms;  // the latest permitted loop
  const MmuFrames sent = bench.mmu.tick(bench.now, bench.transfer());
  REQUIRE(sent.size() >= 1);
  CHECK(sent[0] == worked(internal_bus::status, 0x5C).frame());
}

TEST_CASE("worked frames 143, 183, 243, 283 and 303", "[unit][mmu][contract][MMU_1][MMU_4]") {
  MmuBench bench({.node = 3, .board_sensor_count = 3, .serial_number = 1'234'567});
  bench.measured.cell_voltage_uV = {3'651'200, 3'649'800, 3'653'000, 3'651'200, 3'650'000, 3'650'000,
                                    3'650'000, 3'650'000, 3'650'000, 3'650'000, 3'650'000, 3'650'000};
  bench.measured.converted_cells = static_cast<CellMask>(first_cells(12) & ~cell_bit(4));
  bench.measured.cell_temperature_dC = {known(251), known(-53), not_known(Validity::open_circuit), known(253)};
  bench.measured.board_temperature_dC = {known(310), known(330), known(300), not_known()};
  bench.settle();
  bench.poll_counter = 41;
  const auto answer = bench.ask(0x1F);
  for (const MessageSpec* const message : {&internal_bus::cells_1, &internal_bus::cells_2, &internal_bus::temp_1,
                                           &internal_bus::temp_2, &internal_bus::ident}) {
    const auto all = internal_worked_frames();
    for (const WorkedFrame& one : all) {
      if (one.message == message) CHECK(with_id(answer, one.frame().id) == one.frame());
    }
  }
}

TEST_CASE("worked frames 343, 383 and 2C3: minutes for cell 5, done, its switch on for up to a minute more",
          "[unit][mmu][contract][MMU_CB]") {
  MmuBench bench = quiet_bench();
  bench.measured.module_mV = 43'812;
  bench.measured.reports_faults = false;  // an older module: its b5 contains the minutes alone
  bench.mmu.observe(worked(internal_bus::command, 3).frame(), bench.now);
  const auto said = bench.run(10ms);
  REQUIRE(said.size() == 1);
  CHECK(said[0].frame == worked(internal_bus::response, 3).frame());
  bench.run_polled(62s);
  bench.poll_counter = 41;
  CHECK(asked(bench, 0x08, 0x2C3) == worked(internal_bus::module, 0x55).frame());
}

TEST_CASE("worked frames 343 and 080: limits, and a POLL to all", "[unit][mmu][contract][MMU_2]") {
  MmuBench bench;
  bench.settle();
  CHECK(bench.command(worked(internal_bus::command, 2).frame()) == 0);
  CHECK(bench.mmu.limits().undervoltage_uV == 3'000'000);
  CHECK(bench.mmu.limits().overvoltage_uV == 4'200'000);
  bench.mmu.observe(worked(internal_bus::poll, 0).frame(), bench.now);
  const auto answer = bench.run(10ms);
  REQUIRE(answer.size() == 8);  // no IDENT
  for (const TimedFrame& one : answer) CHECK(one.frame.data[6] == 42);
}

// --- POLL -----------------------------------------------------------------------------------------------------------

TEST_CASE("each bit of POLL brings its frames and no other, reserved bits and bytes mean nothing",
          "[unit][mmu][contract][MMU_1]") {
  MmuBench bench;
  bench.settle();
  const std::vector<std::pair<unsigned, Bytes>> rows{{0x01, {0x103}},
                                                     {0x02, {0x143, 0x183, 0x1C3, 0x203}},
                                                     {0x04, {0x243, 0x283}},
                                                     {0x08, {0x2C3}},
                                                     {0x10, {0x303}},
                                                     {0x20, {}},
                                                     {0x40, {}},
                                                     {0x80, {}}};
  for (const unsigned target : {0U, 3U}) {
    for (const unsigned filling : {0x00U, 0xFFU}) {
      for (const auto& [bit, wanted] : rows) {
        CanFrame frame = poll_frame(static_cast<std::uint8_t>(target), bit, ++bench.poll_counter);
        std::fill(frame.data.begin() + 2, frame.data.begin() + 6, static_cast<std::uint8_t>(filling));
        seal(internal_bus::poll, bench.poll_counter, frame);
        bench.mmu.observe(frame, bench.now);
        Bytes got;
        for (const TimedFrame& one : bench.run(10ms)) got.push_back(one.frame.id);
        INFO("bit " << bit);
        CHECK(got == wanted);
      }
    }
  }
}

TEST_CASE("whatever it sends, what no row of the tables names is 0, and checksum and counter are right",
          "[unit][mmu][contract]") {
  MmuBench bench;
  bench.settle();
  bench.measured.open_wires = 0xFFF;
  bench.measured.module_mV = 200'000;
  bench.run_polled(1s);
  bench.mmu.observe(command_of(bench, {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}), bench.now);
  const auto sent = bench.ask(0x1F);
  REQUIRE(sent.size() == 10);
  for (const TimedFrame& one : sent) {
    const MessageMatch match = internal_bus::catalogue.find(one.frame.id);
    REQUIRE(match.message != nullptr);
    const MessageSpec& message = *match.message;
    FrameBytes named{};
    for (const SignalSpec& signal : message.signals) {
      const FrameBytes mask = field_mask(signal);
      for (std::size_t byte = 0; byte < 8; ++byte) named[byte] |= mask[byte];
    }
    INFO("frame " << one.frame.id);
    CHECK(one.frame.length == 8);
    for (std::size_t byte = 0; byte < 6; ++byte) CHECK((one.frame.data[byte] & ~unsigned{named[byte]} & 0xFFU) == 0);
    CHECK(one.frame.data[7] == frame_crc(one.frame));
    const bool is_response = one.frame.id == 0x383;
    CHECK(one.frame.data[6] == (is_response ? bench.command_counter : bench.poll_counter));
  }
}

// --- STATUS ---------------------------------------------------------------------------------------------------------

TEST_CASE("STATUS b1: each flag by its own cause", "[unit][mmu][contract]") {
  struct Row {
    unsigned flags;
    void (*cause)(MmuBench&);
    Duration shows_after = 1s;
  };
  const std::vector<Row> rows{
      {0x00, [](MmuBench&) {}},
      {0x01, [](MmuBench& b) { b.on_transfer = [](FrontEndTransfer& t) { t.groups[0][7] ^= 1; }; }, 20ms},
      {0x02, [](MmuBench& b) { b.measured.self_test_ok = false; }},
      {0x04, [](MmuBench& b) { b.measured.open_wires = 1; }},
      {0x08, [](MmuBench& b) { b.measured.board_temperature_dC[3] = known(860); }},
      {0x10, [](MmuBench& b) { b.measured.external_supply_mV = 4'900; }},
      {0xA0, [](MmuBench& b) { b.mmu.restart(b.now); }, 20ms},  // this includes limits not set
      {0x40, [](MmuBench& b) { b.measured.cell_temperature_dC[0] = not_known(Validity::open_circuit); }},
      {0x40, [](MmuBench& b) { b.measured.cell_temperature_dC[3] = not_known(Validity::short_circuit); }},
      {0x40, [](MmuBench& b) { b.measured.board_temperature_dC[0] = not_known(Validity::open_circuit); }},
  };
  for (const Row& row : rows) {
    MmuBench bench = quiet_bench();
    row.cause(bench);
    bench.run(row.shows_after);
    CHECK(asked(bench, 0x01, 0x103).data[1] == row.flags);
  }
}

TEST_CASE("STATUS b0: mode, supply, balancing, number of cells", "[unit][mmu][contract]") {
  for (std::uint8_t cells = 1; cells <= 12; ++cells) {
    MmuBench bench = quiet_bench({.node = 3, .cell_count = cells, .serial_number = 1});
    CHECK(asked(bench, 0x01, 0x103).data[0] == (0x40U | cells));
  }
  MmuBench starting;
  starting.run(20ms);
  CHECK(asked(starting, 0x01, 0x103).data[0] == 0x0C);
  MmuBench bench = quiet_bench();
  bench.measured.external_supply_mV = 0;
  bench.run_polled(1s);
  CHECK(asked(bench, 0x01, 0x103).data[0] == 0x6C);
  bench.measured.external_supply_mV = 12'000;
  REQUIRE(bench.command(command_of(bench, {3, 0x3F, 0xFF, 0xFF, 0xFF, 0xF0})) == 0);  // 1 minute, the others unchanged
  bench.run_polled(2s);
  CHECK(asked(bench, 0x01, 0x103).data[0] == 0x5C);
  bench.mmu.observe(command_of(bench, {1, 3}), bench.now);
  bench.run(2ms);
  CHECK(asked(bench, 0x01, 0x103).data[0] == 0xCC);
}

TEST_CASE("STATUS b2 to b4: each cell's failure in its own bit", "[unit][mmu][contract][MMU_UV]") {
  for (std::size_t cell = 0; cell < 12; ++cell) {
    MmuBench bench = quiet_bench();
    bench.measured.cell_voltage_uV[cell] = 2'900'000;
    bench.run_polled(4s);
    CHECK(bits_24(asked(bench, 0x01, 0x103)) == 1U << (12 + cell));
    bench.measured.cell_voltage_uV[cell] = 4'300'000;
    REQUIRE(bench.command(command_of(bench, {5})) == 0);
    bench.run_polled(4s);
    CHECK(bits_24(asked(bench, 0x01, 0x103)) == 1U << cell);
  }
}

TEST_CASE("STATUS b5: age in milliseconds, and 255", "[unit][mmu][contract]") {
  MmuBench bench = quiet_bench();
  CHECK(asked(bench, 0x83, 0x103).data[5] <= 11);
  bench.measured.front_end_crc_ok = false;
  unsigned oldest = 0;
  for (int ms = 0; ms < 400; ms += 10) {
    const auto answer = bench.ask(0x83);
    const unsigned age = with_id(answer, 0x103).data[5];
    const bool has_voltages = content(with_id(answer, 0x143)) != Bytes(6, 0xFF);
    if (age != 255) CHECK(age > oldest);
    CHECK((age != 255) == has_voltages);
    oldest = age;
  }
  CHECK(oldest == 255);
}

// --- CELLS, TEMP, MODULE, IDENT -------------------------------------------------------------------------------------

TEST_CASE("CELLS: each cell in its own place, from end to end of its range, FFFF when there is none",
          "[unit][mmu][contract][MMU_1]") {
  const std::vector<std::pair<std::int32_t, Bytes>> values{
      {0, {0x00, 0x00}},         {100, {0x00, 0x01}},       {3'651'200, {0x8E, 0xA0}},
      {5'000'000, {0xC3, 0x50}}, {6'553'400, {0xFF, 0xFE}}, {7'000'000, {0xFF, 0xFE}}};  // largest value of the field
  for (std::size_t cell = 0; cell < 12; ++cell) {
    MmuBench bench = quiet_bench();
    const auto id = static_cast<std::uint32_t>(0x143 + 0x40 * (cell / 3));
    const auto bytes_now = [&] {
      bench.run_polled(200ms);
      Bytes six = content(asked(bench, 0x02, id));
      return Bytes{six[2 * (cell % 3)], six[2 * (cell % 3) + 1]};
    };
    for (const auto& [voltage_uV, bytes] : values) {
      bench.measured.cell_voltage_uV[cell] = voltage_uV;
      CHECK(bytes_now() == bytes);
    }
    bench.measured.converted_cells = static_cast<CellMask>(first_cells(12) & ~cell_bit(cell));
    CHECK(bytes_now() == Bytes{0xFF, 0xFF});
  }
  MmuBench of_seven = quiet_bench({.node = 3, .cell_count = 7, .serial_number = 1});
  CHECK(content(asked(of_seven, 0x02, 0x1C3)) == Bytes{0x90, 0x88, 0xFF, 0xFF, 0xFF, 0xFF});
}

TEST_CASE("TEMP: each sensor in its own place, with its codes for none, open and shorted",
          "[unit][mmu][contract][MMU_4][MMU_16]") {
  struct Row {
    SignalValue value;
    Bytes cell;
    Bytes board;
  };
  const std::vector<Row> rows{{known(0), {0x00, 0x00}, {0x00}},
                              {known(-53), {0xFF, 0xCB}, {0xFB}},
                              {known(251), {0x00, 0xFB}, {0x19}},
                              {known(1'200), {0x04, 0xB0}, {0x78}},
                              {known(1'500), {0x05, 0xDC}, {0x7E}},  // the board field ends at 126 C
                              {not_known(Validity::open_circuit), {0x80, 0x01}, {0x7F}},
                              {not_known(Validity::short_circuit), {0x7F, 0xFF}, {0x7F}}};
  for (std::size_t sensor = 0; sensor < 4; ++sensor) {
    for (const Row& row : rows) {
      MmuBench bench;
      bench.measured.cell_temperature_dC[sensor] = row.value;
      bench.measured.board_temperature_dC[sensor] = row.value;
      bench.settle();
      const auto answer = bench.ask(0x04);
      const Bytes first = content(with_id(answer, 0x243));
      const Bytes second = content(with_id(answer, 0x283));
      const Bytes cell = sensor < 3 ? Bytes{first[2 * sensor], first[2 * sensor + 1]} : Bytes{second[0], second[1]};
      INFO("sensor " << sensor + 1);
      CHECK(cell == row.cell);
      CHECK(Bytes{second[2 + sensor]} == row.board);
    }
  }
  MmuBench bare({.node = 3, .temperature_sensor_count = 0, .board_sensor_count = 0});
  bare.settle();
  const auto answer = bare.ask(0x04);
  CHECK(content(with_id(answer, 0x243)) == Bytes{0x80, 0x00, 0x80, 0x00, 0x80, 0x00});
  CHECK(content(with_id(answer, 0x283)) == Bytes{0x80, 0x00, 0x80, 0x80, 0x80, 0x80});
}

TEST_CASE("MODULE: voltage in 2 mV, each switch and each wire in its own bit, minutes rounded up",
          "[unit][mmu][contract][MMU_CB]") {
  MmuBench bench = quiet_bench();
  const std::vector<std::pair<std::int32_t, Bytes>> voltages{
      {0, {0x00, 0x00}}, {2, {0x00, 0x01}}, {43'812, {0x55, 0x92}}, {131'068, {0xFF, 0xFE}}};
  for (const auto& [voltage_mV, bytes] : voltages) {
    bench.measured.module_mV = voltage_mV;
    bench.run_polled(100ms);
    const Bytes six = content(asked(bench, 0x08, 0x2C3));
    CHECK(Bytes{six[0], six[1]} == bytes);
  }
  for (std::size_t cell = 0; cell < 12; ++cell) {
    bench.measured.open_wires = cell_bit(cell);
    bench.run_polled(100ms);
    CHECK(bits_24(asked(bench, 0x08, 0x2C3)) == 1U << cell);
  }
  bench.measured.open_wires = 0;
  bench.on_transfer = [](FrontEndTransfer& transfer) { transfer.groups[4][7] ^= 1; };
  bench.run_polled(300ms);
  const Bytes unknown = content(asked(bench, 0x08, 0x2C3));
  CHECK(Bytes{unknown[0], unknown[1]} == Bytes{0xFF, 0xFF});
  bench.on_transfer = nullptr;
  bench.run_polled(100ms);
  for (std::size_t cell = 0; cell < 12; ++cell) {
    CanFrame frame = balance_frame(3, bench.next_command(), {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    const unsigned first_bit = static_cast<unsigned>(8 + 3 * cell);  // cell 1 from b1's most significant bit on
    insert_bits(frame.data, first_bit, 3, 1 + cell % 5);
    seal(internal_bus::command, bench.command_counter, frame);
    REQUIRE(bench.command(frame) == 0);
    bench.run_polled(1s);
    const CanFrame said = asked(bench, 0x08, 0x2C3);
    CHECK(upper_mask(said) == 1U << cell);
    CHECK(lower_mask(said) == 0);
    CHECK(said.data[5] == 0x80 + 1 + cell % 5);
  }
}

TEST_CASE("MODULE b5: what the front end reports, kept until faults are cleared", "[unit][mmu][contract][RR_7]") {
  MmuBench bench = quiet_bench();
  const auto byte_5 = [&bench] { return unsigned{asked(bench, 0x08, 0x2C3).data[5]}; };
  CHECK(byte_5() == 0x80);
  for (const unsigned bit : {0x40U, 0x20U}) {
    bool& found = bit == 0x40U ? bench.measured.supply_low : bench.measured.thermal_shutdown;
    found = true;
    bench.run(10ms);  // one sample, and no POLL
    found = false;
    bench.run_polled(1s);
    CHECK(byte_5() == (0x80U | bit));
    CHECK(byte_5() == (0x80U | bit));  // more than once
    REQUIRE(bench.command(command_of(bench, {5})) == 0);
    CHECK(byte_5() == 0x80);
  }
  bench.measured.supply_low = true;
  bench.run(10ms);
  REQUIRE(bench.command(command_of(bench, {5})) == 0);
  bench.run(10ms);
  CHECK(byte_5() == 0xC0);  // cleared, and present again
  bench.mmu.restart(bench.now);
  bench.measured.supply_low = false;
  bench.run_polled(1s);
  CHECK(byte_5() == 0x80);
}

TEST_CASE("MODULE b5: nothing is reported of a front end that has no such report or is not received",
          "[unit][mmu][contract][RR_7]") {
  MmuBench bench = quiet_bench();
  bench.on_transfer = [](FrontEndTransfer& transfer) { transfer.groups[5][7] ^= 1; };  // its diagnosis
  bench.run_polled(200ms);
  CHECK(asked(bench, 0x08, 0x2C3).data[5] == 0x80);
  bench.run_polled(100ms);
  CHECK(asked(bench, 0x08, 0x2C3).data[5] == 0x00);
  bench.on_transfer = nullptr;
  bench.run_polled(100ms);
  CHECK(asked(bench, 0x08, 0x2C3).data[5] == 0x80);
  bench.measured.supply_low = true;
  bench.run_polled(20ms);
  bench.on_transfer = [](FrontEndTransfer& transfer) { transfer.groups[5][7] ^= 1; };
  bench.run_polled(1s);
  CHECK(asked(bench, 0x08, 0x2C3).data[5] == 0xC0);  // a detected fault is reported until it is cleared
  REQUIRE(bench.command(command_of(bench, {5})) == 0);
  CHECK(asked(bench, 0x08, 0x2C3).data[5] == 0x00);
  bench.on_transfer = nullptr;
  bench.measured.reports_faults = false;
  bench.measured.supply_low = bench.measured.thermal_shutdown = true;
  bench.run_polled(100ms);
  CHECK(asked(bench, 0x08, 0x2C3).data[5] == 0x00);
}

TEST_CASE("IDENT: version, cells and sensors, serial number", "[unit][mmu][contract]") {
  for (const std::uint32_t serial : {0U, 1U, 0x01020304U, 0xFFFFFFFFU}) {
    for (std::uint8_t sensors = 0; sensors <= 4; ++sensors) {
      const auto cells = static_cast<std::uint8_t>(12 - sensors);
      MmuBench bench({.node = 3, .cell_count = cells, .temperature_sensor_count = sensors, .serial_number = serial});
      bench.settle();
      CHECK(content(asked(bench, 0x10, 0x303)) == Bytes{1, unsigned{cells} << 4U | sensors, serial >> 24U,
                                                        serial >> 16U & 0xFFU, serial >> 8U & 0xFFU, serial & 0xFFU});
    }
  }
}

// --- COMMAND and RESPONSE -------------------------------------------------------------------------------------------

TEST_CASE("COMMAND: each operation, its arguments and its results", "[unit][mmu][contract][MMU_N]") {
  struct Row {
    Bytes bytes;
    unsigned result;
    void (*before)(MmuBench&) = [](MmuBench&) {};
  };
  const auto self_test_fails = [](MmuBench& b) {
    b.measured.self_test_ok = false;
    b.run_polled(100ms);
  };
  const auto first_cell_fails = [](MmuBench& b) {
    b.measured.cell_voltage_uV[0] = 2'500'000;
    b.run_polled(4s);
  };
  const std::vector<Row> rows{
      {{0}, 1},
      {{1, 1}, 0},
      {{1, 1, 1}, 0},
      {{1, 3}, 0},
      {{1, 0}, 2},
      {{1, 2}, 2},
      {{1, 4}, 2},
      {{2, 0x75, 0x30, 0xA4, 0x10}, 0},
      {{2, 0xA4, 0x10, 0x75, 0x30}, 2},
      {{2, 0x75, 0x30, 0x75, 0x30}, 2},
      {{2, 0x75, 0x30, 0xFF, 0xFF}, 2},
      {{3, 0x3F, 0xFF, 0xFF, 0xFF, 0xF0}, 0},  // minutes of cell 1: 1
      {{3, 0xBF, 0xFF, 0xFF, 0xFF, 0xF0}, 0},  // 5
      {{3, 0xDF, 0xFF, 0xFF, 0xFF, 0xF0}, 2},  // 6
      {{3, 0xFF, 0xFF, 0xFF, 0xFF, 0xF0}, 0},  // 7: unchanged
      {{3, 0x1F, 0xFF, 0xFF, 0xFF, 0xF0}, 0},  // 0
      {{3, 0xFF, 0xFF, 0xFF, 0xFF, 0xE0}, 2},  // 6 for cell 12
      {{3, 0x3F, 0xFF, 0xFF, 0xFF, 0xF0}, 3, first_cell_fails},
      {{3, 0xE7, 0xFF, 0xFF, 0xFF, 0xF0}, 0, first_cell_fails},  // cell 2
      {{3, 0x3F, 0xFF, 0xFF, 0xFF, 0xF0}, 3, [](MmuBench& b) { b.mmu.restart(b.now); }},
      {{3, 0x3F, 0xFF, 0xFF, 0xFF, 0xF0}, 4, self_test_fails},
      {{3, 0x1F, 0xFF, 0xFF, 0xFF, 0xF0}, 0, self_test_fails},
      {{4}, 0},
      {{4, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}, 0},  // bytes that no table names
      {{5}, 0},
      {{6, 9, 0x00, 0x12, 0xD6, 0x87}, 2},  // broadcast only
      {{7, 1}, 0},
      {{7, 85}, 0},
      {{7, 0}, 2},
      {{7, 200}, 2},  // no thermistor reaches that
      {{8}, 1},
      {{0xFF}, 1},
  };
  for (const Row& row : rows) {
    MmuBench bench = quiet_bench();
    row.before(bench);
    const CanFrame order = command_of(bench, row.bytes);
    const TimePoint at = bench.now;
    bench.mmu.observe(order, bench.now);
    const auto sent = bench.run(10ms);
    INFO("operation " << row.bytes[0] << " " << (row.bytes.size() > 1 ? row.bytes[1] : 0));
    const CanFrame answer = with_id(sent, 0x383);
    CHECK(content(answer) == Bytes{row.bytes[0], row.result, 0, 0, 0, 0});
    CHECK(answer.data[6] == order.data[6]);
    CHECK(sent.front().at - at <= 10ms);
  }
}

TEST_CASE("COMMAND to all is done and answered by nobody, a node number by the one meant alone",
          "[unit][mmu][contract][MMU_N]") {
  MmuBench bench = quiet_bench();
  bench.mmu.observe(command_of(bench, {2, 0x6D, 0x60, 0xA2, 0x1C}, 0), bench.now);
  CHECK(bench.run(20ms).empty());
  CHECK(bench.mmu.limits().undervoltage_uV == 2'800'000);
  bench.mmu.observe(command_of(bench, {6, 9, 0x00, 0x12, 0xD6, 0x88}, 0), bench.now);
  CHECK(bench.mmu.node() == 3);
  bench.mmu.observe(command_of(bench, {6, 0, 0x00, 0x12, 0xD6, 0x87}, 0), bench.now);
  CHECK(bench.mmu.node() == 3);
  bench.mmu.observe(command_of(bench, {6, 63, 0x00, 0x12, 0xD6, 0x87}, 0), bench.now);
  CHECK(bench.mmu.node() == 63);
  CHECK(asked(bench, 0x01, 0x13F).data[0] == 0x4C);
}

}  // namespace
}  // namespace bmu
