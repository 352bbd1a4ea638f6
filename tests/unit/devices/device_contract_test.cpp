// Contracts of every device in the list: its rows keep the contracts of rows, its worked frames decode as documented,
// and all of them are shown.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "devices/device_list.hpp"
#include "devices/i3_csc/i3_csc.hpp"
#include "protocol/candump.hpp"
#include "protocol/receive_check.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/contracts.hpp"
#include "tests/support/folders.hpp"
#include "tools/bmudump/frame_text.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

std::vector<const Catalogue*> catalogues_of(const Device& device) {
  std::vector<const Catalogue*> all{device.catalogue};
  if (device.little_endian != nullptr) all.push_back(device.little_endian);
  return all;
}

std::string file_of(const Device& device, const char* file) {
  return test::in_source("devices/" + std::string(device.name) + "/" + file);
}

std::string content_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  INFO(file);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

/// Calls `take` for each line of the worked frames that is a frame.
template <class Take>
void for_each_worked_frame(const Device& device, const Take& take) {
  std::istringstream lines(content_of(file_of(device, "worked_frames.log")));
  for (std::string line; std::getline(lines, line);) {
    INFO(device.name << ": " << line);
    const auto parsed = parse_log_line(line);
    REQUIRE(parsed);
    if (parsed->kind == LogLineKind::frame) take(*parsed);
  }
}

/// Output as of `bmudump -t none --device can0=NAME -r devices/NAME/worked_frames.log`.
std::string dump_of_worked_frames(const Device& device) {
  const dump::DumpCatalogue catalogue({.has_internal = false, .has_vehicle = false, .devices = {&device}});
  dump::LineStart start({.time = dump::TimeForm::none});
  dump::FrameText format(catalogue, {}, start);
  dump::TextWriter text(-1);
  ReceiveCheck check(catalogue.all(), ReceiveCheck::Role::listener);
  for_each_worked_frame(device, [&](const LogLine& line) {
    const CheckedFrame verdict = check.check(line.frame);
    format.print_text({line, verdict}, text);
  });
  return std::string(text.pending());
}

/// Frame of the row with every signal at a random permitted value.
CanFrame some_frame(const MessageSpec& message, std::uint8_t node, std::uint8_t counter, Random& random) {
  CanFrame frame = make_frame(message, node);
  for (const SignalSpec& signal : message.signals) {
    if (signal.bit_count == 64 || signal.selected_by >= 0) continue;
    const RawRange range = raw_range(signal);
    encode_signal(signal, known(carried(signal, random.between(range.min, range.max))), frame.data);
  }
  seal(message, counter, frame);
  return frame;
}

}  // namespace

TEST_CASE("every signal of every device keeps the contracts of a signal", "[unit][devices][contract]") {
  Random random(11);
  for (const Device* device : all_devices()) {
    for (const Catalogue* catalogue : catalogues_of(*device)) {
      for (const MessageSpec* message : catalogue->messages()) {
        for (const SignalSpec& signal : message->signals) {
          INFO(device->name << " " << message->name << " " << signal.name);
          check_signal_contracts(signal, random);
        }
      }
    }
  }
}

TEST_CASE("a device is found by its name, and messages of different devices have different names",
          "[unit][devices][contract]") {
  std::set<std::string_view> names;
  std::set<const MessageSpec*> rows;
  for (const Device* device : all_devices()) {
    CHECK(find_device(device->name) == device);
    for (const MessageSpec* message : device->catalogue->messages()) {
      INFO(device->name << " " << message->name);
      // A row that two devices share is one message.
      if (rows.insert(message).second) CHECK(names.insert(message->name).second);
      CHECK(message->name.size() <= 24);
    }
  }
  CHECK(find_device("elcon") == nullptr);
  CHECK(find_device("") == nullptr);
}

