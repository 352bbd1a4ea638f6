// Core and its buses on the bench: frames sent and their times, frames accepted and rejected, and reception after a
// silence, a restart or a queue.
#include "daemon/core/core.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

bool is_open(const CoreBench& bench) {
  return !bench.commanded().any_contactor();
}

bool has_blocker(const CoreBench& bench, Blocker blocker) {
  const auto& blockers = bench.core().permission().blockers;
  return std::find(blockers.begin(), blockers.end(), blocker) != blockers.end();
}

}  // namespace

TEST_CASE("without our own commands coming back from the bus nothing closes", "[unit][core][F49]") {
  CoreBench bench(small_pack());
  bench.on_observe = {};
  bench.bus_echoes = false;
  CHECK_FALSE(bench.close());
  const auto& blockers = bench.core().permission().blockers;
  CHECK(std::find(blockers.begin(), blockers.end(), Blocker::commands_not_on_bus) != blockers.end());
}

TEST_CASE("two modules under one node number are found, named, and keep the pack open", "[unit][core][F30]") {
  CoreBench bench(small_pack());
  auto twin = bench.modules[0];
  twin.serial_number = 4711;
  twin.cell_voltage_uV.fill(known(2'000'000));
  bench.modules.push_back(twin);
  CHECK_FALSE(bench.close());
  CHECK(bench.is_active(FaultId::duplicate_node));
  CHECK(bench.core().faults().state(FaultId::duplicate_node).confirmed.element.module_node == 1);
  CHECK(bench.core().receive_counts().rejected[static_cast<std::size_t>(RejectReason::conflicting)] > 10);
  bench.run(30s);
  CHECK(bench.core().faults().state(FaultId::duplicate_node).stage == FaultStage::active);
  bench.modules.pop_back();
  bench.run(20s);
  bench.give(Command::clear_faults);
  bench.run(100ms);
  CHECK_FALSE(bench.is_active(FaultId::duplicate_node));
}

TEST_CASE("the contactor command goes out every 50 ms, at once on a change, and counts up", "[unit][core][I6]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  std::optional<TimePoint> last_at;
  std::optional<std::uint8_t> last_counter;
  for (std::size_t index = 0; index < bench.sent().size(); ++index) {
    const CanFrame& frame = bench.sent()[index].frame;
    if (frame.id != internal_bus::contactor_command.base_id) continue;
    if (last_at.has_value()) CHECK(bench.sent_at()[index] - *last_at <= 50ms);
    if (last_counter.has_value()) CHECK(frame.data[6] == static_cast<std::uint8_t>(*last_counter + 1));
    last_at = bench.sent_at()[index];
    last_counter = frame.data[6];
  }
}

TEST_CASE("decisions between two ticks do not stretch the contactor command's period", "[unit][core][I6]") {
  CoreBench bench(small_pack());
  bench.answer_delay = 7ms;  // a complete answer brings a decision forward, off the ticks
  REQUIRE(bench.close());
  const std::size_t before = bench.sent().size();
  bench.run(5s);
  int commands = 0;
  std::optional<TimePoint> last_at;
  for (std::size_t index = before; index < bench.sent().size(); ++index) {
    if (bench.sent()[index].frame.id != internal_bus::contactor_command.base_id) continue;
    ++commands;
    if (last_at.has_value()) CHECK(bench.sent_at()[index] - *last_at <= 54ms);
    last_at = bench.sent_at()[index];
  }
  CHECK(commands >= 99);
  CHECK(commands <= 101);
}

TEST_CASE("620h to 628h go out once a second, 10 ms apart", "[unit][core][BMS_F.8]") {
  CoreBench bench(small_pack());
  bench.run(5s);
  std::vector<std::pair<std::uint32_t, TimePoint>> reports;
  for (std::size_t index = 0; index < bench.sent().size(); ++index) {
    if (bench.sent()[index].port == Port::vehicle)
      reports.push_back({bench.sent()[index].frame.id, bench.sent_at()[index]});
  }
  REQUIRE(reports.size() >= 4 * vehicle_message_count);
  for (std::size_t index = 0; index < reports.size(); ++index) {
    CHECK(reports[index].first == 0x620 + index % 9);
    if (index == 0) continue;
    const Duration gap = reports[index].second - reports[index - 1].second;
    CHECK(gap == (index % 9 == 0 ? Duration{920ms} : Duration{10ms}));
  }
}

