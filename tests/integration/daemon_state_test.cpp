// What outlives the real daemon: killed and started again it still knows every fault, its locks, and who cleared what.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <grp.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/support/daemon_bench.hpp"

namespace bmu {

using test::Bench;
using test::is_open;
using test::milliseconds;

namespace {

constexpr const char* deep_discharge = "1 cell 2.7 voltage_mV 2000\n3 cell 2.7 voltage_mV auto\n";

struct StateBench : Bench {
  std::string state = folder / "state.json";

  void start(const std::vector<std::string>& environment = {}) {
    std::vector<std::string> command = daemon_command();
    if (environment.empty()) command.insert(command.end(), {"--state", state});
    daemon = std::make_unique<Process>(command, ProcessOptions{.environment = environment, .err_file = log});
    REQUIRE(listener.next(milliseconds(5000)));
  }
  void kill() {
    daemon->signal(SIGKILL);
    REQUIRE(daemon->wait(milliseconds(2000)) == 128 + SIGKILL);
    static_cast<void>(listener.last());
  }
  [[nodiscard]] nlohmann::json fault(const std::string& name) const {
    const nlohmann::json reply = ask_json("faults");
    for (const nlohmann::json& one : reply.at("faults")) {
      if (one.at("name") == name) return one;
    }
    return nullptr;
  }
  /// Looked at with each contactor command, every 50 ms.
  [[nodiscard]] bool becomes(const std::function<bool()>& is_so) {
    for (int i = 0; i < 200; ++i) {
      if (is_so()) return true;
      REQUIRE(listener.next(milliseconds(5000)));
    }
    return false;
  }
  [[nodiscard]] bool has_stage(const std::string& name, const std::string& stage) {
    return becomes([&] { return fault(name).at("stage") == stage; });
  }
  /// The log has a thread of its own, too.
  [[nodiscard]] bool has_logged(const std::string& text) {
    return becomes([&] { return read_file(log).find(text) != std::string::npos; });
  }
  /// The store's thread has written what the daemon knows.
  [[nodiscard]] bool has_written(const std::string& text) {
    return becomes([&] { return read_file(state).find(text) != std::string::npos; });
  }
};

constexpr unsigned nobody = 65'534;

/// One question to the status socket, by a process of its own that gives up what it is, if it is to be somebody else.
nlohmann::json ask_as(std::optional<unsigned> user, const std::string& socket_path, const std::string& question) {
  std::array<int, 2> ends{};
  REQUIRE(::pipe2(ends.data(), O_CLOEXEC) == 0);
  const OwnedFd read_end(ends[0]);
  OwnedFd write_end(ends[1]);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    socket_path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    if (user && (::setgroups(0, nullptr) != 0 || ::setgid(*user) != 0 || ::setuid(*user) != 0)) ::_exit(1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) ::_exit(2);
    const std::string line = question + "\n";
    if (::send(fd, line.data(), line.size(), MSG_NOSIGNAL) < 0) ::_exit(3);
    std::array<char, 65536> buffer{};
    const ssize_t count = ::recv(fd, buffer.data(), buffer.size(), 0);
    ::_exit(count > 0 && ::write(ends[1], buffer.data(), static_cast<std::size_t>(count)) == count ? 0 : 4);
  }
  write_end = OwnedFd();
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  REQUIRE(WEXITSTATUS(status) == 0);
  std::array<char, 65536> buffer{};
  const ssize_t count = ::read(read_end.get(), buffer.data(), buffer.size());
  return nlohmann::json::parse(std::string(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))));
}

}  // namespace

TEST_CASE("killed and started again, counts and a lock are still there, and it is told who cleared them",
          "[integration][daemon][state]") {
  StateBench bench;
  bench.start_emulator(deep_discharge);
  bench.start();
  REQUIRE(bench.has_stage("cell_deep_discharge", "latched"));
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
  // A clear of anybody is not enough, after a restart either.
  CHECK(bench.ask_json("clear").at("still_present").dump().find("cell_deep_discharge") != std::string::npos);
  const nlohmann::json cleared = nlohmann::json::parse(bench.ask({"--json", "clear", "--authorised"}).out);
  CHECK(cleared.at("authority") == "service");
  CHECK(cleared.at("cleared").dump().find("cell_deep_discharge") != std::string::npos);
  CHECK(bench.has_logged("with authority: cell_deep_discharge cleared"));
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
  CHECK(page.find("with authority") != std::string::npos);
  CHECK(page.find("once, 20") != std::string::npos);
}

