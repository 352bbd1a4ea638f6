// mmusim as run by a user: its reports on scripts and packs.
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

const std::string pack_file = test::in_source("config/packs/demo-48s.json");

}  // namespace

TEST_CASE("a check tells what is wrong with the script and what the pack does not have, by line",
          "[integration][mmusim]") {
  const TemporaryFolder folder;
  const std::string script = folder / "my.scn";
  std::ofstream(script) << "1 vehicle on\n2 cell 9.1 voltage_mV 2700\n# so far so good\n3 vehcle off\n"
                        << "4 cell 1.12 leak_Ohm 5\n5 module 7 silent\n6 load current_A";
  const Finished finished = run_program({program("mmusim"), "--check", "--scenario", script, "--pack", pack_file});
  CHECK(finished.status == 65);
  const std::string start = "mmusim: " + script + ":";
  std::size_t at = 0;
  for (const std::string place : {"2:3: ", "4:3: ", "6:3: ", "7:"}) {
    CAPTURE(place, finished.err);
    at = finished.err.find(start + place, at);
    CHECK(at != std::string::npos);
  }
  CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 4);
}

TEST_CASE("a pack that nobody asks wakes mmusim every 5 ms, not every millisecond", "[integration][mmusim][bus]") {
  // A waiting process yields its processor: once per wake-up.
  const auto waits = [] {
    rusage of_children{};
    REQUIRE(::getrusage(RUSAGE_CHILDREN, &of_children) == 0);
    return of_children.ru_nvcsw;
  };
  constexpr int seconds = 2;
  constexpr int waits_max = seconds * 300 + 100;  // 200 per second, and those of start and end
  const auto before = waits();
  const std::string bus = "unix:calm-" + std::to_string(::getpid());
  const Finished run = run_program(
      {program("mmusim"), "--seconds", std::to_string(seconds), "--quiet", "--pack", pack_file, "--bus", bus});
  CHECK(run.status == 0);
  CHECK(waits() - before < waits_max);
}

TEST_CASE("a check without a pack says what it could not check", "[integration][mmusim]") {
  const std::string script = test::in_source("vcan-fixtures/demo.scn");
  const Finished alone = run_program({program("mmusim"), "--check", "--scenario", script});
  CHECK(alone.status == 0);
  CHECK(alone.out.find("without --pack") != std::string::npos);
  const Finished both = run_program({program("mmusim"), "--check", "--scenario", script, "--pack", pack_file});
  CHECK(both.status == 0);
  CHECK(both.out.find("lines for demo 48s") != std::string::npos);
}

TEST_CASE("a recording is not written over the script or the pack that is read", "[integration][mmusim]") {
  const TemporaryFolder folder;
  const std::string script = folder / "my.scn";
  std::ofstream(script) << "1 vehicle on\n";
  const std::string pack = folder / "packs/lipo-6s-24v.json";
  const std::string cell = folder / "cells/lipo-3300.json";
  for (const char* part : {"packs", "cells"}) std::filesystem::create_directory(folder / part);
  std::filesystem::copy_file(test::in_source("config/packs/lipo-6s-24v.json"), pack);
  std::filesystem::copy_file(test::in_source("config/cells/lipo-3300.json"), cell);
  for (const std::string& file : {script, pack, cell}) {
    const auto size = std::filesystem::file_size(file);
    const Finished run = run_program({program("mmusim"), "--with-master", "--seconds", "1", "--quiet", "--pack", pack,
                                      "--scenario", script, "--record", file});
    CAPTURE(file, run.err);
    CHECK(run.status == 2);
    CHECK(run.err.find("mmusim: --record: '") == 0);
    CHECK(std::filesystem::file_size(file) == size);
  }
}

TEST_CASE("a script that cannot be read is told with the reason", "[integration][mmusim]") {
  const Finished finished = run_program({program("mmusim"), "--check", "--scenario", "/nowhere/my.scn"});
  CHECK(finished.status == 65);
  CHECK(finished.err == "mmusim: /nowhere/my.scn: cannot be read: No such file or directory\n");
}

