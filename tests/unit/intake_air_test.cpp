// The temperature of the intake air: of each source, into 627h, and unknown where it is missing, absurd or too old.
#include "daemon/shell/intake_air.hpp"

#include <chrono>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include "daemon/core/report_vehicle.hpp"
#include "protocol/message.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;
using test::CoreBench;

namespace {

CoreConfig pack_with(const IntakeAirConfig& air) {
  CoreConfig config = test::small_pack();
  config.intake_air = air;
  return config;
}

CanFrame pdu_temperature_frame(const SignalValue& temperature_dC, std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::pdu_temperature);
  write<internal_bus::pdu_temperature, "intake_air_temperature_dC">(frame, temperature_dC);
  seal(internal_bus::pdu_temperature, counter, frame);
  return frame;
}

/// Byte 1 of the last 627h.
std::uint8_t sent_air(const CoreBench& bench) {
  std::uint8_t air = 0;
  for (const OutgoingFrame& sent : bench.sent()) {
    if (sent.frame.id == 0x627) air = sent.frame.data[1];
  }
  return air;
}

constexpr std::uint8_t unknown_air = 0x80;

}  // namespace

TEST_CASE("without a source the intake air is unknown, whoever reports one", "[unit][vehicle][AIR_1]") {
  CoreBench bench(pack_with({}));
  bench.observe(IntakeAirSeen{.temperature_dC = 234});
  bench.deliver(pdu_temperature_frame(known(234), 1));
  bench.run(1500ms);
  CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
  CHECK(sent_air(bench) == unknown_air);
}

TEST_CASE("the intake air of a board sensor of a module is reported while the module answers",
          "[unit][vehicle][AIR_1]") {
  const auto sensor = static_cast<std::uint8_t>(GENERATE(1, 2, 3, 4));
  CAPTURE(sensor);
  CoreBench bench(pack_with({.source = AirSource::module, .node = 2, .sensor = sensor}));
  bench.run(1500ms);
  CHECK(bench.core().intake_air_dC(bench.now()).value == 280 + 10 * sensor);
  CHECK(sent_air(bench) == 28 + sensor);
  bench.modules[1].talks = false;
  bench.run(2s);
  CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
  CHECK(sent_air(bench) == unknown_air);
}

TEST_CASE("the intake air of the PDU is reported until it is too old", "[unit][vehicle][AIR_1]") {
  CoreBench bench(pack_with({.source = AirSource::pdu, .age_max = 3s}));
  bench.run(100ms);
  bench.observe(IntakeAirSeen{.temperature_dC = 500});  // not the source that is named
  bench.deliver(pdu_temperature_frame(known(-53), 7));
  bench.run(1500ms);
  CHECK(bench.core().intake_air_dC(bench.now()).value == -53);
  CHECK(sent_air(bench) == 0xFB);                       // -5 C
  bench.observe(IntakeAirSeen{.temperature_dC = 500});  // nor later
  CHECK(bench.core().intake_air_dC(bench.now()).value == -53);
  CanFrame damaged = pdu_temperature_frame(known(200), 8);
  damaged.data[7] ^= 1;
  bench.deliver(damaged);
  CHECK(bench.core().intake_air_dC(bench.now()).value == -53);
  bench.run(1600ms);
  CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
  bench.run(1s);
  CHECK(sent_air(bench) == unknown_air);
}

TEST_CASE("an open sensor of the PDU is unknown at once", "[unit][vehicle][AIR_1]") {
  CoreBench bench(pack_with({.source = AirSource::pdu}));
  bench.run(100ms);
  bench.deliver(pdu_temperature_frame(known(210), 1));
  CHECK(bench.core().intake_air_dC(bench.now()).is_valid());
  bench.deliver(pdu_temperature_frame(not_known(Validity::open_circuit), 2));
  CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
  bench.deliver(pdu_temperature_frame(known(210), 3));
  CHECK(bench.core().intake_air_dC(bench.now()).is_valid());
}

TEST_CASE("the intake air of a file is reported until it is too old, and no absurd one", "[unit][vehicle][AIR_1]") {
  CoreBench bench(pack_with({.source = AirSource::file, .age_max = 3s}));
  bench.run(100ms);
  bench.deliver(pdu_temperature_frame(known(500), 1));  // not the source that is named
  CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
  bench.observe(IntakeAirSeen{.temperature_dC = 234});
  bench.run(1500ms);
  CHECK(bench.core().intake_air_dC(bench.now()).value == 234);
  CHECK(sent_air(bench) == 23);
  for (const std::int32_t temperature_dC : {1'201, -601}) {
    bench.observe(IntakeAirSeen{.temperature_dC = temperature_dC});
    CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
  }
  for (const std::int32_t temperature_dC : {1'200, -600}) {
    bench.observe(IntakeAirSeen{.temperature_dC = temperature_dC});
    CHECK(bench.core().intake_air_dC(bench.now()).is_valid());
  }
  bench.run(2990ms);
  CHECK(bench.core().intake_air_dC(bench.now()).is_valid());
  bench.run(30ms);
  CHECK_FALSE(bench.core().intake_air_dC(bench.now()).is_valid());
}

TEST_CASE("a worked frame of PDU_TEMPERATURE", "[unit][protocol][AIR_1]") {
  const CanFrame frame = pdu_temperature_frame(known(-53), 5);
  const std::array<std::uint8_t, 8> bytes{0xFF, 0xCB, 0, 0, 0, 0, 0x05, 0xBC};
  CHECK(frame.id == 0x042);
  CHECK(std::equal(bytes.begin(), bytes.end(), frame.data.begin()));
}

TEST_CASE("the kernel's text is milli-degrees Celsius, and nothing else", "[unit][intake_air][AIR_1]") {
  CHECK(air_temperature_dC("23437\n") == 234);
  CHECK(air_temperature_dC("23450") == 235);
  CHECK(air_temperature_dC("-5300\n") == -53);
  CHECK(air_temperature_dC("0\n") == 0);
  for (const char* text :
       {"", "\n", "warm\n", "23.437\n", "23437 C\n", "1000001\n", "-1000001\n", "99999999999999999999\n"}) {
    INFO(text);
    CHECK_FALSE(air_temperature_dC(text).has_value());
  }
}

TEST_CASE("a file is read on a thread, and what goes wrong with it is logged once", "[unit][intake_air][AIR_1]") {
  const TemporaryFolder folder;
  const std::string file = folder / "in_temp_input";
  std::mutex mutex;
  std::vector<std::string> lines;
  const auto log = [&](Severity, std::string_view line) {
    const std::lock_guard lock(mutex);
    lines.emplace_back(line);
  };
  const auto until = [](auto condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!condition() && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return condition();
  };
  const auto line_count = [&] {
    const std::lock_guard lock(mutex);
    return lines.size();
  };
  {
    const auto reader = IntakeAirReader::start(file, log);
    REQUIRE(reader);
    REQUIRE(until([&] { return line_count() == 1; }));
    CHECK_FALSE((*reader)->take_dC().has_value());
    std::ofstream(file) << "21500\n";
    std::optional<std::int32_t> reading_dC;
    REQUIRE(until([&] {
      if (!reading_dC) reading_dC = (*reader)->take_dC();
      return reading_dC.has_value();
    }));
    CHECK(reading_dC == 215);
    CHECK(until([&] { return line_count() == 2; }));
  }
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].find(file + ": No such file or directory; 627h reports an unknown air temperature") !=
        std::string::npos);
  CHECK(lines[1] == "intake air: " + file + " can be read again");
}