TEST_CASE("what is not known leaves as the invalid code, not as the last value", "[unit][core][I7]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1500ms);
  bench.modules[0].talks = false;
  bench.sensor_talks = false;
  bench.run(2500ms);
  const auto last_of = [&](std::uint32_t id) {
    CanFrame found;
    for (const OutgoingFrame& out : bench.sent()) {
      if (out.frame.id == id) found = out.frame;
    }
    return found;
  };
  using namespace vehicle_bus;
  const CanFrame voltage = last_of(0x623);
  CHECK(read<pack_voltage, "pack_voltage_mV">(voltage) == not_known());
  CHECK(read<pack_voltage, "cell_voltage_min_uV">(voltage) == not_known());
  CHECK(read<pack_voltage, "cell_voltage_max_cell">(voltage) == not_known());
  const CanFrame current = last_of(0x624);
  CHECK(read<pack_current, "pack_current_mA">(current) == not_known());
  CHECK(read<pack_current, "discharge_limit_mA">(current) == known(0));
  CHECK(read<pack_status, "state">(last_of(0x622)) == known(0));
}

TEST_CASE("damaged, late, repeated and foreign frames change nothing and are counted", "[unit][core][F28][F34][F35]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(300ms);
  CanFrame lie = make_frame(internal_bus::cells_1, 1);
  write<internal_bus::cells_1, "cell_voltage_1_uV">(lie, 1'000'000);
  seal(internal_bus::cells_1, 200, lie);
  const auto before = bench.core().modules().modules()[0].cell_voltage_uV[0];
  const auto rejected = [&](RejectReason reason) {
    return bench.core().receive_counts().rejected[static_cast<std::size_t>(reason)];
  };
  const auto tell = [&](const CanFrame& frame) { bench.observe(FrameReceived{Port::internal, frame}); };
  tell(lie);
  CHECK(rejected(RejectReason::late) == 1);
  CanFrame broken = lie;
  broken.data[7] ^= 1;
  tell(broken);
  CHECK(rejected(RejectReason::wrong_crc) == 1);
  CanFrame shorter = lie;
  shorter.length = 7;
  tell(shorter);
  CHECK(rejected(RejectReason::wrong_length) == 1);
  CanFrame twin = lie;
  twin.is_extended = true;
  tell(twin);
  CHECK(rejected(RejectReason::wrong_form) == 1);
  CanFrame unknown = lie;
  unknown.id = 0x7FF;
  tell(unknown);
  CHECK(rejected(RejectReason::unknown_id) == 1);
  CanFrame stranger = make_frame(internal_bus::cells_1, 9);
  seal(internal_bus::cells_1, bench.core().modules().modules()[0].answers_complete & 0xFF, stranger);
  tell(stranger);
  CHECK(rejected(RejectReason::not_configured) + rejected(RejectReason::late) == 2);
  const auto after = bench.core().modules().modules()[0].cell_voltage_uV[0];
  CHECK(after.value == before.value);
  CHECK(after.taken_at == before.taken_at);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("frames of a wrong length under a module's identifiers are counted and nothing else", "[unit][core][F34]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  CanFrame shorter = make_frame(internal_bus::cells_1, 1);
  shorter.length = 7;
  for (int count = 0; count < 10; ++count) bench.observe(FrameReceived{Port::internal, shorter});
  bench.run(20ms);
  CHECK_FALSE(bench.is_active(FaultId::module_disturbed));
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("commands that waited in the queue of a bus without listeners never close the mains again",
          "[unit][core][F46][F48]") {
  for (const std::size_t queue : {6U, 10U, 16U}) {
    for (int phase_ms = 0; phase_ms < 1'000; phase_ms += 10) {
      CoreBench bench(small_pack());
      bench.queue_length = queue;
      REQUIRE(bench.close());
      bench.run(500ms + std::chrono::milliseconds(phase_ms));
      bench.bus_is_stuck = true;
      bench.pdu_talks = bench.sensor_talks = false;
      for (auto& module : bench.modules) module.talks = false;
      bench.run(600ms);
      REQUIRE_FALSE(bench.core().outputs().any_contactor());
      REQUIRE_FALSE(bench.contacts().any_contactor());
      bench.link_voltage_mV = 0;
      bool has_closed = false;
      bench.on_mains_made = [&](std::int32_t, std::int32_t) { has_closed = true; };
      bench.free_bus();
      bench.pdu_talks = bench.sensor_talks = true;
      bench.run(200ms);
      CAPTURE(queue, phase_ms);
      REQUIRE_FALSE(has_closed);
      REQUIRE_FALSE(bench.commanded().any_contactor());
    }
  }
}

TEST_CASE("an open command that the system does not take is given again until it is on the bus", "[unit][core][F49]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.queue_length = 0;
  bench.bus_is_stuck = true;
  bench.run(300ms);
  REQUIRE_FALSE(bench.core().outputs().any_contactor());
  bench.free_bus();
  CHECK(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 15ms));
}

TEST_CASE("a unit that restarts between two words is not made to close again", "[unit][core][F101]") {
  for (int offset_ms = 0; offset_ms < 50; offset_ms += 5) {
    for (const bool tells_changes : {false, true}) {
      CoreBench bench(small_pack());
      bench.pdu_tells_changes = tells_changes;
      REQUIRE(bench.close());
      bench.run(500ms + std::chrono::milliseconds(offset_ms));
      bench.contacts_held_open = true;
      bench.pdu_talks = false;
      bench.run(60ms);
      bench.restart_pdu();
      bench.contacts_held_open = false;
      bench.pdu_talks = true;
      bench.run(150ms);
      CAPTURE(offset_ms, tells_changes);
      CHECK(is_open(bench));
      CHECK(bench.is_active(FaultId::pdu_opened_by_itself));
    }
  }
}

TEST_CASE("a module that was swapped while the bus was away is named, and gets our limits before anything closes",
          "[unit][core][F40][BMS_F.2]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.observe(PortChanged{Port::internal, false});
  bench.run(100ms);
  bench.modules[1].serial_number = 777;
  bench.modules[1].limits_not_set = false;
  bench.modules[1].ignores_commands = true;
  bench.observe(PortChanged{Port::internal, true});
  bench.run(2s);
  CHECK(bench.is_active(FaultId::duplicate_node));
  CHECK(has_blocker(bench, Blocker::modules_not_set_up));
  bench.run(20s);
  bench.give(Command::clear_faults);
  bench.run(1s);
  CHECK_FALSE(bench.is_active(FaultId::duplicate_node));
  CHECK(has_blocker(bench, Blocker::modules_not_set_up));
  bench.modules[1].ignores_commands = false;
  bench.run(1s);
  CHECK_FALSE(has_blocker(bench, Blocker::modules_not_set_up));
  CHECK(bench.is_active(FaultId::module_exchanged));  // until an authorised client has accepted it
  bench.observe(CommandGiven{.command = Command::accept_modules, .authority = Authority::service});
  bench.run(2s);
  CHECK(bench.core().permission().may_close);
}

TEST_CASE("one bad sample and one damaged frame after it do not open", "[unit][core][F2][F28]") {
  for (const int which : {0, 1, 2}) {
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.run(1s);
    int polls = 0;
    bench.before_poll = [&] {
      const bool is_bad = ++polls == 1;
      auto& module = bench.modules[0];
      module.cell_voltage_uV[0] = which == 0 && is_bad ? not_known(Validity::not_fitted) : known(3'700'000);
      module.undervoltage_cells = which == 1 && is_bad ? 1 : 0;
      module.cell_temperature_dC[0] = which == 2 && is_bad ? not_known(Validity::open_circuit) : known(250);
    };
    bench.is_lost = [&](const CanFrame& frame) { return polls == 2 && frame.id == (which == 2 ? 0x241U : 0x101U); };
    bench.run(2s);
    CAPTURE(which);
    CHECK(bench.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("a module that was away for a whole circle of the counter is not taken for two", "[unit][core][F30]") {
  CoreBench bench(small_pack());
  bench.run(1500ms);
  while (to_ms(bench.now().time_since_epoch()) % 100 != 50) bench.run(1ms);
  bench.modules[0].talks = false;
  // The module is also polled alone meanwhile: the counter wraps in fewer than 256 cycles.
  const auto polls_since = [&, from = bench.sent().size()] {
    return std::count_if(bench.sent().begin() + static_cast<std::ptrdiff_t>(from), bench.sent().end(),
                         [](const OutgoingFrame& out) {
                           return out.frame.id == internal_bus::poll.base_id && out.port == Port::internal;
                         });
  };
  REQUIRE(bench.run_until([&] { return polls_since() == 255; }, 30s));
  bench.modules[0].cell_voltage_uV[0] = known(3'701'000);
  bench.modules[0].talks = true;
  bench.run(300ms);
  CHECK(bench.core().receive_counts().rejected[static_cast<std::size_t>(RejectReason::conflicting)] > 0);
  CHECK_FALSE(bench.is_active(FaultId::duplicate_node));
}

TEST_CASE("an answer without its last frame is no answer", "[unit][core][F23]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.is_lost = [](const CanFrame& frame) { return frame.id == 0x2C1; };
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 400ms));
  CHECK(bench.core().last_opening().fault == FaultId::module_lost);
}

TEST_CASE("one echo that is lost on this machine neither opens nor stops the polls", "[unit][core][F2][F53]") {
  for (const bool is_closed : {false, true}) {
    for (int offset_ms = 0; offset_ms < 100; offset_ms += 7) {
      CoreBench bench(small_pack());
      if (is_closed) {
        REQUIRE(bench.close());
      } else {
        bench.run(1500ms);
      }
      bench.run(500ms + std::chrono::milliseconds(offset_ms));
      bool has_lost = false;
      bench.echo_is_lost = [&](const OutgoingFrame& frame) {
        const bool loses = !has_lost && frame.frame.id == internal_bus::contactor_command.base_id;
        has_lost = has_lost || loses;
        return loses;
      };
      bench.run(2s);
      CAPTURE(offset_ms);
      REQUIRE(has_lost);
      CHECK((bench.core().sequence().phase == Phase::closed) == is_closed);
      CHECK_FALSE(bench.is_active(FaultId::module_lost));
      CHECK_FALSE(bench.is_active(FaultId::command_not_on_bus));
    }
  }
}

TEST_CASE("a module that says done and does nothing keeps the pack open", "[unit][core][BMS_F.3]") {
  CoreBench bench(small_pack());
  bench.modules[1].only_says_done = true;
  CHECK_FALSE(bench.close());
  CHECK(has_blocker(bench, Blocker::modules_not_set_up));
}

TEST_CASE("one open wire seen once and one damaged frame after it do not open, lasting ones do", "[unit][core][F10]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1s);
  int polls = 0;
  bench.before_poll = [&] { bench.modules[0].open_wire_cells = ++polls == 1 ? 1 : 0; };
  bench.is_lost = [&](const CanFrame& frame) { return polls == 2 && frame.id == 0x2C1; };
  bench.run(2s);
  CHECK(bench.core().sequence().phase == Phase::closed);
  bench.before_poll = [&] { bench.modules[0].open_wire_cells = 1; };
  CHECK(bench.run_until([&] { return is_open(bench); }, 500ms));
}

TEST_CASE("a jump of the unit's counter is a restart, but not after frames were lost here", "[unit][core][F101][F53]") {
  for (const bool were_lost_here : {false, true}) {
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.run(520ms);
    bench.is_lost = [](const CanFrame& frame) { return frame.id == internal_bus::pdu_status.base_id; };
    for (int word = 0; word < 5; ++word) bench.tell_pdu_status();
    bench.is_lost = {};
    if (were_lost_here) bench.observe(FramesLost{Port::internal, 5});
    bench.tell_pdu_status();
    bench.run(1s);
    CHECK(is_open(bench) == !were_lost_here);
  }
}

TEST_CASE("a clear is over when it was given, on a stuck bus too", "[unit][faults][I10]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[0].cell_voltage_uV[0] = known(2'800'000);
  bench.run(1s);
  bench.modules[0].cell_voltage_uV[0] = known(3'700'000);
  bench.run(500ms);
  bench.bus_is_stuck = true;
  bench.run(100ms);
  bench.give(Command::clear_faults);  // the cause is gone, but not for the required time
  REQUIRE(bench.is_active(FaultId::cell_undervoltage));
  bench.run(600ms);
  bench.free_bus();
  bench.run(3s);
  CHECK(bench.is_active(FaultId::cell_undervoltage));
}
