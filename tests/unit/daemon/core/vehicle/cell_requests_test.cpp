// Data on request: each PID with its worked answer, requests without an answer, and the permission to clear faults.
#include "daemon/core/vehicle/cell_requests.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/core/vehicle/cell_question.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr std::uint16_t request_id = 0x745;
constexpr std::uint16_t reply_id = 0x74D;

CanFrame request(std::vector<std::uint8_t> bytes) {
  CanFrame frame = data_frame(request_id, 8);
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}
CanFrame read_of(std::uint8_t pid, std::uint8_t number = 0) {
  return request({0x03, 0x10, pid, number});
}

CoreConfig asked_pack() {
  CoreConfig config = test::small_pack();  // two modules of four cells and two sensors
  config.vehicle.request_id = request_id;
  config.current.discharge_continuous_mA = 100'000;
  config.current.charge_continuous_mA = 50'000;
  return config;
}

/// Sends a request over the bus and returns the bytes of the answer; nothing if there is none.
std::optional<std::vector<int>> ask(test::CoreBench& bench, const CanFrame& frame) {
  const std::size_t before = bench.sent().size();
  bench.observe(FrameReceived{Port::vehicle, frame});
  bench.run(20ms);
  for (std::size_t index = before; index < bench.sent().size(); ++index) {
    const OutgoingFrame& sent = bench.sent()[index];
    if (sent.port != Port::vehicle || sent.frame.id != reply_id) continue;
    CHECK(sent.frame.length == 8);
    return std::vector<int>(sent.frame.data.begin(), sent.frame.data.end());
  }
  return std::nullopt;
}

using Answer = std::vector<int>;

/// Cells at 3.70 V except for the sixth (3.23 V) and the third (3.95 V); sensors 21 and 23 C, 25 C on the second
/// module.
test::CoreBench& set_values(test::CoreBench& bench) {
  bench.modules[1].cell_voltage_uV[1] = known(3'230'000);
  bench.modules[0].cell_voltage_uV[2] = known(3'950'000);
  bench.modules[0].cell_temperature_dC[0] = known(210);
  bench.modules[0].cell_temperature_dC[1] = known(230);
  bench.run(1500ms);
  return bench;
}

}  // namespace

TEST_CASE("each PID of cells, banks and the pack has its answer", "[unit][core][requests][BMS_F.8][VEH_1]") {
  test::CoreBench bench(asked_pack());
  set_values(bench);
  struct Row {
    std::uint8_t pid;
    std::uint8_t number;
    Answer answer;
  };
  const std::vector<Row> rows{
      // Voltage and temperature known, no resistance yet, no load on.
      {0x11, 6, {0x05, 0x50, 0x11, 0x06, 0x03, 0x00, 0, 0}},
      {0x14, 6, {0x04, 0x50, 0x14, 0x06, 0x7B, 0, 0, 0}},  // 2.00 + 1.23 V
      {0x14, 3, {0x04, 0x50, 0x14, 0x03, 0xC3, 0, 0, 0}},
      {0x18, 1, {0x06, 0x50, 0x18, 0x01, 0x96, 0, 0x96, 0}},  // 22 C
      {0x20, 1, {0x07, 0x50, 0x20, 0x01, 5, 4, 1, 1}},
      {0x30, 0, {0x07, 0x50, 0x30, 0x00, 1, 8, 0, 2}},
      {0x40, 0, {0x07, 0x50, 0x40, 0x00, 1, 8, 0, 2}},
      {0x21, 0, {0x05, 0x50, 0x21, 0x00, 4, 0, 0, 0}},
      {0x31, 0, {0x05, 0x50, 0x31, 0x00, 0, 0, 0, 0}},
      {0x41, 0, {0x05, 0x50, 0x41, 0x00, 0, 0, 0, 0}},
      {0x42, 0, {0x07, 0x50, 0x42, 0x00, 0, 0, 0, 0}},
      {0x23, 0, {0x05, 0x50, 0x23, 0x00, 0xAA, 1, 0, 0}},
      {0x23, 1, {0x05, 0x50, 0x23, 0x01, 0x7B, 6, 0, 0}},
      {0x43, 0, {0x05, 0x50, 0x43, 0x00, 0x7B, 6, 0, 0}},
      {0x33, 0, {0x05, 0x50, 0x33, 0x00, 0x7B, 6, 0, 0}},
      {0x44, 0, {0x04, 0x50, 0x44, 0x00, 0xA7, 0, 0, 0}},  // 29.38 V of 8 cells: 3.6725 V
      {0x45, 0, {0x05, 0x50, 0x45, 0x00, 0xC3, 3, 0, 0}},
      {0x26, 0, {0x05, 0x50, 0x26, 0x00, 0x00, 151, 0, 0}},   // 15.05 V
      {0x46, 0, {0x05, 0x50, 0x46, 0x00, 0x01, 0x26, 0, 0}},  // 29.38 V
      {0x27, 0, {0x07, 0x50, 0x27, 0x00, 0x95, 1, 0x95, 1}},
      {0x47, 0, {0x07, 0x50, 0x47, 0x00, 0x95, 1, 0x95, 1}},
      {0x48, 0, {0x06, 0x50, 0x48, 0x00, 0x98, 0, 0x98, 0}},  // 23.5 C
      {0x29, 1, {0x07, 0x50, 0x29, 0x01, 0x99, 3, 0x99, 3}},
      {0x49, 0, {0x07, 0x50, 0x49, 0x00, 0x99, 3, 0x99, 3}},
  };
  for (const Row& row : rows) {
    INFO("PID " << int{row.pid} << ", " << int{row.number});
    CHECK(ask(bench, read_of(row.pid, row.number)) == row.answer);
  }
  CHECK(bench.core().cell_requests().answered == rows.size());
  CHECK(bench.core().gate_refusals() == 0);
}

