// The real daemon loads another pack file while it runs, or reports why it does not; by bmuctl and by SIGHUP.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <pty.h>
#include <sched.h>
#include <sys/resource.h>

#include "tests/support/ask_as.hpp"
#include "tests/support/busy_machine.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/sanitized.hpp"
#include "tools/bmuctl/client.hpp"

namespace bmu {

using test::ask_as;
using test::Bench;
using test::is_closed;
using test::is_open;
using test::NotifySocket;

namespace {

using std::chrono::milliseconds;

constexpr const char* reload_request = R"({"cmd":"reload"})";

/// With its own pack file, which a test may change.
struct ReloadBench : Bench {
  std::string text;

  ReloadBench() {
    std::ifstream stream(test::pack_file);
    text.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    text.replace(text.find("\"../cells/"), 10, "\"" + test::in_source("config/cells/"));
    pack = folder / "pack.json";
    put(text);
    more_options = {"--state", folder / "state.json"};
  }
  void put(const std::string& content) const { std::ofstream(pack) << content; }
  /// Writes the original file with one change.
  void put_with(const std::string& what, const std::string& with) const {
    std::string content = text;
    const auto at = content.find(what);
    REQUIRE(at != std::string::npos);
    put(content.replace(at, what.size(), with));
  }
  void put_with_period(int period_ms) const {
    put_with("\"period_ms\": 100", "\"period_ms\": " + std::to_string(period_ms));
  }
  void start(const ProcessOptions& options = {}) {
    start_daemon(options);
    REQUIRE(listener.next(test::hang_max));
  }
  [[nodiscard]] nlohmann::json reload() const { return ask_as(std::nullopt, socket, reload_request); }
  [[nodiscard]] std::string hash() const { return ask_json("status").at("pack").at("config_hash"); }
  [[nodiscard]] std::int64_t reloads() const { return ask_json("status").at("daemon").at("reloads"); }
  [[nodiscard]] bool has_logged(const std::string& part) {
    return becomes([&] { return read_file(log).find(part) != std::string::npos; });
  }
  [[nodiscard]] int end() {
    daemon->signal(SIGTERM);
    return daemon->wait(test::hang_max);
  }
};

/// The lowest unused descriptor of the process.
rlim_t first_free(const Process& process) {
  rlim_t number = 0;
  while (std::filesystem::is_symlink("/proc/" + std::to_string(process.pid()) + "/fd/" + std::to_string(number))) {
    ++number;
  }
  return number;
}

/// Number of entries of a folder of /proc: descriptors, threads.
std::size_t count_in(const Process& process, const std::string& name) {
  const std::filesystem::directory_iterator entries("/proc/" + std::to_string(process.pid()) + "/" + name);
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

std::int64_t resident_kB(const Process& process) {
  std::ifstream stream("/proc/" + std::to_string(process.pid()) + "/status");
  for (std::string word; stream >> word;) {
    std::int64_t value = 0;
    if (word == "VmRSS:" && stream >> value) return value;
  }
  return 0;
}

}  // namespace

TEST_CASE("a reload takes up the file whole, says what has changed, and keeps what the pack remembered",
          "[integration][daemon][reload][bus][F80]") {
  ReloadBench bench;
  bench.start_emulator("");
  bench.start();
  const auto overvoltage = [&] {
    const nlohmann::json reply = bench.ask_json("faults");
    for (const nlohmann::json& fault : reply.at("faults")) {
      if (fault.at("name") == "cell_overvoltage") return fault;
    }
    return nlohmann::json::object();
  };
  bench.send_event("cell 2.7 voltage_mV 4305");
  REQUIRE(bench.becomes([&] { return overvoltage().value("stage", "") == "active"; }));
  bench.send_event("cell 2.7 voltage_mV auto");
  REQUIRE(bench.becomes([&] { return overvoltage().value("stage", "") == "latched"; }));
  const std::string before = bench.hash();
  const pid_t pid = bench.daemon->pid();
  bench.put_with_period(80);
  const nlohmann::json done = bench.reload();
  INFO(done.dump());
  REQUIRE(done.at("ok") == true);
  CHECK(done.at("is_new_life") == true);
  CHECK(done.at("config_hash_before") == before);
  CHECK(done.at("config_hash") == bench.hash());
  CHECK(done.at("config_hash") != before);
  REQUIRE(done.at("changes").size() == 1);
  CHECK(done.at("changes").at(0).at("path") == "/poll/period_ms");
  CHECK(done.at("changes").at(0).at("before") == "100");
  CHECK(done.at("changes").at(0).at("now") == "80");
  CHECK(bench.daemon->pid() == pid);
  CHECK(bench.reloads() == 1);
  // Latched over the reload as over a restart.
  const nlohmann::json fault = overvoltage();
  CHECK(fault.at("stage") == "latched");
  CHECK(fault.at("is_restored") == true);
  CHECK(fault.at("count") == 1);
  CHECK(bench.has_logged("changed: " + bench.pack + ": /poll/period_ms: 100 -> 80"));
  CHECK(bench.has_logged("reload by root (user 0, process "));

  const Finished again = bench.ask({"reload"});
  CHECK(again.status == 0);
  CHECK(again.out.find(" unchanged.") != std::string::npos);
  bench.put(bench.text);
  const Finished back = bench.ask({"reload"});
  CHECK(back.status == 0);
  CHECK(back.out.find("/poll/period_ms: 80 -> 100\n") != std::string::npos);
  CHECK(bench.hash() == before);
  CHECK(bench.end() == 0);
}

TEST_CASE("a reload with the same bus goes on commanding at once, after a short silence",
          "[integration][daemon][reload][bus][F39]") {
  ReloadBench bench;
  bench.start();
  REQUIRE(bench.listener.hears_commands(5));
  // After a longer pause the next session listens first.
  constexpr std::int64_t kept_max_ms = 100;
  constexpr int reloads_max = 20;
  bool is_quick = false;
  for (int reload = 0; reload < reloads_max && !is_quick; ++reload) {
    bench.put_with_period(80 + reload);
    const nlohmann::json done = bench.reload();
    REQUIRE(done.at("is_new_life") == true);
    // The reply is sent before the next session's loop starts.
    is_quick = done.at("away_ms") <= kept_max_ms / 2;
    const nlohmann::json status = ask_as(std::nullopt, bench.socket, R"({"cmd":"status"})");
    if (is_quick) CHECK(status.at("state").at("claim") == "held");
    REQUIRE(bench.listener.hears_commands(2));
  }
  CHECK(is_quick);
  CHECK(bench.end() == 0);
}

TEST_CASE("the state is kept over a reload also where nobody keeps it over a restart",
          "[integration][daemon][reload][bus]") {
  ReloadBench bench;
  bench.more_options.clear();
  bench.start_emulator("0 estop 1 pressed\n");
  bench.start();
  const auto has_stop = [&] {
    return bench.ask_json("status").at("faults_present").dump().find("emergency_stop") != std::string::npos;
  };
  REQUIRE(bench.becomes(has_stop));
  bench.send_event("estop 1 released");
  bench.put_with_period(80);
  REQUIRE(bench.becomes([&] { return bench.reload().at("ok") == true; }));
  CHECK(bench.reloads() == 1);
  CHECK(has_stop());
}

TEST_CASE("while the pack is closed a reload is refused with the reason, and nothing changes",
          "[integration][daemon][reload][bus][F80]") {
  Finished refused;
  bool is_as_wanted = false;
  const auto bench = test::driven<ReloadBench>([&](ReloadBench& made) {
    made.start_emulator("");
    made.start();
    REQUIRE(made.closes());
    const std::string before = made.hash();
    made.put_with_period(80);
    refused = made.ask({"reload"});
    made.daemon->signal(SIGHUP);
    const auto has_logged = [&](const std::string& part) {
      return made.becomes_unless_open([&] { return read_file(made.log).find(part) != std::string::npos; });
    };
    return has_logged("with SIGHUP refused: contactors not open") &&
           has_logged("refused: \"reload\" by root (user 0, process ") && made.hash() == before &&
           made.reloads() == 0 && is_closed(made.listener.last()) && (is_as_wanted = true);
  });
  CHECK(is_as_wanted);
  CHECK(refused.status == 1);
  CHECK(refused.err == "bmuctl: refused: contactors not open\n");
  CHECK(bench->end() == 0);
}

TEST_CASE("a file that is invalid is refused with all its problems, and the life goes on",
          "[integration][daemon][reload][bus][F80]") {
  ReloadBench bench;
  bench.start_emulator("");
  bench.start();
  const std::string before = bench.hash();
  bench.put_with("\"period_ms\": 100", "\"period_ms\": 1, \"temprature_every\": 3");
  const nlohmann::json refused = bench.reload();
  INFO(refused.dump());
  CHECK(refused.at("error").at("code") == "refused");
  CHECK(refused.at("error").at("problems").size() >= 2);
  const std::string problems = refused.at("error").at("problems").dump();
  CHECK(problems.find("/poll/period_ms") != std::string::npos);
  CHECK(problems.find("/poll/temprature_every") != std::string::npos);
  const Finished told = bench.ask({"reload"});
  CHECK(told.status == 1);
  CHECK(told.err.find("/poll/temprature_every") != std::string::npos);
  CHECK(bench.has_logged("/poll/temprature_every"));
  std::filesystem::remove(bench.pack);
  CHECK(bench.reload().at("error").at("problems").size() == 1);
  CHECK(bench.hash() == before);
  CHECK(bench.reloads() == 0);
  bench.put_with_period(80);
  CHECK(bench.reload().at("ok") == true);
  CHECK(bench.end() == 0);
}

TEST_CASE("a pack whose bus cannot be opened is refused before anything that runs is touched",
          "[integration][daemon][reload][bus]") {
  ReloadBench bench;
  bench.start_emulator("");
  bench.start();
  const std::string before = bench.hash();
  // A bus between programs is a file here; a folder of that name prevents it.
  const std::string name = "test-no-bus-" + std::to_string(::getpid());
  const std::string in_its_place = "/dev/shm/bmud-bus." + name;
  REQUIRE(std::filesystem::create_directory(in_its_place));
  const auto vehicle = bench.text.find("\"vehicle\": \"");
  REQUIRE(vehicle != std::string::npos);
  bench.put_with(bench.text.substr(vehicle, bench.text.find('"', vehicle + 12) - vehicle),
                 "\"vehicle\": \"unix:" + name);
  const nlohmann::json refused = bench.reload();
  std::filesystem::remove(in_its_place);
  INFO(refused.dump());
  const auto message = refused.at("error").at("message").get<std::string>();
  CHECK(message.find(name) != std::string::npos);
  CHECK(message.find("running configuration unchanged") != std::string::npos);
  CHECK(bench.hash() == before);
  CHECK(bench.reloads() == 0);
  CHECK(bench.end() == 0);
}

TEST_CASE("where a medium for recordings has gone the life that records goes on, and no other begins",
          "[integration][daemon][reload][bus]") {
  for (const std::string option : {"--record", "--black-box"}) {
    ReloadBench bench;
    const std::filesystem::path medium = bench.folder / "medium";
    bench.more_options = {option, medium};
    bench.start_emulator("");
    bench.start();
    REQUIRE(bench.becomes([&] { return std::filesystem::is_directory(medium); }));
    const std::string before = bench.hash();
    bench.put_with_period(80);
    std::filesystem::rename(medium, bench.folder / "pulled-out");
    std::ofstream(medium) << "in its place";
    const nlohmann::json refused = bench.reload();
    INFO(refused.dump());
    const auto message = refused.at("error").at("message").get<std::string>();
    CHECK(message.find(medium) != std::string::npos);
    CHECK(message.find("running configuration unchanged") != std::string::npos);
    CHECK(bench.hash() == before);
    std::filesystem::remove(medium);
    CHECK(bench.reload().at("ok") == true);
    CHECK(std::filesystem::is_directory(medium));
    CHECK(bench.end() == 0);
  }
}

TEST_CASE("a life that cannot begin gives way to one with the configuration of before",
          "[integration][daemon][reload][bus]") {
  if (test::is_sanitized) {
    WARN("skipped: a sanitizer needs descriptors to look at objects");
    return;
  }
  ReloadBench bench;
  // Threads that write files would take descriptors at times.
  bench.more_options = {"--history", "none"};
  bench.start_emulator("");
  bench.start();
  const std::string before = bench.hash();
  // Lines and console need a descriptor each. The daemon gets one more than it has: the one for reading the file.
  bench.put_with("\"poll\"", R"("gpio": {"chip": "/dev/gpiochip99", "outputs": {"fan": {"line": 6}}},
                                 "serial": {"device": "/dev/bmud-test-no-such-terminal"}, "poll")");
  auto client = Client::connect(bench.socket);
  REQUIRE(client);
  REQUIRE(client->send_line(R"({"cmd":"version"})"));
  REQUIRE(client->read_line(test::hang_max));  // now the connection has its descriptor
  rlimit all{};
  REQUIRE(::prlimit(bench.daemon->pid(), RLIMIT_NOFILE, nullptr, &all) == 0);
  const rlimit one_more{.rlim_cur = first_free(*bench.daemon) + 1, .rlim_max = all.rlim_max};
  REQUIRE(::prlimit(bench.daemon->pid(), RLIMIT_NOFILE, &one_more, nullptr) == 0);
  REQUIRE(client->send_line(reload_request));
  const auto answer = client->read_line(test::hang_max);
  REQUIRE(::prlimit(bench.daemon->pid(), RLIMIT_NOFILE, &all, nullptr) == 0);
  REQUIRE(answer);
  INFO(*answer << read_file(bench.log));
  CHECK(answer->find("previous configuration restored") != std::string::npos);
  CHECK(bench.hash() == before);
  CHECK(bench.reloads() == 0);
  CHECK(bench.becomes([&] { return bench.ask_json("status").at("modules_answering") == 4; }));
  // With enough descriptors it succeeds.
  CHECK(bench.reload().at("ok") == true);
  CHECK(bench.reloads() == 1);
  CHECK(bench.end() == 0);
}

TEST_CASE("SIGHUP that somebody sends is a reload", "[integration][daemon][reload][bus]") {
  ReloadBench bench;
  bench.start_emulator("");
  bench.start();
  const std::string before = bench.hash();
  bench.put_with_period(80);
  bench.daemon->signal(SIGHUP);
  CHECK(bench.becomes([&] { return bench.hash() != before; }));
  CHECK(bench.has_logged("with SIGHUP: configuration "));
  bench.put("{");
  bench.daemon->signal(SIGHUP);
  CHECK(bench.has_logged("with SIGHUP refused: " + bench.pack + " is invalid"));
  CHECK(bench.end() == 0);
}

TEST_CASE("a terminal that hangs up ends the daemon as ever", "[integration][daemon][reload][bus][pty]") {
  ReloadBench bench;
  std::vector<std::string> words = bench.daemon_command();
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  REQUIRE(child >= 0);
  if (child == 0) {
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  REQUIRE(bench.listener.next(test::hang_max));
  ::close(terminal);
  int status = -1;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}

TEST_CASE("clients stay connected over a reload, those who watch and those who ask",
          "[integration][daemon][reload][bus]") {
  ReloadBench bench;
  bench.start_emulator("");
  bench.start();
  const std::string before = bench.hash();
  auto watching = Client::connect(bench.socket);
  auto asking = Client::connect(bench.socket);
  REQUIRE(watching);
  REQUIRE(asking);
  // Unread updates are queued, and a client with a megabyte in its queue is dropped: this period produces few of them,
  // however long a reload takes.
  REQUIRE(watching->send_line(R"({"cmd":"watch","period_ms":1000})"));
  REQUIRE(watching->read_line(test::hang_max));
  bench.put_with_period(80);
  // A request sent after a reload is answered after it.
  REQUIRE(asking->send_line(std::string(reload_request) + "\n" + R"({"cmd":"status"})"));
  const auto done = asking->read_line(test::hang_max);
  REQUIRE(done);
  CHECK(nlohmann::json::parse(*done).at("cmd") == "reload");
  const auto status = asking->read_line(test::hang_max);
  REQUIRE(status);
  CHECK(nlohmann::json::parse(*status).at("pack").at("config_hash") != before);
  bool has_seen_new = false;
  const auto give_up_at = std::chrono::steady_clock::now() + test::hang_max;
  while (!has_seen_new && std::chrono::steady_clock::now() < give_up_at) {
    const auto line = watching->read_line(test::hang_max);
    REQUIRE(line);
    has_seen_new = nlohmann::json::parse(*line).at("status").at("pack").at("config_hash") != before;
  }
  CHECK(has_seen_new);
  CHECK(bench.end() == 0);
}

TEST_CASE("balancing that was switched off stays so over a reload", "[integration][daemon][reload][bus]") {
  ReloadBench bench;
  bench.start_emulator("");
  bench.start();
  CHECK(bench.ask({"balance", "--off"}).status == 0);
  bench.put_with_period(80);
  REQUIRE(bench.reload().at("ok") == true);
  CHECK(bench.reloads() == 1);
  CHECK(bench.ask_json("balance").at("is_switched_off") == true);
}

TEST_CASE("the service manager is told of a reload, asked for patience, and told when it is over",
          "[integration][daemon][reload][bus]") {
  ReloadBench bench;
  NotifySocket manager(bench.folder / "notify");
  bench.start_emulator("");
  bench.start_daemon({.environment = {"NOTIFY_SOCKET=" + (bench.folder / "notify"), "WATCHDOG_USEC=500000"}});
  REQUIRE(manager.hears("READY=1", test::hang_max));
  REQUIRE(bench.becomes([&] { return bench.ask_json("status").at("modules_answering") == 4; }));
  /// All messages except the watchdog and status ones.
  const auto next_word = [&] {
    while (true) {
      const auto word = manager.next(test::hang_max);
      REQUIRE(word);
      if (*word != "WATCHDOG=1" && !word->starts_with("STATUS=")) return *word;
    }
  };
  manager.drain();
  bench.put_with_period(80);
  CHECK(bench.reload().at("ok") == true);
  CHECK(next_word().starts_with("RELOADING=1\nMONOTONIC_USEC="));
  CHECK(next_word() == "WATCHDOG=1\nWATCHDOG_USEC=5000000");
  CHECK(next_word() == "READY=1\nWATCHDOG_USEC=500000");
  // A refused reload also sends its start and its end.
  bench.put("{");
  CHECK(bench.reload().at("ok") == false);
  CHECK(next_word().starts_with("RELOADING=1\nMONOTONIC_USEC="));
  CHECK(next_word() == "READY=1");
  CHECK(bench.end() == 0);
  CHECK(next_word() == "STOPPING=1");
}

TEST_CASE("with a real-time priority and locked memory the next life's threads are ordinary ones, too",
          "[integration][daemon][reload][real_time][bus]") {
  const Finished tried = run_program({"/usr/bin/chrt", "-f", "20", "/bin/true"});
  if (tried.status != 0 || ::geteuid() != 0) {
    WARN("skipped: not root, or no real-time scheduling here");
    return;
  }
  ReloadBench bench;
  bench.more_options.insert(bench.more_options.end(), {"--realtime-priority", "20", "--lock-memory"});
  bench.start_emulator("");
  bench.start();
  bench.put_with_period(80);
  REQUIRE(bench.reload().at("ok") == true);
  const std::string tasks = "/proc/" + std::to_string(bench.daemon->pid()) + "/task";
  for (const auto& entry : std::filesystem::directory_iterator(tasks)) {
    const pid_t thread = std::stoi(entry.path().filename());
    const int policy = ::sched_getscheduler(thread) & ~SCHED_RESET_ON_FORK;
    CHECK(policy == (thread == bench.daemon->pid() ? SCHED_FIFO : SCHED_OTHER));
  }
}

TEST_CASE("two hundred reloads leave nothing behind", "[integration][daemon][reload][bus][slow]") {
  ReloadBench bench;
  bench.more_options.insert(bench.more_options.end(),
                            {"--record", bench.folder / "drives", "--black-box", bench.folder / "boxes"});
  bench.start_emulator("");
  bench.start();
  const auto reload_times = [&](int times) {
    for (int i = 0; i < times; ++i) {
      bench.put_with_period(i % 2 == 0 ? 80 : 100);
      const nlohmann::json done = bench.reload();
      INFO(done.dump());
      REQUIRE(done.at("ok") == true);
      REQUIRE(done.at("is_new_life") == true);
    }
  };
  // With a sanitizer forty are enough: it checks for leaks at the end. An even number, or the next file is the same.
  constexpr int first_reloads = test::is_sanitized ? 10 : 50;
  reload_times(first_reloads);
  // A sanitizer keeps 256 MB of freed memory.
  constexpr std::int64_t growth_max_kB = test::is_sanitized ? 300'000 : 8'000;
  const std::size_t descriptors = count_in(*bench.daemon, "fd");
  const std::size_t threads = count_in(*bench.daemon, "task");
  const std::int64_t memory_kB = resident_kB(*bench.daemon);
  reload_times(3 * first_reloads);
  // Writer threads have a file open at times, and buffers of some megabytes; a busy machine makes them write. A leak in
  // each reload would occur thirty times or more.
  constexpr std::size_t few = 5;
  CHECK(bench.becomes([&] { return count_in(*bench.daemon, "fd") <= descriptors + few; }));
  CHECK(bench.becomes([&] { return count_in(*bench.daemon, "task") <= threads + few; }));
  CHECK(bench.becomes([&] { return resident_kB(*bench.daemon) - memory_kB < growth_max_kB; }));
  CHECK(bench.reloads() == 4 * first_reloads);
  CHECK(bench.becomes([&] { return bench.ask_json("status").at("modules_answering") == 4; }));
  const nlohmann::json faults = test::faults_of_the_pack(bench);
  INFO(faults.dump());
  CHECK(faults.empty());
  CHECK(test::faults_of_the_machine_pass(bench));
  CHECK(bench.end() == 0);
}

}  // namespace bmu
