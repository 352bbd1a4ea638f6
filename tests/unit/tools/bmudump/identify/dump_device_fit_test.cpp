// Frames with identifiers of devices that may be from other senders: which of them bmudump attributes to the device.
#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "devices/device_list.hpp"
#include "protocol/candump.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tools/bmudump/identify/device_fit.hpp"
#include "tools/bmudump/identify/evidence.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;

CanFrame frame_of(std::uint32_t id, const std::vector<int>& bytes) {
  CanFrame frame = data_frame(id, static_cast<std::uint8_t>(bytes.size()));
  for (std::size_t i = 0; i < bytes.size(); ++i) frame.data.at(i) = static_cast<std::uint8_t>(bytes[i]);
  return frame;
}

Fit fit_of(const Catalogue& catalogue, const CanFrame& frame) {
  const MessageSpec* const message = catalogue.find(frame).message;
  REQUIRE(message != nullptr);
  return dump::fit_of(*message, frame);
}

Fit fit_of_device(const char* device, const CanFrame& frame) {
  return fit_of(*find_device(device)->catalogue, frame);
}

bool fits_device(const char* device, const CanFrame& frame) {
  return fit_of_device(device, frame) != Fit::no;
}

/// A Brusa has a warning of that name. Some batteries have numbers under the identifier of a name.
bool is_out_of_range(const std::string& text) {
  const bool has_number = text.find("out of range") != std::string::npos;
  return (has_number && text.find("command out of range") == std::string::npos) ||
         text.find("no text") != std::string::npos;
}

/// Number of worked frames that fit, and the texts of the others.
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
    if (dump::fit_of(*message, parsed->frame) != Fit::no) {
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
  // Wrong length.
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
  // Commands and answers that do not exist.
  CHECK_FALSE(fits_device("ivt_s", frame_of(0x411, {0x00, 0x12, 0, 0, 0, 0, 0, 0})));
  CHECK_FALSE(fits_device("ivt_s", frame_of(0x511, {0x12, 0, 0, 0, 0, 0, 0, 0})));
  // Wrong checksum.
  CHECK_FALSE(fits_device("i3_csc", frame_of(0x123, {0xD8, 0x8F, 0xDB, 0x8F, 0xDB, 0x8F, 0xA0, 0x89})));
  CHECK(fits_device("i3_csc", frame_of(0x123, {0xD8, 0x8F, 0xDB, 0x8F, 0xDB, 0x8F, 0xA0, 0x88})));
}

TEST_CASE("a row that nothing contradicts fits everything of its length, and that proves nothing",
          "[unit][bmudump][devices][fit]") {
  const std::vector<int> any{0xDE, 0xAD, 0xBE, 0xEF, 0x12, 0x34, 0x56, 0x78};
  for (const std::uint32_t id : {0x1D0U, 0x1C0U, 0x0F0U, 0x4A0U, 0x0B0U}) {
    INFO(id);
    CHECK(fit_of_device("i3_csc", frame_of(id, any)) == Fit::unproven);
  }
  CHECK(fit_of_device("ivt_s", frame_of(0x510, any)) == Fit::unproven);
  CHECK(fit_of_device("pylontech", frame_of(0x35C, any)) == Fit::unproven);
  CHECK(fit_of_device("pylontech", frame_of(0x305, {0, 0, 0, 0, 0, 0, 0, 0})) == Fit::unproven);
  CHECK(fit_of_device("victron", frame_of(0x372, {0xFF, 0xFF, 0, 0, 0, 0, 0, 0})) == Fit::unproven);
  CHECK(fit_of_device("sma", frame_of(0x35A, any)) == Fit::unproven);
  CHECK(fit_of_device("sma", frame_of(0x00F, {})) == Fit::unproven);
  // Most numbers are possible voltages and currents; unknown values prove nothing.
  CHECK(fit_of_device("brusa_nlg5", frame_of(0x612, {0, 160, 120, 126, 0, 0, 0, 0})) == Fit::unproven);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x625, any)) == Fit::unproven);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x628, {0, 96, 8, 12, 14, 88})) == Fit::unproven);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x623, {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF})) == Fit::unproven);
}

