// The whole core on the bench: closing, opening, and forbidden behaviour. The traffic on its buses is tested in
// core_bus_test.cpp.
#include "daemon/core/core.hpp"

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::pack_of;
using bmu::test::small_pack;

namespace {

void all_cells(CoreBench& bench, std::int64_t voltage_uV) {
  for (auto& module : bench.modules) module.cell_voltage_uV.fill(known(voltage_uV));
}

bool is_open(const CoreBench& bench) {
  return !bench.commanded().any_contactor();
}

}  // namespace

TEST_CASE("a healthy pack closes in the order negative, precharge, positive", "[unit][core][FS_2]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(200ms);
  CHECK(bench.commanded() == ContactorOutputs{.main_positive = true, .main_negative = true, .auxiliary = true});
  CHECK(bench.core().last_precharge().was_successful);
  std::vector<ContactorOutputs> steps;
  for (const OutgoingFrame& out : bench.sent()) {
    if (out.frame.id != internal_bus::contactor_command.base_id) continue;
    const ContactorOutputs outputs = outputs_of(out.frame);
    if (steps.empty() || steps.back() != outputs) steps.push_back(outputs);
  }
  CHECK(steps == std::vector<ContactorOutputs>{{},
                                               {.main_negative = true},
                                               {.main_negative = true, .precharge = true},
                                               {.main_positive = true, .main_negative = true, .precharge = true},
                                               {.main_positive = true, .main_negative = true, .auxiliary = true}});
}

TEST_CASE("nothing closes while the vehicle was on already when the daemon started", "[unit][core][F64]") {
  CoreBench bench(small_pack());
  bench.inputs.vehicle_on = true;
  bench.run(4s);
  CHECK(is_open(bench));
  bench.inputs.vehicle_on = false;
  bench.run(200ms);
  bench.inputs.vehicle_on = true;
  CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
}

