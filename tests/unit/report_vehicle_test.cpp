// What 620h to 628h say of a pack at the ends of their fields, of one that is not known, and when they are due.
#include "daemon/core/report_vehicle.hpp"

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/image.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using Bytes = std::vector<int>;

constexpr Spread cells_of(std::uint16_t number_of_lowest, std::uint16_t number_of_highest) {
  return {.min = 3'140'000,
          .max = 4'060'000,
          .average = 3'600'000,
          .min_at = {.pack_number = number_of_lowest},
          .max_at = {.pack_number = number_of_highest},
          .count = 300,
          .expected = 300};
}

struct Report {
  PackState pack;
  CurrentLimits limits;
  VehicleConfig config;
  VehicleView view;

  Report() {
    view.pack = &pack;
    view.limits = &limits;
  }
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;
  [[nodiscard]] Bytes message(unsigned id) const {
    const CanFrame frame = vehicle_frame(id - 0x620, view, config);
    CHECK(frame.id == id);
    return {frame.data.begin(), frame.data.begin() + frame.length};
  }
};

}  // namespace

TEST_CASE("name and version of the pack file are the texts of 620h and 621h", "[unit][vehicle][BMS_F.8]") {
  Report report;
  CHECK(report.message(0x620) == Bytes{'B', 'M', 'U', 'D', ' ', ' ', ' ', ' '});
  CHECK(report.message(0x621) == Bytes{'S', 'W', ':', ' ', '0', '.', '1', '0'});
  report.config.name = {'P', 'a', 'c', 'k', ' ', 'n', 'o', '7'};
  report.config.version = {'2', '0', '2', '6', '-', '1', '1', 'b'};
  CHECK(report.message(0x620) == Bytes{'P', 'a', 'c', 'k', ' ', 'n', 'o', '7'});
  CHECK(report.message(0x621) == Bytes{'2', '0', '2', '6', '-', '1', '1', 'b'});
}

