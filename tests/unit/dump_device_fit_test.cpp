// Frames under identifiers of devices that may be others': which of them bmudump takes for the device's.
#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "devices/device_list.hpp"
#include "protocol/candump.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tools/bmudump/device_fit.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;

CanFrame frame_of(std::uint32_t id, const std::vector<int>& bytes) {
  CanFrame frame = data_frame(id, static_cast<std::uint8_t>(bytes.size()));
  for (std::size_t i = 0; i < bytes.size(); ++i) frame.data.at(i) = static_cast<std::uint8_t>(bytes[i]);
  return frame;
}

bool fits_device(const char* device, const CanFrame& frame) {
  const MessageSpec* const message = find_device(device)->catalogue->find(frame).message;
  REQUIRE(message != nullptr);
  return fits(*message, frame);
}

/// A Brusa has a warning of that name.
bool is_out_of_range(const std::string& text) {
  return text.find("out of range") != std::string::npos && text.find("command out of range") == std::string::npos;
}

/// Of its worked frames those that fit, and of the others what is said of them.
struct Worked {
  int fitting = 0;
  std::vector<std::string> others;
};
Worked worked_of(const Device& device) {
  const std::string folder = test::in_source("devices/" + std::string(device.name) + "/");
  std::ifstream frames(folder + "worked_frames.log");
  std::ifstream texts(folder + "worked_frames.expected");
  Worked worked;
  for (std::string line, text; std::getline(frames, line);) {
    if (!line.starts_with("(")) continue;
    const auto parsed = parse_log_line(line);
    REQUIRE(parsed);
    REQUIRE(std::getline(texts, text));
    const MessageSpec* const message = device.catalogue->find(parsed->frame).message;
    REQUIRE(message != nullptr);
    if (fits(*message, parsed->frame)) {
      ++worked.fitting;
      INFO(text);
      CHECK_FALSE(is_out_of_range(text));
    } else {
      worked.others.push_back(text);
    }
  }
  return worked;
}

}  // namespace

TEST_CASE("every worked frame of a device fits it, but for those that are out of range",
          "[unit][bmudump][devices][fit]") {
  for (const Device* device : all_devices()) {
    INFO(device->name);
    const Worked worked = worked_of(*device);
    CHECK(worked.fitting > 0);
    for (const std::string& text : worked.others) {
      INFO(text);
      CHECK(is_out_of_range(text));
    }
  }
}

TEST_CASE("frames that cars have under identifiers of devices do not fit these", "[unit][bmudump][devices][fit]") {
  // Of another length.
  CHECK_FALSE(fits_device("brusa_nlg5", frame_of(0x610, {0, 0, 0, 0, 0, 0, 0, 0})));
  CHECK_FALSE(fits_device("iso165c", frame_of(0x037, {0xF4, 1, 0, 0, 0, 0, 0, 0})));
  // A voltage of 2,560 V at 0.1 V, 6,144 A of mains, a temperature of 1,587 C, a cell of 41 V.
  CHECK_FALSE(fits_device("brusa_nlg5", frame_of(0x611, {0, 0, 0x64, 0, 0x64, 0, 0, 0})));
  CHECK_FALSE(fits_device("sma", frame_of(0x356, {0x10, 0x27, 0, 0, 0x00, 0x3E, 0, 0})));
  CHECK_FALSE(fits_device("sma", frame_of(0x355, {0x00, 0x40, 0x10, 0, 0, 0, 0, 0})));
  CHECK_FALSE(fits_device("outlander_cmu", frame_of(0x622, {0xA0, 0xB1, 0xC2, 0xD3, 0xE4, 0xF5, 0x06, 0x17})));
  CHECK_FALSE(fits_device("outlander_cmu", frame_of(0x621, {0x20, 0, 0xF0, 0, 0, 0, 0, 0})));
  CHECK_FALSE(fits_device("outlander_cmu", frame_of(0x3C3, {0x80, 0x00, 0, 0, 3, 0, 0, 0})));  // 32.8 V
  CHECK_FALSE(fits_device("outlander_cmu", frame_of(0x3C3, {0x0F, 0x6E, 7, 0, 3, 0, 0, 0})));  // balancing 7
  CHECK_FALSE(fits_device("lem_cab", frame_of(0x3C2, {0, 0x12, 0x34, 0x56, 0, 0, 0, 0})));
  // Commands and answers that there are none of.
  CHECK_FALSE(fits_device("ivt_s", frame_of(0x411, {0x00, 0x12, 0, 0, 0, 0, 0, 0})));
  CHECK_FALSE(fits_device("ivt_s", frame_of(0x511, {0x12, 0, 0, 0, 0, 0, 0, 0})));
  // No checksum.
  CHECK_FALSE(fits_device("i3_csc", frame_of(0x123, {0xD8, 0x8F, 0xDB, 0x8F, 0xDB, 0x8F, 0xA0, 0x89})));
  CHECK(fits_device("i3_csc", frame_of(0x123, {0xD8, 0x8F, 0xDB, 0x8F, 0xDB, 0x8F, 0xA0, 0x88})));
}