TEST_CASE("an insulation monitor has its time from the start of the daemon, however long the machine has been on",
          "[unit][core]") {
  const Core core(small_pack(), TimePoint{1'000s});
  CHECK(core.sensors().insulation_known_at == TimePoint{1'000s});
}

TEST_CASE("every single missing thing keeps the pack open and is named", "[unit][core][F32][F42]") {
  struct Case {
    const char* what;
    std::function<void(CoreBench&)> break_it;
    Blocker blocker;
  };
  const std::vector<Case> cases{
      {"a module is silent", [](CoreBench& b) { b.modules[1].talks = false; }, Blocker::modules_incomplete},
      {"a cell is not measured",
       [](CoreBench& b) { b.modules[0].cell_voltage_uV[2] = not_known(Validity::not_fitted); },
       Blocker::modules_incomplete},
      {"a temperature sensor is open",
       [](CoreBench& b) { b.modules[0].cell_temperature_dC[1] = not_known(Validity::open_circuit); },
       Blocker::modules_incomplete},
      {"temperatures do not come", [](CoreBench& b) { b.modules[0].sends_temperatures = false; },
       Blocker::modules_incomplete},
      {"voltages are of unknown age", [](CoreBench& b) { b.modules[0].voltage_age_ms = not_known(); },
       Blocker::modules_incomplete},
      {"the current sensor is silent", [](CoreBench& b) { b.sensor_talks = false; }, Blocker::sensors_incomplete},
      {"the voltage sensor is silent", [](CoreBench& b) { b.voltage_talks = false; }, Blocker::sensors_incomplete},
      {"the PDU is silent", [](CoreBench& b) { b.pdu_talks = false; }, Blocker::pdu_unknown},
      {"emergency stop pressed", [](CoreBench& b) { b.inputs.estop_2_released = false; }, Blocker::inputs_unhealthy},
      {"the interlock is open", [](CoreBench& b) { b.inputs.interlock_closed = false; }, Blocker::inputs_unhealthy},
      {"insulation is bad", [](CoreBench& b) { b.inputs.insulation_monitor_ok = false; }, Blocker::inputs_unhealthy},
      {"a module does not take the limits", [](CoreBench& b) { b.modules[1].ignores_commands = true; },
       Blocker::modules_not_set_up},
      {"a cell is too low", [](CoreBench& b) { all_cells(b, 2'800'000); }, Blocker::fault},
  };
  for (const Case& one : cases) {
    DYNAMIC_SECTION(one.what) {
      CoreBench bench(small_pack());
      one.break_it(bench);
      CHECK_FALSE(bench.close());
      CHECK(is_open(bench));
      const auto& blockers = bench.core().permission().blockers;
      CHECK(std::find(blockers.begin(), blockers.end(), one.blocker) != blockers.end());
    }
  }
}

TEST_CASE("each condition opens a closed pack within its budget", "[unit][core][BMS_F.1][FS_2][BMU_12][BMU_14]") {
  struct Case {
    const char* what;
    std::function<void(CoreBench&)> break_it;
    FaultId fault;
    Duration budget;
  };
  const std::vector<Case> cases{
      {"cell undervoltage", [](CoreBench& b) { b.modules[1].cell_voltage_uV[2] = known(2'900'000); },
       FaultId::cell_undervoltage, 450ms},
      {"cell overvoltage", [](CoreBench& b) { b.modules[0].cell_voltage_uV[0] = known(4'200'000); },
       FaultId::cell_overvoltage, 450ms},
      {"over-temperature", [](CoreBench& b) { b.modules[0].cell_temperature_dC[1] = known(600); },
       FaultId::cell_overtemperature, 950ms},
      {"under-temperature", [](CoreBench& b) { b.modules[0].cell_temperature_dC[0] = known(-200); },
       FaultId::cell_undertemperature, 950ms},
      {"discharge overcurrent", [](CoreBench& b) { b.current_mA = 100'000; }, FaultId::discharge_overcurrent, 450ms},
      {"charge overcurrent", [](CoreBench& b) { b.current_mA = -30'000; }, FaultId::charge_overcurrent, 450ms},
      {"lost module", [](CoreBench& b) { b.modules[0].talks = false; }, FaultId::module_lost, 400ms},
      {"lost temperatures of a module", [](CoreBench& b) { b.modules[0].sends_temperatures = false; },
       FaultId::temperature_not_measured, 550ms},
      {"cell no longer measured",
       [](CoreBench& b) { b.modules[0].cell_voltage_uV[3] = not_known(Validity::not_fitted); },
       FaultId::cell_not_measured, 400ms},
      {"lost current sensor", [](CoreBench& b) { b.sensor_talks = false; }, FaultId::current_sensor_lost, 300ms},
      {"lost voltage sensor", [](CoreBench& b) { b.voltage_talks = false; }, FaultId::voltage_sensor_lost, 400ms},
      {"lost PDU", [](CoreBench& b) { b.pdu_talks = false; }, FaultId::pdu_lost, 300ms},
      {"sum of cells against pack voltage", [](CoreBench& b) { b.pack_voltage_mV = 8 * 3'700 + 1'000; },
       FaultId::pack_voltage_mismatch, 1s},
      {"emergency stop", [](CoreBench& b) { b.inputs.estop_1_released = false; }, FaultId::emergency_stop, 70ms},
      {"interlock", [](CoreBench& b) { b.inputs.interlock_closed = false; }, FaultId::interlock_open, 70ms},
      {"insulation", [](CoreBench& b) { b.inputs.insulation_monitor_ok = false; }, FaultId::insulation_fault, 1s},
      {"module flags an empty cell", [](CoreBench& b) { b.modules[0].undervoltage_cells = 1; },
       FaultId::module_reports_undervoltage, 450ms},
      {"module flags a full cell", [](CoreBench& b) { b.modules[0].overvoltage_cells = 1; },
       FaultId::module_reports_fault, 450ms},
      {"two serial numbers on one node",
       [](CoreBench& b) {
         CanFrame who = make_frame(internal_bus::ident, 1);
         write<internal_bus::ident, "protocol_version">(who, 1);
         write<internal_bus::ident, "cell_count">(who, 4);
         write<internal_bus::ident, "temperature_sensor_count">(who, 2);
         write<internal_bus::ident, "serial_number">(who, 99);
         seal(internal_bus::ident, 0, who);
         b.observe(FrameReceived{Port::internal, who});
       },
       FaultId::duplicate_node, 100ms},
      {"second master",
       [](CoreBench& b) {
         b.observe(FrameReceived{Port::internal, contactor_command_frame({}, 77)});
       },
       FaultId::foreign_master, 20ms},
      {"internal bus down",
       [](CoreBench& b) {
         b.observe(PortChanged{Port::internal, false});
       },
       FaultId::internal_bus_down, 20ms},
      {"bus-off",
       [](CoreBench& b) {
         b.observe(BusErrorSeen{Port::internal, 0x040});
       },
       FaultId::internal_bus_down, 20ms},
      {"half of the cells' samples are too low, the others are missing",
       [](CoreBench& b) {
         b.before_poll = [&b, odd = false]() mutable {
           odd = !odd;
           b.modules[0].cell_voltage_uV[1] = odd ? known(2'000'000) : not_known(Validity::not_fitted);
         };
       },
       FaultId::cell_undervoltage, 450ms},
      {"a sensor that is now too hot, now open",
       [](CoreBench& b) {
         b.before_poll = [&b, odd = false]() mutable {
           odd = !odd;
           b.modules[0].cell_temperature_dC[1] = odd ? known(1'200) : not_known(Validity::open_circuit);
         };
       },
       FaultId::temperature_not_measured, 550ms},
      {"a cell that is not measured every second time",
       [](CoreBench& b) {
         b.before_poll = [&b, odd = false]() mutable {
           odd = !odd;
           b.modules[0].cell_voltage_uV[1] = odd ? known(3'700'000) : not_known(Validity::not_fitted);
         };
       },
       FaultId::cell_not_measured, 700ms},
      {"a cell that is too low every second time",
       [](CoreBench& b) {
         b.before_poll = [&b, odd = false]() mutable {
           odd = !odd;
           b.modules[0].cell_voltage_uV[1] = known(odd ? 3'700'000 : 2'000'000);
         };
       },
       FaultId::cell_undervoltage, 700ms},
      {"voltages without the status that tells their age", [](CoreBench& b) { b.modules[0].sends_status = false; },
       FaultId::module_lost, 400ms},
      {"a unit that misses the commands", [](CoreBench& b) { b.pdu_hears = false; }, FaultId::pdu_opened_by_itself,
       300ms},
      {"commands that do not get onto the bus", [](CoreBench& b) { b.bus_echoes = false; }, FaultId::command_not_on_bus,
       200ms},
      {"a contactor that opens by itself",
       [](CoreBench& b) {
         b.inputs.vehicle_on = true;
         b.contactors_stuck = true;
         b.drop_contacts();
       },
       FaultId::contactor_feedback, 80ms},
  };
  for (const Case& one : cases) {
    DYNAMIC_SECTION(one.what) {
      CoreBench bench(small_pack());
      REQUIRE(bench.close());
      bench.run(300ms);
      const TimePoint broken_at = bench.now();
      one.break_it(bench);
      REQUIRE(bench.run_until([&] { return !bench.core().outputs().any_contactor(); }, one.budget));
      CHECK(bench.is_active(one.fault));
      CHECK(bench.core().last_opening().cause == OpeningCause::fault);
      CHECK(bench.core().last_opening().fault == one.fault);
      CHECK(bench.now() - broken_at <= one.budget);
      bench.run(15s);
      CHECK(is_open(bench));  // nothing closes again by itself
    }
  }
}

TEST_CASE("one bad sample alone does not open", "[unit][core][F2]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(500ms);
  bench.modules[0].cell_voltage_uV[1] = known(2'500'000);
  const std::uint64_t answers = bench.core().modules().modules()[0].answers_complete;
  REQUIRE(bench.run_until([&] { return bench.core().modules().modules()[0].answers_complete > answers; }, 200ms));
  bench.modules[0].cell_voltage_uV[1] = known(3'700'000);
  bench.run(1s);
  CHECK(bench.core().sequence().phase == Phase::closed);
  CHECK_FALSE(bench.is_active(FaultId::cell_undervoltage));
}

TEST_CASE("values one step before a limit never open, however long", "[unit][core][F3]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[0].cell_voltage_uV[0] = known(2'900'100);
  bench.modules[1].cell_voltage_uV[0] = known(4'199'900);
  bench.modules[0].cell_temperature_dC[0] = known(599);
  bench.current_mA = 99'999;
  bench.run(5s);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("precharge that never reaches the threshold locks out", "[unit][contactors][F86]") {
  CoreBench bench(small_pack());
  bench.link_rise_mV_per_ms = 0;
  CHECK_FALSE(bench.close());
  bench.run(1s);
  CHECK(is_open(bench));
  CHECK(bench.is_active(FaultId::precharge_failed));
  CHECK(bench.core().last_opening().fault == FaultId::precharge_failed);
  CHECK_FALSE(bench.core().last_precharge().was_successful);
}

TEST_CASE("precharge with a current that does not fall does not close", "[unit][contactors][F88]") {
  CoreBench bench(small_pack());
  bench.precharge_current_mA = 2'000;
  CHECK_FALSE(bench.close());
  bench.run(1s);
  CHECK(is_open(bench));
  CHECK(bench.is_active(FaultId::precharge_failed));
}

TEST_CASE("after a fault a clear and a new wish are needed, and the lockout must be over", "[unit][core][BMS_F.1]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[0].cell_voltage_uV[0] = known(2'800'000);
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 1s));
  bench.give(Command::clear_faults);
  bench.run(50ms);
  CHECK(bench.is_active(FaultId::cell_undervoltage));  // the cause is still present
  bench.modules[0].cell_voltage_uV[0] = known(3'700'000);
  bench.run(12s);
  CHECK(bench.core().faults().state(FaultId::cell_undervoltage).stage == FaultStage::latched);
  bench.give(Command::clear_faults);
  bench.run(500ms);
  CHECK_FALSE(bench.is_active(FaultId::cell_undervoltage));
  CHECK(is_open(bench));  // the vehicle is still on, but that is the previous request
  bench.inputs.vehicle_on = false;
  bench.run(200ms);
  bench.inputs.vehicle_on = true;
  CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
}

TEST_CASE("a stopped daemon opens first when it comes back", "[unit][core][F60]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(300ms);
  bench.stall(131ms);
  CHECK(is_open(bench));
  CHECK(bench.is_active(FaultId::control_loop_gap));
  CHECK_FALSE(bench.core().pack().is_complete());
}

TEST_CASE("a short delay of the loop is ridden through", "[unit][core][F60]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(300ms);
  bench.stall(100ms);
  bench.run(500ms);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

namespace {

/// The contacts of a closed pack have opened and could close again momentarily later: in no case may the main
/// contactors close onto a DC link without precharge.
void must_not_close_again(CoreBench& bench) {
  bench.link_voltage_mV = 0;
  for (int step = 0; step < 3'000; ++step) {
    bench.run(1ms);
    const ContactorOutputs commanded = bench.commanded();
    REQUIRE_FALSE((commanded.main_positive && commanded.main_negative && bench.contacts().main_positive));
    bench.link_voltage_mV = 0;
  }
  CHECK(is_open(bench));
}

}  // namespace

TEST_CASE("a unit that missed commands for a moment is not made to close again", "[unit][core][F101]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(300ms);
  bench.pdu_hears = false;
  REQUIRE(bench.run_until([&] { return !bench.contacts().any_contactor(); }, 300ms));
  bench.pdu_hears = true;
  bench.run(60ms);  // until its status has arrived
  must_not_close_again(bench);
  CHECK(bench.is_active(FaultId::pdu_opened_by_itself));
}

TEST_CASE("a contact that drops out after it had followed opens everything", "[unit][core][F84]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(300ms);
  SECTION("once, for a moment") {
    bench.contacts_held_open = true;
    bench.run(60ms);
    bench.contacts_held_open = false;
    must_not_close_again(bench);
  }
  SECTION("for a flicker, which is forgiven") {
    bench.contacts_held_open = true;
    REQUIRE(bench.run_until([&] { return !bench.core().sensors().pdu.value.main_positive_closed; }, 60ms));
    bench.contacts_held_open = false;
    bench.run(5ms);
    bench.tell_pdu_status();
    bench.run(1s);
    CHECK(bench.core().sequence().phase == Phase::closed);
    return;
  }
  SECTION("again and again") {
    for (int round = 0; round < 4; ++round) {
      bench.contacts_held_open = true;
      bench.run(200ms);
      bench.contacts_held_open = false;
      bench.run(50ms);
    }
    CHECK(is_open(bench));
  }
  CHECK(bench.is_active(FaultId::contactor_feedback));
}

TEST_CASE("an overcurrent with short breaks opens", "[unit][core][BMU_14]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  const TimePoint began = bench.now();
  while (!is_open(bench) && bench.now() - began < 2s) {
    bench.current_mA = 500'000;
    bench.run(80ms);
    bench.current_mA = 0;
    bench.run(20ms);
  }
  CHECK(is_open(bench));
  CHECK(bench.core().last_opening().fault == FaultId::discharge_overcurrent);
}

TEST_CASE("a key that is turned on and off again does not rattle the contactors", "[unit][contactors][F92]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  std::vector<TimePoint> closed_at;
  bool was_closed = true;
  for (int ms = 0; ms < 30'000; ++ms) {
    bench.inputs.vehicle_on = ms % 1'000 >= 500;
    bench.run(1ms);
    const bool is_closed = bench.commanded().any_contactor();
    if (is_closed && !was_closed) closed_at.push_back(bench.now());
    was_closed = is_closed;
  }
  CHECK(closed_at.size() >= 2);
  CHECK(closed_at.size() <= 3);  // from the second closing within the window the key counts as cycled repeatedly
  for (std::size_t index = 1; index < closed_at.size(); ++index) CHECK(closed_at[index] - closed_at[index - 1] >= 2s);
}

TEST_CASE("what a module warns of is told and opens nothing", "[unit][core]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[1].board_too_hot = true;
  bench.run(1s);
  CHECK(bench.is_active(FaultId::module_warning));
  CHECK(bench.core().faults().state(FaultId::module_warning).confirmed.element.module_node == 2);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("shutting down opens, waits for the contacts, and then says so", "[unit][core][F63]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(300ms);
  bench.give(Command::shut_down);
  CHECK(is_open(bench));
  CHECK_FALSE(bench.last().is_shut_down);
  CHECK(bench.run_until([&] { return bench.last().is_shut_down; }, 300ms));
  CHECK_FALSE(bench.has_event(EventId::shut_down_unconfirmed));
  CHECK(bench.core().last_opening().cause == OpeningCause::shut_down);
}

TEST_CASE("shutting down does not wait for ever for contacts that do not open", "[unit][core][F63]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.contactors_stuck = true;
  bench.give(Command::shut_down);
  CHECK(is_open(bench));
  CHECK(bench.run_until([&] { return bench.last().is_shut_down; }, 600ms));
  CHECK(bench.has_event(EventId::shut_down_unconfirmed));
}

TEST_CASE("vehicle off opens and vehicle on closes again", "[unit][core]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.inputs.vehicle_on = false;
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 100ms));
  CHECK(bench.core().last_opening().cause == OpeningCause::request_over);
  bench.link_voltage_mV = 0;
  bench.run(300ms);
  bench.inputs.vehicle_on = true;
  CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
}

TEST_CASE("an opening whose current nobody knew does not tell one", "[unit][core][I7]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.current_mA = 20'000;
  bench.run(300ms);
  bench.sensor_talks = false;
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 400ms));
  CHECK_FALSE(bench.core().last_opening().current_mA.is_valid());
}

TEST_CASE("a fault that refuses to close breaks off a closing at once and leaves a closed pack alone",
          "[unit][core][F102]") {
  CoreBench bench(small_pack());
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  const auto somebody_reports = [&bench] { bench.observe(FrameReceived{Port::vehicle, data_frame(0x622, 8)}); };
  SECTION("half closed") {
    REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::precharge; }, 3s));
    somebody_reports();
    bench.run(tick_period);
    CHECK(bench.is_active(FaultId::foreign_reporter));
    CHECK_FALSE(bench.core().outputs().any_contactor());
  }
  SECTION("closed") {
    REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
    somebody_reports();
    bench.run(1s);
    CHECK(bench.is_active(FaultId::foreign_reporter));
    CHECK(bench.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("the state of charge starts from a rest and is counted from there", "[unit][estimators][FS_4][BMS_F.6]") {
  CoreBench bench(small_pack());
  bench.run(3s);
  REQUIRE(bench.core().soc_permille());
  CHECK(*bench.core().soc_permille() == 500);  // 3.7 V of the bench cell
  REQUIRE(bench.close());
  const std::int64_t before_uAs = bench.core().charge().flowed_uAs;
  bench.current_mA = 36'000;
  bench.run(100s);
  const std::int64_t used_uAs = bench.core().charge().flowed_uAs - before_uAs;
  CHECK(used_uAs == Approx(3'600'000'000.0).epsilon(0.001));  // 36 A for 100 s is 1 Ah
}

TEST_CASE("current limits fall between warning and opening threshold and name their cause", "[unit][limits][BMU_13]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(200ms);
  CHECK(bench.core().limits().discharge.limit_mA == 80'000);
  bench.modules[1].cell_voltage_uV[3] = known(3'000'000);
  bench.run(300ms);
  CHECK(bench.core().limits().discharge.limit_mA == 40'000);
  CHECK(bench.core().limits().discharge.cause == LimitCause::cell_voltage_low);
  CHECK(bench.core().limits().discharge.element == Element{2, 4, 8});
  CHECK(bench.core().limits().charge.limit_mA == 20'000);
}

TEST_CASE("identical observations give identical decisions", "[unit][core]") {
  const auto run_once = [] {
    CoreBench bench(small_pack());
    (void)bench.close();
    bench.current_mA = 20'000;
    bench.run(1s);
    bench.modules[0].talks = false;
    bench.run(1s);
    std::vector<CanFrame> frames;
    for (const OutgoingFrame& out : bench.sent()) frames.push_back(out.frame);
    return frames;
  };
  CHECK(run_once() == run_once());
}

TEST_CASE("a wish from the time of a fault does not close the pack when the fault is cleared",
          "[unit][core][F90][I3]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.inputs.estop_1_released = false;
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 100ms));
  bench.run(1s);
  bench.inputs.vehicle_on = false;
  bench.run(200ms);
  bench.inputs.vehicle_on = true;  // refused: the emergency stop is still pressed
  bench.run(200ms);
  CHECK(bench.has_event(EventId::close_refused));
  CHECK(bench.core().last_refusal().blocker == Blocker::fault);
  bench.inputs.estop_1_released = true;
  bench.run(15s);
  bench.give(Command::clear_faults);
  bench.run(10s);
  CHECK(bench.core().permission().may_close);
  CHECK(is_open(bench));
}

TEST_CASE("a wish waits for a pack that is not ready yet, but not for ever", "[unit][core][F90]") {
  CoreBench quick(small_pack());
  quick.modules[0].ignores_commands = true;
  quick.run(300ms);
  quick.inputs.vehicle_on = true;
  quick.run(3s);
  CHECK(quick.core().is_close_requested());
  quick.modules[0].ignores_commands = false;
  CHECK(quick.run_until([&] { return quick.core().sequence().phase == Phase::closed; }, 3s));

  CoreBench slow(small_pack());
  slow.modules[0].ignores_commands = true;
  slow.run(300ms);
  slow.inputs.vehicle_on = true;
  slow.run(6s);
  CHECK_FALSE(slow.core().is_close_requested());
  CHECK(slow.core().last_refusal().blocker == Blocker::modules_not_set_up);
  slow.modules[0].ignores_commands = false;
  slow.run(10s);
  CHECK(is_open(slow));
}

TEST_CASE("a sensor value that comes later than the rest is not lost at start", "[unit][core][F89]") {
  CoreBench bench(small_pack());
  bench.voltage_talks = false;  // current every 20 ms, voltages every 60 ms: temporarily one is valid without the other
  bench.run(1500ms);
  CHECK_FALSE(bench.is_active(FaultId::voltage_sensor_lost));
  bench.voltage_talks = true;
  CHECK(bench.close());
}

// --- possible failures, one after another ----------------------------------------------------------------------------

namespace {

/// Lowest DC link voltage, relative to the pack voltage, at which the main contactors of this bench have closed.
struct Watch {
  std::int32_t permille_min = 1000;

  void on(CoreBench& bench) {
    bench.on_mains_made = [this](std::int32_t link_mV, std::int32_t pack_mV) {
      permille_min = std::min(permille_min, link_mV * 1000 / pack_mV);
    };
  }
};

bool reach(CoreBench& bench, Phase phase) {
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  return bench.run_until([&] { return bench.core().sequence().phase == phase; }, 4s);
}

}  // namespace

TEST_CASE("contactors of any speed within the allowance: the mains meet a charged link, and limits come after",
          "[unit][contactors][F83][I4]") {
  for (const std::size_t slow : {0U, 1U, 2U}) {
    for (const Duration delay : {Duration{15ms}, Duration{120ms}, Duration{180ms}}) {
      CoreBench bench(small_pack());
      bench.pdu_tells_changes = true;
      bench.contact_delays[slow] = delay;
      bench.link_fall_mV_per_ms = 1'000;
      Watch watch;
      watch.on(bench);
      bench.each_ms = [&] {
        const bool allows = bench.core().limits().discharge.limit_mA > 0;
        REQUIRE_FALSE((allows && !bench.contacts().main_positive));
      };
      CHECK(reach(bench, Phase::closed));
      CHECK(bench.contacts().main_positive);
      CHECK(watch.permille_min >= 950);
    }
  }
}

TEST_CASE("voltages from before a slow contact has closed grant no step", "[unit][contactors][I4]") {
  constexpr std::array slow_contacts{std::pair{1U, Phase::main_negative}, std::pair{2U, Phase::precharge},
                                     std::pair{0U, Phase::main_positive}};
  for (const auto& [slow, phase] : slow_contacts) {
    CoreBench bench(small_pack());
    bench.pdu_tells_changes = true;
    bench.contact_delays[slow] = 180ms;
    REQUIRE(reach(bench, phase));
    bench.run(165ms);
    bench.voltage_talks = false;
    bool goes_on = false;
    bench.each_ms = [&, phase = phase] { goes_on = goes_on || bench.core().sequence().phase > phase; };
    bench.run(1s);
    CAPTURE(to_text(phase));
    CHECK_FALSE(goes_on);
    CHECK(is_open(bench));
  }
}

TEST_CASE("a main contact that lets go while it is being closed is never made to close past the precharge",
          "[unit][contactors][F84][I4]") {
  for (Duration after = 20ms; after < 400ms; after += 20ms) {
    CoreBench bench(small_pack());
    bench.pdu_tells_changes = true;
    Watch watch;
    watch.on(bench);
    REQUIRE(reach(bench, Phase::main_positive));
    bench.run(after);
    bench.link_fall_mV_per_ms = 1'000;
    bench.main_positive_held_open = true;
    bench.run(60ms);
    bench.main_positive_held_open = false;
    bench.run(2s);
    CAPTURE(to_ms(after));
    CHECK(watch.permille_min >= 950);
  }
}

TEST_CASE("what turns bad while the contactors close keeps the mains open", "[unit][core][F105][I4]") {
  struct Case {
    const char* what;
    std::function<void(CoreBench&)> break_it;
  };
  const std::vector<Case> cases{
      {"insulation", [](CoreBench& b) { b.inputs.insulation_monitor_ok = false; }},
      {"a cell too low", [](CoreBench& b) { b.modules[0].cell_voltage_uV[0] = known(2'000'000); }},
      {"a cell not measured", [](CoreBench& b) { b.modules[0].cell_voltage_uV[0] = not_known(Validity::not_fitted); }},
      {"a module silent", [](CoreBench& b) { b.modules[0].talks = false; }},
      {"a module flags a cell", [](CoreBench& b) { b.modules[0].undervoltage_cells = 1; }},
  };
  for (const Case& one : cases) {
    for (const Phase phase : {Phase::main_negative, Phase::precharge}) {
      DYNAMIC_SECTION(one.what << " in phase " << to_text(phase)) {
        CoreBench bench(small_pack());
        bench.link_rise_mV_per_ms = 100;  // a precharge of 300 ms: all of these are known before its end
        REQUIRE(reach(bench, phase));
        one.break_it(bench);
        bool has_closed = false;
        bench.on_mains_made = [&](std::int32_t, std::int32_t) { has_closed = true; };
        bench.run(2s);
        CHECK_FALSE(has_closed);
        CHECK(is_open(bench));
      }
    }
  }
}

TEST_CASE("one bad sample while the contactors close delays them and no more", "[unit][core][F2]") {
  CoreBench bench(small_pack());
  REQUIRE(reach(bench, Phase::main_negative));
  int polls = 0;
  bench.before_poll = [&] { bench.modules[0].cell_voltage_uV[1] = known(polls++ == 0 ? 2'000'000 : 3'700'000); };
  CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
}

TEST_CASE("a voltage sensor without its ground precharges nothing", "[unit][contactors][F89][I4]") {
  for (const Duration before : {Duration{0ms}, Duration{100ms}, Duration{250ms}}) {
    CoreBench bench(small_pack());
    bench.link_rise_mV_per_ms = 0;
    bench.run(1500ms - before);
    bench.pack_voltage_mV = 40;
    bench.link_voltage_mV = 40;
    bench.run(before);
    bench.inputs.vehicle_on = true;
    bool has_closed = false;
    bench.on_mains_made = [&](std::int32_t, std::int32_t) { has_closed = true; };
    bench.run(5s);
    CHECK_FALSE(has_closed);
  }
}

TEST_CASE("contacts that say closed while the link has no voltage are not believed", "[unit][core][F85]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(500ms);
  bench.feedback_lies = bench.contactors_stuck = true;
  bench.drop_contacts();
  bench.link_voltage_mV = 0;
  const TimePoint broken_at = bench.now();
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 500ms));
  CHECK(bench.core().last_opening().fault == FaultId::link_not_following);
  CHECK(bench.now() - broken_at <= 500ms);
}

TEST_CASE("a main positive that is welded shows with main negative alone, whatever its contact says",
          "[unit][contactors][F82][I4]") {
  CoreBench bench(small_pack());
  bool is_welded = true;
  bench.link_voltage_mV = 0;
  bench.each_ms = [&] {
    if (is_welded && bench.contacts().main_negative) bench.link_voltage_mV = 29'600;
  };
  bench.run(6s);
  bench.inputs.vehicle_on = true;
  bench.run(3s);
  CHECK_FALSE(bench.has_event(EventId::precharge_done));
  CHECK_FALSE(bench.core().last_precharge().has_run);
  CHECK_FALSE(bench.commanded().any_contactor());
  const OpeningRecord& opening = bench.core().last_opening();
  CHECK(opening.from == Phase::main_negative);
  CHECK(opening.fault == FaultId::contactor_welded);
  CHECK(opening.reading.value >= 29'599);
  CHECK(opening.reading.element == Element{.contactor = 1});
  REQUIRE(bench.is_active(FaultId::contactor_welded));
  CHECK(bench.core().faults().state(FaultId::contactor_welded).confirmed.element == Element{.contactor = 1});
  bench.inputs.vehicle_on = false;
  bench.run(40s);
  CHECK(bench.is_active(FaultId::contactor_welded));  // until an authorised clear
  bench.give(Command::clear_faults);
  bench.run(1s);
  CHECK(bench.is_active(FaultId::contactor_welded));
  bench.observe(CommandGiven{.command = Command::clear_faults, .authority = Authority::service});
  bench.run(1s);
  CHECK_FALSE(bench.is_active(FaultId::contactor_welded));
  is_welded = false;
  CHECK(bench.close());
}

TEST_CASE("a rest of charge that shows only with main negative is none of a weld", "[unit][contactors][I4]") {
  const std::int32_t pack_mV = 29'600;
  struct Case {
    std::int32_t rest_permille;
    Duration open_for;
    bool closes;
  };
  // Shortly after an opening the core waits while the DC link is at pack voltage, and reports no weld.
  for (const Case& one : {Case{900, 15s, true}, Case{1000, 3s, false}}) {
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.inputs.vehicle_on = false;
    bool is_shown = false;
    bench.each_ms = [&] {
      const ContactorOutputs contacts = bench.contacts();
      const bool is_fed = contacts.precharge || contacts.main_positive;
      if (!contacts.main_negative) bench.link_voltage_mV = 0;
      if (contacts.main_negative && !is_fed) bench.link_voltage_mV = pack_mV * one.rest_permille / 1000;
      is_shown = is_shown || (contacts.main_negative && !is_fed);
    };
    bench.run(one.open_for);
    is_shown = false;
    bench.inputs.vehicle_on = true;
    CHECK(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 4s) == one.closes);
    CHECK(is_shown);
    CHECK_FALSE(bench.is_active(FaultId::contactor_welded));
    if (one.closes) continue;
    CHECK(bench.core().last_opening().cause == OpeningCause::permission);
    CHECK(bench.core().last_opening().blocker == Blocker::link_follows);
  }
}

TEST_CASE("while everything is open and the link is at the pack's voltage nothing closes", "[unit][contactors][I4]") {
  CoreBench bench(small_pack());
  const auto has_blocker = [&bench](Blocker blocker) {
    const auto& blockers = bench.core().permission().blockers;
    return std::find(blockers.begin(), blockers.end(), blocker) != blockers.end();
  };
  const std::int32_t pack_mV = 29'600;
  std::int32_t held_mV = pack_mV;
  bench.each_ms = [&] { bench.link_voltage_mV = held_mV; };
  bench.run(1500ms);
  bench.inputs.vehicle_on = true;
  bench.run(1s);
  CHECK(has_blocker(Blocker::link_follows));
  CHECK(bench.core().sequence().phase == Phase::open);
  SECTION("until it has left the pack") {
    held_mV = pack_mV * 95 / 100 - 1;
    bench.run(500ms);
    CHECK_FALSE(has_blocker(Blocker::link_follows));
    CHECK(bench.core().sequence().phase != Phase::open);
  }
  SECTION("and after the time it has it is a fault") {
    bench.run(4s);
    CHECK(bench.is_active(FaultId::link_not_discharging));
    CHECK(bench.core().last_refusal().has_happened);
    CHECK_FALSE(bench.has_event(EventId::phase_changed));
  }
  SECTION("and a link that nobody measures is no better") {
    bench.voltage_talks = false;
    bench.run(1s);
    CHECK(has_blocker(Blocker::sensors_incomplete));
    CHECK_FALSE(bench.has_event(EventId::phase_changed));
  }
}

TEST_CASE("a line told since the last decision is as the unit tells it", "[unit][core]") {
  CoreBench bench(small_pack());
  bench.inputs.vehicle_on = true;
  bench.run(1500ms);
  std::size_t looks = 0;
  bench.each_ms = [&] {
    ++looks;
    REQUIRE(bench.core().mode_inputs(bench.now()).vehicle_on);
  };
  bench.run(500ms);
  CHECK(looks == 500);
}

TEST_CASE("a line that nobody tells any more is off for those outside, too", "[unit][core]") {
  for (bool PduState::*line : {&PduState::vehicle_on, &PduState::charger_connected}) {
    CoreBench bench(small_pack());
    bench.inputs.*line = true;
    bench.run(1500ms);
    const auto is_told_on = [&bench, line] {
      const ModeInputs in = bench.core().mode_inputs(bench.now());
      return line == &PduState::vehicle_on ? in.vehicle_on : in.charger_connected;
    };
    CHECK(is_told_on());
    bench.pdu_talks = false;
    bench.run(300ms);
    CHECK_FALSE(is_told_on());
    bench.pdu_talks = true;
    bench.run(300ms);
    CHECK(is_told_on());
  }
}

TEST_CASE("a status between two decisions counts as received for the mode, as in the decision before and after it",
          "[unit][core][vehicle]") {
  struct Case {
    bool PduState::*line;
    PackMode mode;
    vehicle_bus::State reported;
  };
  for (const Case& one : {Case{&PduState::vehicle_on, PackMode::driving, vehicle_bus::State::on_closed},
                          Case{&PduState::charger_connected, PackMode::charging, vehicle_bus::State::charger_closed}}) {
    CoreBench bench(small_pack());
    bench.pdu_tells_changes = true;
    bench.run(1500ms);
    bench.inputs.*one.line = true;
    REQUIRE(bench.run_until([&] { return bench.core().mode(bench.now()) == one.mode; }, 3s));
    int younger = 0;
    bench.each_ms = [&] {
      bench.tell_pdu_status();  // in every millisecond, decisions or not
      younger += bench.core().sensors().pdu.taken_at > bench.core().decided_at() ? 1 : 0;
      CHECK(bench.core().mode(bench.now()) == one.mode);
      CHECK(iha_state(bench.core().mode(bench.now())) == static_cast<std::uint8_t>(one.reported));
    };
    bench.run(200ms);
    CHECK(younger >= 150);
    // The same status is ignored once it is stale at a decision.
    bench.each_ms = {};
    bench.pdu_talks = false;
    bench.run(300ms);
    CHECK_FALSE(bench.core().mode_inputs(bench.now()).vehicle_on);
    CHECK_FALSE(bench.core().mode_inputs(bench.now()).charger_connected);
  }
}

TEST_CASE("a wish ends with the line it came from", "[unit][core][I3][F64]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[0].cell_voltage_uV[0] = known(2'800'000);
  REQUIRE(bench.run_until([&] { return is_open(bench); }, 1s));
  bench.modules[0].cell_voltage_uV[0] = known(3'700'000);
  bench.run(15s);
  bench.give(Command::clear_faults);
  bench.run(500ms);
  bench.inputs.charger_connected = true;
  REQUIRE(bench.run_until([&] { return bench.core().sequence().phase == Phase::closed; }, 3s));
  bench.inputs.charger_connected = false;  // the key is on, but has not been cycled since the fault
  bench.run(200ms);
  CHECK(is_open(bench));
}

TEST_CASE("nothing is cleared within its hysteresis, or while its value is not known", "[unit][faults][I10]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[0].cell_voltage_uV[0] = known(2'800'000);
  bench.run(1s);
  bench.modules[0].cell_voltage_uV[0] = known(3'700'000);
  bench.run(12s);
  REQUIRE(bench.core().faults().state(FaultId::cell_undervoltage).stage == FaultStage::latched);
  SECTION("just behind the threshold") {
    bench.modules[0].cell_voltage_uV[0] = known(2'900'100);
  }
  SECTION("the module is silent") {
    bench.modules[0].talks = false;
  }
  bench.run(1s);
  bench.give(Command::clear_faults);
  bench.run(100ms);
  CHECK(bench.is_active(FaultId::cell_undervoltage));
  bench.modules[0].talks = true;
  bench.modules[0].cell_voltage_uV[0] = known(3'700'000);
  bench.run(2s);
  bench.give(Command::clear_faults);
  bench.run(100ms);
  CHECK_FALSE(bench.is_active(FaultId::cell_undervoltage));
}

TEST_CASE("a healthy pack stays closed whatever its load does between the samples", "[unit][core][BMU_14]") {
  CoreConfig config = pack_of(4);
  config.cell.series_resistance_Ohm = 0.0015;
  for (const int period_ms : {70, 100, 130, 200}) {
    CoreBench bench(config);
    bench.link_rise_mV_per_ms = 2'000;
    bench.each_ms = [&] {
      const bool is_loaded = bench.core().sequence().phase == Phase::closed &&
                             to_ms(bench.now().time_since_epoch()) % period_ms < period_ms / 2;
      bench.current_mA = is_loaded ? 60'000 : 0;
      const std::int64_t sag_uV = is_loaded ? 90'000 : 0;
      for (auto& module : bench.modules) module.cell_voltage_uV.fill(known(3'700'000 - sag_uV));
    };
    REQUIRE(bench.close());
    bench.run(30s);
    CAPTURE(period_ms);
    CHECK(bench.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("one result of the sensor that is none does not open, lasting ones do", "[unit][core][F2][F17]") {
  for (const MessageSpec* row : {&internal_bus::sensor_current, &internal_bus::sensor_u1, &internal_bus::sensor_u2}) {
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.run(507ms);
    const auto spoil = [&](std::uint8_t counter) {
      CanFrame frame = make_frame(*row);
      frame.data[1] = 0x20;  // measurement error
      seal(*row, counter, frame);
      bench.deliver(frame);
    };
    spoil(9);
    bench.run(500ms);
    CHECK(bench.core().sequence().phase == Phase::closed);
    bench.sensor_talks = false;
    const TimePoint broken_at = bench.now();
    std::uint8_t counter = 0;
    bench.each_ms = [&] {
      if (to_ms(bench.now().time_since_epoch()) % 20 == 0) spoil(counter++ & 0x0F);
    };
    REQUIRE(bench.run_until([&] { return is_open(bench); }, 400ms));
    CHECK(bench.now() - broken_at <= 300ms);
  }
}

TEST_CASE("one bad temperature does not open where temperatures come in every second answer only", "[unit][core][F2]") {
  CoreConfig config = small_pack();
  config.poll.temperature_every = 2;
  config.ages.temperature = 550ms;
  CoreBench bench(config);
  REQUIRE(bench.close());
  bench.run(1s);
  bool is_spoilt = false;
  bench.each_ms = [&] {
    bench.modules[0].cell_temperature_dC[1] = is_spoilt ? known(250) : not_known(Validity::open_circuit);
    const auto& seen = bench.core().modules().modules()[0].cell_temperature_dC[1];
    is_spoilt = is_spoilt || !seen.is_valid();
  };
  bench.run(3s);
  CHECK(is_spoilt);
  CHECK(bench.core().sequence().phase == Phase::closed);
}

TEST_CASE("a stall that leaves 130 ms between two decisions at most is ridden through", "[unit][core][F60]") {
  for (int offset_ms = 0; offset_ms < 100; offset_ms += 3) {
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.run(500ms + std::chrono::milliseconds(offset_ms));
    bench.stall(120ms);
    bench.run(500ms);
    CAPTURE(offset_ms, row_of(bench.core().last_opening().fault).name);
    CHECK(bench.core().sequence().phase == Phase::closed);
  }
}

TEST_CASE("with a healthy open pack every fault row that can latch knows that all is good",
          "[unit][faults][contract]") {
  CoreBench bench(small_pack());
  bench.run(10s);
  for (const FaultRow& row : fault_table()) {
    // These can only be confirmed with a second sensor, or with a monitor that measures.
    if (row.id == FaultId::current_sensors_disagree || row.id == FaultId::insulation_low) continue;
    if (row.latch == Latch::none) continue;
    CAPTURE(row.name);
    CHECK(bench.core().faults().state(row.id).judged == Verdict::good);
  }
}

TEST_CASE("what was seen while closed can be cleared, and the pack close again, once it is open and healthy",
          "[unit][core][I10]") {
  const auto closes_again = [](CoreBench& bench) {
    bench.contactors_stuck = bench.feedback_lies = bench.contacts_held_open = false;
    bench.inputs.estop_1_released = true;
    bench.inputs.vehicle_on = false;
    bench.run(20s);
    bench.give(Command::clear_faults);
    bench.run(1s);
    return bench.close();
  };
  SECTION("a link that did not follow") {
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.run(500ms);
    bench.feedback_lies = bench.contactors_stuck = true;
    bench.drop_contacts();
    bench.link_voltage_mV = 0;
    REQUIRE(bench.run_until([&] { return is_open(bench); }, 500ms));
    REQUIRE(bench.is_active(FaultId::link_not_following));
    CHECK(closes_again(bench));
  }
  SECTION("an emergency stop that cuts the contactors by itself") {
    for (int offset_ms = 0; offset_ms < 120; offset_ms += 7) {
      CoreBench bench(small_pack());
      bench.link_fall_mV_per_ms = 1'000;
      REQUIRE(bench.close());
      bench.run(500ms + std::chrono::milliseconds(offset_ms));
      bench.contacts_held_open = true;
      bench.run(15ms);
      bench.inputs.estop_1_released = false;
      bench.run(2s);
      CAPTURE(offset_ms);
      CHECK(closes_again(bench));
    }
  }
}

TEST_CASE("a link that is loaded while the main contact is on its way stops the closing", "[unit][contactors][I4]") {
  for (const Duration delay : {Duration{120ms}, Duration{200ms}, Duration{280ms}}) {
    CoreBench bench(small_pack());
    bench.pdu_tells_changes = true;
    bench.contact_delays[0] = delay;
    Watch watch;
    watch.on(bench);
    REQUIRE(reach(bench, Phase::main_positive));
    bench.each_ms = [&] {
      if (!bench.contacts().main_positive) bench.link_voltage_mV = std::max(0, bench.link_voltage_mV - 2'000);
    };
    bench.run(2s);
    CAPTURE(to_ms(delay));
    CHECK(watch.permille_min >= 950);
    CHECK(is_open(bench));
    CHECK(bench.is_active(FaultId::precharge_failed));
  }
}

TEST_CASE("a healthy pack stays closed though the sensor sends its two voltages one after the other",
          "[unit][core][BMU_14]") {
  CoreConfig config = pack_of(2);
  config.cell.series_resistance_Ohm = 0.002;
  for (const int period_ms : {60, 61, 62, 70, 100}) {
    CoreBench bench(config);
    bench.link_rise_mV_per_ms = 2'000;
    std::optional<CanFrame> late;
    TimePoint late_at{};
    bool is_own = false;
    bench.is_lost = [&](const CanFrame& frame) {  // U2 comes 20 ms after it was measured with U1
      if (frame.id != internal_bus::sensor_u2.base_id || is_own) return false;
      late_at = bench.now() + 20ms;
      late = frame;
      return true;
    };
    bench.each_ms = [&] {
      const std::int64_t ms = to_ms(bench.now().time_since_epoch());
      const bool is_loaded = bench.core().sequence().phase == Phase::closed && ms % period_ms < period_ms / 2;
      bench.current_mA = is_loaded ? 60'000 : 0;
      for (auto& module : bench.modules) module.cell_voltage_uV.fill(known(is_loaded ? 3'580'000 : 3'700'000));
      if (!late || bench.now() < late_at) return;
      encode_signal(internal_bus::sensor_u2.signals[0], known(bench.link_voltage_mV), late->data);
      is_own = true;
      bench.deliver(*std::exchange(late, std::nullopt));
      is_own = false;
    };
    REQUIRE(bench.close());
    bench.run(20s);
    CAPTURE(period_ms);
    CHECK(bench.core().sequence().phase == Phase::closed);
  }
}
