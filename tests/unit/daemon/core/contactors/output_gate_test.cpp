// Frames that the output gate passes, and the contactor command bit by bit.
#include "daemon/core/contactors/output_gate.hpp"

#include <array>
#include <set>

#include "devices/device_list.hpp"
#include "protocol/message.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr std::array all_outputs = {&ContactorOutputs::main_positive, &ContactorOutputs::main_negative,
                                    &ContactorOutputs::precharge,     &ContactorOutputs::charge,
                                    &ContactorOutputs::auxiliary,     &ContactorOutputs::fan,
                                    &ContactorOutputs::heater};

}  // namespace

TEST_CASE("each output has its own bit in the command, and comes back out of it", "[unit][gate]") {
  std::set<std::uint8_t> bits;
  for (const auto output : all_outputs) {
    ContactorOutputs outputs;
    outputs.*output = true;
    const CanFrame frame = contactor_command_frame(outputs, 77);
    CHECK(outputs_of(frame) == outputs);
    bits.insert(frame.data[0]);
    CHECK(frame.id == 0x040);
    CHECK(frame.length == 8);
    CHECK((frame.data[0] ^ frame.data[1]) == 0xFF);
    CHECK(frame.data[6] == 77);
  }
  CHECK(bits == std::set<std::uint8_t>{0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40});
  CHECK(contactor_command_frame({}, 0).data[0] == 0);
  CHECK(outputs_of(contactor_command_frame({}, 0)) == ContactorOutputs{});
}

TEST_CASE("no contactor leaves without the permission to stay closed, other outputs need none", "[unit][gate]") {
  for (const auto output : all_outputs) {
    ContactorOutputs outputs;
    outputs.*output = true;
    const CanFrame frame = contactor_command_frame(outputs, 1);
    CHECK(judge_output(Port::internal, frame, {.may_stay_closed = true, .decided = outputs}) == GateVerdict::pass);
    const GateVerdict forbidden = outputs.any_contactor() ? GateVerdict::not_permitted : GateVerdict::pass;
    CHECK(judge_output(Port::internal, frame, {.may_stay_closed = false, .decided = outputs}) == forbidden);
    CHECK(judge_output(Port::internal, frame, {.may_stay_closed = true}) == GateVerdict::not_permitted);
    CHECK(judge_output(Port::internal, contactor_command_frame({}, 1), {.may_stay_closed = true, .decided = outputs}) ==
          GateVerdict::not_permitted);
  }
  CHECK(judge_output(Port::internal, contactor_command_frame({.main_negative = true}, 1), {}) ==
        GateVerdict::not_permitted);
}

TEST_CASE("rules that nobody filled in let no contactor close", "[unit][gate]") {
  const GateRules rules;
  CHECK_FALSE(rules.may_stay_closed);
  CHECK(rules.decided == ContactorOutputs{});
  CHECK_FALSE(rules.decided.any_contactor());
  CHECK(judge_output(Port::vehicle, make_frame(vehicle_bus::pack_name), rules) == GateVerdict::pass);
  CHECK(judge_output(Port::vehicle, make_frame(vehicle_bus::pack_resistance), rules) == GateVerdict::pass);
}

TEST_CASE("rules that nobody filled in let no current flow", "[unit][gate]") {
  const GateRules rules;
  CHECK_FALSE(rules.may_charge);
  CHECK_FALSE(rules.may_request_mains);
  CHECK_FALSE(rules.is_soc_known);
  CHECK(rules.charge_current_mA == 0);
  CHECK(rules.charge_voltage_mV == 0);
  CHECK(rules.inverter_charge_mA == 0);
  CHECK(rules.inverter_discharge_mA == 0);
  CHECK(rules.inverter_charge_voltage_mV == 0);
  CHECK(rules.inverter_discharge_voltage_mV == 0);
  CHECK(rules.module_round == 0);
}

TEST_CASE("each way in which a frame can have the wrong form is found", "[unit][gate]") {
  CanFrame good = make_frame(internal_bus::poll);
  seal(internal_bus::poll, 1, good);
  REQUIRE(judge_output(Port::internal, good, {}) == GateVerdict::pass);
  const auto malformed = [&good](void (*spoil)(CanFrame & frame)) {
    CanFrame frame = good;
    spoil(frame);
    return judge_output(Port::internal, frame, {}) == GateVerdict::malformed;
  };
  CHECK(malformed([](CanFrame& frame) { frame.is_extended = true; }));
  CHECK(malformed([](CanFrame& frame) { frame.is_remote = true; }));
  CHECK(malformed([](CanFrame& frame) { frame.is_error = true; }));
  CHECK(malformed([](CanFrame& frame) { frame.length = 7; }));
  CHECK(malformed([](CanFrame& frame) { frame.data[7] ^= 1; }));
  CHECK(malformed([](CanFrame& frame) { frame.data[6] ^= 1; }));
}

