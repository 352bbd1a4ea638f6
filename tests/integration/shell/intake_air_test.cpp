// The temperature of the intake air from a file of the machine, by the real daemon into 627h.
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {
namespace {

constexpr std::uint32_t report_id = 0x627;
constexpr std::uint8_t unknown_air = 0x80;

/// Receives 627h only.
class AirDisplay {
 public:
  explicit AirDisplay(const std::string& bus) {
    auto port = open_bus(bus, {.receive_ids = {report_id}});
    REQUIRE(port);
    port_ = std::move(*port);
  }
  /// Waits until byte 1 of 627h has this value: whole degrees Celsius, signed.
  [[nodiscard]] bool shows(std::uint8_t air) {
    const auto give_up_at = test::steady_clock::now() + test::hang_max;
    while (test::steady_clock::now() < give_up_at) {
      ReceivedFrame received;
      if (port_->read(received) == ReadStatus::frame) {
        if (received.frame.data[1] == air) return true;
        continue;
      }
      pollfd wait{.fd = port_->fd(), .events = POLLIN, .revents = 0};
      static_cast<void>(::poll(&wait, 1, 100));
    }
    return false;
  }

 private:
  std::unique_ptr<BusPort> port_;
};

/// The demonstration's pack on one bus, with the intake air read from a file.
std::string pack_that_reads(const std::string& file, const std::string& bus) {
  std::ifstream shipped(test::pack_file);
  nlohmann::json pack = nlohmann::json::parse(shipped, nullptr, true, true);
  pack["cell"] = test::in_source("config/packs/") + pack["cell"].get<std::string>();
  pack["buses"] = {{"internal", bus}, {"vehicle", bus}};
  pack["intake_air"] = {{"source", "file"}, {"file", file}, {"age_max_ms", 2'000}};
  return pack.dump();
}

}  // namespace

TEST_CASE(
    "627h carries the temperature of the file that the pack file names, follows it, and is unknown once it is gone",
    "[integration][daemon][vehicle][AIR_1][bus]") {
  test::Bench bench;
  const std::string sensor = bench.folder.file("in_temp_input", "23437\n");
  bench.pack = bench.folder.file("pack.json", pack_that_reads(sensor, bench.bus));
  AirDisplay display(bench.bus);
  bench.start_daemon();
  CHECK(display.shows(23));
  bench.folder.file("in_temp_input", "-5300\n");
  CHECK(display.shows(0xFB));  // -5 C
  std::filesystem::remove(sensor);
  CHECK(display.shows(unknown_air));
}

}  // namespace bmu
