// Persistent state of the real daemon: killed and restarted it still has every fault, its latches, and the authority of
// each clear.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/shell/state/state_text.hpp"
#include "tests/support/ask_as.hpp"
#include "tests/support/busy_machine.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

using test::ask_as;
using test::Asker;
using test::Bench;
using test::is_open;
using test::milliseconds;

namespace {

struct StateBench : Bench {
  std::string state = folder / "state.json";

  void start(const std::vector<std::string>& environment = {}) {
    std::vector<std::string> command = daemon_command();
    if (environment.empty()) command.insert(command.end(), {"--state", state});
    daemon = std::make_unique<Process>(command, ProcessOptions{.environment = environment, .err_file = log});
    prefer(*daemon);
    REQUIRE(listener.next(test::hang_max));
  }
  void kill() {
    daemon->signal(SIGKILL);
    REQUIRE(daemon->wait(test::hang_max) == 128 + SIGKILL);
    static_cast<void>(listener.last());
  }
  [[nodiscard]] nlohmann::json fault(const std::string& name) const {
    const nlohmann::json reply = ask_json("faults");
    for (const nlohmann::json& one : reply.at("faults")) {
      if (one.at("name") == name) return one;
    }
    return nullptr;
  }
  [[nodiscard]] bool has_stage(const std::string& name, const std::string& stage) {
    return becomes([&] { return fault(name).at("stage") == stage; });
  }
  /// The fault is confirmed by `event`, and stays latched after `healing_event`.
  void latch(const std::string& name, const std::string& event, const std::string& healing_event) {
    send_event(event);
    REQUIRE(has_stage(name, "active"));
    send_event(healing_event);
    REQUIRE(has_stage(name, "latched"));
  }
  void discharge_deeply() { latch("cell_deep_discharge", "cell 2.7 voltage_mV 2000", "cell 2.7 voltage_mV auto"); }
  /// The log is written by its own thread, too.
  [[nodiscard]] bool has_logged(const std::string& text) {
    return becomes([&] { return read_file(log).find(text) != std::string::npos; });
  }
  /// Count of a fault in the state file.
  [[nodiscard]] int written_count(const std::string& name) const {
    const nlohmann::json written = nlohmann::json::parse(read_file(state), nullptr, false);
    return written.is_object() ? written.value(nlohmann::json::json_pointer("/content/faults/" + name + "/count"), 0)
                               : 0;
  }
  /// Waits until the store's thread has written the text.
  [[nodiscard]] bool has_written(const std::string& text) {
    return becomes([&] { return read_file(state).find(text) != std::string::npos; });
  }
};

}  // namespace

TEST_CASE("killed and started again, counts and a lock are still there, and it is told who cleared them",
          "[integration][daemon][state][bus]") {
  StateBench bench;
  bench.start_emulator("");
  bench.start();
  bench.discharge_deeply();
  const nlohmann::json before = bench.fault("cell_deep_discharge");
  CHECK(before.at("count") == 1);
  CHECK(before.at("is_locked") == true);
  CHECK(before.at("cleared").is_null());
  REQUIRE(bench.has_written("cell_deep_discharge"));
  bench.kill();

  bench.start();
  const nlohmann::json restored = bench.fault("cell_deep_discharge");
  CHECK(restored.at("is_present") == true);
  CHECK(restored.at("is_locked") == true);
  CHECK(restored.at("count") == 1);
  CHECK(restored.at("count_since_start") == 0);
  CHECK(restored.at("first_unix_time_ms") == before.at("first_unix_time_ms"));
  CHECK(restored.at("freeze_frame") == before.at("freeze_frame"));
  CHECK(restored.at("freeze_frame").at("cell_voltage_min_uV") < 2'100'000);
  CHECK(bench.fault("cell_undervoltage").at("count") == 1);
  // A clear without authority is not enough, after a restart either.
  CHECK(bench.ask_json("clear").at("still_present").dump().find("cell_deep_discharge") != std::string::npos);
  const nlohmann::json cleared = nlohmann::json::parse(bench.ask({"--json", "clear", "--authorised"}).out);
  CHECK(cleared.at("authority") == "service");
  CHECK(cleared.at("cleared").dump().find("cell_deep_discharge") != std::string::npos);
  CHECK(bench.has_logged("(authorised): cleared cell_deep_discharge"));
  REQUIRE(bench.has_written("\"authority\":\"service\""));
  bench.kill();

  bench.start();
  const nlohmann::json after = bench.fault("cell_deep_discharge");
  CHECK(after.at("is_present") == false);
  CHECK(after.at("is_locked") == false);
  CHECK(after.at("count") == 1);
  CHECK(after.at("cleared").at("user_id") == ::geteuid());
  CHECK(after.at("cleared").at("authority") == "service");
  CHECK(after.at("cleared").at("unix_time_ms") >= before.at("last_unix_time_ms"));
  const std::string page = bench.ask({"faults"}).out;
  INFO(page);
  CHECK(page.find(", authorised") != std::string::npos);
  CHECK(page.find("once, 20") != std::string::npos);
}