TEST_CASE("a current flows from 200 mA on, either way, and none is neither", "[unit][vehicle][BMS_F.8]") {
  constexpr int charging = 0x02;
  constexpr int discharging = 0x04;
  Report report;
  const auto flags_at = [&](std::int32_t current_mA, Validity validity) {
    report.pack.current_mA = {current_mA, TimePoint{1s}, validity};
    return report.message(0x622)[3];
  };
  CHECK(flags_at(0, Validity::valid) == 0);
  CHECK(flags_at(199, Validity::valid) == 0);
  CHECK(flags_at(200, Validity::valid) == discharging);
  CHECK(flags_at(-199, Validity::valid) == 0);
  CHECK(flags_at(-200, Validity::valid) == charging);
  CHECK(flags_at(5'000, Validity::unknown) == 0);
  CHECK(flags_at(-5'000, Validity::unknown) == 0);
}

TEST_CASE("the uptime of 622h begins at 0 after 65535 s, in each dialect", "[unit][vehicle][BMS_F.8]") {
  for (const VehicleDialect dialect : {VehicleDialect::iha, VehicleDialect::original, VehicleDialect::elithion}) {
    Report report;
    report.config.dialect = dialect;
    const auto uptime_at = [&](Duration uptime) {
      report.view.uptime = uptime;
      const Bytes bytes = report.message(0x622);
      return bytes[1] * 256 + bytes[2];
    };
    CHECK(uptime_at(999ms) == 0);
    CHECK(uptime_at(1s) == 1);
    CHECK(uptime_at(65'535s) == 65'535);
    CHECK(uptime_at(65'536s) == 0);
    CHECK(uptime_at(65'537s) == 1);
  }
}

TEST_CASE("623h and 627h have lowest and highest with their numbers, and a number above 254 is unknown",
          "[unit][vehicle][BMS_F.8]") {
  Report report;
  report.pack.pack_voltage_mV = {170'400, TimePoint{1s}, Validity::valid};
  report.pack.cell_voltage_uV = cells_of(1, 254);
  CHECK(report.message(0x623) == Bytes{0x00, 0xAA, 31, 1, 41, 254});
  report.pack.cell_voltage_uV = cells_of(254, 255);
  CHECK(report.message(0x623) == Bytes{0x00, 0xAA, 31, 254, 41, 0xFF});
  report.pack.cell_voltage_uV = cells_of(300, 7);
  CHECK(report.message(0x623) == Bytes{0x00, 0xAA, 31, 0xFF, 41, 7});

  report.pack.cell_temperature_dC = {.min = -94,
                                     .max = 456,
                                     .average = 204,
                                     .min_at = {.pack_number = 255},
                                     .max_at = {.pack_number = 254},
                                     .count = 300,
                                     .expected = 300};
  CHECK(report.message(0x627) == Bytes{20, 0x80, 0xF7, 0xFF, 46, 254});
}

TEST_CASE("what is not known, or of some cells only, leaves as the code for that in each field",
          "[unit][vehicle][BMS_F.8]") {
  Report report;
  report.pack.cell_voltage_uV = cells_of(1, 2);
  report.pack.cell_voltage_uV.count = 299;
  CHECK(report.message(0x623) == Bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF});
  CHECK(report.message(0x624) == Bytes{0x80, 0x00, 0x00, 0x00, 0x00, 0x00});
  CHECK(report.message(0x625) == Bytes(8, 0xFF));
  CHECK(report.message(0x626) == Bytes{0xFF, 0xFF, 0xFF, 0x00, 0x00, 0xFF, 0xFF});
  report.pack.cell_temperature_dC = cells_of(3, 4);
  report.pack.cell_temperature_dC.count = 299;
  CHECK(report.message(0x627) == Bytes{0x80, 0x80, 0x80, 0xFF, 0x80, 0xFF});
  CHECK(report.message(0x628) == Bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF});
}

TEST_CASE("a report is due 1 s after the start, the next 10 ms later, and after a gap without a burst",
          "[unit][vehicle][BMS_F.8]") {
  const Report pack;
  constexpr TimePoint started_at{100s};
  VehicleReporter reporter;
  reporter.init(started_at);
  const auto sent_at = [&](Duration after_start) -> unsigned {
    const std::optional<CanFrame> frame = reporter.step(started_at + after_start, pack.view, pack.config);
    return frame ? frame->id : 0;
  };
  CHECK(sent_at(999ms) == 0);
  for (unsigned index = 0; index < 9; ++index) {
    const Duration due = 1s + 10ms * static_cast<int>(index);
    CHECK(sent_at(due - 1ms) == 0);
    CHECK(sent_at(due) == 0x620 + index);
  }
  CHECK(sent_at(1'999ms) == 0);
  CHECK(sent_at(2'000ms) == 0x620);
  // Due at 2010 ms: less than a period late it keeps its place, later it does not make up for it.
  CHECK(sent_at(3'019ms) == 0x621);
  CHECK(sent_at(3'019ms) == 0x622);
  CHECK(sent_at(3'040ms) == 0x623);  // the next was due a whole period ago
  CHECK(sent_at(3'040ms) == 0);
  CHECK(sent_at(3'049ms) == 0);
  CHECK(sent_at(3'050ms) == 0x624);
  CHECK(sent_at(9'000ms) == 0x625);
  CHECK(sent_at(9'009ms) == 0);
  CHECK(sent_at(9'010ms) == 0x626);
}

TEST_CASE("an image in which a message after the last is due is refused", "[unit][vehicle][image]") {
  const VehicleReporter reporter;
  std::vector<std::uint8_t> bytes(image_size(reporter));
  REQUIRE(write_image(reporter, bytes) == bytes.size());
  const auto problem_of = [&bytes](std::uint8_t index) {
    bytes[bytes.size() - sizeof(std::size_t)] = index;
    VehicleReporter other;
    return read_image(std::span<const std::uint8_t>(bytes), other);
  };
  CHECK_FALSE(problem_of(8));
  CHECK(problem_of(9) == ImageProblem::no_state);
}

}  // namespace bmu
