// Small stages of the core, each alone, with values dense around their limits.
#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/estimation/soc/coulomb_counter.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/modules/poll_schedule.hpp"
#include "daemon/core/records/event.hpp"
#include "daemon/core/vehicle/report_vehicle.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

SequenceInputs precharging(TimePoint now, std::int32_t link_mV, std::int32_t current_mA) {
  return {.now = now,
          .close_wanted = true,
          .close_permitted = true,
          .may_advance = true,
          .contacts_settled = true,
          .is_current_known = true,
          .current_mA = current_mA,
          .current_at = now,
          .is_measured = true,
          .cells_mV = 100'000,
          .pack_mV = 100'000,
          .pack_at = now,
          .link_mV = link_mV,
          .link_at = now};
}

}  // namespace

TEST_CASE("precharge ends exactly within 5 % of the pack and not a millivolt before", "[unit][contactors]") {
  const ContactorConfig config;
  const SequenceState state{Phase::precharge, start};
  const TimePoint now = start + 500ms;
  CHECK(step(state, precharging(now, 94'999, 0), config).state.phase == Phase::precharge);
  CHECK(step(state, precharging(now, 95'000, 0), config).state.phase == Phase::main_positive);
  CHECK(step(state, precharging(now, 105'000, 0), config).state.phase == Phase::main_positive);
  CHECK(step(state, precharging(now, 105'001, 0), config).state.phase == Phase::precharge);
}

TEST_CASE("precharge ends only when the current has fallen, whichever way it flows", "[unit][contactors]") {
  const ContactorConfig config;
  const SequenceState state{Phase::precharge, start};
  const TimePoint now = start + 500ms;
  for (const std::int32_t sign : {1, -1}) {
    CHECK(step(state, precharging(now, 99'000, sign * 500), config).state.phase == Phase::main_positive);
    CHECK(step(state, precharging(now, 99'000, sign * 501), config).state.phase == Phase::precharge);
  }
  CHECK(step(state, precharging(now, 99'000, INT32_MIN), config).state.phase == Phase::precharge);
}

TEST_CASE("precharge is judged on what was measured during it, not before", "[unit][contactors][F86]") {
  const ContactorConfig config;
  const SequenceState state{Phase::precharge, start};
  SequenceInputs in = precharging(start + 500ms, 99'000, 0);
  in.link_at = in.pack_at = start + config.settle - 1ns;
  CHECK(step(state, in, config).state.phase == Phase::precharge);
  in.link_at = in.pack_at = start + config.settle;
  CHECK(step(state, in, config).state.phase == Phase::main_positive);
}

TEST_CASE("a pack of no volts is never precharged", "[unit][contactors]") {
  SequenceInputs in = precharging(start + 500ms, 0, 0);
  in.pack_mV = in.cells_mV = 0;
  CHECK(step({Phase::precharge, start}, in, {}).state.phase == Phase::precharge);
}

TEST_CASE("precharge gives up at its time-out, even if the link arrives in that tick", "[unit][contactors][F86]") {
  const ContactorConfig config;
  const SequenceState state{Phase::precharge, start};
  const SequenceStep before = step(state, precharging(start + 2s - 1ns, 0, 0), config);
  CHECK(before.state.phase == Phase::precharge);
  CHECK(before.precharge_failure == PrechargeFailure::none);
  const SequenceStep at = step(state, precharging(start + 2s, 99'000, 0), config);
  CHECK(at.state.phase == Phase::open);
  CHECK(at.precharge_failure == PrechargeFailure::too_slow);
  CHECK_FALSE(at.outputs.any_contactor());
}

TEST_CASE("every phase waits its settling time and not longer", "[unit][contactors]") {
  const ContactorConfig config;
  for (const auto& [from, to] :
       {std::pair{Phase::main_negative, Phase::precharge}, std::pair{Phase::precharge, Phase::main_positive},
        std::pair{Phase::main_positive, Phase::closed}}) {
    const std::int32_t link_mV = from == Phase::main_negative ? 0 : 99'000;
    CHECK(step({from, start}, precharging(start + config.settle - 1ns, link_mV, 0), config).state.phase == from);
    CHECK(step({from, start}, precharging(start + config.settle, link_mV, 0), config).state.phase == to);
  }
}

TEST_CASE("the gate lets out what is ours and nothing else", "[unit][gate]") {
  const ContactorOutputs closed{.main_positive = true, .main_negative = true};
  const GateRules allowed{.may_stay_closed = true, .decided = closed};
  const GateRules forbidden{.may_stay_closed = false, .decided = closed};
  CHECK(judge_output(Port::internal, contactor_command_frame(closed, 1), allowed) == GateVerdict::pass);
  CHECK(judge_output(Port::internal, contactor_command_frame(closed, 1), forbidden) == GateVerdict::not_permitted);
  CHECK(judge_output(Port::internal, contactor_command_frame({.main_negative = true}, 1), allowed) ==
        GateVerdict::not_permitted);
  CHECK(judge_output(Port::internal, contactor_command_frame({}, 1), {}) == GateVerdict::pass);
  CHECK(judge_output(Port::vehicle, contactor_command_frame({}, 1), {}) == GateVerdict::not_ours);

  CanFrame of_a_module = make_frame(internal_bus::status, 3);
  seal(internal_bus::status, 1, of_a_module);
  CHECK(judge_output(Port::internal, of_a_module, allowed) == GateVerdict::not_ours);

  CanFrame damaged = contactor_command_frame({}, 1);
  damaged.data[7] ^= 0x10;
  CHECK(judge_output(Port::internal, damaged, {}) == GateVerdict::malformed);
  CanFrame wrong_complement = contactor_command_frame({}, 1);
  wrong_complement.data[1] = 0;
  wrong_complement.data[7] = frame_crc(wrong_complement);
  CHECK(judge_output(Port::internal, wrong_complement, {}) == GateVerdict::malformed);
  CanFrame extended = contactor_command_frame({}, 1);
  extended.is_extended = true;
  CHECK(judge_output(Port::internal, extended, {}) == GateVerdict::malformed);

  CanFrame moved = make_frame(vehicle_bus::pack_current);
  CHECK(judge_output(Port::vehicle, moved, {}) == GateVerdict::pass);
  CHECK(judge_output(Port::vehicle, moved, {.vehicle_base_id = 0x6A0}) == GateVerdict::not_ours);
  moved.id = 0x6A4;
  CHECK(judge_output(Port::vehicle, moved, {.vehicle_base_id = 0x6A0}) == GateVerdict::pass);
}

TEST_CASE("polls keep their period, carry a rising counter and ask for identities until they are known",
          "[unit][polling][FS_1]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms, .temperature_every = 2}, start);
  std::vector<Poll> polls;
  std::vector<TimePoint> at;
  for (TimePoint now = start; now < start + 2s; now += 7ms) {
    const Poll poll = schedule.step(now, 100ms, now > start + 500ms);
    if (!poll.is_due) continue;
    polls.push_back(poll);
    at.push_back(now);
  }
  REQUIRE(polls.size() == 20);
  for (std::size_t index = 0; index < polls.size(); ++index) {
    CHECK(at[index] - (start + index * 100ms) < 7ms);  // late by a tick at most, without drift
    CHECK(polls[index].frame.data[6] == index);
    CHECK(polls[index].wants.temperatures == (index % 2 == 0));
    CHECK(polls[index].frame.data[7] == frame_crc(polls[index].frame));
  }
  CHECK(polls[3].wants.identity);
  CHECK_FALSE(polls[8].wants.identity);
}

TEST_CASE("after a gap polls go on without a burst", "[unit][polling]") {
  PollSchedule schedule;
  schedule.init({.period = 100ms}, start);
  CHECK(schedule.step(start, 100ms, true).is_due);
  CHECK(schedule.step(start + 5s, 100ms, true).is_due);
  CHECK_FALSE(schedule.step(start + 5s + 99ms, 100ms, true).is_due);
  CHECK(schedule.step(start + 5s + 100ms, 100ms, true).is_due);
}

TEST_CASE("charge is counted exactly, and a hole in the current is not bridged", "[unit][estimators][FS_4]") {
  CoulombCounter counter;
  counter.init(test::small_pack());
  const Measured<std::int32_t> pack_mV{100'000, start + 2s, Validity::valid};
  for (int sample = 0; sample <= 1000; ++sample) {  // 12.345 A for exactly 10 s
    const TimePoint at = start + 2s + sample * 10ms;
    counter.observe({12'345, at, Validity::valid}, {100'000, at, Validity::valid});
  }
  CHECK(counter.state().flowed_uAs == 123'450'000);
  CHECK(counter.state().energy_out_mWh == 3429);  // 12.345 A * 100 V * 10 s = 3.429 Wh
  counter.observe({12'345, start + 20s, Validity::valid}, pack_mV);
  CHECK(counter.state().flowed_uAs == 123'450'000);
  CHECK(counter.state().uncounted == 8s);
  CHECK(counter.state().counted == 10s);
  CHECK(counter.state().counted_until == start + 20s);
}

TEST_CASE("the largest and smallest numbers a sensor frame can carry are not measurements and are not counted",
          "[unit][estimators]") {
  const CoreConfig config = test::small_pack();
  for (const std::int64_t raw : {std::int64_t{INT32_MAX}, std::int64_t{INT32_MIN}, std::int64_t{5'000'001}}) {
    SensorTable sensors;
    CoulombCounter counter;
    counter.init(config);
    for (std::uint8_t sample = 0; sample < 10; ++sample) {
      const TimePoint at = start + sample * 20ms;
      for (const MessageSpec* row : {&internal_bus::sensor_current, &internal_bus::sensor_u1}) {
        CanFrame frame = make_frame(*row);
        insert_bits(frame.data, 16, 32, static_cast<std::uint64_t>(raw), ByteOrder::big);
        seal(*row, sample, frame);
        sensors.observe(*row, frame, at, config);
      }
      counter.observe(sensors.current_mA, sensors.pack_voltage_mV);
    }
    CHECK_FALSE(sensors.current_mA.is_valid());
    CHECK_FALSE(sensors.pack_voltage_mV.is_valid());
    CHECK(sensors.refused.of(ResultRefusal::out_of_range) == 20);
    CHECK(sensors.refused.count() == 20);
    CHECK(counter.state().energy_out_mWh == 0);
    CHECK(counter.state().energy_in_mWh == 0);
  }
}

TEST_CASE("current limits reach zero at the opening threshold, from every side", "[unit][limits][BMU_13]") {
  const CoreConfig config = test::small_pack();
  PackState pack;
  pack.cell_voltage_uV = {.min = 3'700'000, .max = 3'700'000, .count = 8, .expected = 8};
  pack.cell_temperature_dC = {.min = 250, .max = 250, .count = 4, .expected = 4};
  const auto limits = [&] {
    return evaluate_limits(pack, config, {.is_connected = true, .may_discharge = true, .may_charge = true});
  };
  CHECK(limits().discharge.limit_mA == 80'000);
  CHECK(limits().charge.limit_mA == 20'000);
  pack.cell_voltage_uV.max = 4'175'000;
  CHECK(limits().charge.limit_mA == 10'000);
  CHECK(limits().charge.cause == LimitCause::cell_voltage_high);
  CHECK(limits().discharge.limit_mA == 80'000);
  pack.cell_voltage_uV.max = 4'200'000;
  CHECK(limits().charge.limit_mA == 0);
  pack.cell_temperature_dC.max = 575;
  CHECK(limits().discharge.limit_mA == 20'000);
  CHECK(limits().discharge.cause == LimitCause::cell_hot);
  pack.cell_temperature_dC.max = 250;
  pack.cell_temperature_dC.min = -200;
  CHECK(limits().discharge.limit_mA == 0);
  CHECK(limits().discharge.cause == LimitCause::cell_cold);
  pack.cell_temperature_dC.min = 250;
  pack.cell_voltage_uV.max = 3'700'000;
  const CurrentLimits low{.discharge = {.limit_mA = 1'000}, .charge = {.limit_mA = 2'000}};
  CHECK(evaluate_limits(pack, config, {.is_connected = true, .may_discharge = true, .may_charge = true, .before = low})
            .discharge.limit_mA == 80'000);
  pack.cell_voltage_uV.count = 7;  // the missing cell may be the limiting one
  CHECK(evaluate_limits(pack, config, {.is_connected = true, .may_discharge = true, .may_charge = true, .before = low})
            .discharge.limit_mA == 1'000);
  CHECK(evaluate_limits(pack, config, {.is_connected = true, .may_discharge = true, .may_charge = true, .before = low})
            .charge.limit_mA == 2'000);
  CHECK(evaluate_limits(pack, config, {}).charge.cause == LimitCause::not_connected);
  CHECK(evaluate_limits(pack, config, {.is_connected = true, .may_discharge = true}).charge.limit_mA == 0);
}

TEST_CASE("a cell number that does not fit a byte is unknown, not another cell's", "[unit][reports]") {
  PackState pack;
  pack.cell_voltage_uV = {.min = 3'000'000,
                          .max = 4'000'000,
                          .min_at = {30, 3, 254},
                          .max_at = {30, 4, 255},
                          .count = 300,
                          .expected = 300};
  const CurrentLimits limits;
  const VehicleView view{.pack = &pack, .limits = &limits, .capacity_uAs = uAs_per_Ah};
  const CanFrame frame = vehicle_frame(3, view, {});
  CHECK(read<vehicle_bus::pack_voltage, "cell_voltage_min_cell">(frame) == known(254));
  CHECK(read<vehicle_bus::pack_voltage, "cell_voltage_max_cell">(frame) == not_known());
}

TEST_CASE("values are shown in the unit people think in", "[unit][text]") {
  CHECK(value_text(Unit::uV, 2'871'049) == "2.8710 V");
  CHECK(value_text(Unit::mA, -15'007) == "-15.007 A");
  CHECK(value_text(Unit::dC, -3) == "-0.3 C");
  CHECK(value_text(Unit::Ohm, 1'200'000) == "1200 kOhm");
  CHECK(value_text(Unit::none, 7) == "7");
  CHECK(to_text(Element{2, 7, 19}) == "cell 2.7 (no. 19)");
  CHECK(to_text(Element{3, 1, 9, true}) == "temperature sensor 3.1 (no. 9)");
  CHECK(to_text(Element{3, 4, 0, true}) == "temperature sensor 3.4");
  CHECK(to_text(Element{3, 6, 0, true}) == "board sensor 3.1");
  CHECK(to_text(Element{3, 9, 0, true}) == "board sensor 3.4");
  CHECK(to_text(Element{3, 8, 20}) == "cell 3.8 (no. 20)");
  CHECK(to_text(Element{3, 0, 0}) == "module 3");
  CHECK(to_text(Element{}).empty());
}