TEST_CASE("each PID of the system has its answer", "[unit][core][requests][BMS_F.8]") {
  test::CoreBench bench(asked_pack());
  set_values(bench);
  REQUIRE(bench.close());
  bench.current_mA = 12'340;
  bench.run(500ms);
  const auto data = [&bench](std::uint8_t pid) {
    const auto answer = ask(bench, read_of(pid));
    REQUIRE(answer);
    return Answer(answer->begin() + 4, answer->begin() + 1 + answer->front());
  };
  const CoreConfig& config = bench.core().config();
  CHECK(data(0x50) == Answer{(*bench.core().soc_permille() + 5) / 10});
  CHECK(data(0x51) == Answer{0, static_cast<int>(divide_to_nearest(config.cell.capacity_uAs, uAs_per_Ah))});
  CHECK(data(0x52).size() == 2);
  CHECK(data(0x53) == Answer{0, 4});  // 29.4 V, 12.3 A: 362 W
  CHECK(data(0x54) == Answer{0, 0, 0});
  CHECK(data(0x55) == Answer{0, 0, 0});
  CHECK(data(0x60) == Answer{0, 1});  // the first session
  const Answer uptime = data(0x61);
  REQUIRE(uptime.size() == 3);
  CHECK(uptime[2] == static_cast<int>(to_ms(bench.now() - bench.core().started_at()) / 1000));
  CHECK(data(0x62) == Answer{0, 0, 0});
  CHECK(data(0x63) == Answer{0x11});
  CHECK(data(0x64).size() == 2);
  CHECK(data(0x65).size() == 2);
  CHECK(data(0x66) == Answer{0b0000'1010});
  CHECK(data(0x67) == Answer{0b0000'1010, 0});
  CHECK(data(0x68) == Answer{0, 123});
  CHECK(data(0x69) == Answer{0, 0});
  CHECK(data(0x6A) == Answer{0, 123});
  CHECK(data(0x6B) == Answer{0, 0});
  CHECK(data(0x6C) == Answer{0, 123});
  CHECK(data(0x70) == Answer{'0', '.', '1', '0'});
  bench.current_mA = -12'340;
  bench.run(500ms);
  CHECK(data(0x68) == Answer{0xFF, 0x85});
  CHECK(data(0x69) == Answer{0, 123});
  CHECK(data(0x6A) == Answer{0, 0});
}

TEST_CASE("power cycles are starts that came to see the whole pack, kept over lives", "[unit][core][requests]") {
  const auto cycles = [](test::CoreBench& bench) { return ask(bench, read_of(0x60)); };
  PersistentState kept;
  for (int life = 1; life <= 3; ++life) {
    test::CoreBench bench(asked_pack(), kept);
    const std::uint32_t generation = bench.core().persistent_generation();
    CHECK(cycles(bench) == std::nullopt);
    CHECK(bench.core().persistent().starts == kept.starts);  // a daemon that ends now does not count as a start
    set_values(bench);
    const Answer answer{0x05, 0x50, 0x60, 0, 0, life, 0, 0};
    CHECK(cycles(bench) == answer);
    CHECK(bench.core().persistent_generation() > generation);
    bench.observe(PortChanged{Port::internal, false});  // the return of a bus is not a new start
    bench.run(100ms);
    bench.observe(PortChanged{Port::internal, true});
    bench.run(2s);
    CHECK(cycles(bench) == answer);
    kept = bench.core().persistent();
    CHECK(kept.starts == static_cast<std::uint32_t>(life));
  }
  for (const std::uint32_t before : {65'534U, 65'535U, 4'294'967'295U}) {
    test::CoreBench bench(asked_pack(), {.starts = before});
    set_values(bench);
    CHECK(cycles(bench) == Answer{0x05, 0x50, 0x60, 0, 0xFF, 0xFF, 0, 0});
    CHECK(bench.core().starts() == (before == 4'294'967'295U ? before : before + 1));
  }
}

TEST_CASE("limits are told as shares of the most there may be, with their cause", "[unit][core][requests]") {
  CoreConfig config = asked_pack();
  test::CoreBench bench(config);
  bench.run(1500ms);
  const auto open = ask(bench, read_of(0x65));
  REQUIRE(open);
  CHECK((*open)[4] == 0);  // not connected
  CHECK((*open)[5] == 0);
  bench.modules[0].cell_voltage_uV[0] = known(3'020'000);  // near the limit
  REQUIRE(bench.close());
  bench.run(5s);
  const CurrentLimit& discharge = bench.core().limits().discharge;
  REQUIRE(discharge.cause == LimitCause::cell_voltage_low);
  const CurrentLimitConfig most = carried(bench.core().config());
  const int most_mA = std::max(most.discharge_peak_mA, most.discharge_continuous_mA);
  const auto low = ask(bench, read_of(0x65));
  REQUIRE(low);
  CHECK((*low)[4] == static_cast<int>(std::int64_t{discharge.limit_mA} * 255 / most_mA));
  CHECK((*low)[5] == 3);
}

TEST_CASE("what is not there, not known, or not ours to give gets no answer", "[unit][core][requests]") {
  test::CoreBench bench(asked_pack());
  set_values(bench);
  for (const auto& [pid, number] : std::vector<std::pair<int, int>>{
           {0x14, 0},   {0x14, 9}, {0x14, 255}, {0x11, 9}, {0x20, 2}, {0x20, 16}, {0x30, 1},
           {0x40, 1},   {0x50, 1}, {0x2E, 0},   {0x10, 1}, {0x00, 0}, {0x57, 0},  {0x6D, 0},
           {0x71, 168}, {0x1B, 1}, {0x4A, 0},   {0x4D, 0}, {0x56, 0}, {0xFF, 255}}) {
    INFO(pid << " " << number);
    CHECK(ask(bench, read_of(static_cast<std::uint8_t>(pid), static_cast<std::uint8_t>(number))) == std::nullopt);
  }
  std::vector<CanFrame> bad{request({0x04, 0x10, 0x43}), request({0x03, 0x11, 0x43}),
                            request({0x03, 0xA2, 0x67, 0, 0x82}),
                            request({0x07, 0x10, 0x71, 0xA8, 0x64, 0x12, 0x34, 0x56}), request({})};
  bad.push_back(read_of(0x43));
  bad.back().length = 7;
  for (const CanFrame& frame : bad) CHECK(ask(bench, frame) == std::nullopt);
  CHECK(bench.core().cell_requests().answered == 0);
  CanFrame remote = read_of(0x43);
  remote.is_remote = true;
  CanFrame extended = read_of(0x43);
  extended.is_extended = true;
  for (const CanFrame& frame : {remote, extended}) CHECK(ask(bench, frame) == std::nullopt);
  bench.observe(FrameReceived{Port::internal, read_of(0x43)});  // another bus
  bench.run(50ms);
  CHECK(bench.core().cell_requests().answered == 0);
}

TEST_CASE("a cell that is not measured is told as missing, and its voltage not at all", "[unit][core][requests]") {
  test::CoreBench bench(asked_pack());
  set_values(bench);
  bench.modules[1].cell_voltage_uV[0] = not_known(Validity::not_fitted);
  bench.run(1s);
  CHECK(ask(bench, read_of(0x14, 5)) == std::nullopt);
  CHECK(ask(bench, read_of(0x43)) == std::nullopt);
  CHECK(ask(bench, read_of(0x14, 6)));
  CHECK(ask(bench, read_of(0x11, 5)) == Answer{0x05, 0x50, 0x11, 5, 0b0001'0010, 0, 0, 0});
  CHECK(ask(bench, read_of(0x42)) == Answer{0x07, 0x50, 0x42, 0, 1, 5, 0, 0});
  CHECK(ask(bench, read_of(0x41)) == Answer{0x05, 0x50, 0x41, 0, 1, 0, 0, 0});
  CHECK(ask(bench, read_of(0x21, 1)) == Answer{0x05, 0x50, 0x21, 1, 0x83, 0, 0, 0});
  bench.modules[1].talks = false;
  bench.run(1s);
  CHECK(ask(bench, read_of(0x42)) == Answer{0x07, 0x50, 0x42, 0, 4, 5, 1, 1});
  CHECK(ask(bench, read_of(0x21, 1)) == Answer{0x05, 0x50, 0x21, 1, 0xFF, 0, 0, 0});
  CHECK(ask(bench, read_of(0x11, 5)) == Answer{0x05, 0x50, 0x11, 5, 0, 0, 0, 0});
}

TEST_CASE("cells that bleed are told as loads that are on", "[unit][core][requests]") {
  test::CoreBench bench(asked_pack());
  bench.modules[1].balancing_cells = 0b0101;
  set_values(bench);
  CHECK(ask(bench, read_of(0x11, 5)) == Answer{0x05, 0x50, 0x11, 5, 0b0000'1011, 1, 0, 0});
  CHECK(ask(bench, read_of(0x21, 1)) == Answer{0x05, 0x50, 0x21, 1, 4, 2, 0, 0});
  CHECK(ask(bench, read_of(0x41)) == Answer{0x05, 0x50, 0x41, 0, 0, 2, 0, 0});
}

TEST_CASE("without an identifier for them nobody's requests are answered", "[unit][core][requests]") {
  CoreConfig config = asked_pack();
  config.vehicle.request_id = 0;
  test::CoreBench bench(config);
  set_values(bench);
  CHECK(ask(bench, read_of(0x43)) == std::nullopt);
  CanFrame zero = read_of(0x43);
  zero.id = 0;
  CHECK(ask(bench, zero) == std::nullopt);
}

TEST_CASE("answers come where the pack file wants them", "[unit][core][requests]") {
  CoreConfig config = asked_pack();
  config.vehicle.request_id = 0x700;
  CHECK(reply_id_of(config.vehicle) == 0x708);
  config.vehicle.reply_id = reply_id;
  test::CoreBench bench(config);
  set_values(bench);
  CanFrame moved = read_of(0x43);
  CHECK(ask(bench, moved) == std::nullopt);
  moved.id = 0x700;
  CHECK(ask(bench, moved));
}

TEST_CASE("a stored fault is cleared by request only where the pack file allows it", "[unit][core][requests]") {
  CoreConfig config = asked_pack();
  const bool is_allowed = GENERATE(false, true);
  config.vehicle.may_clear_faults = is_allowed;
  test::CoreBench bench(config);
  set_values(bench);
  bench.inputs.estop_1_released = false;
  bench.run(500ms);
  bench.inputs.estop_1_released = true;
  bench.run(5s);
  REQUIRE(bench.is_active(FaultId::emergency_stop));  // latched
  const CanFrame clear = request({0x03, 0x14, 0x62});
  const auto answer = ask(bench, clear);
  CHECK(answer.has_value() == is_allowed);
  if (answer) CHECK(*answer == Answer{0x03, 0x54, 0x62, 0, 0, 0, 0, 0});
  CHECK(bench.is_active(FaultId::emergency_stop) == !is_allowed);
  CHECK(bench.core().cell_requests().refused == (is_allowed ? 0U : 1U));
  // The output of faults is not supported.
  CHECK(ask(bench, request({0x03, 0x14, 0x67})) == std::nullopt);
}

TEST_CASE("requests without end are answered one a tick, the rest is dropped and nothing else suffers",
          "[unit][core][requests]") {
  test::CoreBench bench(asked_pack());
  set_values(bench);
  REQUIRE(bench.close());
  bench.each_ms = [&bench] {
    for (int i = 0; i < 5; ++i) bench.observe(FrameReceived{Port::vehicle, read_of(0x43)});
  };
  const std::size_t before = bench.sent().size();
  bench.run(1s);
  const auto answers = std::count_if(bench.sent().begin() + static_cast<std::ptrdiff_t>(before), bench.sent().end(),
                                     [](const OutgoingFrame& sent) { return sent.frame.id == reply_id; });
  CHECK(answers >= 90);
  CHECK(answers <= 140);  // ticks also come early
  CHECK(bench.core().cell_requests().dropped > 4'000);
  CHECK(bench.core().sequence().phase == Phase::closed);
  CHECK(bench.core().faults().state(FaultId::tick_overrun).is_present() == false);
}

TEST_CASE("somebody else who answers our requests is a fault", "[unit][core][requests][F38]") {
  test::CoreBench bench(asked_pack());
  set_values(bench);
  bench.observe(FrameReceived{Port::vehicle, data_frame(reply_id, 8)});
  bench.run(50ms);
  CHECK(bench.is_active(FaultId::foreign_reporter));
}

TEST_CASE("no PID has two answers", "[unit][requests]") {
  std::set<int> pids;
  for (const std::span<const PidRow> rows : {cell_answers(), system_answers()}) {
    for (const PidRow& row : rows) CHECK(pids.insert(row.pid).second);
  }
  CHECK(pids.size() == 4 + 3 * 14 + 21);
}

TEST_CASE("encodings round to nearest and end at what a byte carries", "[unit][requests]") {
  CHECK(voltage_byte(1'900'000) == 0);
  CHECK(voltage_byte(2'004'999) == 0);
  CHECK(voltage_byte(2'005'000) == 1);
  CHECK(voltage_byte(4'600'000) == 0xFF);
  CHECK(temperature_byte(-1'300) == 0);
  CHECK(temperature_byte(-5) == 127);
  CHECK(temperature_byte(1'300) == 0xFF);
  CHECK(resistance_byte(0.0012) == 12);
  CHECK(resistance_byte(1.0) == 0xFF);
  RequestData data;
  put_16(data, 70'000);
  put_signed_16(data, -1);
  CHECK(std::vector<int>(data.begin(), data.end()) == std::vector<int>{0xFF, 0xFF, 0xFF, 0xFF});
  RequestData more;
  put_24(more, 0x01'02'03);
  CHECK(std::vector<int>(more.begin(), more.end()) == std::vector<int>{1, 2, 3});
}

TEST_CASE("a number that does not fit a byte gets no answer, it would be another cell's", "[unit][core][requests]") {
  CoreConfig config = test::pack_of(22);  // 264 cells
  config.vehicle.request_id = request_id;
  test::CoreBench bench(config);
  bench.modules[21].cell_voltage_uV[1] = known(3'230'000);   // cell 254
  bench.modules[21].cell_voltage_uV[11] = known(3'950'000);  // cell 264
  bench.run(1500ms);
  CHECK(ask(bench, read_of(0x43)) == Answer{0x05, 0x50, 0x43, 0, 0x7B, 254, 0, 0});
  CHECK(ask(bench, read_of(0x45)) == std::nullopt);
  CHECK(ask(bench, read_of(0x44)));
  CHECK(ask(bench, read_of(0x40)) == std::nullopt);
  CHECK(ask(bench, read_of(0x20, 15)) == Answer{0x07, 0x50, 0x20, 15, 181, 12, 15, 1});
  bench.modules[21].cell_voltage_uV[2] = not_known(Validity::not_fitted);  // cell 255
  bench.run(1s);
  CHECK(ask(bench, read_of(0x42)) == std::nullopt);
  bench.modules[21].cell_voltage_uV[1] = not_known(Validity::not_fitted);
  bench.run(1s);
  CHECK(ask(bench, read_of(0x42)) == Answer{0x07, 0x50, 0x42, 0, 2, 254, 0, 0});
}
