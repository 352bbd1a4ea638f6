// Two daemons, each with a pack of its own, on one vehicle's bus: each is the other's second pack.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/shell/bus_port.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

namespace {

/// The demonstration pack with these keys instead of its own.
std::string pack_with(const TemporaryFolder& folder, const nlohmann::json& changes) {
  std::ifstream file(test::pack_file);
  nlohmann::json pack = nlohmann::json::parse(file, nullptr, true, true);
  pack["cell"] = test::in_source("config/cells/nmc-30ah-10p.json");
  pack.merge_patch(changes);
  return folder.file("pack.json", pack.dump());
}

/// What is heard on the vehicle's bus.
class VehicleEar {
 public:
  explicit VehicleEar(const std::string& bus) {
    auto port = open_bus(bus, {});
    REQUIRE(port);
    port_ = std::move(*port);
  }
  [[nodiscard]] BusPort& port() { return *port_; }
  /// The next frame of this identifier whose byte is as wanted.
  template <class IsWanted>
  [[nodiscard]] bool hears(std::uint32_t id, IsWanted is_wanted, milliseconds at_most) {
    const auto deadline = steady_clock::now() + at_most;
    while (steady_clock::now() < deadline) {
      ReceivedFrame received;
      if (port_->read(received) == ReadStatus::frame) {
        if (received.frame.id == id && is_wanted(received.frame)) return true;
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

/// The field of the second pack on the page of bmuctl, without the spaces behind it.
std::string shown_second_pack(const test::Bench& bench) {
  const std::string page = bench.ask({"status"}).out;
  const std::size_t begin = page.find("Second pack");
  if (begin == std::string::npos) return page;
  const std::string line = page.substr(begin, page.find('\n', begin) - begin);
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

/// Its silence is seen some messages after that of its charge.
nlohmann::json status_of_silence(const test::Bench& bench) {
  const auto deadline = steady_clock::now() + test::hang_max;
  nlohmann::json status;
  do {
    status = bench.ask_json("status");
  } while (status["second_pack"]["is_silent"] != true && steady_clock::now() < deadline);
  return status;
}

struct TwoPacks {
  std::string vehicle = "unix:test-vehicle-" + std::to_string(::getpid());
  test::Bench one;
  test::Bench other;

  TwoPacks() {
    one.pack = pack_with(one.folder, {{"vehicle", {{"request_id", "745"}}}, {"second_pack", {{"base_id", "640"}}}});
    other.pack = pack_with(other.folder, {{"vehicle", {{"base_id", "640"}, {"name", "SECOND"}}}});
    for (test::Bench* const bench : {&one, &other}) {
      bench->more_options = {"--bus-vehicle", vehicle};
      // The other one is a real daemon: nobody has to play it.
      bench->start_emulator(std::string("0 pack soc_permille 600\n") + (bench == &one ? "0 second_pack silent\n" : ""));
      bench->start_daemon();
    }
  }
  TwoPacks(const TwoPacks&) = delete;
  TwoPacks& operator=(const TwoPacks&) = delete;
  ~TwoPacks() { std::filesystem::remove("/dev/shm/bmud-bus." + vehicle.substr(5)); }
};

bool is_known_soc_2(const CanFrame& frame) {
  return frame.length == 7 && frame.data[5] != 0xFF && frame.data[5] > 50 && frame.data[5] < 90;
}
bool is_unknown_soc_2(const CanFrame& frame) {
  return frame.length == 7 && frame.data[5] == 0xFF;
}

}  // namespace

TEST_CASE("a second pack's charge is told as SOC2, and its silence as unknown, by the real daemon",
          "[integration][daemon][second_pack][BMS_F.8][bus]") {
  TwoPacks packs;
  VehicleEar ear(packs.vehicle);
  REQUIRE(ear.hears(0x626, is_known_soc_2, test::hang_max));
  // Its name comes in another message than its charge.
  nlohmann::json status;
  CHECK(packs.one.becomes([&] {
    status = packs.one.ask_json("status");
    return status["second_pack"]["name"] == "SECOND  ";
  }));
  CHECK(status["second_pack"]["soc_permille"].is_number());
  CHECK(status["ports"].size() == 3);
  CHECK(status["ports"][2]["port"] == "second_pack");
  CHECK(status["ports"][2]["bus"] == packs.vehicle);
  CHECK(packs.other.ask_json("status")["second_pack"].is_null());
  const Finished page = packs.one.ask({"status"});
  INFO(page.out << page.err);
  CHECK(page.out.find("SECOND") != std::string::npos);
  packs.other.daemon.reset();
  REQUIRE(ear.hears(0x626, is_unknown_soc_2, test::hang_max));
  const nlohmann::json silent = status_of_silence(packs.one);
  CHECK(silent["second_pack"]["soc_permille"].is_null());
  CHECK(silent["second_pack"]["is_silent"] == true);
  CHECK(packs.one.ask({"status"}).out.find("silent for") != std::string::npos);
}

TEST_CASE("the real daemon answers who asks for data on the vehicle's bus",
          "[integration][daemon][requests][BMS_F.8][bus]") {
  TwoPacks packs;
  VehicleEar ear(packs.vehicle);
  REQUIRE(ear.hears(
      0x626, [](const CanFrame& frame) { return frame.data[0] != 0xFF; }, test::hang_max));
  CanFrame request = data_frame(0x745, 8);
  request.data = {0x03, 0x10, 0x14, 0x05};
  const auto is_answer = [](const CanFrame& frame) {
    return frame.length == 8 && frame.data[0] == 4 && frame.data[1] == 0x50 && frame.data[4] > 100;
  };
  // Until it is answered: a starved daemon discards what waited meanwhile.
  CHECK(packs.one.becomes([&] {
    REQUIRE(ear.port().send(request));
    return ear.hears(0x74D, is_answer, milliseconds(1000));
  }));
  CHECK(packs.one.becomes([&] { return packs.one.ask_json("status")["requests"]["answered"] >= 1; }));
}

TEST_CASE("an emulated second pack is heard by the real daemon on a bus of its own, and missed when it falls silent",
          "[integration][daemon][mmusim][second_pack][BMS_F.8][bus]") {
  const std::string vehicle = "unix:test-second-" + std::to_string(::getpid());
  test::Bench bench;
  bench.pack = pack_with(bench.folder, {{"second_pack", {{"base_id", "640"}, {"dialect", "elithion"}}},
                                        {"buses", {{"internal", bench.bus}, {"vehicle", vehicle}}}});
  VehicleEar ear(vehicle);
  bench.start_emulator("0 second_pack soc_permille 640\n0 second_pack state driving\n");
  bench.start_daemon();
  REQUIRE(ear.hears(
      0x626, [](const CanFrame& frame) { return frame.data[5] == 64; }, test::hang_max));
  nlohmann::json heard;
  CHECK(bench.becomes([&] { return (heard = bench.ask_json("status")["second_pack"])["name"] == "SECOND  "; }));
  CHECK(heard["soc_permille"] == 640);
  CHECK(heard["frames_refused"] == 0);
  bench.send_event("second_pack silent");
  REQUIRE(ear.hears(0x626, is_unknown_soc_2, test::hang_max));
  CHECK(status_of_silence(bench)["second_pack"]["is_silent"] == true);
  std::filesystem::remove("/dev/shm/bmud-bus." + vehicle.substr(5));
}

TEST_CASE("the state of a second pack is shown in the words of its dialect, and not while it is not known",
          "[integration][daemon][mmusim][second_pack][BMS_F.8][bus]") {
  struct Words {
    const char* dialect;
    const char* open;
    const char* driving;
    const char* charging;
  };
  const Words words = GENERATE(
      Words{"iha", "contactors open", "vehicle on, contactors closed", "charger connected, contactors closed"},
      Words{"original", "unplugged, vehicle off", "unplugged, vehicle on, charge depleted", "plugged in, charging"},
      Words{"elithion", "no fault, contactors off", "K1 on, K3 on", "K1 on, K3 on"});
  CAPTURE(words.dialect);
  const std::string vehicle = "unix:test-state-" + std::to_string(::getpid());
  test::Bench bench;
  bench.pack = pack_with(bench.folder, {{"second_pack", {{"base_id", "640"}, {"dialect", words.dialect}}},
                                        {"buses", {{"internal", bench.bus}, {"vehicle", vehicle}}}});
  VehicleEar ear(vehicle);
  bench.start_emulator("0 second_pack soc_permille 640\n");
  bench.start_daemon();
  const auto second_pack = [&bench] {
    const nlohmann::json status = bench.ask_json("status");
    return status.is_object() ? status["second_pack"] : nlohmann::json::object();
  };
  const auto shows = [&](const std::string& state) {
    return bench.becomes([&] { return second_pack().value("state", nlohmann::json()) == state; }) &&
           bench.becomes([&] { return shown_second_pack(bench).ends_with("   " + state); });
  };
  CHECK(shows(words.open));
  for (const auto& [state, text] :
       {std::pair{"driving", words.driving}, {"open", words.open}, {"charging", words.charging}}) {
    CAPTURE(state);
    bench.send_event("second_pack state " + std::string(state));
    CHECK(shows(text));
  }
  // Of a master that sends its charge alone, and of one whose state is a number without a name.
  bench.send_event("second_pack silent");
  const bool has_numbers = std::string(words.dialect) != "elithion";
  for (const bool sends_state : {false, true}) {
    if (sends_state && !has_numbers) continue;
    CAPTURE(sends_state);
    const auto send = [&] {
      CanFrame status = data_frame(0x642, 6);
      status.data[0] = 99;
      if (sends_state) REQUIRE(ear.port().send(status));
      CanFrame charge = data_frame(0x646, 6);
      charge.data[0] = 64;
      REQUIRE(ear.port().send(charge));
    };
    CHECK(bench.becomes([&] {
      send();
      const nlohmann::json pack = second_pack();
      return pack.at("state").is_null() && pack.at("is_silent") == false &&
             (pack.at("values_out_of_range") != 0) == sends_state;
    }));
    CHECK(bench.becomes([&] {
      send();
      return shown_second_pack(bench).ends_with("SOC 64.0 %   --   --");
    }));
  }
  std::filesystem::remove("/dev/shm/bmud-bus." + vehicle.substr(5));
}

TEST_CASE("buses that the command line joins are refused with both names, at the start and by a check",
          "[integration][daemon][identifiers][bus]") {
  test::Bench bench;
  const std::string pack =
      pack_with(bench.folder, {{"second_pack", {{"base_id", "620"}}}, {"buses", {{"second_pack", "can7"}}}});
  const Finished apart = run_program({program("bmud"), "--config", pack, "--check-config"});
  CHECK(apart.status == 0);
  std::vector<std::string> command{
      program("bmud"), "--config", pack,       "--bus-internal", bench.bus, "--bus-second-pack",        bench.bus,
      "--bus-vehicle", bench.bus,  "--socket", bench.socket,     "--state", bench.folder / "state.json"};
  const bool is_check = GENERATE(false, true);
  if (is_check) command.emplace_back("--check-config");
  CAPTURE(is_check);
  const Finished joined = run_program(command);
  CHECK(joined.status == 78);
  CHECK(joined.err.find("/second_pack/base_id: found \"620\"") != std::string::npos);
  CHECK(joined.err.find("620 would be both the messages to the vehicle and the messages of the second pack") !=
        std::string::npos);
}

}  // namespace bmu
