// The key of a pack file that is usually wrong, named by what else is seen: in likely_cause() by itself, and in the
// texts of a core that meets it.
#include "daemon/core/likely_cause.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/event.hpp"
#include "daemon/core/link_decay.hpp"
#include "daemon/shell/why_json.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

bool has(const std::string& text, std::string_view words) {
  return text.find(words) != std::string::npos;
}

/// A link of 50 V that falls with this time constant, sampled for so long by a sensor with this offset.
std::optional<Duration> measured(double time_constant_s, Duration span, Duration every = 100ms, int offset_mV = 0) {
  LinkDecay link;
  const TimePoint open_since{10s};
  for (TimePoint at = open_since; at <= open_since + 100ms + span; at += every) {
    const double since_s = std::chrono::duration<double>(at - open_since).count();
    const auto mV = static_cast<std::int32_t>(std::lround(50'000 * std::exp(-since_s / time_constant_s))) + offset_mV;
    link.update(open_since, {mV, at, Validity::valid}, 100ms);
  }
  return link.time_constant();
}

double seconds(Duration span) {
  return std::chrono::duration<double>(span).count();
}

std::string events_text(const CoreBench& bench, EventId id) {
  std::string text;
  for (const Event& event : bench.events()) {
    if (event.id == id) text += to_text(event) + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("the time constant of a link is measured as it falls, and not of one that stands",
          "[unit][contactors][F82]") {
  for (const double time_constant_s : {2.0, 40.0, 400.0}) {
    CAPTURE(time_constant_s);
    const auto found = measured(time_constant_s, 5s);
    REQUIRE(found);
    CHECK(std::abs(seconds(*found) - time_constant_s) < 0.01 * time_constant_s);
  }
  CHECK_FALSE(measured(1e9, 60s));      // a weld
  CHECK_FALSE(measured(400.0, 900ms));  // too early to say
  CHECK(measured(400.0, 1s));
  CHECK_FALSE(measured(505.0, 1s));  // 0.2 % or less may be the sensor
}

TEST_CASE("the time constant of a link stays what it was while it fell, whatever the sensor shows of an empty one",
          "[unit][contactors][F82]") {
  for (const double time_constant_s : {2.0, 10.0, 110.0, 700.0}) {
    for (const int offset_mV : {300, 0, -300}) {
      CAPTURE(time_constant_s, offset_mV);
      const auto span = std::chrono::milliseconds{static_cast<std::int64_t>(time_constant_s * 20e3)};
      const auto found = measured(time_constant_s, span, 50ms, offset_mV);
      REQUIRE(found);
      CHECK(std::abs(seconds(*found) - time_constant_s) < 0.1 * time_constant_s);
    }
  }
}

TEST_CASE("a link that stops on its way does not get slower for as long as it is watched", "[unit][contactors]") {
  LinkDecay link;
  const TimePoint open_since{10s};
  std::optional<Duration> before;
  for (TimePoint at = open_since + 100ms; at < open_since + 12h; at += 1s) {
    link.update(open_since, {at < open_since + 60s ? 50'000 : 40'000, at, Validity::valid}, 100ms);
    if (at > open_since + 601s && !before) before = link.time_constant();
  }
  REQUIRE(before);
  CHECK(link.time_constant() == before);
}

TEST_CASE("what a link was before its contactors had their time to open counts as little as after they closed again",
          "[unit][contactors]") {
  LinkDecay link;
  const auto at = [&link](Duration since_10s, std::int32_t mV, Validity validity = Validity::valid) {
    link.update(TimePoint{10s}, {mV, TimePoint{10s} + since_10s, validity}, 100ms);
  };
  at(99ms, 90'000);  // still joined, under a charger
  at(100ms, 50'000);
  at(2s, 0, Validity::unknown);
  at(3s + 100ms, 40'000);
  REQUIRE(link.time_constant());
  CHECK(std::abs(seconds(*link.time_constant()) - 3.0 / std::log(50.0 / 40.0)) < 0.01);
  at(4s, 0);
  REQUIRE(link.time_constant());  // empty: what was seen while it fell stands
  CHECK(std::abs(seconds(*link.time_constant()) - 3.0 / std::log(50.0 / 40.0)) < 0.01);
  link.update({}, {40'000, TimePoint{15s}, Validity::valid}, 100ms);
  CHECK_FALSE(link.time_constant());
}

TEST_CASE("the decay that would do is what a link takes to leave the pack's voltage, and half as much again",
          "[unit][contactors]") {
  ContactorConfig config;
  config.precharge_done_permille = 950;
  CHECK(link_decay_that_would_do(400s, config) == 31s);  // 400 s x ln(1 / 0.95) x 1.5 = 30.8 s
  CHECK(link_decay_that_would_do(10s, config) == 1s);
  config.precharge_done_permille = 900;
  CHECK(link_decay_that_would_do(400s, config) == 64s);  // 63.2 s
  config.precharge_done_permille = 1'000;                // as of 990
  CHECK(link_decay_that_would_do(400s, config) == 7s);   // 6.03 s
}

TEST_CASE("each key is named for the faults that it explains, by what speaks for it, and for no other",
          "[unit][faults]") {
  struct Case {
    SeenBeside seen;
    WrongKey key;
    std::vector<FaultId> faults;
  };
  const std::vector<FaultId> lost{FaultId::module_lost, FaultId::pdu_lost, FaultId::current_sensor_lost,
                                  FaultId::voltage_sensor_lost};
  const std::vector<Case> cases{
      {{}, WrongKey::none, {}},
      {{.is_without_charger = true},
       WrongKey::invert_current,
       {FaultId::charge_overcurrent, FaultId::charge_overload, FaultId::charge_not_allowed}},
      {{.are_results_out_of_range = true},
       WrongKey::little_endian,
       {FaultId::current_sensor_lost, FaultId::voltage_sensor_lost}},
      {{.are_buses_swapped = true}, WrongKey::buses, lost},
      {{.are_results_out_of_range = true, .are_buses_swapped = true}, WrongKey::buses, lost},
      {{.link_time_constant = 20s}, WrongKey::link_decay, {FaultId::link_not_discharging}},
      {{.is_without_charger = true, .do_cells_follow_steps = true}, WrongKey::none, {}},
      {{.do_cells_oppose_steps = true},
       WrongKey::invert_current_by_step,
       {FaultId::charge_overcurrent, FaultId::charge_overload, FaultId::charge_not_allowed,
        FaultId::discharge_overcurrent, FaultId::discharge_overload, FaultId::discharge_not_allowed}},
      {{.is_charger_mirrored = true},
       WrongKey::invert_current_by_charger,
       {FaultId::discharge_overcurrent, FaultId::discharge_overload, FaultId::discharge_not_allowed,
        FaultId::charger_contradicts}},
      {{.do_cells_follow_steps = true, .is_charger_mirrored = true}, WrongKey::none, {}},
      {{.are_sensors_mirrored = true}, WrongKey::second_is_reversed, {FaultId::current_sensors_disagree}},
      {{.do_cells_move_against_current = true},
       WrongKey::invert_current_by_cells,
       {FaultId::current_contradicts_voltage}},
      {{.link_followed_after = 100ms}, WrongKey::precharge_min, {FaultId::precharge_too_fast}},
      {{.slow_rise = SlowRise{.time_constant = 3s, .pack_mV = 700'000}},
       WrongKey::precharge_timeout,
       {FaultId::precharge_failed}},
      {{.slow_rise = SlowRise{.time_constant = 3s, .pack_mV = 700'000, .is_ended_by_heat = true}},
       WrongKey::precharge_energy,
       {FaultId::precharge_failed}},
  };
  for (const Case& one : cases) {
    for (const FaultRow& row : fault_table()) {
      INFO(row.name);
      const bool is_explained = std::find(one.faults.begin(), one.faults.end(), row.id) != one.faults.end();
      const LikelyCause cause = likely_cause(row.id, one.seen, {});
      CHECK(cause.key == (is_explained ? one.key : WrongKey::none));
      CHECK(to_text(cause).empty() == !is_explained);
    }
  }
}

TEST_CASE("a link that discharges slowly is told from a weld, with the key, its time constant and a value",
          "[unit][faults][F82]") {
  const ContactorConfig config{.link_decay = 5s};
  const auto text_of = [&config](Duration time_constant) {
    return to_text(likely_cause(FaultId::link_not_discharging, {.link_time_constant = time_constant}, config));
  };
  CHECK(text_of(400s) ==
        "the link falls, with a time constant of 400 s: contactors/link_decay_ms 31000 would do, found 5000");
  CHECK(text_of(779s) ==
        "the link falls, with a time constant of 779 s: contactors/link_decay_ms 60000 would do, found "
        "5000");
  CHECK(text_of(790s) ==
        "the link falls, with a time constant of 790 s: contactors/link_decay_ms would have to be 61000, and may be "
        "60000; it needs a discharge resistor");
}

TEST_CASE("a precharge that is too fast or too slow for its link names the keys, what was measured and values",
          "[unit][faults][F86]") {
  ContactorConfig config{
      .precharge_min = 150ms, .precharge_timeout = 2s, .precharge_resistance_Ohm = 100, .precharge_energy_J = 2'000};
  const auto fast = [&config](Duration after) {
    return to_text(likely_cause(FaultId::precharge_too_fast, {.link_followed_after = after}, config));
  };
  CHECK(fast(135ms) ==
        "the link was seen on its way and followed after 135 ms: where no contactor is welded, "
        "contactors/precharge_min_ms 90 would do, found 150");
  CHECK(fast(60ms) ==
        "the link was seen on its way and followed after 60 ms: where no contactor is welded, "
        "contactors/precharge_min_ms would have to be 40, and is at least 80; it needs a resistor of more ohms");
  const auto slow = [&config](Duration time_constant, bool is_ended_by_heat) {
    const SlowRise rise{time_constant, 100ms, 700'000, is_ended_by_heat};
    return to_text(likely_cause(FaultId::precharge_failed, {.slow_rise = rise}, config));
  };
  CHECK(slow(1s, false) ==
        "the link rises, with a time constant of 1.0 s: contactors/precharge_timeout_ms 4700 would do, found 2000");
  CHECK(
      slow(3s, false) ==
      "the link rises, with a time constant of 3.0 s: contactors/precharge_timeout_ms would have to be 13700, and may "
      "be 10000; it needs a resistor of fewer ohms");
  CHECK(slow(1s, true) ==
        "the link rises, with a time constant of 1.0 s, until the resistor has had what it bears: "
        "contactors/precharge_energy_J 2940 would do, found 2000, with a resistor that bears it; "
        "contactors/precharge_timeout_ms 4700 would do, found 2000");
  config.precharge_timeout = 5s;
  CHECK(slow(1s, true) ==
        "the link rises, with a time constant of 1.0 s, until the resistor has had what it bears: "
        "contactors/precharge_energy_J 2940 would do, found 2000, with a resistor that bears it");
}

TEST_CASE("a precharge that was given up shows the voltages of link and pack, where they are known", "[unit][events]") {
  Event event{.id = EventId::precharge_gave_up, .number = 2'000};
  CHECK(to_text(event) == "precharge given up after 2000 ms");
  event.reading = {true, 29'920};
  event.threshold = 40'000;
  CHECK(to_text(event) == "precharge given up after 2000 ms: link 29.920 V, pack 40.000 V");
}

TEST_CASE("too much charge without a charger names the direction of the current sensor", "[unit][core][faults][F16]") {
  for (const bool has_charger : {false, true}) {
    CAPTURE(has_charger);
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.inputs.charger_connected = has_charger;
    bench.run(100ms);
    bench.current_mA = -bench.core().config().limits.charge_overcurrent.open - 1'000;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::charge_overcurrent); }, 2s));
    bench.run(100ms);
    CHECK(has(events_text(bench, EventId::fault_confirmed), "sensor/invert_current") == !has_charger);
    CHECK(has(why_json({.core = bench.core(), .now = bench.now()}).dump(), "where no motor brakes either") ==
          !has_charger);
  }
}

TEST_CASE("that no charger was plugged in is known of the moment of the fault, not of a later one",
          "[unit][core][faults][F16]") {
  for (const bool has_charger : {false, true}) {
    CAPTURE(has_charger);
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.inputs.charger_connected = has_charger;
    bench.run(100ms);
    bench.current_mA = -bench.core().config().limits.charge_overcurrent.open - 1'000;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::charge_overcurrent); }, 2s));
    bench.current_mA = 0;
    bench.inputs.charger_connected = !has_charger;
    bench.run(1s);
    CHECK(has(why_json({.core = bench.core(), .now = bench.now()}).dump(), "where no motor brakes either") ==
          !has_charger);
  }
}

TEST_CASE("results out of range name the byte order, a silent sensor does not", "[unit][core][faults][BMS_NF.2]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  SECTION("10 A in the other byte order") {
    bench.sensor_talks = false;
    for (std::uint8_t sample = 0; sample < 50; ++sample) {
      CanFrame frame = make_frame(internal_bus::sensor_current);
      frame.data[2] = 0x10;
      frame.data[3] = 0x27;
      seal(internal_bus::sensor_current, sample, frame);
      bench.deliver(frame);
      bench.run(20ms);
    }
    REQUIRE(bench.is_active(FaultId::current_sensor_lost));
    CHECK(has(events_text(bench, EventId::fault_confirmed), "sensor/little_endian"));
  }
  SECTION("nothing") {
    bench.sensor_talks = false;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::current_sensor_lost); }, 2s));
    CHECK_FALSE(has(events_text(bench, EventId::fault_confirmed), "sensor/little_endian"));
  }
}

TEST_CASE("modules and a unit that are heard on the vehicle bus name the swapped buses", "[unit][core][faults][F38]") {
  const CanFrame pdu_status = [] {
    CanFrame frame = make_frame(internal_bus::pdu_status);
    seal(internal_bus::pdu_status, 1, frame);
    return frame;
  }();
  CanFrame ident = make_frame(internal_bus::ident, 2);
  seal(internal_bus::ident, 0, ident);
  CanFrame ident_on_request = make_frame(internal_bus::ident, 2);
  seal(internal_bus::ident, 1, ident_on_request);
  CanFrame ident_of_another = make_frame(internal_bus::ident, 3);
  seal(internal_bus::ident, 0, ident_of_another);
  struct Case {
    const char* what;
    CanFrame frame;
    Port port;
    bool is_named;
  };
  CanFrame damaged = pdu_status;
  damaged.data[7] ^= 1U;
  CanFrame remote = pdu_status;
  remote.is_remote = true;
  CanFrame sensor = make_frame(internal_bus::sensor_u1);
  for (const Case& one :
       {Case{"a unit", pdu_status, Port::vehicle, true}, Case{"damaged", damaged, Port::vehicle, false},
        Case{"remote", remote, Port::vehicle, false}, Case{"a sensor", sensor, Port::vehicle, false},
        Case{"a module", ident, Port::vehicle, true}, Case{"asked for", ident_on_request, Port::vehicle, false},
        Case{"a module of no pack", ident_of_another, Port::vehicle, false},
        Case{"the charger's bus", pdu_status, Port::charger, false}}) {
    INFO(one.what);
    CoreBench bench(small_pack());
    REQUIRE(bench.close());
    bench.pdu_talks = false;
    for (auto& module : bench.modules) module.talks = false;
    for (int count = 0; count < 20; ++count) {
      bench.observe(FrameReceived{one.port, one.frame});
      bench.run(50ms);
    }
    REQUIRE(bench.is_active(FaultId::pdu_lost));
    REQUIRE(bench.is_active(FaultId::module_lost));
    const std::string why = why_json({.core = bench.core(), .now = bench.now()}).dump();
    CHECK(has(why, "buses/internal and buses/vehicle are swapped") == one.is_named);
    CHECK(has(events_text(bench, EventId::fault_confirmed), "are swapped") == one.is_named);
    bench.run(BusWatch::misplaced_memory);
    CHECK_FALSE(has(why_json({.core = bench.core(), .now = bench.now()}).dump(), "are swapped"));
  }
}

TEST_CASE("without a unit the sensor's results on the vehicle bus name the swapped buses, beside a silent internal bus",
          "[unit][core][faults][F38]") {
  CoreConfig config = small_pack();
  config.contactors.has_pdu = false;
  CanFrame result = make_frame(internal_bus::sensor_u1);
  seal(internal_bus::sensor_u1, 0, result);
  CanFrame of_another_channel = result;
  of_another_channel.data[0] = internal_bus::sensor_u2.channel;
  struct Case {
    const char* what;
    CanFrame frame;
    bool do_modules_talk;
    bool is_named;
  };
  for (const Case& one :
       {Case{"results", result, false, true}, Case{"another channel", of_another_channel, false, false},
        Case{"beside modules: a sensor of the vehicle", result, true, false}}) {
    INFO(one.what);
    CoreBench bench(config);
    bench.sensor_talks = bench.voltage_talks = bench.pdu_talks = false;
    for (auto& module : bench.modules) module.talks = one.do_modules_talk;
    for (int count = 0; count < 140; ++count) {  // 7 s: what modules send is remembered for 5 s
      bench.observe(FrameReceived{Port::vehicle, one.frame});
      bench.run(50ms);
    }
    REQUIRE(bench.is_active(FaultId::voltage_sensor_lost));
    CHECK(has(why_json({.core = bench.core(), .now = bench.now()}).dump(), "are swapped") == one.is_named);
  }
}

TEST_CASE("frames that show swapped buses are taken for no measurement", "[unit][core][F38]") {
  using namespace internal_bus;
  for (const bool has_pdu : {true, false}) {
    CoreConfig config = small_pack();
    config.contactors.has_pdu = has_pdu;
    CoreBench bench(config);
    bench.sensor_talks = bench.voltage_talks = bench.pdu_talks = false;
    for (auto& one : bench.modules) one.talks = false;
    bench.run(1s);  // what was on its way has arrived
    const std::uint64_t accepted = bench.core().receive_counts().accepted;
    const TimePoint last_answer_at = bench.core().modules().find(1)->last_answer_at;
    for (std::uint8_t count = 0; count < 40; ++count) {
      for (const MessageSpec* const row : {&pdu_status, &sensor_current, &sensor_u1, &sensor_u2, &ident}) {
        CanFrame frame = make_frame(*row, row->has_node() ? 1 : 0);
        if (row == &pdu_status) frame.data[1] = 0x7F;  // every input as one would like it, the key on
        seal(*row, count, frame);
        bench.observe(FrameReceived{Port::vehicle, frame});
      }
      bench.run(50ms);
    }
    CHECK(bench.core().receive_counts().accepted == accepted);
    CHECK(bench.core().receive_counts().rejected_total() == 0);
    const SensorTable& sensors = bench.core().sensors();
    CHECK_FALSE(sensors.pdu_word.is_valid());
    for (const auto* const value : {&sensors.current_mA, &sensors.pack_voltage_mV, &sensors.link_voltage_mV}) {
      CHECK_FALSE(value->is_valid());
    }
    CHECK(bench.core().modules().find(1)->last_answer_at == last_answer_at);
    CHECK_FALSE(bench.core().permission().may_close);
  }
}

TEST_CASE("a request to close that is refused names the values that it was refused for", "[unit][core][F90]") {
  CHECK(refusal_text(Blocker::link_follows, {}, {true, 29'920}, 30'000) ==
        "the link is still at the pack's voltage: not yet shown that nothing is welded: link 29.920 V, pack 30.000 V");
  CHECK(refusal_text(Blocker::not_qualified, {}, {true, 1}, 2) == "too few complete poll cycles yet");
  CHECK(
      refusal_text(Blocker::fault, FaultId::cell_undervoltage,
                   {true, 2'851'000, {.module_node = 1, .number = 3, .pack_number = 3}}, 2'900'000) ==
      "a fault is present: a cell's voltage is too low; when it was confirmed: cell 1.3 (no. 3) 2.8510 V, limit 2.9000 "
      "V");
  CHECK(refusal_text(Blocker::fault, FaultId::module_lost, {true, 1, {.module_node = 3}}, 1) ==
        "a fault is present: a module does not answer, or not completely: module 3");
  CHECK(refusal_text(Blocker::fault, FaultId::emergency_stop, {true, 1}, 1) ==
        "a fault is present: an emergency stop is pressed");
  CHECK(refusal_text(Blocker::fault, FaultId::cell_undervoltage, {}, 0) == "a fault is present");  // not known any more

  CHECK(
      refusal_text(Blocker::fault, FaultId::link_not_discharging, {true, 29'920}, 30'000) ==
      "a fault is present: the contactors are open, but the link keeps the pack's voltage; when it was confirmed: link "
      "29.920 V, pack 30.000 V");
  CHECK(
      refusal_text(Blocker::fault, FaultId::contactor_welded, {true, 29'920, {.contactor = 1}}, 30'000) ==
      "a fault is present: a contactor is closed that should be open, as its contact says or the link's voltage; when "
      "it was confirmed: main positive: link 29.920 V, pack 30.000 V");

  CoreConfig config = small_pack();
  config.contactors.link_decay = 30s;  // a request is refused before the link is a fault
  CoreBench bench(config);
  bench.run(1s);
  SECTION("a link that stays at the pack's voltage") {
    bench.link_voltage_mV = 29'600;
    bench.link_fall_mV_per_ms = 0;
    bench.run(1s);
    bench.inputs.vehicle_on = true;
    REQUIRE(bench.run_until([&] { return bench.core().last_refusal().has_happened; }, 10s));
    CHECK(bench.core().last_refusal().blocker == Blocker::link_follows);
    CHECK(has(events_text(bench, EventId::close_refused), ": link 29.600 V, pack 29.600 V"));
  }
  SECTION("a cell that is too low") {
    bench.modules[0].cell_voltage_uV[2] = known(2'000'000);
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::cell_undervoltage); }, 2s));
    bench.inputs.vehicle_on = true;
    REQUIRE(bench.run_until([&] { return bench.core().last_refusal().has_happened; }, 2s));
    CHECK(has(events_text(bench, EventId::close_refused), "cell 1.3 (no. 3) 2.0000 V, limit 2.9000 V"));
    CHECK(has(why_json({.core = bench.core(), .now = bench.now()}).dump(),
              " ago: a fault is present: a cell's voltage is too low; when it was confirmed: cell 1.3"));
  }
}

TEST_CASE("a request that a fault of link and pack refuses names the voltages that it was confirmed by",
          "[unit][core][F90]") {
  CoreConfig config = small_pack();
  config.contactors.link_decay = 5s;
  CoreBench bench(config);
  bench.run(1s);
  bench.link_voltage_mV = 29'600;
  bench.link_fall_mV_per_ms = 0;
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::link_not_discharging); }, 10s));
  bench.link_voltage_mV = 100;  // meanwhile it has discharged
  bench.run(1s);
  bench.inputs.vehicle_on = true;
  REQUIRE(bench.run_until([&] { return bench.core().last_refusal().has_happened; }, 10s));
  const std::string voltages =
      "but the link keeps the pack's voltage; when it was confirmed: link 29.600 V, pack 29.600 V";
  CHECK(has(events_text(bench, EventId::close_refused), voltages));
  CHECK(has(why_json({.core = bench.core(), .now = bench.now()}).dump(), voltages));
  // Over a restart, too.
  CoreBench again(config, bench.core().persistent());
  again.run(1s);
  again.inputs.vehicle_on = true;
  REQUIRE(again.run_until([&] { return again.core().last_refusal().has_happened; }, 10s));
  CHECK(has(events_text(again, EventId::close_refused), voltages));
}

TEST_CASE("the decay that would do is known over a restart", "[unit][core][F82]") {
  CoreConfig config = small_pack();
  config.contactors.link_decay = 2s;
  CoreBench bench(config);
  bench.link_voltage_mV = 29'600;
  bench.link_fall_mV_per_ms = 0;
  bench.each_ms = [&bench] {
    if (bench.now().time_since_epoch() % 100ms == 0ms) bench.link_voltage_mV -= bench.link_voltage_mV / 1'000;
  };
  REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::link_not_discharging); }, 10s));
  const std::string text = to_text(bench.core().likely_cause(FaultId::link_not_discharging, bench.now()));
  INFO(text);
  REQUIRE(has(events_text(bench, EventId::fault_confirmed), text));
  REQUIRE(has(text, "contactors/link_decay_ms"));
  bench.run(60s);
  CHECK(has(why_json({.core = bench.core(), .now = bench.now()}).dump(), text));
  CoreBench again(config, bench.core().persistent());
  again.run(5s);  // its link is empty
  CHECK(has(why_json({.core = again.core(), .now = again.now()}).dump(), text));
}
