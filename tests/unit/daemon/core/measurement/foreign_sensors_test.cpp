// Sensors of other manufacturers, as they are read and configured: round trip of each driver, worked frames, and
// rejected frames.
#include <array>
#include <vector>

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

const CurrentSensorDriver& lem() {
  return *find_device("lem_cab")->current;
}
const CurrentSensorDriver& outlander() {
  return *find_device("outlander_current")->current;
}
const SensorSetUpDriver& ivt() {
  return *find_device("ivt_s")->set_up;
}
const InsulationDriver& bender() {
  return *find_device("iso165c")->insulation;
}

CanFrame frame_of(std::uint32_t id, const std::vector<int>& bytes) {
  CanFrame frame = data_frame(id, static_cast<std::uint8_t>(bytes.size()));
  for (std::size_t i = 0; i < bytes.size(); ++i) frame.data.at(i) = static_cast<std::uint8_t>(bytes[i]);
  return frame;
}

/// The same frame in every form that a sensor does not use.
std::vector<CanFrame> others_of(const CanFrame& frame) {
  CanFrame error = frame;
  error.is_error = true;
  CanFrame extended = frame;
  extended.is_extended = true;
  CanFrame other = frame;
  ++other.id;
  return {error, extended, other};
}
std::vector<CanFrame> damaged_of(const CanFrame& frame) {
  CanFrame remote = frame;
  remote.is_remote = true;
  CanFrame shorter = frame;
  shorter.length = 3;
  return {remote, shorter};
}

}  // namespace

TEST_CASE("sensors are found by their names, and say what they are", "[unit][devices][sensors]") {
  for (const Device* device : all_devices()) {
    INFO(device->name);
    CHECK((device->current == nullptr || device->kind == DeviceKind::current_sensor));
    CHECK((device->set_up == nullptr || device->kind == DeviceKind::current_sensor));
    CHECK((device->kind == DeviceKind::insulation_monitor) == (device->insulation != nullptr));
    if (device->current != nullptr) CHECK(device->current->name == device->name);
    if (device->set_up != nullptr) CHECK(device->set_up->name == device->name);
    if (device->insulation != nullptr) CHECK(device->insulation->name == device->name);
  }
}

