// Emulated current and voltage sensor: periods, counters, flags, byte orders.
#include "mmu/devices/current_sensor.hpp"

#include <map>

#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using namespace internal_bus;

constexpr TimePoint power_up{7s};

std::vector<std::pair<TimePoint, CanFrame>> run(CurrentSensor& sensor, const SensorMeasurements& measured,
                                                TimePoint from, Duration duration) {
  std::vector<std::pair<TimePoint, CanFrame>> sent;
  for (TimePoint now = from + 1ms; now <= from + duration; now += 1ms) {
    for (const CanFrame& frame : sensor.tick(now, measured)) sent.emplace_back(now, frame);
  }
  return sent;
}

TEST_CASE("current comes each 20 ms, voltages each 60 ms, every channel with its own counter", "[unit][sensor]") {
  CurrentSensor sensor({}, power_up);
  const auto sent = run(sensor, {.current_mA = 1}, power_up, 1200ms);
  std::map<std::uint32_t, std::vector<TimePoint>> times;
  std::map<std::uint32_t, std::vector<unsigned>> counters;
  for (const auto& [at, frame] : sent) {
    times[frame.id].push_back(at);
    counters[frame.id].push_back(frame.data[1] & 0x0FU);
    CHECK(frame.length == 6);
    CHECK(frame.data[0] == frame.id - 0x521);
  }
  CHECK(times.size() == 3);
  CHECK(times[0x521].size() == 60);
  CHECK(times[0x522].size() == 20);
  CHECK(times[0x523].size() == 20);
  for (const auto& [id, list] : counters) {
    for (std::size_t index = 1; index < list.size(); ++index) CHECK(list[index] == (list[index - 1] + 1) % 16);
  }
  for (std::size_t index = 1; index < times[0x522].size(); ++index) {
    CHECK(times[0x522][index] - times[0x522][index - 1] == 60ms);
  }
}