// --- scripts as tests -----------------------------------------------------------------------------------------------

namespace {

using Json = nlohmann::json;

/// The demonstration's pack with a script of these lines, beside the core unless the arguments select otherwise.
Finished run_script(const std::string& text, std::vector<std::string> arguments = {"--with-master"}) {
  const TemporaryFolder folder;
  std::ofstream(folder / "my.scn") << text;
  std::vector<std::string> command{program("mmusim"), "--pack", pack_file, "--scenario", folder / "my.scn"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_program(command);
}

const std::string closes = "2 vehicle on\nwait contactor main_positive closed within 3\n";

}  // namespace

TEST_CASE("a script whose conditions hold ends the run with success and says how it went", "[integration][mmusim]") {
  const Finished finished =
      run_script(closes + "+1 cell 2.7 voltage_mV 2700\nwait master phase = open within 0.4\npass");
  CAPTURE(finished.out, finished.err);
  CHECK(finished.status == 0);
  CHECK(finished.out.find("script: passed, conditions held: 2") != std::string::npos);
  CHECK(finished.out.find("times real time, seed 1\n") != std::string::npos);
  CHECK(finished.out.find("cell voltage too low: cell 2.7") != std::string::npos);
  CHECK(finished.err.find("wait contactor main_positive closed within 3: after 0.8") != std::string::npos);
  CHECK(finished.err.find('\r') == std::string::npos);  // no progress without a terminal
}

TEST_CASE("a condition that does not hold has an exit code of its own and its place", "[integration][mmusim]") {
  const Finished finished =
      run_script(closes + "+1 expect contactor main_positive open\n", {"--with-master", "--quiet"});
  CHECK(finished.status == 3);
  CHECK(finished.out.empty());
  CHECK(finished.err.find("my.scn:3:4: at 3.842 s: expected contactor main_positive open; found closed\n") !=
        std::string::npos);
}

TEST_CASE("how far apart a module's frames are can be said, up to 2 ms", "[integration][mmusim]") {
  const auto run_with = [](const char* spacing_us) {
    return run_program({program("mmusim"), "--pack", pack_file, "--with-master", "--seconds", "1", "--quiet",
                        "--frame-spacing-us", spacing_us});
  };
  CHECK(run_with("0").status == 0);
  CHECK(run_with("2000").status == 0);
  const Finished refused = run_with("2001");
  CHECK(refused.status == 2);
  CHECK(refused.err.find("--frame-spacing-us") != std::string::npos);
}

TEST_CASE("a run that ends before its script has not passed", "[integration][mmusim]") {
  const Finished finished = run_script(closes, {"--with-master", "--seconds", "2.5"});
  CHECK(finished.status == 3);
  CHECK(finished.err.find("my.scn:2:1: the run ended at 2.5 s, conditions not decided: 1") != std::string::npos);
}

TEST_CASE("the result for machines is the same for the same seed, but for the time it took", "[integration][mmusim]") {
  const std::string script = closes + "+random 0..2 estop 1 pressed\nwait contactor main_positive open within 0.2";
  const auto result = [&script](const std::string& seed) {
    const Finished finished = run_script(script, {"--with-master", "--json", "--seed", seed});
    CHECK(finished.status == 0);
    Json json = Json::parse(finished.out);
    CHECK(json.at("took_s").get<double>() > 0.0);
    json.erase("took_s");
    json.erase("scenario");  // in a different folder each time
    return json;
  };
  const Json first = result("5");
  CHECK(first == result("5"));
  CHECK(first.at("conditions") != result("6").at("conditions"));
  CHECK(first.at("result") == "passed");
  CHECK(first.at("seed") == 5);
  CHECK(first.at("openings").size() == 1);
  CHECK(first.at("conditions").at(1).at("line") == 4);
  CHECK(first.at("conditions").at(1).at("held") == true);
}

TEST_CASE("in real time on a bus a script ends the run as well", "[integration][mmusim][bus]") {
  const std::vector<std::string> on_bus{"--bus", "unix:test-mmusim-" + std::to_string(::getpid())};
  const std::string asks = "0.1 vehicle on\nwait frame PDU_STATUS vehicle_on = 1 within 60\n";
  CHECK(run_script(asks + "pass", on_bus).status == 0);
  CHECK(run_script(asks, on_bus).status == 0);
  const Finished failed = run_script(asks + "fail \"enough\"", on_bus);
  CHECK(failed.status == 3);
  CHECK(failed.err.find("enough") != std::string::npos);
}

namespace {

/// A run that reports its first event as soon as it handles signals, ended by one of them.
Finished run_and_stop(const std::string& text, std::vector<std::string> arguments, int signal) {
  const TemporaryFolder folder;
  std::ofstream(folder / "my.scn") << text;
  int told[2] = {-1, -1};
  REQUIRE(::pipe2(told, O_CLOEXEC) == 0);
  const OwnedFd reader(told[0]);
  OwnedFd writer(told[1]);
  std::vector<std::string> command{program("mmusim"), "--pack", pack_file, "--scenario", folder / "my.scn"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  Process process(command, {.environment = {}, .out_file = folder / "out", .err_fd = writer.get()});
  writer = OwnedFd();
  Finished finished;
  std::array<char, 4096> part{};
  const auto read_on = [&] {
    const auto length = ::read(reader.get(), part.data(), part.size());
    if (length > 0) finished.err.append(part.data(), static_cast<std::size_t>(length));
    return length > 0;
  };
  while (finished.err.find("vehicle on") == std::string::npos) REQUIRE(read_on());
  process.signal(signal);
  while (read_on()) {
  }
  finished.status = process.wait(test::hang_max);
  finished.out = read_file(folder / "out");
  return finished;
}

}  // namespace

TEST_CASE("a signal ends a run in virtual time: it says so, and how far it came", "[integration][mmusim][bus]") {
  const std::string endless = "0.1 vehicle on\n";
  for (const auto& [signal, name] : {std::pair(SIGINT, "SIGINT"), std::pair(SIGTERM, "SIGTERM")}) {
    const Finished stopped = run_and_stop(endless, {"--virtual-time", "--seconds", "1000000"}, signal);
    CAPTURE(stopped.err);
    CHECK(stopped.status == 0);
    CHECK(stopped.err.find("mmusim: ended by " + std::string(name) + " after ") != std::string::npos);
    CHECK(stopped.out.find("times real time, seed 1\n") != std::string::npos);
  }
  const Finished json = run_and_stop(endless, {"--with-master", "--json", "--seconds", "1000000"}, SIGTERM);
  CHECK(Json::parse(json.out).at("ended_by_signal") == "SIGTERM");
  const Finished on_bus = run_and_stop(endless, {"--bus", "unix:test-mmusim-" + std::to_string(::getpid())}, SIGTERM);
  CHECK(on_bus.status == 0);
  CHECK(on_bus.err.find("mmusim: ended by SIGTERM after ") != std::string::npos);
}

TEST_CASE("a script that a signal cut short has not passed", "[integration][mmusim]") {
  const Finished stopped = run_and_stop("0.1 vehicle on\n999999 pass", {"--virtual-time"}, SIGTERM);
  CAPTURE(stopped.err);
  CHECK(stopped.status == 3);
  CHECK(stopped.err.find("ended by SIGTERM") != std::string::npos);
}

TEST_CASE("on a bus the master cannot be asked, and without a bus none can be named", "[integration][mmusim]") {
  const Finished refused = run_script("expect master phase = open", {"--virtual-time"});
  CHECK(refused.status == 65);
  CHECK(refused.err.find("my.scn:1:8: found 'master'") != std::string::npos);
  const Finished untold = run_script("1 master clear", {"--virtual-time"});
  CHECK(untold.status == 65);
  CHECK(untold.err.find("my.scn:1:3: found 'master', expected an event of the emulated pack") != std::string::npos);
  CHECK(run_script("1 pass", {"--with-master", "--bus", "unix:nobody"}).status == 2);
  CHECK(run_program({program("mmusim"), "--with-master", "--pack", pack_file}).status == 2);
}

}  // namespace bmu