TEST_CASE("what latched until it is cleared holds over a crash, refuses to close, and is cleared by command alone",
          "[integration][daemon][state][RL]") {
  StateBench bench;
  bench.start_emulator(
      "1 estop 1 pressed\n2 estop 1 released\n"
      "1 cell 2.7 voltage_mV 4305\n3 cell 2.7 voltage_mV auto\n"
      "1 cell 1.3 voltage_mV 2700\n3 cell 1.3 voltage_mV auto\n"
      "10 vehicle on\n");
  bench.start();
  const std::array names{"cell_overvoltage", "cell_undervoltage", "emergency_stop"};
  for (const char* name : names) REQUIRE(bench.has_stage(name, "latched"));
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
  REQUIRE(bench.becomes(
      [&] { return bench.ask_json("why").dump().find("the last request to close") != std::string::npos; }));
  const std::string why = bench.ask({"why"}).out;
  INFO(why);
  CHECK(why.find("cell 2.7 (no. 19): 4.30") != std::string::npos);
  CHECK(why.find("emergency stop 1 of the unit, from before the daemon started") != std::string::npos);
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

TEST_CASE("a healthy pack that is switched off and on again has no lock of it", "[integration][daemon][state]") {
  StateBench bench;
  bench.start_emulator("");
  bench.start();
  REQUIRE(bench.becomes([&] { return bench.ask_json("status").at("permission").at("may_close") == true; }));
  bench.emulator.reset();  // modules, sensors and unit fall silent first
  REQUIRE(bench.has_stage("module_lost", "active"));
  REQUIRE(bench.has_written("module_lost"));
  bench.daemon->signal(SIGTERM);
  REQUIRE(bench.daemon->wait(milliseconds(5000)) == 0);
  static_cast<void>(bench.listener.last());

  bench.start();  // and come up last
  REQUIRE(bench.has_stage("module_lost", "active"));
  bench.daemon->signal(SIGTERM);
  REQUIRE(bench.daemon->wait(milliseconds(5000)) == 0);
  static_cast<void>(bench.listener.last());
  bench.start_emulator("");
  bench.start();
  REQUIRE(bench.becomes([&] { return bench.ask_json("status").at("permission").at("may_close") == true; }));
  CHECK(bench.ask_json("status").at("faults_present").empty());
  CHECK(bench.fault("module_lost").at("count") == 2);
}

TEST_CASE("a state that cannot be read keeps the pack open until somebody with authority has cleared it",
          "[integration][daemon][state]") {
  StateBench bench;
  std::ofstream(bench.state) << "{\"format\":1,";
  bench.start_emulator("");
  bench.start();
  CHECK(bench.has_logged("the state cannot be read"));
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
          "[integration][daemon][state]") {
  StateBench bench;
  const std::string folder = bench.folder / "kept";
  std::filesystem::create_directory(folder);
  bench.start({"STATE_DIRECTORY=" + folder + ":" + (bench.folder / "other")});
  CHECK(bench.ask_json("status").at("store").at("path") == folder + "/state.json");
  bench.kill();
  bench.start({"STATE_DIRECTORY="});
  CHECK(bench.ask_json("status").at("store").is_null());
  CHECK(bench.has_logged("no state file (--state)"));
  const std::string log = read_file(bench.log);
  CHECK(log.find("no state file (--state)") == log.rfind("no state file (--state)"));
  bench.kill();
  std::vector<std::string> command = bench.daemon_command();
  command.insert(command.end(), {"--state", bench.folder / "slip/state.json"});
  const Finished refused = run_program(command);
  CHECK(refused.status == 71);
  CHECK(refused.err.find("wanted the existing directory " + (bench.folder / "slip")) != std::string::npos);
}

TEST_CASE("authority is root's and the daemon's own user's, nobody else's", "[integration][daemon][state]") {
  if (::geteuid() != 0) {
    WARN("only root can ask as somebody else");
    return;
  }
  StateBench bench;
  bench.start_emulator(deep_discharge);
  bench.start();
  REQUIRE(bench.has_stage("cell_deep_discharge", "latched"));
  // Into the folder and to the socket: what a group of the daemon's would have.
  REQUIRE(::chmod((bench.folder / "").c_str(), 0755) == 0);
  REQUIRE(::chmod(bench.socket.c_str(), 0666) == 0);
  const auto refused = ask_as(nobody, bench.socket, R"({"cmd":"clear","authorised":true})");
  CHECK(refused.at("ok") == false);
  CHECK(refused.at("error").at("code") == "not_allowed");
  const auto message = refused.at("error").at("message").get<std::string>();
  CHECK(message.find("65534") != std::string::npos);
  CHECK(message.find("root may") != std::string::npos);
  CHECK(bench.fault("cell_deep_discharge").at("is_locked") == true);
  const auto plain = ask_as(nobody, bench.socket, R"({"cmd":"clear"})");
  CHECK(plain.at("ok") == true);
  CHECK(plain.at("authority") == "user");
  CHECK(bench.fault("cell_undervoltage").at("cleared").at("user_id") == 65'534);
  CHECK(bench.fault("cell_deep_discharge").at("is_locked") == true);
  CHECK(ask_as(nobody, bench.socket, R"({"cmd":"wake"})").at("ok") == true);
}

TEST_CASE("a request with a key nobody knows, or one of the wrong kind, is refused and names it",
          "[integration][daemon][status]") {
  StateBench bench;
  bench.start();
  const auto error = [&](const std::string& question) {
    return ask_as(std::nullopt, bench.socket, question).at("error");
  };
  CHECK(error(R"({"cmd":"status","verbose":true})").at("code") == "unknown_key");
  CHECK(error(R"({"cmd":"status","verbose":true})").at("message").get<std::string>().starts_with("\"verbose\": "));
  CHECK(error(R"({"cmd":"clear","authorized":true})").at("code") == "unknown_key");
  CHECK(error(R"({"cmd":"clear","authorised":"yes"})").at("code") == "bad_argument");
}

}  // namespace bmu