TEST_CASE("a module is given another node and its own again, who belongs where outlives the daemon",
          "[integration][daemon][state][MMU_N][BMS_F.2][bus]") {
  StateBench bench;
  bench.start_emulator("");
  bench.start();
  REQUIRE(bench.has_written(R"("modules":{"1":{"serial_number":1001})"));
  const auto module_2 = [&] { return bench.ask_json("modules").at("modules").at(1); };
  REQUIRE(bench.becomes([&] { return module_2().at("limits") == "set"; }));
  CHECK(module_2().at("place") == "expected");
  CHECK(module_2().at("answer_times").at("worst_us") > 0);

  CHECK(bench.ask({"modules", "assign", "1002", "1"}).err.find("node in use by another module") != std::string::npos);
  CHECK(bench.ask({"modules", "assign", "4711", "40"}).err.find("no module with this serial number") !=
        std::string::npos);
  CHECK(bench.ask({"modules", "assign", "1002", "64"}).status == 2);
  const auto already = bench.ask({"modules", "assign", "1002", "2"});
  CHECK(already.status == 0);
  CHECK(already.out == "Serial number 1002 already has node 2.\n");
  const auto moved = bench.ask({"modules", "assign", "1002", "40"});
  CHECK(moved.out == "Serial number 1002: node 40 assigned and confirmed, previously node 2.\n");
  CHECK(moved.status == 0);
  REQUIRE(bench.has_stage("module_lost", "active"));
  REQUIRE(bench.has_stage("unknown_module", "active"));
  CHECK(bench.ask({"modules"}).out.find("Unknown module at node 40: serial number 1002") != std::string::npos);
  bench.kill();

  bench.start();
  // The node has no expected module since its module was assigned elsewhere, and no module is present.
  REQUIRE(bench.becomes(
      [&] { return bench.ask({"modules"}).out.find("node 40: serial number 1002") != std::string::npos; }));
  REQUIRE(bench.becomes([&] { return bench.ask({"modules", "assign", "1002", "2"}).status == 0; }));
  CHECK(bench.has_logged("serial number 1002: node 2 assigned"));
  REQUIRE(bench.becomes([&] { return module_2().at("limits") == "set"; }));
  CHECK(module_2().at("place") == "expected");
  CHECK(bench.has_written(R"("2":{"serial_number":1002})"));
  CHECK(bench.ask({"modules", "accept"}).out == "Nothing to accept: all 4 modules are registered.\n");
}

TEST_CASE("only root and the daemon's own user give node numbers and accept modules",
          "[integration][daemon][MMU_N][BMS_F.2][bus]") {
  if (::geteuid() != 0) {
    WARN("skipped: only root can ask as somebody else");
    return;
  }
  StateBench bench;
  bench.start_emulator("");
  bench.start();
  REQUIRE(::chmod((bench.folder / "").c_str(), 0755) == 0);
  REQUIRE(::chmod(bench.socket.c_str(), 0666) == 0);
  for (const char* question :
       {R"({"cmd":"assign_module","serial_number":1002,"node":40})", R"({"cmd":"accept_modules"})"}) {
    const nlohmann::json refused = ask_as(Asker{}, bench.socket, question);
    CHECK(refused.at("error").at("code") == "not_allowed");
  }
  CHECK(bench.ask_json("modules").at("assignment").is_null());
}