TEST_CASE("every identifier of every device finds its row and node", "[unit][devices][contract]") {
  for (const Device* device : all_devices()) {
    for (const MessageSpec* message : device->catalogue->messages()) {
      for (unsigned node = message->node_min; node <= message->node_max; ++node) {
        INFO(device->name << " " << message->name << " " << node);
        const MessageMatch match = device->catalogue->find(make_frame(*message, static_cast<std::uint8_t>(node)));
        CHECK(match.message == message);
        CHECK(match.node == node);
      }
    }
  }
}

TEST_CASE("of every device, a frame of another length is refused", "[unit][devices][contract]") {
  Random random(12);
  for (const Device* device : all_devices()) {
    for (const MessageSpec* message : device->catalogue->messages()) {
      INFO(device->name << " " << message->name);
      ReceiveCheck check(*device->catalogue, ReceiveCheck::Role::listener);
      CanFrame frame = some_frame(*message, message->node_min, 1, random);
      for (std::uint8_t length = 0; length <= 8; ++length) {
        if (length >= message->shortest() && length <= message->length) continue;
        frame.length = length;
        CHECK(check.check(frame).reason == RejectReason::wrong_length);
      }
      frame.length = message->length;
      CHECK(check.check(frame).is_accepted);
    }
  }
}

TEST_CASE("of every device with a checksum, a frame with one wrong bit is refused, and so is one that was there",
          "[unit][devices][contract]") {
  Random random(13);
  for (const Device* device : all_devices()) {
    for (const MessageSpec* message : device->catalogue->messages()) {
      if (!has_crc(*message)) continue;
      INFO(device->name << " " << message->name);
      ReceiveCheck check(*device->catalogue, ReceiveCheck::Role::listener);
      const CanFrame frame = some_frame(*message, message->node_max, 3, random);
      for (unsigned bit = 0; bit < 64; ++bit) {
        CanFrame damaged = frame;
        damaged.data[bit / 8] = static_cast<std::uint8_t>(damaged.data[bit / 8] ^ (1U << (bit % 8)));
        CHECK(check.check(damaged).reason == RejectReason::wrong_crc);
      }
      CHECK(check.check(frame).is_accepted);
      CHECK(check.check(frame).reason == RejectReason::repeated_counter);
      CanFrame other = frame;
      other.data[0] = static_cast<std::uint8_t>(other.data[0] ^ 1U);
      seal(*message, 3, other);
      CHECK(check.check(other).reason == RejectReason::conflicting);
      seal(*message, 4, other);
      CHECK(check.check(other).is_accepted);
    }
  }
}

TEST_CASE("a master refuses what only it may send, of every device", "[unit][devices][contract]") {
  Random random(14);
  for (const Device* device : all_devices()) {
    ReceiveCheck check(*device->catalogue, ReceiveCheck::Role::master);
    for (const MessageSpec* message : device->catalogue->messages()) {
      INFO(device->name << " " << message->name);
      const CheckedFrame verdict = check.check(some_frame(*message, message->node_min, 1, random));
      CHECK(verdict.is_accepted == (message->sender != Sender::bmu));
      if (!verdict.is_accepted) CHECK(verdict.reason == RejectReason::foreign_master);
    }
  }
}

TEST_CASE("a master knows what only it may send by the identifier, of every device", "[unit][devices][contract][F39]") {
  Random random(15);
  for (const Device* device : all_devices()) {
    for (const MessageSpec* message : device->catalogue->messages()) {
      if (message->sender != Sender::bmu) continue;
      INFO(device->name << " " << message->name);
      ReceiveCheck check(*device->catalogue, ReceiveCheck::Role::master);
      const CanFrame whole = some_frame(*message, message->node_min, 1, random);
      CanFrame damaged = whole;
      damaged.data[7] ^= 0xFFU;
      CHECK(check.check(damaged).reason == RejectReason::foreign_master);
      for (std::uint8_t length = 0; length <= 8; ++length) {
        CanFrame other = whole;
        other.length = length;
        CHECK(check.check(other).reason == RejectReason::foreign_master);
      }
      CHECK(check.counts().rejected[static_cast<std::size_t>(RejectReason::foreign_master)] == 10);
    }
  }
}

