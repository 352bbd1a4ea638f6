// The real daemon, the real emulated pack and its inverter, which is on its own bus with the vehicle's messages.
#include <filesystem>
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

namespace {

struct Storage : test::Bench {
  std::string inverter_bus = "unix:test-inverter-" + std::to_string(::getpid());

  Storage() {
    std::ifstream file(test::in_source("config/packs/storage-16s-48v.json"));
    nlohmann::json settings = nlohmann::json::parse(file, nullptr, true, true);
    settings["cell"] = test::in_source("config/cells/lfp-100ah.json");
    settings["buses"] = {{"internal", bus}, {"vehicle", inverter_bus}};
    pack = folder.file("pack.json", settings.dump());
  }
  Storage(const Storage&) = delete;
  Storage& operator=(const Storage&) = delete;
  ~Storage() { std::filesystem::remove("/dev/shm/bmud-bus." + inverter_bus.substr(5)); }
};

}  // namespace

TEST_CASE("an inverter draws from the real daemon's pack as it is told, and opens it by its silence",
          "[integration][daemon][inverter][bus]") {
  nlohmann::json closed;
  nlohmann::json open;
  std::string page;
  std::string status_page;
  bool has_drawn = false;
  const auto bench = test::driven<Storage>([&](Storage& storage) {
    storage.start_emulator("0 inverter current_A 30\n");
    storage.start_daemon();
    REQUIRE(storage.listener.next(test::hang_max));
    REQUIRE(storage.closes());
    has_drawn = storage.becomes_unless_open([&] {
      closed = storage.ask_json("status");
      page = storage.ask({"inverter"}).out;
      status_page = storage.ask({"status"}).out;
      const nlohmann::json& current_mA = closed["values"]["current_mA"];
      return current_mA.is_number() && current_mA > 25'000;
    });
    if (!has_drawn) return false;
    storage.send_event("inverter silent");
    REQUIRE(storage.listener.hears(test::is_open, test::hang_max));
    open = storage.ask_json("status");
    return open["last_opening"]["fault"] == "inverter_lost";
  });
  REQUIRE(has_drawn);
  CHECK(closed["inverter"]["protocol"] == "pylontech");
  CHECK(closed["inverter"]["is_talking"] == true);
  CHECK(closed["inverter"]["told"]["discharge_limit_mA"] > 50'000);
  CHECK(closed["ports"].size() == 3);
  CHECK(closed["ports"][2]["port"] == "inverter");
  CHECK(page.find("pylontech") != std::string::npos);
  CHECK(page.find("received") != std::string::npos);
  CHECK(status_page.find("Inverter") != std::string::npos);
  CHECK(open["inverter"]["is_talking"] == false);
  CHECK(open["inverter"]["told"]["discharge_limit_mA"] == 0);
  CHECK(open["last_opening"]["fault"] == "inverter_lost");
  const std::string reason = open["last_opening"]["reason"];
  INFO(reason);
  CHECK(reason.find("last received ") != std::string::npos);
  CHECK(reason.find("limit 5.0 s") != std::string::npos);
}

TEST_CASE("a bus of the command line on which the inverter would meet the modules is refused",
          "[integration][daemon][inverter][identifiers][bus]") {
  Storage storage;
  storage.more_options = {"--bus-inverter", storage.bus};
  const Finished joined = run_program(storage.daemon_command());
  CHECK(joined.status == 78);
  CHECK(joined.err.find("/inverter/protocol: found ") != std::string::npos);
  CHECK(joined.err.find("351 would be both COMMAND to a module and the limits for the ") != std::string::npos);
}

}  // namespace bmu
