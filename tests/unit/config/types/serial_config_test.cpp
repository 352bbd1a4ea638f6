// Section "serial" of a pack file.
#include "config/types/serial_config.hpp"

#include <fstream>
#include <sstream>
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu {
namespace {

const std::string folder = test::in_source("config/packs");

/// Shipped pack with this section; empty: without it.
Result<PackConfig, ConfigProblems> parse_with(const std::string& section) {
  std::ostringstream bytes;
  bytes << std::ifstream(folder + "/lipo-6s-24v.json").rdbuf();
  std::string text = bytes.str();
  if (!section.empty()) text.insert(text.find("\"name\""), "\"serial\": " + section + ", ");
  return parse_pack_config(text, "pack.json", folder);
}

std::string problem_with(const std::string& section) {
  const auto pack = parse_with(section);
  return pack || pack.error().size() != 1 ? "" : to_text(pack.error().front());
}

}  // namespace

TEST_CASE("without a section there is no console, and with a device one of 38400 Bd that may set nothing",
          "[unit][config][serial][BMS_NF.5]") {
  const auto without = parse_with("");
  REQUIRE(without);
  CHECK(without->serial.device.empty());
  const auto with = parse_with(R"({"device": "/dev/ttyUSB0"})");
  REQUIRE(with);
  CHECK(with->serial.device == "/dev/ttyUSB0");
  CHECK(with->serial.bit_rate_Bd == 38'400);
  CHECK_FALSE(with->serial.may_set_cell_count);
  CHECK(with->serial.modules_max == 1);
  const auto all = parse_with(R"({"device": "/dev/ttyS1", "bit_rate_Bd": 115200, "may_set_cell_count": true})");
  REQUIRE(all);
  CHECK(all->serial.bit_rate_Bd == 115'200);
  CHECK(all->serial.may_set_cell_count);
}

TEST_CASE("a device that is none, a rate no adapter knows and a key nobody knows are told",
          "[unit][config][serial][BMS_NF.5]") {
  CHECK(problem_with(R"({"device": "ttyUSB0"})") ==
        "pack.json: /serial/device: found \"ttyUSB0\", expected a file such as /dev/ttyUSB0, or nothing");
  CHECK(problem_with(R"({"bit_rate_Bd": 38401})") ==
        "pack.json: /serial/bit_rate_Bd: found 38401, expected one of 1200, 2400, 4800, 9600, 19200, 38400, 57600, "
        "115200");
  CHECK(problem_with(R"({"bit_rate_Bd": 300})") ==
        "pack.json: /serial/bit_rate_Bd: found 300, expected a whole number from 1200 to 115200");
  CHECK_FALSE(problem_with(R"({"may_set_cell_count": 1})").empty());
  CHECK_FALSE(problem_with(R"({"port": "/dev/ttyUSB0"})").empty());
}

}  // namespace bmu
