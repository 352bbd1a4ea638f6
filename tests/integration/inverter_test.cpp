// The real daemon, the real emulated pack and its inverter, which is on a bus of its own with the vehicle's messages.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

using std::chrono::milliseconds;

namespace {

struct Storage {
  std::string inverter_bus = "unix:test-inverter-" + std::to_string(::getpid());
  test::Bench bench;

  Storage() {
    std::ifstream file(test::in_source("config/packs/storage-16s-48v.json"));
    nlohmann::json pack = nlohmann::json::parse(file, nullptr, true, true);
    pack["cell"] = test::in_source("config/cells/lfp-100ah.json");
    pack["buses"] = {{"internal", bench.bus}, {"vehicle", inverter_bus}};
    bench.pack = bench.folder.file("pack.json", pack.dump());
  }
  Storage(const Storage&) = delete;
  Storage& operator=(const Storage&) = delete;
  ~Storage() { std::filesystem::remove("/dev/shm/bmud-bus." + inverter_bus.substr(5)); }

  /// The status once it is as wanted, or the last there was.
  template <class IsWanted>
  [[nodiscard]] nlohmann::json status_when(IsWanted is_wanted, milliseconds at_most) const {
    const auto deadline = std::chrono::steady_clock::now() + at_most;
    nlohmann::json status;
    do {
      status = bench.ask_json("status");
    } while (!(status.is_object() && is_wanted(status)) && std::chrono::steady_clock::now() < deadline);
    return status;
  }
};

}  // namespace

TEST_CASE("an inverter draws from the real daemon's pack as it is told, and opens it by its silence",
          "[integration][daemon][inverter][bus]") {
  Storage storage;
  storage.bench.start_emulator("0 inverter current_A 30\n");
  storage.bench.start_daemon();
  REQUIRE(storage.bench.listener.next(test::hang_max));
  REQUIRE(storage.bench.closes());
  const auto draws = [](const nlohmann::json& status) {
    return status["values"]["current_mA"].is_number() && status["values"]["current_mA"] > 25'000;
  };
  const nlohmann::json closed = storage.status_when(draws, test::hang_max);
  REQUIRE(draws(closed));
  CHECK(closed["inverter"]["protocol"] == "pylontech");
  CHECK(closed["inverter"]["is_talking"] == true);
  CHECK(closed["inverter"]["told"]["discharge_limit_mA"] > 50'000);
  CHECK(closed["ports"].size() == 3);
  CHECK(closed["ports"][2]["port"] == "inverter");
  const std::string page = storage.bench.ask({"inverter"}).out;
  CHECK(page.find("pylontech") != std::string::npos);
  CHECK(page.find("heard") != std::string::npos);
  CHECK(storage.bench.ask({"status"}).out.find("Inverter") != std::string::npos);
  storage.bench.send_event("inverter silent");
  REQUIRE(storage.bench.listener.hears(test::is_open, test::hang_max));
  const nlohmann::json open = storage.bench.ask_json("status");
  CHECK(open["inverter"]["is_talking"] == false);
  CHECK(open["inverter"]["told"]["discharge_limit_mA"] == 0);
  CHECK(open["last_opening"]["fault"] == "inverter_lost");
  const std::string reason = open["last_opening"]["reason"];
  INFO(reason);
  CHECK(reason.find("last heard ") != std::string::npos);
  CHECK(reason.find("limit 5.0 s") != std::string::npos);
}

TEST_CASE("a bus of the command line on which the inverter would meet the modules is refused",
          "[integration][daemon][inverter][identifiers][bus]") {
  Storage storage;
  storage.bench.more_options = {"--bus-inverter", storage.bench.bus};
  const Finished joined = run_program(storage.bench.daemon_command());
  CHECK(joined.status == 78);
  CHECK(joined.err.find("/inverter/protocol: found ") != std::string::npos);
  CHECK(joined.err.find("351 would be both COMMAND to a module and the limits for the inverter") != std::string::npos);
}

}  // namespace bmu
