// The real daemon, the real emulated pack and its charger, which is alone on its own bus.
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

namespace {

/// The pack file names three buses; the charger's bus is overridden on the command line of both programs.
struct Wall : test::Bench {
  std::string charger_bus = bus + "-charger";
  std::unique_ptr<BusPort> internal;
  std::unique_ptr<BusPort> charger;

  Wall() {
    std::ifstream file(test::in_source("vcan-fixtures/charger-own-bus-48s.json"));
    nlohmann::json settings = nlohmann::json::parse(file, nullptr, true, true);
    settings["cell"] = test::in_source("config/cells/nmc-30ah-10p.json");
    settings["buses"] = {{"internal", bus}, {"vehicle", bus}, {"charger", "unix:nobody"}};
    pack = folder.file("pack.json", settings.dump());
    more_options = {"--bus-charger", charger_bus};
    more_emulator_options = {"--charger-bus", charger_bus};
    internal = listen(bus);
    charger = listen(charger_bus);
  }
  Wall(const Wall&) = delete;
  Wall& operator=(const Wall&) = delete;
  ~Wall() { std::filesystem::remove("/dev/shm/bmud-bus." + charger_bus.substr(5)); }

  static std::unique_ptr<BusPort> listen(const std::string& name) {
    auto port = open_bus(name, {});
    REQUIRE(port);
    return std::move(*port);
  }
  /// Identifiers of 29 bits, as those of the charger; and the number of other frames.
  struct Heard {
    std::set<std::uint32_t> extended;
    int others = 0;
  };
  static void hear(BusPort& port, Heard& heard) {
    ReceivedFrame received;
    for (ReadStatus status = port.read(received); status != ReadStatus::empty; status = port.read(received)) {
      if (status != ReadStatus::frame) continue;
      if (received.frame.is_extended) {
        heard.extended.insert(received.frame.id);
      } else {
        ++heard.others;
      }
    }
  }
  /// The current rises by 2 A/s.
  [[nodiscard]] bool charges() {
    return becomes_unless_open([&] {
      const nlohmann::json status = ask_json("status");
      if (!status.is_object()) return false;
      const nlohmann::json& current_mA = status.at("values").at("current_mA");
      return current_mA.is_number() && current_mA < -2'000;
    });
  }
};

}  // namespace

TEST_CASE("a charger on a bus of its own charges the real daemon's pack, stops, and opens it by its silence",
          "[integration][daemon][charger][bus]") {
  Wall::Heard of_charger;
  Wall::Heard of_modules;
  nlohmann::json charging;
  nlohmann::json stopped;
  nlohmann::json lost;
  const auto bench = test::driven<Wall>([&](Wall& wall) {
    of_charger = {};
    of_modules = {};
    wall.start_emulator("0 charger current_A 20\n");
    wall.start_daemon();
    REQUIRE(wall.listener.next(test::hang_max));
    REQUIRE(wall.closes(test::Bench::charger_plug));
    if (!wall.charges()) return false;
    charging = wall.ask_json("status");
    wall.send_event("charger disconnected");
    REQUIRE(wall.listener.hears(test::is_open, test::hang_max));
    stopped = wall.ask_json("status");
    REQUIRE(wall.closes(test::Bench::charger_plug));
    if (!wall.charges()) return false;
    wall.send_event("charger mains off");
    REQUIRE(wall.listener.hears(test::is_open, test::hang_max));
    lost = wall.ask_json("status");
    Wall::hear(*wall.charger, of_charger);
    Wall::hear(*wall.internal, of_modules);
    return stopped["last_opening"]["cause"] == "request over" && lost["last_opening"]["fault"] == "charger_silent";
  });
  CHECK(charging["charger"]["stage"] == "charging");
  CHECK(charging["charger"]["units"][0]["is_talking"] == true);
  CHECK(stopped["last_opening"]["cause"] == "request over");
  CHECK(lost["last_opening"]["fault"] == "charger_silent");
  CHECK(of_charger.extended == std::set<std::uint32_t>{0x1806E5F4, 0x18FF50E5});
  CHECK(of_charger.others == 0);
  CHECK(of_modules.extended.empty());
  CHECK(of_modules.others > 0);
}

}  // namespace bmu
