// Lines of a recording: exact round trip of every observation.
#include "daemon/recording/record_line.hpp"

#include <array>
#include <string>
#include <vector>

#include "protocol/image.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

const RecordBuses two_buses{.internal = "can0", .vehicle = "can1"};
constexpr RecordClock wall{.ahead_us = 1'700'000'000'000'000};

std::string line_of(const Observation& observation, const RecordBuses& buses = two_buses) {
  std::array<char, record_line_max> room{};
  const std::size_t size = print_observation(observation, wall, buses, room);
  REQUIRE(room[size - 1] == '\n');
  return {room.data(), size - 1};
}

RecordLine parsed(std::string_view line) {
  auto result = parse_record_line(line, wall, two_buses);
  INFO(line);
  REQUIRE(result);
  return *result;
}

std::vector<std::uint8_t> image_of(const Observation& observation) {
  std::vector<std::uint8_t> bytes(image_size(observation));
  static_cast<void>(write_image(observation, bytes));
  return bytes;
}

CanFrame frame_of(std::uint32_t id, std::uint8_t length) {
  CanFrame frame{.id = id, .length = length};
  for (std::size_t index = 0; index < length; ++index)
    frame.data[index] = static_cast<std::uint8_t>(0x11 * (index + 1));
  return frame;
}

/// Each kind of observation, with a value in each of its members.
std::vector<ObservedThing> all_kinds() {
  CanFrame extended = frame_of(0x18ff50e5, 2);
  extended.is_extended = true;
  return {FrameReceived{.port = Port::internal, .frame = frame_of(0x143, 8)},
          FrameReceived{.port = Port::vehicle, .frame = extended},
          FrameReceived{.port = Port::internal, .frame = {.id = 0x143, .is_remote = true, .length = 4}},
          FrameEchoed{.port = Port::vehicle, .frame = frame_of(0x620, 0)},
          SendFailed{.port = Port::internal, .frame = frame_of(0x040, 3)},
          PortChanged{.port = Port::vehicle, .is_up = true},
          PortChanged{.port = Port::internal, .is_up = false},
          FramesLost{.port = Port::vehicle, .count = 1'234'567'890'123},
          BusErrorSeen{.port = Port::vehicle, .classes = 0x44, .controller = 0x10},
          CommandGiven{.command = Command::clear_faults},
          CommandGiven{.command = Command::assign_node,
                       .authority = Authority::service,
                       .user_id = 1000,
                       .node = 7,
                       .serial_number = 4'000'000'000,
                       .is_unheard_allowed = true},
          CommandGiven{.command = Command::accept_modules, .authority = Authority::service, .node = 63},
          CommandGiven{.command = Command::wake},
          CommandGiven{.command = Command::balancing_off},
          CommandGiven{.command = Command::balancing_on},
          CommandGiven{.command = Command::shut_down},
          WallClockSeen{.unix_time_ms = 1'700'000'000'123},
          WallClockSeen{.unix_time_ms = -5},
          HealthSeen{},
          HealthSeen{.health = {.store_unreadable = true,
                                .store_write_failed = true,
                                .history_write_failed = true,
                                .memory_low = true,
                                .disk_low = true}},
          IntakeAirSeen{.temperature_dC = -53},
          LinesSeen{},
          LinesSeen{.image = {.is_failed = true}},
          LinesSeen{.image = {.closed_contacts = 0xa5,
                              .vehicle_on = true,
                              .charger_connected = true,
                              .resume_button = true,
                              .insulation_ok = true,
                              .supply_ok = true,
                              .estops_pressed = 0x8001,
                              .interlocks_open = 0x4002}},
          PulsesSeen{},
          PulsesSeen{.pwm = {.frequency_mHz = 10'000, .duty_permille = 503, .is_high = true, .since_edge = 4'120us}},
          PulsesSeen{.pwm = {.frequency_mHz = INT32_MAX, .duty_permille = -1, .since_edge = 3'600s}},
          ClaimBegins{},
          ClaimBegins{.length = 273'481us},
          ClaimBegins{.length = 1'500ms, .is_kept = true}};
}

}  // namespace

TEST_CASE("whatever a core is told comes back from its line as it was", "[unit][recording][FS_6]") {
  for (const ObservedThing& what : all_kinds()) {
    const Observation observation{.at = TimePoint{12'345'678'901us}, .what = what};
    const std::string line = line_of(observation);
    INFO(line);
    const RecordLine back = parsed(line);
    REQUIRE(std::holds_alternative<Observation>(back));
    CHECK(image_of(std::get<Observation>(back)) == image_of(observation));
  }
}

TEST_CASE("frames stand in a recording as in any candump log", "[unit][recording][FS_6]") {
  const TimePoint at{12'345'678'901us};
  CHECK(line_of({at, FrameReceived{.port = Port::internal, .frame = frame_of(0x143, 2)}}) ==
        "(1700012345.678901) can0 143#1122 R");
  CHECK(line_of({at, FrameEchoed{.port = Port::vehicle, .frame = frame_of(0x620, 1)}}) ==
        "(1700012345.678901) can1 620#11 T");
  CHECK(line_of({at, BusErrorSeen{.port = Port::internal, .classes = 4, .controller = 0x10}}) ==
        "(1700012345.678901) can0 20000004#0010000000000000");
  CHECK(line_of({at, LinesSeen{.image = {.closed_contacts = 3, .vehicle_on = true}}}) ==
        "# (1700012345.678901) lines vehicle_on contacts 3");
  CHECK(
      line_of({at,
               PulsesSeen{
                   .pwm = {.frequency_mHz = 10'000, .duty_permille = 503, .is_high = true, .since_edge = 4'120us}}}) ==
      "# (1700012345.678901) pulses 10000 mHz 503 permille 4120 us high");
  CHECK(line_of({at, ClaimBegins{.length = 273'481us}}) == "# (1700012345.678901) claim 273481 us");
  CHECK(line_of({at, ClaimBegins{.length = 1ms, .is_kept = true}}) == "# (1700012345.678901) claim 1000 us kept");
  CHECK(line_of({at, IntakeAirSeen{.temperature_dC = -53}}) == "# (1700012345.678901) air -53 dC");
}

TEST_CASE("a time before a whole second has all its digits", "[unit][recording]") {
  CHECK(line_of({TimePoint{1us}, WallClockSeen{.unix_time_ms = 1}}) == "# (1700000000.000001) clock 1");
}

TEST_CASE("one interface for both buses is the internal one's", "[unit][recording]") {
  const RecordBuses shared{.internal = "vcan0", .vehicle = "vcan0"};
  const Observation told{TimePoint{1s}, FrameReceived{.port = Port::internal, .frame = frame_of(0x143, 1)}};
  const auto back = parse_record_line(line_of(told, shared), wall, shared);
  REQUIRE(back);
  CHECK(image_of(std::get<Observation>(*back)) == image_of(told));
}

TEST_CASE("decisions stand behind their tick, with what was sent, driven and told", "[unit][recording][FS_6]") {
  Decisions decisions;
  decisions.frames.push_back({.port = Port::internal, .frame = frame_of(0x040, 2)});
  decisions.outputs = {.main_positive = true, .main_negative = true};
  decisions.events.push_back({.id = EventId::port_up, .at = TimePoint{2s}, .port = Port::vehicle});
  decisions.wake_at = TimePoint{3s};
  std::string text;
  append_decisions(text, TimePoint{2s}, decisions, {}, 0x1234, wall, two_buses);
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  REQUIRE(lines.size() == 4);
  const RecordLine tick = parsed(lines[0]);
  CHECK(std::get<RecordTick>(tick).at == TimePoint{2s});
  CHECK(std::get<RecordTick>(tick).fingerprint == fingerprint_of(decisions));
  CHECK(std::get<RecordTick>(tick).lines_sum == 0x1234);
  CHECK(lines[1] == "# > can0 040#1122");
  const RecordLine sent = parsed(lines[1]);
  CHECK(std::get<RecordSent>(sent).sent.frame == frame_of(0x040, 2));
  CHECK(std::get<RecordSent>(sent).sent.port == Port::internal);
  CHECK(lines[2] == "# = main_negative main_positive");
  CHECK(std::get<RecordOutputs>(parsed(lines[2])).outputs == decisions.outputs);
  CHECK(std::get<RecordEvent>(parsed(lines[3])).text == to_text(decisions.events[0]));

  text.clear();
  append_decisions(text, TimePoint{2s}, decisions, decisions.outputs, 0, wall, two_buses);
  CHECK(text.find("# =") == std::string::npos);
}

TEST_CASE("every part of a decision has a part in its fingerprint", "[unit][recording]") {
  const Decisions one;
  std::vector<Decisions> others(6);
  others[0].frames.push_back({});
  others[1].outputs.fan = true;
  others[2].events.push_back({});
  others[3].wake_at = TimePoint{1ns};
  others[4].is_shut_down = true;
  others[5].frames.push_back({.port = Port::vehicle});
  for (std::size_t index = 0; index < others.size(); ++index) {
    CHECK(fingerprint_of(others[index]) != fingerprint_of(one));
    for (std::size_t before = 0; before < index; ++before) {
      CHECK(fingerprint_of(others[index]) != fingerprint_of(others[before]));
    }
  }
  CHECK(fingerprint_of(one) == 0xc8210784d8af5a5ULL);  // the same on every machine
}

TEST_CASE("a note is handed on, and an empty line says nothing", "[unit][recording]") {
  const RecordLine note = parsed("# pack {\"name\": \"demo 48s\"}");
  CHECK(std::get<RecordNote>(note).word == "pack");
  CHECK(std::get<RecordNote>(note).rest == "{\"name\": \"demo 48s\"}");
  CHECK(std::holds_alternative<RecordNothing>(parsed("")));
  CHECK(std::holds_alternative<RecordNothing>(parsed("\r")));
}

TEST_CASE("a damaged line is refused with its place and what was wanted there", "[unit][recording][F106]") {
  struct Row {
    const char* line;
    std::size_t column;
    const char* wanted;
  };
  const Row rows[] = {
      {"something else", 0, "a frame, or a comment of a recording"},
      {"(1700000000.000000) can2 143#11 R", 20, "the name of a bus of the recording's head"},
      {"(1700000000.000000) can0 143#1", 29, "data bytes of two hexadecimal digits"},
      {"# (17000) tick 1", 2, "a time as in a candump log"},
      {"# (1700000000.000000) tick 12xz", 27, "16 hexadecimal digits"},
      {"# (1700000000.000000) tick", 26, "16 hexadecimal digits"},
      {"# (1700000000.000000) tick 1", 28, "8 hexadecimal digits"},
      {"# (1700000000.000000) tick 1 2 3", 31, "the end of the line"},
      {"# (1700000000.000000) sing", 22, "tick, or an observation"},
      {"# (1700000000.000000) port left up", 27, "internal, vehicle, charger, second_pack or inverter"},
      {"# (1700000000.000000) port internal sideways", 36, "up or down"},
      {"# (1700000000.000000) lost internal many", 36, "a number of frames"},
      {"# (1700000000.000000) failed internal can0 0x1", 43, "a frame as in a candump log"},
      {"# (1700000000.000000) failed internal can1 143#11", 38,
       "the name of this port's bus, as in the recording's head"},
      {"# (1700000000.000000) failed inverter can0 143#11", 38,
       "the name of this port's bus, as in the recording's head"},
      {"# (1700000000.000000) failed inverter", 37, "the name of this port's bus, as in the recording's head"},
      {"# (1700000000.000000) command explode user by 0", 30, "the name of a command"},
      {"# (1700000000.000000) command wake god by 0", 35, "user or service"},
      {"# (1700000000.000000) command wake user 0", 40, "by"},
      {"# (1700000000.000000) command wake user by 0 node 300", 50, "a node number"},
      {"# (1700000000.000000) command wake user by 0 soon", 45, "node, serial_number or unheard"},
      {"# (1700000000.000000) clock now", 28, "milliseconds since 1970"},
      {"# (1700000000.000000) health good", 29, "a condition of store, memory or disk"},
      {"# (1700000000.000000) lines estops 70000", 35, "emergency stops, bit by bit"},
      {"# (1700000000.000000) lines blinking", 28, "levels of GPIO lines"},
      {"# (1700000000.000000) claim soon", 28, "the receive time before the claim"},
      {"# (1700000000.000000) claim -1 us", 28, "a time in us"},
      {"# (1700000000.000000) claim 5 ms", 30, "a time in us"},
      {"# (1700000000.000000) claim 5 us lost", 33, "kept"},
      {"# > can2 040#11", 4, "the name of a bus of the recording's head"},
      {"# > can0 0x1", 9, "a frame as in a candump log"},
      {"# = main_battery", 4, "driven outputs"},
  };
  for (const Row& row : rows) {
    INFO(row.line);
    const auto result = parse_record_line(row.line, wall, two_buses);
    REQUIRE_FALSE(result);
    CHECK(result.error().wanted == row.wanted);
    CHECK(result.error().column == row.column);
  }
}

TEST_CASE("no line is longer than other tools bear", "[unit][recording]") {
  const std::string name(bus_name_length_max, 'c');
  const RecordBuses longest{.internal = name, .vehicle = name};
  for (const ObservedThing& what : all_kinds()) {
    CHECK(line_of({TimePoint{4'000'000'000s}, what}, longest).size() < record_line_max);
  }
}