TEST_CASE("what latched until it is cleared holds over a crash, refuses to close, and is cleared by command alone",
          "[integration][daemon][state][RL][bus][F59]") {
  StateBench bench;
  bench.start_emulator("");
  bench.start();
  const std::array names{"cell_overvoltage", "cell_undervoltage", "emergency_stop"};
  bench.latch("emergency_stop", "estop 1 pressed", "estop 1 released");
  bench.latch("cell_overvoltage", "cell 2.7 voltage_mV 4305", "cell 2.7 voltage_mV auto");
  bench.latch("cell_undervoltage", "cell 1.3 voltage_mV 2700", "cell 1.3 voltage_mV auto");
  REQUIRE(bench.has_written("cell_undervoltage"));
  REQUIRE(bench.has_written("cell_overvoltage"));
  bench.kill();

  bench.start();
  for (const char* name : names) {
    CAPTURE(name);
    const nlohmann::json restored = bench.fault(name);
    CHECK(restored.at("stage") == "latched");
    CHECK(restored.at("is_present") == true);
    CHECK(restored.at("is_locked") == true);
    CHECK(restored.at("is_restored") == true);
    CHECK(restored.at("confirmed_ago_ms").is_null());
    CHECK(restored.at("confirmed").at("age_ms").is_null());
    CHECK(restored.at("count") == 1);
  }
  bench.turn_key_on();
  REQUIRE(bench.becomes(
      [&] { return bench.ask_json("why").dump().find("last close request refused") != std::string::npos; }));
  const std::string why = bench.ask({"why"}).out;
  INFO(why);
  CHECK(why.find("cell 2.7 (no. 19): 4.30") != std::string::npos);
  CHECK(why.find("emergency stop 1 (PDU), confirmed in an earlier session") != std::string::npos);
  CHECK(why.find("0.0000 V") == std::string::npos);
  CHECK(is_open(bench.listener.last()));
  const nlohmann::json cleared = bench.ask_json("clear");
  for (const char* name : names) {
    CHECK(cleared.at("cleared").dump().find(name) != std::string::npos);
    const nlohmann::json after = bench.fault(name);
    CHECK(after.at("is_present") == false);
    CHECK(after.at("is_locked") == false);
    CHECK(after.at("cleared").at("user_id") == ::geteuid());
    CHECK(after.at("cleared").at("authority") == "user");
  }
}

namespace {

/// A pack with modules, sensors and PDU that are switched off before its daemon, and come up after it.
struct SwitchedPack : StateBench {
  /// False as soon as a latched fault waits for a clear: then nothing closes any more.
  [[nodiscard]] bool may_close() {
    nlohmann::json status;
    const auto has_lock = [&] {
      const nlohmann::json reply = ask_json("faults");
      return std::any_of(reply.at("faults").begin(), reply.at("faults").end(),
                         [](const nlohmann::json& one) { return one.at("stage") == "latched"; });
    };
    static_cast<void>(becomes([&] {
      status = ask_json("status");
      return status.at("permission").at("may_close") == true || has_lock();
    }));
    return status.at("permission").at("may_close") == true;
  }
  /// Returns once its PDU is received: the start-up time depends on the machine, and does not count as skipped time.
  void begin_emulator() {
    const auto ear = open_bus(bus, {.receive_ids = {internal_bus::pdu_status.base_id}});
    REQUIRE(ear);
    start_emulator("");
    pollfd heard{.fd = (*ear)->fd(), .events = POLLIN, .revents = 0};
    REQUIRE(::poll(&heard, 1, static_cast<int>(test::hang_max.count())) == 1);
  }
  void end() {
    daemon->signal(SIGTERM);
    REQUIRE(daemon->wait(test::hang_max) == 0);
    static_cast<void>(listener.last());
  }
  /// Ends it in order, so that it reports whether it was held up.
  void end_emulator() {
    emulator->signal(SIGTERM);
    REQUIRE(emulator->wait(test::hang_max) == 0);
    emulator.reset();
  }
  /// True if the pack may close before, and without a fault after it was switched off and on.
  [[nodiscard]] bool is_switched() {
    begin_emulator();
    start();
    if (!may_close()) return false;
    end_emulator();
    REQUIRE(has_stage("module_lost", "active"));
    REQUIRE(has_written("module_lost"));
    end();
    start();
    REQUIRE(has_stage("module_lost", "active"));
    REQUIRE(becomes([&] { return written_count("module_lost") >= 2; }));
    end();
    begin_emulator();
    start();
    return may_close() && test::faults_of_the_pack(*this).empty();
  }
};

}  // namespace