TEST_CASE("a checksum, a range, a mark or a name proves whose a frame is", "[unit][bmudump][devices][fit]") {
  CHECK(fit_of_device("i3_csc", frame_of(0x123, {0xD8, 0x8F, 0xDB, 0x8F, 0xDB, 0x8F, 0xA0, 0x88})) == Fit::proven);
  CHECK(fit_of_device("i3_csc", frame_of(0x0A0, {0x37, 0xFF, 0, 0, 0, 0, 0, 0})) == Fit::proven);
  CHECK(fit_of_device("ivt_s", frame_of(0x524, {3, 2, 0, 0, 0x30, 0x39})) == Fit::proven);
  CHECK(fit_of_device("cell_data", frame_of(0x650, {1, 7, 0x8E, 0xA0, 0x8E, 0x92, 0x8E, 0xB2})) == Fit::proven);
  CHECK(fit_of_device("pylontech", frame_of(0x356, {0, 0, 0, 0, 0xFA, 0, 0, 0})) == Fit::proven);
  // With the mark of its manufacturer, and without.
  CHECK(fit_of_device("pylontech", frame_of(0x359, {0, 0, 0, 0, 1, 'P', 'N', 0})) == Fit::proven);
  CHECK(fit_of_device("pylontech", frame_of(0x359, {0xDE, 0xAD, 0xBE, 0xEF, 0x12, 0x34, 0x56, 0x78})) == Fit::no);
  CHECK(fit_of_device("sma", frame_of(0x35E, {'P', 'Y', 'L', 'O', 'N', 0, 0, 0})) == Fit::proven);
  CHECK(fit_of_device("sma", frame_of(0x35E, {'P', 'Y', 0, 0, 0, 0, 0, 0})) == Fit::no);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x620, {'I', 'H', 'A', ' ', 'B', 'M', 'S', '1'})) == Fit::proven);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x620, {1, 2, 3, 4, 5, 6, 7, 8})) == Fit::no);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x620, {0, 0, 0, 0, 0, 0, 0, 0})) == Fit::no);
  CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x624, {0, 0x55, 0, 0x28, 0, 0xC8})) == Fit::proven);
}

TEST_CASE("bytes that are all clear or all set prove nothing, whatever the row", "[unit][bmudump][devices][fit]") {
  for (const int byte : {0x00, 0xFF}) {
    INFO(byte);
    const std::vector<int> eight(8, byte);
    for (const char* device : {"sma", "victron", "pylontech"}) {
      INFO(device);
      CHECK(fit_of_device(device, frame_of(0x356, eight)) == Fit::unproven);
      CHECK(fit_of_device(device, frame_of(0x355, eight)) != Fit::proven);
    }
    CHECK(fit_of_device("i3_csc", frame_of(0x0A0, eight)) != Fit::proven);
    CHECK(fit_of(vehicle_bus::catalogue, frame_of(0x624, std::vector<int>(6, byte))) != Fit::proven);
    CHECK(fit_of(internal_bus::catalogue, frame_of(0x521, std::vector<int>(6, byte))) != Fit::proven);
  }
  // Its checksum happens to be 0.
  CHECK(fit_of(internal_bus::catalogue, frame_of(0x35C, std::vector<int>(8, 0))) == Fit::unproven);
  CHECK(fit_of_device("sma", frame_of(0x356, {0, 0, 0, 0, 1, 0})) == Fit::proven);
}

TEST_CASE("results of the current sensor fit in ranges that batteries have", "[unit][bmudump][devices][fit]") {
  const auto fit = [](std::uint32_t id, const std::vector<int>& bytes) {
    return fit_of(internal_bus::catalogue, frame_of(id, bytes));
  };
  CHECK(fit(0x521, {0, 3, 0xFF, 0xFF, 0xC5, 0x68}) == Fit::proven);                           // -15 A
  CHECK(fit(0x521, {0, 0x12, 0x34, 0x56, 0x78, 0xAB}) == Fit::no);                            // 878 kA
  CHECK(fit(0x521, {0, 0x12, 0x34, 0x56, 0x78, 0x9A, 0, 0}) == Fit::no);                      // too long
  CHECK(fit(0x522, {0, 0, 0, 6, 0x1A, 0x80}) == Fit::no);                                     // of another channel
  CHECK(fit(0x527, {6, 0x12, 0x34, 0x56, 0x78, 0x90}) == Fit::no);                            // 243,912 Ah
  CHECK(fit(0x527, {6, 0, 0, 0, 0x0E, 0x10}) == Fit::proven);                                 // 1 Ah
  CHECK(fit_of_device("ivt_s", frame_of(0x526, {5, 0, 0x34, 0x56, 0x78, 0x90})) == Fit::no);  // 878 MW
}

TEST_CASE("the internal bus is shown by right seals, not by one of many", "[unit][bmudump][fit]") {
  const auto shown_by = [](int wrong_before, int right) {
    Evidence evidence;
    for (int i = 0; i < wrong_before; ++i) evidence.note_seal(false);
    for (int i = 0; i < right; ++i) evidence.note_seal(true);
    return evidence.has_internal();
  };
  CHECK_FALSE(shown_by(0, 0));
  CHECK(shown_by(0, 1));
  CHECK(shown_by(1, 1));
  CHECK_FALSE(shown_by(2, 1));
  CHECK(shown_by(9, 2));
  CHECK_FALSE(shown_by(10, 2));
  CHECK(shown_by(10, 3));
  // If other senders use the identifiers, one of 256 checksums is correct.
  Evidence car;
  car.note_seal(false);
  car.note_seal(false);
  for (int i = 0; i < 100'000; ++i) car.note_seal(i % 256 == 255);
  CHECK_FALSE(car.has_internal());
}
