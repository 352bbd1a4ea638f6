// Values of sensor, PDU and GPIO inputs, received and merged: a "not OK" of either applies, a close request of either
// counts, a contact that either reports closed is closed.
#include "daemon/core/measurement/sensor_table.hpp"

#include <array>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using namespace bmu::internal_bus;

namespace {

constexpr TimePoint start{100s};

CanFrame result_of(const MessageSpec& row, std::int64_t value) {
  CanFrame frame = make_frame(row);
  encode_signal(row.signals[0], known(value), frame.data);
  return frame;
}

CanFrame word(InsulationState state, SignalValue resistance_Ohm) {
  CanFrame frame = make_frame(pdu_status);
  write<pdu_status, "insulation_monitor_state">(frame, static_cast<std::int64_t>(state));
  write<pdu_status, "insulation_resistance_Ohm">(frame, resistance_Ohm);
  return frame;
}

/// Pack with GPIO lines for everything, with a PDU or without.
CoreConfig with_lines(bool has_unit) {
  CoreConfig config = test::small_pack();
  config.contactors.has_pdu = has_unit;
  config.lines = {.are_used = true,
                  .feedback = 0xF,
                  .has_vehicle_on = true,
                  .has_charger_connected = true,
                  .has_resume_button = true,
                  .has_insulation_ok = true,
                  .has_supply_ok = true};
  return config;
}

Measured<PduState> unit(const PduState& state, TimePoint at = start) {
  return {state, at, Validity::valid};
}
Measured<LineImage> lines(const LineImage& image, TimePoint at = start) {
  return {image, at, Validity::valid};
}

struct Contact {
  bool PduState::*state;
  ContactorId id;
};
constexpr std::array contacts{Contact{&PduState::main_positive_closed, ContactorId::main_positive},
                              Contact{&PduState::main_negative_closed, ContactorId::main_negative},
                              Contact{&PduState::precharge_closed, ContactorId::precharge},
                              Contact{&PduState::charge_closed, ContactorId::charge}};

LineImage closed_at(ContactorId id) {
  LineImage image;
  image.closed_contacts = static_cast<std::uint8_t>(1U << static_cast<unsigned>(id));
  return image;
}

}  // namespace