TEST_CASE("a healthy pack that is switched off and on again has no lock of it", "[integration][daemon][state][bus]") {
  bool is_switched = false;
  const auto bench = test::driven<SwitchedPack>([&](SwitchedPack& made) { return is_switched = made.is_switched(); });
  REQUIRE(is_switched);
  CHECK(test::faults_of_the_machine_pass(*bench));
  const int count = bench->fault("module_lost").at("count");
  CHECK((count == 2 || (count > 2 && bench->was_held_up())));
}

namespace {

/// Replaces one part of the text, which must be present.
std::string with(std::string text, const std::string& said, const std::string& instead) {
  const std::size_t at = text.find(said);
  REQUIRE(at != std::string::npos);
  return text.replace(at, said.size(), instead);
}

/// The demonstration's pack with cells that relax in a second, and are balanced by their charge; rests count after
/// `rest_ms` milliseconds.
std::string charge_pack(const StateBench& bench, int rest_ms) {
  const std::string config = test::in_source("config/");
  std::string cell = read_file(config + "cells/nmc-30ah-10p.json");
  cell = with(cell, "\"slow_rc_time_constant_s\": 600", "\"slow_rc_time_constant_s\": 1");
  cell = with(cell, "\"rc_time_constant_s\": 30", "\"rc_time_constant_s\": 0.2");
  std::ofstream(bench.folder / "cell.json") << cell;
  std::string pack = read_file(config + "packs/demo-48s.json");
  pack = with(pack, "../cells/nmc-30ah-10p.json", "cell.json");
  pack = with(pack, "\"rest_ms\": 1000", "\"rest_ms\": " + std::to_string(rest_ms));
  pack = with(pack, "\"method\": \"ocv\"", "\"method\": \"charge\"");
  std::string file = bench.folder / ("pack-" + std::to_string(rest_ms) + ".json");
  std::ofstream(file) << pack;
  return file;
}

}  // namespace