TEST_CASE("the current of a LEM CAB is read from its frame, of six bytes or of eight", "[unit][devices][sensors]") {
  const auto current_of = [](const std::vector<int>& bytes) { return lem().take(frame_of(0x3C2, bytes)).current_mA; };
  CHECK(current_of({0x80, 0, 0, 1, 0xC8, 0}) == known(1));
  CHECK(current_of({0x7F, 0xFF, 0xFC, 0xB1, 0xC8, 0, 0, 0}) == known(-847));
  CHECK(current_of({0x80, 0x01, 0x86, 0xA0, 0xC8, 0}) == known(100'000));
  CHECK(current_of({0x80, 0, 0, 0, 0xC8, 0}) == known(0));
  CHECK(current_of({0x80, 0x01, 0x86, 0xA0, 0xC8, 0xCA, 0xB5, 0x16}) == known(100'000));  // as delivered
}

TEST_CASE("below zero of an Outlander's current sensor is discharge, and a LEM CAB has the sign of its mounting",
          "[unit][devices][sensors]") {
  // From a capture: the precharge discharges the pack with 7.7 A.
  const CanFrame precharge = frame_of(0x3C2, {0x7F, 0xFF, 0xE1, 0xEC, 0xC8, 0, 0, 0});
  CHECK(outlander().take(precharge).current_mA == known(7'700));
  CHECK(outlander().report(known(7'700)) == precharge);
  CHECK(lem().take(precharge).current_mA == known(-7'700));
  CHECK(outlander().take(frame_of(0x3C2, {0x80, 0, 0, 1, 0xC9, 0, 0, 0})).current_mA.validity ==
        Validity::sensor_fault);
  CHECK(outlander().take(outlander().report(not_known())).current_mA.validity == Validity::sensor_fault);
  for (const CanFrame& frame : others_of(precharge)) CHECK(outlander().take(frame).word == CurrentWord::none);
  for (const CanFrame& frame : damaged_of(precharge)) CHECK(outlander().take(frame).word == CurrentWord::refused);
}

TEST_CASE("a frame at 3C2h with another b4 and a current that no LEM CAB measures is another device's",
          "[unit][devices][sensors]") {
  const auto word_of = [](const std::vector<int>& bytes) { return lem().take(frame_of(0x3C2, bytes)).word; };
  CHECK(word_of({0x00, 0x12, 0x34, 0x56, 0x00, 0, 0, 0}) == CurrentWord::refused);
  CHECK(word_of({0x80, 0x0F, 0x42, 0x41, 0x40, 0, 0, 0}) == CurrentWord::refused);
  CHECK(word_of({0x80, 0x0F, 0x42, 0x40, 0x40, 0, 0, 0}) == CurrentWord::value);  // marked by the sensor
  CHECK(word_of({0x80, 0x0F, 0x42, 0x41, 0xC8, 0, 0, 0}) == CurrentWord::value);
  CHECK(word_of({0xFF, 0xFF, 0xFF, 0xFF, 0x83, 0, 0, 0}) == CurrentWord::value);  // out of range, as reported
}

TEST_CASE("a current that a LEM CAB marks, or cannot have measured, is none", "[unit][devices][sensors]") {
  const auto current_of = [](const std::vector<int>& bytes) { return lem().take(frame_of(0x3C2, bytes)).current_mA; };
  CHECK(current_of({0x80, 0, 0, 1, 0xC9, 0}).validity == Validity::sensor_fault);  // its error bit
  CHECK(current_of({0x80, 0, 0, 1, 0x82, 0}).validity == Validity::sensor_fault);  // information 41h
  CHECK(current_of({0xFF, 0xFF, 0xFF, 0xFF, 0xC8, 0}).validity == Validity::sensor_fault);
  CHECK(current_of({0x80, 0x0F, 0x42, 0x40, 0xC8, 0}) == known(1'000'000));
  CHECK(current_of({0x80, 0x0F, 0x42, 0x41, 0xC8, 0}).validity == Validity::out_of_range);
  CHECK(current_of({0x7F, 0xF0, 0xBD, 0xBF, 0xC8, 0}).validity == Validity::out_of_range);
  const CanFrame good = lem().report(known(5));
  for (const CanFrame& frame : others_of(good)) CHECK(lem().take(frame).word == CurrentWord::none);
  for (const CanFrame& frame : damaged_of(good)) CHECK(lem().take(frame).word == CurrentWord::refused);
}

TEST_CASE("what an emulated LEM CAB reports is what is read", "[unit][devices][sensors]") {
  for (const std::int64_t current_mA : {-1'000'000, -1, 0, 1, 345'678}) {
    const CurrentNews news = lem().take(lem().report(known(current_mA)));
    CHECK(news.word == CurrentWord::value);
    CHECK(news.current_mA == known(current_mA));
  }
  CHECK(lem().take(lem().report(not_known())).current_mA.validity == Validity::sensor_fault);
}

TEST_CASE("an order to an IVT-S comes out of its command as it went in", "[unit][devices][sensors]") {
  const SensorSetting setting{
      .trigger = SensorTrigger::cyclic, .is_little_endian = true, .is_inverted = true, .period_ms = 1'234};
  for (const SetUpOrder& order :
       {SetUpOrder{.kind = SetUpOrderKind::read, .channel = 7}, SetUpOrder{.kind = SetUpOrderKind::stop},
        SetUpOrder{.kind = SetUpOrderKind::run}, SetUpOrder{.kind = SetUpOrderKind::store},
        SetUpOrder{.kind = SetUpOrderKind::set, .channel = 2, .setting = setting}}) {
    CHECK(ivt().order_of(ivt().command(order)) == order);
    CHECK(ivt().take(ivt().command(order)).word == SetUpWord::none);
  }
  // The worked frames of its table.
  CHECK(ivt().command({.kind = SetUpOrderKind::set, .setting = {.trigger = SensorTrigger::cyclic, .period_ms = 100}}) ==
        frame_of(0x411, {0x20, 0x02, 0x00, 0x64, 0, 0, 0, 0}));
  CHECK(ivt().command({.kind = SetUpOrderKind::stop}) == frame_of(0x411, {0x34, 0x00, 0x01, 0, 0, 0, 0, 0}));
  CHECK(ivt().command({.kind = SetUpOrderKind::run}) == frame_of(0x411, {0x34, 0x01, 0x01, 0, 0, 0, 0, 0}));
  CHECK(ivt().command({.kind = SetUpOrderKind::store}) == frame_of(0x411, {0x32, 0, 0, 0, 0, 0, 0, 0}));
}

TEST_CASE("what is none of these orders is none", "[unit][devices][sensors]") {
  CHECK_FALSE(ivt().order_of(frame_of(0x411, {0x3D, 0, 0, 0, 0, 0, 0, 0})));        // as delivered
  CHECK_FALSE(ivt().order_of(frame_of(0x411, {0x10, 3, 0, 0, 0, 0, 0, 0})));        // another identifier
  CHECK_FALSE(ivt().order_of(frame_of(0x411, {0x10, 6, 0x24, 0, 0, 4, 0xD2, 0})));  // identifier of the traction pack
  CHECK_FALSE(ivt().order_of(frame_of(0x411, {0x28, 2, 0, 20, 0, 0, 0, 0})));       // no such channel
  CHECK_FALSE(ivt().order_of(frame_of(0x411, {0x20, 3, 0, 20, 0, 0, 0, 0})));       // no such trigger
  const CanFrame good = ivt().command({});
  for (const CanFrame& frame : others_of(good)) CHECK_FALSE(ivt().order_of(frame));
  for (const CanFrame& frame : damaged_of(good)) CHECK_FALSE(ivt().order_of(frame));
}

TEST_CASE("an answer of an IVT-S comes out of its frame as it went in", "[unit][devices][sensors]") {
  const SensorSetting setting{.trigger = SensorTrigger::on_trigger, .is_inverted = true, .period_ms = 60};
  for (const SetUpAnswer& answer :
       {SetUpAnswer{SetUpWord::setting, 3, setting}, SetUpAnswer{.word = SetUpWord::running},
        SetUpAnswer{.word = SetUpWord::stopped}, SetUpAnswer{.word = SetUpWord::stored},
        SetUpAnswer{.word = SetUpWord::alive}, SetUpAnswer{.word = SetUpWord::not_understood}}) {
    CHECK(ivt().take(ivt().answer(answer)) == answer);
  }
  CHECK(ivt().take(frame_of(0x511, {0xB9, 2, 0, 0, 0, 0, 0, 0})).word == SetUpWord::other);
  CHECK(ivt().take(frame_of(0x511, {0xA8, 2, 0, 20, 0, 0, 0, 0})).word == SetUpWord::other);
  CHECK(ivt().take(frame_of(0x511, {0xA0, 3, 0, 20, 0, 0, 0, 0})).word == SetUpWord::refused);
  const CanFrame good = ivt().answer({.word = SetUpWord::alive});
  for (const CanFrame& frame : others_of(good)) CHECK(ivt().take(frame).word == SetUpWord::none);
  for (const CanFrame& frame : damaged_of(good)) CHECK(ivt().take(frame).word == SetUpWord::refused);
}

TEST_CASE("what an iso165C tells is taken as a whole", "[unit][devices][sensors]") {
  const auto report_of = [](const std::vector<int>& bytes) {
    MonitorReport report;
    CHECK(bender().take(frame_of(0x037, bytes), report) == MonitorWord::report);
    return report;
  };
  CHECK(report_of({0xF4, 0x01, 0, 0, 0, 0}) == MonitorReport{.resistance_Ohm = known(500'000)});
  CHECK(report_of({0x32, 0, 0x21, 0, 0, 0}) ==
        MonitorReport{.resistance_Ohm = known(50'000), .is_low = true, .is_warning = true});
  CHECK(report_of({0xF4, 1, 0x02, 0, 0, 0}).is_earth_lost);
  for (const auto& [b2, b4] : {std::pair{0x04, 0}, std::pair{0, 0x02}, std::pair{0, 0x04}}) {
    CHECK(report_of({0xF4, 1, b2, 0, b4, 0}).is_faulty);
  }
  // Values that are not current.
  for (const auto& [b2, b4, b5] :
       {std::array{0x08, 0, 0}, std::array{0x10, 0, 0}, std::array{0, 1, 0}, std::array{0, 0, 1}}) {
    CHECK_FALSE(report_of({0xF4, 1, b2, 0, b4, b5}).resistance_Ohm.is_valid());
  }
  CHECK(report_of({0xF4, 1, 0x08, 0, 0, 0}).is_testing);
  CHECK(report_of({0xF4, 1, 0x10, 0, 0, 0}).is_testing);
  CHECK(report_of({0xF4, 1, 0, 0, 1, 0}).is_off);
  for (const int b5 : {0x10, 0x20}) {
    CHECK(report_of({0xF4, 1, 0, 0, 0, b5}) ==
          MonitorReport{.resistance_Ohm = known(500'000), .is_test_pending = true});
  }
}

TEST_CASE("an iso165C-1 has thresholds of its own, and its word is taken all the same", "[unit][devices][sensors]") {
  const MessageSpec& response = *find_device("iso165c")->catalogue->find(0x023).message;
  const auto told = [&response](std::string_view name, int command, int value) {
    const FrameBytes data{static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(value % 256),
                          static_cast<std::uint8_t>(value / 256), 0, 0};
    for (const SignalSpec& signal : response.signals) {
      if (signal.name == name && signal.selected_by == command) return decode_signal(signal, data);
    }
    return not_known();
  };
  // As delivered: 55 and 300 kOhm, iso165C-1: 250 and 400 kOhm.
  for (const int threshold_kOhm : {55, 250}) {
    CHECK(told("error_threshold_Ohm", 50, threshold_kOhm) == known(threshold_kOhm * 1'000));
  }
  for (const int threshold_kOhm : {300, 400}) {
    CHECK(told("warning_threshold_Ohm", 57, threshold_kOhm) == known(threshold_kOhm * 1'000));
  }
  const auto report_of = [](int resistance_kOhm, int b2) {
    MonitorReport report;
    const CanFrame frame = frame_of(0x037, {resistance_kOhm % 256, resistance_kOhm / 256, b2, 0, 0, 0});
    CHECK(bender().take(frame, report) == MonitorWord::report);
    return report;
  };
  // 200 kOhm are below the error threshold of the one, below the warning threshold of the other.
  CHECK(report_of(200, 0x21) == MonitorReport{.resistance_Ohm = known(200'000), .is_low = true, .is_warning = true});
  CHECK(report_of(200, 0x20) == MonitorReport{.resistance_Ohm = known(200'000), .is_warning = true});
}

TEST_CASE("what an emulated iso165C reports is what is read", "[unit][devices][sensors]") {
  const MonitorReport all[] = {{.resistance_Ohm = known(1'200'000)},
                               {.resistance_Ohm = known(30'000), .is_low = true, .is_warning = true},
                               {.resistance_Ohm = known(1'000'000), .is_earth_lost = true, .is_faulty = true},
                               {.is_off = true},
                               {.is_testing = true, .is_test_pending = true}};
  for (const MonitorReport& report : all) {
    MonitorReport read;
    CHECK(bender().take(bender().report(report), read) == MonitorWord::report);
    CHECK(read == report);
  }
  MonitorReport untouched{.resistance_Ohm = known(7'000)};
  for (const CanFrame& frame : others_of(bender().report({}))) {
    CHECK(bender().take(frame, untouched) == MonitorWord::none);
  }
  for (const CanFrame& frame : damaged_of(bender().report({}))) {
    CHECK(bender().take(frame, untouched) == MonitorWord::refused);
  }
  // An iso175 has the identifier with eight bytes, and another layout.
  CHECK(bender().take(frame_of(0x037, {0xF4, 1, 0, 0, 0, 0, 0, 0}), untouched) == MonitorWord::refused);
  CHECK(untouched == MonitorReport{.resistance_Ohm = known(7'000)});
}