TEST_CASE("every signal of the unit's word goes where it belongs", "[unit][sensor_table]") {
  struct Bit {
    void (*write_it)(CanFrame&);
    bool PduState::*state;
  };
  const std::array bits{
      Bit{[](CanFrame& f) { write<pdu_status, "main_positive_closed">(f, 1); }, &PduState::main_positive_closed},
      Bit{[](CanFrame& f) { write<pdu_status, "main_negative_closed">(f, 1); }, &PduState::main_negative_closed},
      Bit{[](CanFrame& f) { write<pdu_status, "precharge_closed">(f, 1); }, &PduState::precharge_closed},
      Bit{[](CanFrame& f) { write<pdu_status, "charge_closed">(f, 1); }, &PduState::charge_closed},
      Bit{[](CanFrame& f) { write<pdu_status, "opened_by_timeout">(f, 1); }, &PduState::opened_by_timeout},
      Bit{[](CanFrame& f) { write<pdu_status, "alarm_loop_open">(f, 1); }, &PduState::alarm_loop_open},
      Bit{[](CanFrame& f) { write<pdu_status, "vehicle_on">(f, 1); }, &PduState::vehicle_on},
      Bit{[](CanFrame& f) { write<pdu_status, "charger_connected">(f, 1); }, &PduState::charger_connected},
      Bit{[](CanFrame& f) { write<pdu_status, "estop_1_released">(f, 1); }, &PduState::estop_1_released},
      Bit{[](CanFrame& f) { write<pdu_status, "estop_2_released">(f, 1); }, &PduState::estop_2_released},
      Bit{[](CanFrame& f) { write<pdu_status, "interlock_closed">(f, 1); }, &PduState::interlock_closed},
      Bit{[](CanFrame& f) { write<pdu_status, "insulation_monitor_ok">(f, 1); }, &PduState::insulation_monitor_ok},
      Bit{[](CanFrame& f) { write<pdu_status, "resume_button">(f, 1); }, &PduState::resume_button}};
  for (const Bit& one : bits) {
    CanFrame frame = word(InsulationState::normal, known(100'000));
    one.write_it(frame);
    SensorTable table;
    table.observe(pdu_status, frame, start, test::small_pack());
    REQUIRE(table.pdu.is_valid());
    CHECK(table.pdu.taken_at == start);
    for (const Bit& other : bits) CHECK(table.pdu.value.*other.state == (other.state == one.state));
    CHECK(table.pdu.value.insulation_state == InsulationState::normal);
    CHECK(table.pdu.value.insulation_resistance_Ohm == known(100'000));
  }
}

TEST_CASE("a state of the monitor that the protocol does not know is undefined", "[unit][sensor_table][F96]") {
  for (std::int64_t raw = 0; raw <= 7; ++raw) {
    CanFrame frame = make_frame(pdu_status);
    write<pdu_status, "insulation_monitor_state">(frame, raw);
    SensorTable table;
    table.observe(pdu_status, frame, start, test::small_pack());
    const std::int64_t wanted = raw <= 5 ? raw : static_cast<std::int64_t>(InsulationState::undefined);
    CHECK(static_cast<std::int64_t>(table.pdu.value.insulation_state) == wanted);
  }
  constexpr std::array names{"no signal",    "normal",      "undervoltage", "speed start",
                             "device error", "earth fault", "undefined"};
  for (std::size_t state = 0; state < names.size(); ++state) {
    CHECK(to_text(static_cast<InsulationState>(state)) == names.at(state));
  }
  CHECK(to_text(static_cast<InsulationState>(99)) == "?");
}

TEST_CASE("when the monitor last told a resistance is kept, and that it ever did", "[unit][sensor_table][F96]") {
  SensorTable table;
  const CoreConfig config = test::small_pack();
  table.observe(pdu_status, word(InsulationState::speed_start, known(100'000)), start, config);
  CHECK(table.insulation_known_at == TimePoint{});
  CHECK_FALSE(table.insulation_told);
  table.observe(pdu_status, word(InsulationState::normal, not_known()), start + 1s, config);
  CHECK_FALSE(table.insulation_told);
  table.observe(pdu_status, word(InsulationState::undervoltage, known(100'000)), start + 2s, config);
  CHECK(table.insulation_known_at == start + 2s);
  CHECK(table.insulation_told);
  table.observe(pdu_status, word(InsulationState::normal, not_known(Validity::above_range)), start + 3s, config);
  CHECK(table.insulation_known_at == start + 3s);
  table.observe(pdu_status, word(InsulationState::no_signal, known(100'000)), start + 4s, config);
  CHECK(table.insulation_known_at == start + 3s);
  CHECK(table.insulation_told);
}

TEST_CASE("each result of the sensor has its place, and its sign if it sits the other way round",
          "[unit][sensor_table][BMU_3]") {
  for (const bool is_inverted : {false, true}) {
    CoreConfig config = test::small_pack();
    config.sensor.invert_current = is_inverted;
    const std::int32_t sign = is_inverted ? -1 : 1;
    SensorTable table;
    table.observe(sensor_current, result_of(sensor_current, 12'000), start, config);
    table.observe(sensor_current_2, result_of(sensor_current_2, 13'000), start + 1ms, config);
    table.observe(sensor_u1, result_of(sensor_u1, 29'000), start + 2ms, config);
    table.observe(sensor_u2, result_of(sensor_u2, 28'000), start + 3ms, config);
    CHECK(table.current_mA.value == sign * 12'000);
    CHECK(table.current_mA.taken_at == start);
    CHECK(table.current_2_mA.value == sign * 13'000);
    CHECK(table.pack_voltage_mV.value == 29'000);
    CHECK(table.link_voltage_mV.value == 28'000);
    CHECK(table.link_voltage_mV.taken_at == start + 3ms);
    CHECK(table.current_window.range(start, start).max_mA == sign * 12'000);
    CHECK(table.refused.count() == 0);
  }
}

TEST_CASE("the pack voltage before the latest is kept, and a result that is none moves neither",
          "[unit][sensor_table][BMU_4]") {
  const CoreConfig config = test::small_pack();
  SensorTable table;
  table.observe(sensor_u1, result_of(sensor_u1, 29'000), start, config);
  CHECK_FALSE(table.pack_voltage_before_mV.is_valid());
  table.observe(sensor_u1, result_of(sensor_u1, 29'500), start + 60ms, config);
  CanFrame bad = result_of(sensor_u1, 99'000);
  write<sensor_current, "measurement_error">(bad, 1);
  table.observe(sensor_u1, bad, start + 120ms, config);
  table.observe(sensor_u2, result_of(sensor_u2, 28'000), start + 120ms, config);
  CHECK(table.pack_voltage_mV.value == 29'500);
  CHECK(table.pack_voltage_before_mV.is_valid());
  CHECK(table.pack_voltage_before_mV.value == 29'000);
  CHECK(table.pack_voltage_before_mV.taken_at == start);
}

TEST_CASE("a result that is none leaves what was before, and is counted", "[unit][sensor_table][F17]") {
  const CoreConfig config = test::small_pack();
  for (const auto& [row, slot] :
       {std::pair{&sensor_current, &SensorTable::current_mA}, std::pair{&sensor_current_2, &SensorTable::current_2_mA},
        std::pair{&sensor_u1, &SensorTable::pack_voltage_mV}, std::pair{&sensor_u2, &SensorTable::link_voltage_mV}}) {
    for (const int error_bit : {0x10, 0x20, 0x40, 0x80}) {
      SensorTable table;
      table.observe(*row, result_of(*row, 12'000), start, config);
      CanFrame bad = result_of(*row, 99'000);
      bad.data[1] = static_cast<std::uint8_t>(bad.data[1] | error_bit);
      table.observe(*row, bad, start + 20ms, config);
      CHECK((table.*slot).value == 12'000);
      CHECK((table.*slot).taken_at == start);
      CHECK(table.refused.count() == 1);
      CHECK(table.refused.of(ResultRefusal::sensor_fault) == 1);
      CHECK(table.refused.last == ResultRefusal::sensor_fault);
      CHECK(table.refused.last_at == start + 20ms);
    }
  }
}

TEST_CASE("without lines the unit's word is all there is", "[unit][sensor_table]") {
  const CoreConfig config = test::small_pack();
  const Measured<PduState> merged = merge_inputs(unit({.vehicle_on = true}), {}, config);
  CHECK(merged.is_valid());
  CHECK(merged.value.vehicle_on);
  CHECK_FALSE(merge_inputs({}, {}, config).is_valid());
}

TEST_CASE("with lines both have to speak, unless there is no unit", "[unit][sensor_table]") {
  const LineImage image;
  const Measured<LineImage> failed{image, start, Validity::sensor_fault};
  CHECK_FALSE(merge_inputs(unit({}), {}, with_lines(true)).is_valid());
  CHECK_FALSE(merge_inputs(unit({}), failed, with_lines(true)).is_valid());
  CHECK_FALSE(merge_inputs({}, lines(image), with_lines(true)).is_valid());
  CHECK(merge_inputs(unit({}), lines(image), with_lines(true)).is_valid());
  CHECK(merge_inputs({}, lines(image), with_lines(false)).is_valid());
  CHECK_FALSE(merge_inputs({}, failed, with_lines(false)).is_valid());
}

TEST_CASE("what both have told is as old as the older word", "[unit][sensor_table]") {
  const LineImage image;
  CHECK(merge_inputs(unit({}, start + 5ms), lines(image, start), with_lines(true)).taken_at == start);
  CHECK(merge_inputs(unit({}, start), lines(image, start + 5ms), with_lines(true)).taken_at == start);
  CHECK(merge_inputs(unit({}, start), lines(image, start + 5ms), with_lines(false)).taken_at == start + 5ms);
}

TEST_CASE("a contact is closed if either says so, and only its own line counts", "[unit][sensor_table]") {
  for (const Contact& one : contacts) {
    const LineImage closed = closed_at(one.id);
    for (const Contact& other : contacts) {
      const bool is_it = other.state == one.state;
      CHECK(merge_inputs(unit({}), lines(closed), with_lines(true)).value.*other.state == is_it);
      CHECK(merge_inputs({}, lines(closed), with_lines(false)).value.*other.state == is_it);
    }
    PduState says_closed;
    says_closed.*one.state = true;
    CHECK(merge_inputs(unit(says_closed), lines({}), with_lines(true)).value.*one.state);
    CHECK_FALSE(merge_inputs(unit(says_closed), lines({}), with_lines(false)).value.*one.state);
    CoreConfig without = with_lines(true);
    without.lines.feedback = static_cast<std::uint8_t>(0xFU & ~unsigned{closed.closed_contacts});
    CHECK_FALSE(merge_inputs(unit({}), lines(closed), without).value.*one.state);
    CHECK(merge_inputs(unit(says_closed), lines({}), without).value.*one.state);
  }
}

TEST_CASE("a wish of either counts", "[unit][sensor_table]") {
  struct Wished {
    bool PduState::*state;
    bool LineImage::*line;
    bool LinesConfig::*has;
  };
  for (const Wished& one :
       {Wished{&PduState::vehicle_on, &LineImage::vehicle_on, &LinesConfig::has_vehicle_on},
        Wished{&PduState::charger_connected, &LineImage::charger_connected, &LinesConfig::has_charger_connected},
        Wished{&PduState::resume_button, &LineImage::resume_button, &LinesConfig::has_resume_button}}) {
    for (const bool by_unit : {false, true}) {
      for (const bool by_line : {false, true}) {
        PduState state;
        state.*one.state = by_unit;
        LineImage image;
        image.*one.line = by_line;
        CHECK(merge_inputs(unit(state), lines(image), with_lines(true)).value.*one.state == (by_unit || by_line));
        CHECK(merge_inputs(unit(state), lines(image), with_lines(false)).value.*one.state == by_line);
        CoreConfig without = with_lines(true);
        without.lines.*one.has = false;
        CHECK(merge_inputs(unit(state), lines(image), without).value.*one.state == by_unit);
      }
    }
  }
}

TEST_CASE("a no of either holds", "[unit][sensor_table]") {
  struct Permitted {
    bool PduState::*state;
    bool LineImage::*line;
    bool LinesConfig::*has;
  };
  for (const Permitted& one :
       {Permitted{&PduState::insulation_monitor_ok, &LineImage::insulation_ok, &LinesConfig::has_insulation_ok},
        Permitted{&PduState::supply_ok, &LineImage::supply_ok, &LinesConfig::has_supply_ok}}) {
    for (const bool by_unit : {false, true}) {
      for (const bool by_line : {false, true}) {
        PduState state;
        state.*one.state = by_unit;
        LineImage image;
        image.*one.line = by_line;
        CHECK(merge_inputs(unit(state), lines(image), with_lines(true)).value.*one.state == (by_unit && by_line));
        CHECK(merge_inputs(unit(state), lines(image), with_lines(false)).value.*one.state == by_line);
        CoreConfig without = with_lines(true);
        without.lines.*one.has = false;
        CHECK(merge_inputs(unit(state), lines(image), without).value.*one.state == by_unit);
      }
    }
  }
}

TEST_CASE("the unit's stops and those of the lines are kept apart, without a unit only the lines' exist",
          "[unit][sensor_table][F93]") {
  LineImage image;
  image.estops_pressed = 0b10;
  image.interlocks_open = 0b100;
  const PduState pressed;  // nothing released, nothing closed
  const PduState both = merge_inputs(unit(pressed), lines(image), with_lines(true)).value;
  CHECK(both.estops_pressed == 0b10);
  CHECK(both.interlocks_open == 0b100);
  CHECK_FALSE(both.estop_1_released);
  CHECK_FALSE(both.estop_2_released);
  CHECK_FALSE(both.interlock_closed);
  const PduState alone = merge_inputs({}, lines(image), with_lines(false)).value;
  CHECK(alone.estops_pressed == 0b10);
  CHECK(alone.estop_1_released);
  CHECK(alone.estop_2_released);
  CHECK(alone.interlock_closed);
  CoreConfig no_monitor = with_lines(false);
  no_monitor.lines.has_insulation_ok = false;
  CHECK(merge_inputs({}, lines(image), no_monitor).value.insulation_monitor_ok);
}

TEST_CASE("whoever speaks, the two are made one anew", "[unit][sensor_table]") {
  const CoreConfig config = with_lines(true);
  SensorTable table;
  LineImage image;
  image.vehicle_on = true;
  table.observe(image, start, config);
  CHECK_FALSE(table.pdu.is_valid());
  table.observe(pdu_status, word(InsulationState::normal, known(100'000)), start + 5ms, config);
  CHECK(table.pdu.is_valid());
  CHECK(table.pdu.value.vehicle_on);
  CHECK(table.pdu.taken_at == start);
  image.vehicle_on = false;
  table.observe(image, start + 10ms, config);
  CHECK_FALSE(table.pdu.value.vehicle_on);
  CHECK(table.pdu.taken_at == start + 5ms);
  image.is_failed = true;
  table.observe(image, start + 20ms, config);
  CHECK_FALSE(table.pdu.is_valid());
  CHECK(table.lines.validity == Validity::sensor_fault);
}

TEST_CASE("a pack is healthy while no input says no", "[unit][sensor_table][F93]") {
  const PduState healthy{
      .estop_1_released = true, .estop_2_released = true, .interlock_closed = true, .insulation_monitor_ok = true};
  CHECK(healthy.is_healthy());
  const PduState silent;
  CHECK_FALSE(silent.insulation_monitor_ok);
  CHECK_FALSE(silent.resume_button);
  const auto is_healthy_with = [&healthy](auto change) {
    PduState state = healthy;
    change(state);
    return state.is_healthy();
  };
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.estop_1_released = false; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.estop_2_released = false; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.estops_pressed = 1; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.interlock_closed = false; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.interlocks_open = 1; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.insulation_monitor_ok = false; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.opened_by_timeout = true; }));
  CHECK_FALSE(is_healthy_with([](PduState& s) { s.alarm_loop_open = true; }));
  for (const Contact& one : contacts) {
    PduState closed;
    CHECK_FALSE(closed.any_contactor_closed());
    closed.*one.state = true;
    CHECK(closed.any_contactor_closed());
  }
}

TEST_CASE("a message of somebody else changes nothing", "[unit][sensor_table]") {
  SensorTable table;
  table.observe(poll, make_frame(poll), start, test::small_pack());
  CHECK_FALSE(table.current_mA.is_valid());
  CHECK_FALSE(table.pdu.is_valid());
  CHECK(table.refused.count() == 0);
}

TEST_CASE("results that are none are counted by why, and what was counted outlives a bus that was away",
          "[unit][sensor_table][F17]") {
  const CoreConfig config = test::small_pack();
  SensorTable table;
  CanFrame marked = result_of(sensor_current, 12'000);
  marked.data[1] = static_cast<std::uint8_t>(marked.data[1] | 0x80U);
  CanFrame absurd = result_of(sensor_current, 0);
  absurd.data[2] = 0x7F;  // some two million ampere
  for (int time = 0; time < 3; ++time) table.observe(sensor_current, marked, start, config);
  for (int time = 0; time < 2; ++time) table.observe(sensor_current, absurd, start + 1s, config);
  table.observe_current(not_known(), true, start + 2s, config);
  table.refused.note_frame(RejectReason::wrong_length);
  table.refused_pulses.observe({.frequency_mHz = 25'000, .duty_permille = 500}, start);
  const auto check = [&table] {
    CHECK(table.refused.of(ResultRefusal::sensor_fault) == 3);
    CHECK(table.refused.of(ResultRefusal::out_of_range) == 2);
    CHECK(table.refused.of(ResultRefusal::not_known) == 1);
    CHECK(table.refused.of(ResultRefusal::wrong_frame) == 0);
    CHECK(table.refused.count() == 6);
    CHECK(table.refused.last == ResultRefusal::not_known);
    CHECK(table.refused.last_at == start + 2s);
    CHECK(table.refused.frames[static_cast<std::size_t>(RejectReason::wrong_length)] == 1);
    CHECK(table.refused_pulses.of(ir155::Misfit::frequency) == 1);
  };
  check();
  table.forget_values(start + 5s);
  CHECK(table.insulation_known_at == start + 5s);
  CHECK_FALSE(table.pack_voltage_mV.is_valid());
  check();
}