TEST_CASE("what is missing in each cell outlives a killed daemon, of another pack it is not believed, and the rest is",
          "[integration][daemon][state][BMS_F.4][bus]") {
  StateBench bench;
  bench.pack = charge_pack(bench, 1'000);
  bench.start_emulator("0 cell 2.7 soc_permille 830\n");
  bench.start();
  const auto book = [&bench] { return bench.ask_json("balance"); };
  const auto above_uAs = [](const nlohmann::json& balance) {
    const nlohmann::json& missing = balance.at("modules").at(1).at("missing_uAs");
    return missing.at(0).get<double>() - missing.at(6).get<double>();
  };
  REQUIRE(bench.becomes([&] { return book().at("cells_with_known_charge") == 48; }));
  REQUIRE(bench.has_written("\"cell_charges\":{\"unix_time_ms\""));
  const double learned_uAs = above_uAs(book());
  CHECK(learned_uAs == Approx(0.030 * 30.0 * 3'600e6).epsilon(0.2));
  bench.kill();

  // The next session has no rest that counts: its charges are the restored ones.
  bench.pack = charge_pack(bench, 600'000);
  bench.start();
  REQUIRE(bench.becomes([&] { return book().at("former_charges") == "in use"; }));
  CHECK(bench.has_logged("restored cell charges: in use"));
  CHECK(book().at("cells_with_known_charge") == 48);
  CHECK(above_uAs(book()) == Approx(learned_uAs).epsilon(0.1));
  bench.kill();

  const auto kept = parse_state(read_file(bench.state));
  REQUIRE(kept);
  CHECK(kept->charges_problem.empty());
  PersistentState other = kept->state;
  other.cell_charges.capacity_uAs *= 2;
  std::ofstream(bench.state) << state_text(other);
  bench.start();
  CHECK(bench.has_logged("restored cell charges: from another pack or other modules, discarded"));
  const nlohmann::json status = bench.ask_json("status");
  CHECK(status.at("store").at("found_at_start") == "newest");
  CHECK(book().at("cells_with_known_charge") == 0);
  CHECK(bench.becomes(
      [&] { return bench.ask_json("modules").at("modules").at(1).at("place") == "expected"; }));  // others were read
}

TEST_CASE("a state that cannot be read keeps the pack open until somebody with authority has cleared it",
          "[integration][daemon][state][bus]") {
  StateBench bench;
  std::ofstream(bench.state) << "{\"format\":1,";
  bench.start_emulator("");
  bench.start();
  CHECK(bench.has_logged("state file: unreadable"));
  REQUIRE(bench.becomes([&] {
    return bench.ask_json("status").at("faults_present").dump().find("store_unreadable") != std::string::npos;
  }));
  const nlohmann::json status = bench.ask_json("status");
  CHECK(status.at("store").at("found_at_start") == "unreadable");
  CHECK(status.at("permission").at("may_close") == false);
  REQUIRE(bench.becomes([&] {
    static_cast<void>(bench.ask({"clear", "--authorised"}));
    return bench.ask_json("status").at("faults_present").dump().find("store_unreadable") == std::string::npos;
  }));
  REQUIRE(bench.has_written("\"format\":1,\"checksum\""));
  bench.kill();
  bench.start();
  CHECK(bench.ask_json("status").at("store").at("found_at_start") == "newest");
}

TEST_CASE("the service manager's folder is where the state goes, and without any it is told once",
          "[integration][daemon][state][bus]") {
  StateBench bench;
  const std::string folder = bench.folder / "kept";
  std::filesystem::create_directory(folder);
  bench.start({"STATE_DIRECTORY=" + folder + ":" + (bench.folder / "other")});
  CHECK(bench.ask_json("status").at("store").at("path") == folder + "/state.json");
  bench.kill();
  bench.start({"STATE_DIRECTORY="});
  CHECK(bench.ask_json("status").at("store").is_null());
  CHECK(bench.has_logged("state file: none (--state)"));
  const std::string log = read_file(bench.log);
  CHECK(log.find("state file: none (--state)") == log.rfind("state file: none (--state)"));
  bench.kill();
  std::vector<std::string> command = bench.daemon_command();
  command.insert(command.end(), {"--state", bench.folder / "slip/state.json"});
  const Finished refused = run_program(command);
  CHECK(refused.status == 71);
  CHECK(refused.err.find("directory " + (bench.folder / "slip") + " does not exist") != std::string::npos);
}

TEST_CASE("without a group for it control is root's and the daemon's own user's, nobody else's",
          "[integration][daemon][state][bus]") {
  if (::geteuid() != 0) {
    WARN("skipped: only root can ask as somebody else");
    return;
  }
  StateBench bench;
  bench.start_emulator("");
  bench.start();
  bench.discharge_deeply();
  // Access to the folder and to the socket, as a group of the daemon would have.
  REQUIRE(::chmod((bench.folder / "").c_str(), 0755) == 0);
  REQUIRE(::chmod(bench.socket.c_str(), 0666) == 0);
  const auto refused = ask_as(Asker{}, bench.socket, R"({"cmd":"clear","authorised":true})");
  CHECK(refused.at("ok") == false);
  CHECK(refused.at("error").at("code") == "not_allowed");
  const auto message = refused.at("error").at("message").get<std::string>();
  CHECK(message.find("65534") != std::string::npos);
  CHECK(message.find("permitted: root") != std::string::npos);
  CHECK(bench.fault("cell_deep_discharge").at("is_locked") == true);
  for (const char* question : {R"({"cmd":"clear"})", R"({"cmd":"wake"})", R"({"cmd":"balance","switch":"off"})"}) {
    INFO(question);
    CHECK(ask_as(Asker{}, bench.socket, question).at("error").at("code") == "not_allowed");
  }
  CHECK(bench.has_logged("nobody (user 65534, process "));
  CHECK(bench.fault("cell_undervoltage").at("cleared").is_null());
  CHECK(bench.ask_json("balance").at("ok") == true);
  CHECK(ask_as(std::nullopt, bench.socket, R"({"cmd":"clear"})").at("authority") == "user");
  CHECK(bench.has_logged("clear by root (user 0, process "));
  CHECK(bench.fault("cell_deep_discharge").at("is_locked") == true);
}

TEST_CASE("a request with a key nobody knows, or one of the wrong kind, is refused and names it",
          "[integration][daemon][status][bus]") {
  StateBench bench;
  bench.start();
  const auto error = [&](const std::string& question) {
    return ask_as(std::nullopt, bench.socket, question).at("error");
  };
  CHECK(error(R"({"cmd":"status","verbose":true})").at("code") == "unknown_key");
  CHECK(error(R"({"cmd":"status","verbose":true})").at("message").get<std::string>().starts_with("\"verbose\": "));
  CHECK(error(R"({"cmd":"clear","authorized":true})").at("code") == "unknown_key");
  CHECK(error(R"({"cmd":"clear","authorised":"yes"})").at("code") == "bad_argument");
  CHECK(error(R"({"cmd":"balance","switch":"maybe"})").at("code") == "bad_argument");
}

TEST_CASE("a request that is none, or asks for what cannot be, is told what was found and what was wanted",
          "[integration][daemon][status][bus]") {
  StateBench bench;
  bench.start();
  const auto message = [&](const std::string& question) {
    return ask_as(std::nullopt, bench.socket, question).at("error").at("message").get<std::string>();
  };
  CHECK(message("hello") == R"(found "hello", which is not JSON; expected a line like {"cmd":"status"})");
  CHECK(message("\xff\x01") == R"(found "\ufffd\u0001", which is not JSON; expected a line like {"cmd":"status"})");
  CHECK(message(std::string(3000, 'x')).starts_with("found \"" + std::string(39, 'x') + "..., which is not JSON"));
  CHECK(message("7").starts_with("found 7, expected an object with a string \"cmd\", one of status, cells"));
  CHECK(message(R"({"cmd":7})").starts_with(R"(found {"cmd":7}, expected an object with a string "cmd")"));
  CHECK(message(R"({"cmd":"clear","authorised":"yes"})") == R"("authorised": found "yes", expected true or false)");
  CHECK(message(R"({"cmd":"balance","switch":"maybe"})") == R"("switch": found "maybe", expected "on" or "off")");
  const std::string long_name(3000, 'x');
  CHECK(message(R"({"cmd":")" + long_name + "\"}").size() < 300);
  CHECK(message(R"({"cmd":"status",")" + long_name + R"(":1,"a":1})").size() < 300);
  CHECK(message(R"({"cmd":"watch","period_ms":10})") ==
        R"("period_ms": found 10, expected an integer from 50 to 60000)");
  CHECK(message(R"({"cmd":"accept_modules","node":64})") ==
        R"("node": found 64, expected an integer from 1 to 63, or no "node" for all modules)");
  CHECK(message(R"({"cmd":"accept_modules","node":63})") == R"("node": found 63, expected a node of the pack file)");
  CHECK(message(R"({"cmd":"assign_module","node":1})") ==
        R"("serial_number": found nothing, expected an integer from 0 to 4294967295)");
  CHECK(message(R"({"cmd":"assign_module","serial_number":1,"node":"one"})") ==
        R"("node": found "one", expected an integer from 1 to 63)");
  CHECK(message(R"({"cmd":"assign_module","serial_number":1,"node":1,"unheard":1})") ==
        R"("unheard": found 1, expected true or false)");
}

}  // namespace bmu
