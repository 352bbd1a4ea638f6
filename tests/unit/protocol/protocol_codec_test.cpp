// Decoding and encoding: the worked frames of the documentation, and the contracts of all rows.
#include <algorithm>

#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/contracts.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

std::vector<WorkedFrame> all_worked_frames() {
  std::vector<WorkedFrame> all = internal_worked_frames();
  for (WorkedFrame& one : vehicle_worked_frames()) all.push_back(one);
  for (WorkedFrame& one : elithion_worked_frames()) all.push_back(one);
  return all;
}

CanFrame encoded(const WorkedFrame& worked) {
  CanFrame frame = make_frame(*worked.message, worked.node);
  for (const SignalSpec& signal : worked.message->signals) {
    if (worked.has(signal)) encode_signal(signal, worked.value_of(signal), frame.data);
  }
  seal(*worked.message, worked.counter, frame);
  return frame;
}

std::vector<const MessageSpec*> all_rows() {
  std::vector<const MessageSpec*> rows(std::begin(internal_bus::rows), std::end(internal_bus::rows));
  rows.insert(rows.end(), std::begin(internal_bus::rows_little_endian_sensor),
              std::end(internal_bus::rows_little_endian_sensor));
  rows.insert(rows.end(), std::begin(vehicle_bus::rows), std::end(vehicle_bus::rows));
  rows.insert(rows.end(), std::begin(vehicle_bus_elithion::rows), std::end(vehicle_bus_elithion::rows));
  return rows;
}

}  // namespace

TEST_CASE("every worked frame decodes to its documented meaning", "[unit][protocol][BMS_F.8]") {
  for (const WorkedFrame& worked : all_worked_frames()) {
    const CanFrame frame = worked.frame();
    for (const SignalSpec& signal : worked.message->signals) {
      if (!worked.has(signal)) continue;
      INFO(worked.message->name << " " << signal.name);
      CHECK(decode_signal(signal, frame.data) == worked.value_of(signal));
    }
  }
}

TEST_CASE("every documented meaning encodes to its worked frame, counter and checksum included",
          "[unit][protocol][BMS_F.8]") {
  for (const WorkedFrame& worked : all_worked_frames()) {
    INFO(worked.message->name);
    CHECK(encoded(worked) == worked.frame());
  }
}

TEST_CASE("a meaning names signals that exist", "[unit][protocol]") {
  for (const WorkedFrame& worked : all_worked_frames()) {
    for (const auto& [name, value] : worked.meaning) {
      INFO(worked.message->name << " " << name);
      CHECK(std::any_of(worked.message->signals.begin(), worked.message->signals.end(),
                        [wanted = name](const SignalSpec& signal) { return signal.name == wanted; }));
    }
  }
}

TEST_CASE("reading and writing by name give the worked cell voltages", "[unit][protocol]") {
  CanFrame frame = make_frame(internal_bus::cells_1, 3);
  write<internal_bus::cells_1, "cell_voltage_1_uV">(frame, 3'651'200);
  write<internal_bus::cells_1, "cell_voltage_2_uV">(frame, 3'649'800);
  write<internal_bus::cells_1, "cell_voltage_3_uV">(frame, 3'653'000);
  seal(internal_bus::cells_1, 42, frame);
  CHECK(frame == internal_worked_frames()[2].frame());
  CHECK(read<internal_bus::cells_1, "cell_voltage_2_uV">(frame) == known(3'649'800));
  CHECK(read_raw<internal_bus::cells_1, "counter">(frame) == 42);
}

TEST_CASE("every signal of every row keeps the contracts of a signal", "[unit][protocol][contract][BMS_NF.2]") {
  Random random(1);
  for (const MessageSpec* message : all_rows()) {
    for (const SignalSpec& signal : message->signals) {
      INFO(message->name << " " << signal.name);
      check_signal_contracts(signal, random);
    }
  }
}

TEST_CASE("a limit is rounded towards zero and saturates below its unknown code", "[unit][protocol]") {
  const SignalSpec& limit = vehicle_bus::pack_current_signals[1];
  CHECK(raw_for(limit, 40'999) == 40);
  CHECK(raw_for(limit, 999) == 0);
  CHECK(raw_for(limit, 999'999'999) == 32'000);
  CHECK(raw_for(vehicle_bus::pack_current_signals[0], -85'500) == -86);
}

TEST_CASE("a number the field must not hold is out of range and no number", "[unit][protocol]") {
  FrameBytes bytes{101};
  CHECK(decode_signal(vehicle_bus::pack_charge_signals[0], bytes) == not_known(Validity::out_of_range));
  bytes[0] = 100;
  CHECK(decode_signal(vehicle_bus::pack_charge_signals[0], bytes) == known(1'000));
}

TEST_CASE("big- and little-endian sensors carry the same value in opposite bytes", "[unit][protocol]") {
  CanFrame big = make_frame(internal_bus::sensor_current);
  CanFrame little = make_frame(internal_bus::sensor_current_le);
  write<internal_bus::sensor_current, "pack_current_mA">(big, -123'456);
  write<internal_bus::sensor_current_le, "pack_current_mA">(little, -123'456);
  std::reverse(little.data.begin() + 2, little.data.begin() + 6);
  CHECK(big == little);
  CHECK(big.data == FrameBytes{0x00, 0x00, 0xFF, 0xFE, 0x1D, 0xC0});
}