TEST_CASE("a complement is asked for exactly where the message has one", "[unit][gate]") {
  CanFrame poll = make_frame(internal_bus::poll);
  poll.data[0] = 0x0F;
  poll.data[1] = 0x0F;
  seal(internal_bus::poll, 1, poll);
  CHECK(judge_output(Port::internal, poll, {}) == GateVerdict::pass);
  CanFrame command = contactor_command_frame({}, 1);
  for (const auto complement : std::to_array<std::uint8_t>({0x00, 0xFE, 0x7F})) {
    command.data[1] = complement;
    command.data[7] = frame_crc(command);
    CHECK(judge_output(Port::internal, command, {}) == GateVerdict::malformed);
  }
}

TEST_CASE("the vehicle's messages need no checksum, and leave at the configured identifiers only", "[unit][gate]") {
  CanFrame frame = make_frame(vehicle_bus::pack_current);
  frame.data[7] = 0x5A;
  CHECK(judge_output(Port::vehicle, frame, {}) == GateVerdict::pass);
  CHECK(judge_output(Port::internal, frame, {}) == GateVerdict::not_ours);
  const std::uint32_t offset = frame.id - 0x620;
  frame.id = 0x100 + offset;
  CHECK(judge_output(Port::vehicle, frame, {.vehicle_base_id = 0x100}) == GateVerdict::pass);
  CHECK(judge_output(Port::vehicle, frame, {}) == GateVerdict::not_ours);
  for (const std::uint32_t outside : {0x0FFU, 0x109U}) {  // the nine messages are 100h to 108h
    frame.id = outside;
    CHECK(judge_output(Port::vehicle, frame, {.vehicle_base_id = 0x100}) == GateVerdict::not_ours);
  }
}

TEST_CASE("the gate's verdicts have names of their own, and no other number has one", "[unit][gate]") {
  std::set<std::string_view> names;
  for (const GateVerdict verdict :
       {GateVerdict::pass, GateVerdict::not_ours, GateVerdict::malformed, GateVerdict::not_permitted}) {
    names.insert(to_text(verdict));
  }
  CHECK(names == std::set<std::string_view>{"pass", "not a frame of this node", "malformed", "not permitted"});
  CHECK(to_text(static_cast<GateVerdict>(99)) == "?");
}

TEST_CASE("an answer to a request for data passes where it belongs, in its form, and only if any is given",
          "[unit][gate][requests]") {
  const GateRules rules{.reply_id = std::uint16_t{0x74D}};
  const CanFrame answer = data_frame(0x74D, 8);
  CHECK(judge_output(Port::vehicle, answer, rules) == GateVerdict::pass);
  CHECK(judge_output(Port::vehicle, answer, {}) == GateVerdict::not_ours);
  CHECK(judge_output(Port::internal, answer, rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::second_pack, answer, rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::second_pack, data_frame(0x620, 8), rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::vehicle, data_frame(0x74E, 8), rules) == GateVerdict::not_ours);
  CanFrame bad = answer;
  bad.length = 7;
  CHECK(judge_output(Port::vehicle, bad, rules) == GateVerdict::malformed);
  bad = answer;
  bad.is_remote = true;
  CHECK(judge_output(Port::vehicle, bad, rules) == GateVerdict::malformed);
  bad = answer;
  bad.is_error = true;
  CHECK(judge_output(Port::vehicle, bad, rules) == GateVerdict::malformed);
  bad = answer;
  bad.is_extended = true;
  CHECK(judge_output(Port::vehicle, bad, rules) == GateVerdict::not_ours);
}

TEST_CASE(
    "a question to foreign modules leaves in its language's own form, and bleeds no cell but by this tick's decision",
    "[unit][gate][foreign_modules]") {
  const ModuleDriver& modules = *find_device("i3_csc")->modules;
  constexpr std::uint32_t round = 7;
  const GateRules rules{.modules = &modules, .module_round = round, .bleed_above_uV = 4'000'000};
  const auto question = [&modules](std::uint32_t in_round, std::optional<std::int32_t> bleed_above_uV) {
    return modules.ask({.node = 3, .wants_voltages = true, .bleed_above_uV = bleed_above_uV}, in_round, {});
  };
  CHECK(judge_output(Port::internal, question(round, {}), rules) == GateVerdict::pass);
  CHECK(judge_output(Port::internal, question(round, 4'000'000), rules) == GateVerdict::pass);
  CHECK(judge_output(Port::internal, question(round, 3'999'000), rules) == GateVerdict::not_permitted);
  const GateRules bleeding_nothing{.modules = &modules, .module_round = round};
  CHECK(judge_output(Port::internal, question(round, 4'000'000), bleeding_nothing) == GateVerdict::not_permitted);
  CHECK(judge_output(Port::internal, question(round, {}), bleeding_nothing) == GateVerdict::pass);
  CHECK(judge_output(Port::internal, question(round + 1, {}), rules) == GateVerdict::malformed);
  CHECK(judge_output(Port::vehicle, question(round, {}), rules) == GateVerdict::not_ours);
}