TEST_CASE("values come in the byte order that is configured", "[unit][sensor]") {
  const SensorMeasurements measured{.current_mA = -15'000, .pack_mV = 400'000, .link_mV = 123'456};
  CurrentSensor big({}, power_up);
  const auto sent = run(big, measured, power_up, 60ms);
  REQUIRE(sent.size() == 5);
  const CanFrame& current = sent[0].second;
  CHECK(current.data == FrameBytes{0x00, 0x00, 0xFF, 0xFF, 0xC5, 0x68, 0, 0});
  CHECK(sent[3].second.data == FrameBytes{0x01, 0x00, 0x00, 0x06, 0x1A, 0x80, 0, 0});
  CHECK(read<sensor_u2, "link_voltage_mV">(sent[4].second) == known(123'456));

  CurrentSensor little({.little_endian = true}, power_up);
  const auto reversed = run(little, measured, power_up, 20ms);
  CHECK(reversed.at(0).second.data == FrameBytes{0x00, 0x00, 0x68, 0xC5, 0xFF, 0xFF, 0, 0});
  CHECK(read<sensor_current_le, "pack_current_mA">(reversed.at(0).second) == known(-15'000));
}

TEST_CASE("a sensor wired the other way counts charging as positive", "[unit][sensor]") {
  CurrentSensor sensor({.invert_current = true}, power_up);
  const auto sent = run(sensor, {.current_mA = 2'000}, power_up, 20ms);
  CHECK(read<sensor_current, "pack_current_mA">(sent.at(0).second) == known(-2'000));
}

TEST_CASE("the current is the mean since the last result", "[unit][sensor]") {
  CurrentSensor sensor({}, power_up);
  run(sensor, {.current_mA = 0}, power_up, 15ms);
  const auto sent = run(sensor, {.current_mA = 4'000}, power_up + 15ms, 25ms);
  REQUIRE(sent.size() == 2);
  CHECK(read<sensor_current, "pack_current_mA">(sent[0].second) == known(1'000));
  CHECK(read<sensor_current, "pack_current_mA">(sent[1].second) == known(4'000));
}

TEST_CASE("flags stand where they belong: this result, any result, system, overcurrent", "[unit][sensor]") {
  CurrentSensor sensor({}, power_up);
  SensorMeasurements measured;
  measured.has_error[1] = true;
  auto sent = run(sensor, measured, power_up, 60ms);
  CHECK(read_raw<sensor_current, "measurement_error">(sent.at(2).second) == 0);
  CHECK(read_raw<sensor_current, "any_measurement_error">(sent.at(2).second) == 1);
  CHECK(read_raw<sensor_u1, "measurement_error">(sent.at(3).second) == 1);
  CHECK(read_raw<sensor_u2, "measurement_error">(sent.at(4).second) == 0);
  measured = {};
  measured.has_system_error = true;
  measured.has_overcurrent = true;
  sent = run(sensor, measured, power_up + 60ms, 20ms);
  CHECK(read_raw<sensor_current, "system_error">(sent.at(0).second) == 1);
  CHECK(read_raw<sensor_current, "overcurrent">(sent.at(0).second) == 1);
  CHECK(read_raw<sensor_current, "any_measurement_error">(sent.at(0).second) == 0);
}

TEST_CASE("charge and energy counters are sent when they are switched on, and are exact", "[unit][sensor]") {
  CurrentSensorConfig config;
  config.periods[3] = 30ms;
  config.periods[4] = 30ms;
  CurrentSensor sensor(config, power_up);
  const auto sent = run(sensor, {.current_mA = 36'000, .pack_mV = 100'000}, power_up, 100s);
  const CanFrame* charge = nullptr;
  const CanFrame* energy = nullptr;
  for (const auto& [at, frame] : sent) {
    if (frame.id == 0x527) charge = &frame;
    if (frame.id == 0x528) energy = &frame;
  }
  REQUIRE(charge != nullptr);
  REQUIRE(energy != nullptr);
  // 36 A for 99.99 s; 100 V times that.
  CHECK(read<sensor_charge, "charge_counter_uAs">(*charge) == known(3'600'000'000));
  CHECK(read<sensor_energy, "energy_counter_mWh">(*energy) == known(100'000));
}

TEST_CASE("charge and energy may come every millisecond, as the data sheet of 2020 allows", "[unit][sensor]") {
  CurrentSensorConfig config;
  config.periods[3] = 1ms;
  config.periods[4] = 1ms;
  CurrentSensor sensor(config, power_up);
  std::map<std::uint32_t, int> counts;
  for (const auto& [at, frame] : run(sensor, {.current_mA = 36'000, .pack_mV = 100'000}, power_up, 1s)) {
    ++counts[frame.id];
  }
  CHECK(counts[0x527] == 1'000);
  CHECK(counts[0x528] == 1'000);
}

TEST_CASE("a second sensor sends the current alone, at 531h, each 20 ms, in either byte order", "[unit][sensor]") {
  CurrentSensor big({}, power_up, SensorPlace::second);
  auto sent = run(big, {.current_mA = -15'000, .pack_mV = 400'000}, power_up, 1200ms);
  REQUIRE(sent.size() == 60);
  CHECK(sent[0].second.id == 0x531);
  CHECK(sent[0].second.data == FrameBytes{0x00, 0x00, 0xFF, 0xFF, 0xC5, 0x68, 0, 0});
  for (std::size_t index = 1; index < sent.size(); ++index) {
    CHECK(sent[index].second.id == 0x531);
    CHECK(sent[index].first - sent[index - 1].first == 20ms);
    CHECK(sent[index].second.data[1] == (sent[index - 1].second.data[1] + 1) % 16);
  }
  CurrentSensor little({.little_endian = true}, power_up, SensorPlace::second);
  sent = run(little, {.current_mA = -15'000}, power_up, 20ms);
  REQUIRE(sent.size() == 1);
  CHECK(sent[0].second.id == 0x531);
  CHECK(read<sensor_current_2_le, "pack_current_2_mA">(sent[0].second) == known(-15'000));
}

TEST_CASE("what the sensors send passes the receive check", "[unit][sensor]") {
  ReceiveCheck check(catalogue, ReceiveCheck::Role::master);
  for (const SensorPlace unit : {SensorPlace::first, SensorPlace::second}) {
    CurrentSensor sensor({}, power_up, unit);
    for (const auto& [at, frame] : run(sensor, {}, power_up, 2s)) CHECK(check.check(frame).is_accepted);
  }
}

}  // namespace
}  // namespace bmu