TEST_CASE("the worked frames of every device pass their check and mean what stands beside them",
          "[unit][devices][golden]") {
  for (const Device* device : all_devices()) {
    const std::string file = file_of(*device, "worked_frames.expected");
    const std::string text = dump_of_worked_frames(*device);
    INFO(device->name);
    CHECK(text.find("!!") == std::string::npos);
    CHECK(text.find("unknown  [") == std::string::npos);
    if (std::getenv("BMUD_REWRITE") != nullptr) std::ofstream(file, std::ios::binary) << text;
    CHECK(text == content_of(file));
  }
}

TEST_CASE("worked frames say where they are from", "[unit][devices][meta]") {
  for (const Device* device : all_devices()) {
    const std::string log = content_of(file_of(*device, "worked_frames.log"));
    for (const char* key : {"Name", "Origin", "Pack", "Date", "Shows", "Requirement"}) {
      INFO(device->name << " " << key);
      CHECK(log.find("# " + std::string(key) + ": ") != std::string::npos);
    }
  }
}

TEST_CASE("every row of a device has a worked frame", "[unit][devices][meta]") {
  for (const Device* device : all_devices()) {
    std::set<const MessageSpec*> worked;
    for_each_worked_frame(*device,
                          [&](const LogLine& line) { worked.insert(device->catalogue->find(line.frame).message); });
    for (const MessageSpec* message : device->catalogue->messages()) {
      INFO(device->name << ": " << message->name << " has no worked frame");
      CHECK(worked.count(message) == 1);
    }
  }
}

TEST_CASE("every checksum of the i3's controller and modules is the one its rows want", "[unit][devices][i3]") {
  struct Sample {
    std::array<std::uint8_t, 7> bytes;
    std::array<std::uint8_t, 8> crc_of_node;
  };
  // The first five are from the controller of a car, the last was calculated by others.
  constexpr Sample samples[] = {
      {{0xC7, 0x10, 0x00, 0x00, 0x20, 0x00, 0x10}, {0xE8, 0x8D, 0x22, 0x47, 0x61, 0x04, 0xAB, 0xCE}},
      {{0xC7, 0x10, 0x00, 0x00, 0x20, 0x00, 0x20}, {0xA2, 0xC7, 0x68, 0x0D, 0x2B, 0x4E, 0xE1, 0x84}},
      {{0xC7, 0x10, 0x00, 0x00, 0x20, 0x00, 0x34}, {0x1B, 0x7E, 0xD1, 0xB4, 0x92, 0xF7, 0x58, 0x3D}},
      {{0xC7, 0x10, 0x00, 0x10, 0x20, 0x00, 0x40}, {0x13, 0x76, 0xD9, 0xBC, 0x9A, 0xFF, 0x50, 0x35}},
      {{0xC7, 0x10, 0x00, 0x50, 0x20, 0x00, 0x50}, {0x4A, 0x2F, 0x80, 0xE5, 0xC3, 0xA6, 0x09, 0x6C}},
      {{0x68, 0x10, 0x00, 0x50, 0x00, 0x00, 0x30}, {0x7C, 0x19, 0xB6, 0xD3, 0xF5, 0x90, 0x3F, 0x5A}},
  };
  for (const Sample& sample : samples) {
    for (std::uint8_t node = 0; node <= i3_csc::node_max; ++node) {
      CanFrame frame = make_frame(i3_csc::command, node);
      std::copy(sample.bytes.begin(), sample.bytes.end(), frame.data.begin());
      seal(i3_csc::command, counter_of(i3_csc::command, frame), frame);
      CHECK(frame.data[7] == sample.crc_of_node.at(node));
    }
  }
}
