// The real daemon and the real bmuctl as processes, on an embedded bus, with the real emulator connected. Every wait is
// for an event (a frame, a datagram, the end of a process) and bounded.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <linux/can.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/records/event.hpp"
#include "daemon/shell/can/bus_port.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/busy_machine.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/notify_socket.hpp"
#include "tools/bmuctl/client.hpp"

namespace bmu {

using test::Bench;
using test::is_closed;
using test::is_open;
using test::NotifySocket;
using test::of_the_pack;
using test::pack_file;

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

void start_and_close(Bench& bench) {
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  REQUIRE(bench.closes());
}

/// Both ends of a full pipe.
struct FullPipe {
  OwnedFd read_end;
  OwnedFd write_end;

  FullPipe() {
    std::array<int, 2> ends{};
    REQUIRE(::pipe2(ends.data(), O_CLOEXEC) == 0);
    read_end = OwnedFd(ends[0]);
    write_end = OwnedFd(ends[1]);
    ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
    const std::array<char, 4096> block{};
    while (::write(ends[1], block.data(), block.size()) > 0) {
    }
    ::fcntl(ends[1], F_SETFL, 0);
  }
};

}  // namespace

TEST_CASE("a good pack file is told so, a bad one with every problem, a wrong command line in one line",
          "[integration][daemon][F78]") {
  const Finished good = run_program({program("bmud"), "--config", pack_file, "--check-config"});
  CHECK(good.status == 0);
  CHECK(good.out ==
        pack_file +
            ": ok: demo 48s, 4 modules, 48 cells\n"
            "internal bus at 500 kbit/s: in use for up to 13 % of the time, a poll cycle takes up to 14 ms\n");
  CHECK(run_program({program("bmud"), "--check-config", pack_file}).out == good.out);

  const TemporaryFolder folder;
  std::ofstream(folder / "bad.json") << R"({"nmae": "x", "modules": []})";
  const Finished bad = run_program({program("bmud"), "--config", folder / "bad.json", "--check-config"});
  CHECK(bad.status == 78);
  CHECK(bad.err.find("/nmae") != std::string::npos);
  CHECK(std::count(bad.err.begin(), bad.err.end(), '\n') > 2);
  CHECK(run_program({program("bmud"), "--config", folder / "none.json"}).status == 78);
  std::ofstream(folder / "broken.json") << "{\n  \"name\": \"x\",\n}";
  const Finished broken = run_program({program("bmud"), "--config", folder / "broken.json"});
  CHECK(broken.status == 78);
  CHECK(broken.err.find((folder / "broken.json") + ":3:1: ") == 0);

  const Finished wrong = run_program({program("bmud"), "--no-such-option"});
  CHECK(wrong.status == 2);
  CHECK(std::count(wrong.err.begin(), wrong.err.end(), '\n') == 1);
  CHECK(wrong.err.find("--no-such-option") != std::string::npos);
  CHECK(run_program({program("bmud")}).status == 2);
  CHECK(run_program({program("bmud"), "--help"}).status == 0);
}

TEST_CASE("an option that cannot be meant is a wrong command line, and nothing is touched", "[integration][daemon]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "states");
  std::ofstream(folder / "states/precious") << "kept";
  const std::string long_path = folder / std::string(110, 's');
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"--state", folder / "states"}, "a directory, expected a file"},
      {{"--state", "/dev/null"}, "not a regular file, expected a file"},
      {{"--bus-internal", "unix:../../x"}, "found 'unix:../../x', expected an interface name"},
      {{"--bus-vehicle", "abcdefghijklmnopqrstuv"}, "expected an interface name of 1 to 15 characters"},
      {{"--socket", long_path}, "characters, expected at most 107"},
      {{"--state", ""}, "found nothing, expected a path"},
      {{"--record", ""}, "found nothing, expected a path"},
      {{"--black-box", ""}, "found nothing, expected a path"},
      {{"--serial", ""}, "found nothing, expected a path"},
      {{"--socket", ""}, "found nothing, expected a path"},
      {{"--history", ""}, "expected a name that ends in .sqlite, or none"},
  };
  for (const auto& [options, words] : wrong) {
    std::vector<std::string> arguments{program("bmud"), "--config", pack_file};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished refused = run_program(arguments);
    INFO(options.front() << " '" << options.back() << "': " << refused.err);
    CHECK(refused.status == 2);
    CHECK(refused.err.find(options.front()) != std::string::npos);
    CHECK(refused.err.find(words) != std::string::npos);
  }
  CHECK(std::filesystem::exists(folder / "states/precious"));
  CHECK(std::filesystem::is_character_file("/dev/null"));
}

TEST_CASE("a pack file that leaves the bus too little is told so, and is good all the same", "[integration][daemon]") {
  std::ifstream stream(test::in_source("config/packs/traction-16x12.json"));
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const auto replace = [&text](const std::string& what, const std::string& with) {
    const auto at = text.find(what);
    REQUIRE(at != std::string::npos);
    text.replace(at, what.size(), with);
  };
  replace("\"../cells/", "\"" + test::in_source("config/cells/"));
  replace("\"period_ms\": 50, \"temperature_every\": 4", "\"period_ms\": 100, \"temperature_every\": 1");
  replace("\"vehicle\": \"can1\"}", "\"vehicle\": \"can1\", \"internal_kbit_per_s\": 250}");
  replace("\"cell_voltage_ms\": 200", "\"cell_voltage_ms\": 285");
  replace("\"module_status_ms\": 200", "\"module_status_ms\": 250");
  replace("\"pack_current_ms\": 100", "\"pack_current_ms\": 125");
  replace("\"pack_voltage_ms\": 200", "\"pack_voltage_ms\": 205");
  const TemporaryFolder folder;
  std::ofstream(folder / "busy.json") << text;
  const Finished busy = run_program({program("bmud"), "--config", folder / "busy.json", "--check-config"});
  CHECK(busy.status == 0);
  CHECK(busy.out.find("warning: ") == 0);
  CHECK(busy.out.find("/poll/period_ms: found 100, which fills the internal bus to up to ") != std::string::npos);
  CHECK(busy.out.find(": ok: traction 16x12") != std::string::npos);
}

TEST_CASE("a drive: the pack closes, a cell sags, it opens and says which cell, value and limit",
          "[integration][daemon][bus]") {
  nlohmann::json closed;
  nlohmann::json why;
  const auto bench = test::driven([&](Bench& made) {
    start_and_close(made);
    closed = made.ask_json("status");
    made.send_event("cell 2.7 voltage_mV ..2500 over 0.3");
    REQUIRE(made.listener.hears(is_open, test::hang_max));
    why = made.ask_json("why");
    return closed.at("state").at("phase") == "closed" && why.at("last_opening").at("fault") == "cell_undervoltage";
  });
  CHECK(closed.at("state").at("phase") == "closed");
  CHECK(closed.at("last_precharge").at("was_successful") == true);
  CHECK(closed.at("modules_answering") == 4);
  CHECK(closed.at("limits").at("discharge").at("limit_mA") > 0);

  const nlohmann::json& opening = why.at("last_opening");
  CHECK(opening.at("fault") == "cell_undervoltage");
  CHECK(opening.at("steps").at(0).at("element").at("module") == 2);
  CHECK(opening.at("steps").at(0).at("element").at("number") == 7);
  CHECK(opening.at("steps").at(0).at("value_uV") <= opening.at("steps").at(1).at("threshold_uV"));
  const Finished text = bench->ask({"why"});
  CHECK(text.status == 0);
  CHECK(text.out.find("cell 2.7 (no. 19)") != std::string::npos);
}

TEST_CASE("the status has current with its sign, voltage and temperature of the emulated pack",
          "[integration][daemon][RR_6][bus]") {
  constexpr int current_tolerance_mA = 700;
  constexpr int voltage_tolerance_mV = 1'000;
  nlohmann::json drawn;
  nlohmann::json fed_back;
  const auto beside_sum_mV = [](const nlohmann::json& values) {
    return values.at("pack_voltage_mV").get<int>() - values.at("cell_voltage_sum_mV").get<int>();
  };
  const auto bench = test::driven([&](Bench& made) {
    drawn = fed_back = nullptr;
    made.start_emulator("0 pack temperature_dC 312\n0 pack ambient_dC 312\n");
    made.start_daemon();
    REQUIRE(made.listener.next(test::hang_max));
    REQUIRE(made.closes());
    // The checks below need the sign of the current. Voltages follow it after about 100 ms.
    const auto settles = [&](int load_A, nlohmann::json& values) {
      made.send_event("load current_A " + std::to_string(load_A));
      return made.becomes_unless_open([&] {
        values = made.ask_json("status").at("values");
        if (!values.at("current_mA").is_number() || !values.at("pack_voltage_mV").is_number()) return false;
        const int apart_mA = std::abs(values.at("current_mA").get<int>()) - std::abs(load_A) * 1'000;
        return std::abs(apart_mA) <= current_tolerance_mA && std::abs(beside_sum_mV(values)) <= voltage_tolerance_mV;
      });
    };
    return settles(20, drawn) && settles(-10, fed_back);
  });
  INFO(drawn.dump() << fed_back.dump());
  REQUIRE(fed_back.is_object());
  CHECK(std::abs(drawn.at("current_mA").get<int>() - 20'000) <= current_tolerance_mA);
  CHECK(std::abs(fed_back.at("current_mA").get<int>() + 10'000) <= current_tolerance_mA);
  for (const nlohmann::json& values : {drawn, fed_back}) {
    const auto voltage_mV = values.at("pack_voltage_mV").get<int>();
    const nlohmann::json& cells = values.at("cell_voltage");
    REQUIRE(cells.at("count") == 48);
    CHECK(std::abs(beside_sum_mV(values)) <= voltage_tolerance_mV);
    CHECK(std::abs(voltage_mV - cells.at("average_uV").get<int>() / 1'000 * 48) <= voltage_tolerance_mV);
    // Voltage of cells at 80 %.
    CHECK(voltage_mV > 48 * 3'800);
    CHECK(voltage_mV < 48 * 4'200);
    // The load warms them by less than this.
    for (const char* const end : {"min_dC", "max_dC"}) {
      CHECK(values.at("cell_temperature").at(end) >= 311);
      CHECK(values.at("cell_temperature").at(end) <= 315);
    }
  }
}

namespace {

constexpr const char* driving = "vehicle on, contactors closed";

/// Waits for the next frame of this port, at most `at_most`, and reads all pending frames.
bool takes_next(BusPort& port, milliseconds at_most) {
  pollfd wait{.fd = port.fd(), .events = POLLIN, .revents = 0};
  const bool is_there = ::poll(&wait, 1, static_cast<int>(at_most.count())) > 0;
  ReceivedFrame received;
  while (port.read(received) == ReadStatus::frame) {
  }
  return is_there;
}

}  // namespace

TEST_CASE("every status asked for right behind a PDU_STATUS says that the vehicle drives",
          "[integration][daemon][vehicle][bus]") {
  nlohmann::json state;
  const auto drives = [&] { return state.at("mode") == "driving" && state.at("vehicle_state") == driving; };
  const auto bench = test::driven([&](Bench& made) {
    start_and_close(made);
    const auto unit = open_bus(made.bus, {.receive_ids = {internal_bus::pdu_status.base_id}});
    REQUIRE(unit);
    auto client = Client::connect(made.socket);
    REQUIRE(client);
    // Nearly all of these requests arrive before the decision that follows the PDU_STATUS.
    for (int count = 0; count < 50; ++count) {
      REQUIRE(takes_next(**unit, test::hang_max));
      REQUIRE(client->send_line(R"({"cmd":"status"})"));
      const auto line = client->read_line(test::hang_max);
      REQUIRE(line);
      state = nlohmann::json::parse(*line).at("state");
      if (!drives()) return false;
    }
    return true;
  });
  INFO(state.dump(1));
  CHECK(drives());
}

namespace {

constexpr const char* limit_row = "limits/cell_undervoltage: derating from 80.000 A at 3.0000 V to zero at 2.8000 V";

/// A linear ramp: 80 A at 3.0 V, zero at 2.8 V; the share is truncated to permille. While it moves, the limit is above
/// it.
bool is_settled(const nlohmann::json& steps) {
  const std::int64_t share_permille = (steps.at(0).at("value_uV").get<std::int64_t>() - 2'800'000) / 200;
  return steps.at(2).at("limit_mA") == 80 * share_permille;
}

}  // namespace

TEST_CASE("a limit is told as a chain from the signal over the row that limits to the current that is left",
          "[integration][daemon][BMU_13][bus]") {
  nlohmann::json chain;
  std::string page;
  bool has_settled = false;
  const auto bench = test::driven([&](Bench& made) {
    has_settled = false;
    start_and_close(made);
    // With a current flowing already the ramp is the binding limit: at rest the voltage prediction would be lower.
    made.send_event("load current_A 39");
    const auto flows = [&] { return made.ask_json("status").at("values").at("current_mA") > 35'000; };
    if (!made.becomes_unless_open(flows)) return false;
    made.send_event("cell 2.7 voltage_mV ..2900 over 0.1");
    has_settled = made.becomes_unless_open([&] {
      chain = made.ask_json("why").at("limits").at("discharge");
      page = made.ask({"why"}).out;
      return chain.at("steps").back().at("cause") == "cell voltage low" && is_settled(chain.at("steps")) &&
             page.find(limit_row) != std::string::npos;
    });
    return has_settled;
  });
  INFO(chain.dump(1) << page);
  REQUIRE(has_settled);
  const nlohmann::json& steps = chain.at("steps");
  REQUIRE(steps.size() == 3);
  CHECK(steps[0].at("kind") == "signal");
  CHECK(steps[0].at("input") == "lowest cell voltage");
  CHECK(steps[0].at("element").at("text") == "cell 2.7 (no. 19)");
  CHECK(steps[0].at("value_uV") < 3'000'000);
  CHECK(steps[1].at("kind") == "limit");
  CHECK(steps[1].at("row") == "limits/cell_undervoltage");
  CHECK(steps[1].at("derates_from_uV") == 3'000'000);
  CHECK(steps[1].at("threshold_uV") == 2'800'000);
  CHECK(steps[1].at("unhindered_mA") == 80'000);
  CHECK(steps[2].at("kind") == "decision");
  CHECK(is_settled(steps));
  CHECK(page.find("\nDischarge limit:") != std::string::npos);
}

TEST_CASE("either emergency stop opens a closed pack", "[integration][daemon][RR_2][bus]") {
  const std::string number = GENERATE("1", "2");
  std::string fault;
  const auto bench = test::driven([&](Bench& made) {
    start_and_close(made);
    made.send_event("estop " + number + " pressed");
    REQUIRE(made.listener.hears(is_open, test::hang_max));
    fault = made.ask_json("status").at("last_opening").at("fault");
    return fault == "emergency_stop";
  });
  CHECK(fault == "emergency_stop");
}

TEST_CASE("SIGTERM opens a closed pack, and the daemon ends with 0", "[integration][daemon][F63][bus]") {
  Bench bench;
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  REQUIRE(bench.closes());
  bench.daemon->signal(SIGTERM);
  CHECK(bench.daemon->wait(test::hang_max) == 0);
  CHECK(is_open(bench.listener.last()));
  CHECK_FALSE(std::filesystem::exists(bench.socket));
}

TEST_CASE("a second SIGTERM ends the daemon at once, open", "[integration][daemon][F63][bus]") {
  const bool is_twice = GENERATE(false, true);
  Bench bench;  // no emulator: the contacts are never confirmed as open
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  // The daemon is stopped meanwhile: both signals are pending before it reads the first one.
  bench.daemon->signal(SIGSTOP);
  int status = 0;
  REQUIRE(::waitpid(bench.daemon->pid(), &status, WUNTRACED) == bench.daemon->pid());
  bench.daemon->signal(SIGTERM);
  if (is_twice) bench.daemon->signal(SIGINT);
  bench.daemon->signal(SIGCONT);
  CHECK(bench.daemon->wait(test::hang_max) == 0);
  CHECK(is_open(bench.listener.last()));
  // After one signal it waits for the confirmation and logs that it is missing; after two it does not wait.
  const std::string log = read_file(bench.log);
  INFO(log);
  CHECK((log.find(to_text(Event{.id = EventId::shut_down_unconfirmed})) == std::string::npos) == is_twice);
}

TEST_CASE("a log that takes nothing stops neither frames nor the end", "[integration][daemon][F74][bus]") {
  Bench bench;
  FullPipe pipe;
  bench.start_daemon({.err_fd = pipe.write_end.get()});
  REQUIRE(bench.listener.next(test::hang_max));
  CHECK(bench.listener.hears_commands(20));
  bench.daemon->signal(SIGTERM);
  CHECK(bench.daemon->wait(test::hang_max) == 0);
}

TEST_CASE("the service manager hears that we are alive only while ticks are decided",
          "[integration][daemon][F61][bus]") {
  Bench bench;
  NotifySocket notify(bench.folder / "notify");
  bench.start_daemon({.environment = {"NOTIFY_SOCKET=" + (bench.folder / "notify"), "WATCHDOG_USEC=300000"}});
  REQUIRE(notify.hears("READY=1", test::hang_max));
  CHECK(notify.hears("WATCHDOG=1", test::hang_max));
  CHECK(notify.hears("WATCHDOG=1", test::hang_max));

  bench.daemon->signal(SIGSTOP);
  int status = 0;
  REQUIRE(::waitpid(bench.daemon->pid(), &status, WUNTRACED) == bench.daemon->pid());
  notify.drain();
  CHECK_FALSE(notify.next(milliseconds(400)));
  bench.daemon->signal(SIGCONT);
  CHECK(notify.hears("WATCHDOG=1", test::hang_max));

  bench.daemon->signal(SIGTERM);
  CHECK(notify.hears("STOPPING=1", test::hang_max));
  // Writing the persistent state may take longer than the watchdog timeout.
  CHECK(notify.hears("WATCHDOG=1\nWATCHDOG_USEC=5000000", test::hang_max));
  CHECK(bench.daemon->wait(test::hang_max) == 0);
}

TEST_CASE("a service manager that takes nothing, or is not there, does not hold the daemon",
          "[integration][daemon][F73][bus]") {
  Bench bench;
  NotifySocket notify(bench.folder / "notify");
  notify.fill();
  const bool is_gone = GENERATE(false, true);
  const std::string path = is_gone ? bench.folder / "nobody" : bench.folder / "notify";
  bench.start_daemon({.environment = {"NOTIFY_SOCKET=" + path, "WATCHDOG_USEC=100000"}});
  REQUIRE(bench.listener.next(test::hang_max));
  CHECK(bench.listener.hears_commands(10));
  bench.daemon->signal(SIGTERM);
  CHECK(bench.daemon->wait(test::hang_max) == 0);
}

TEST_CASE("a second daemon on the same socket refuses to start, a killed one's place is taken",
          "[integration][daemon][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  const Finished second = run_program(bench.daemon_command());
  CHECK(second.status == 71);
  CHECK(second.err.find("another bmud is running") != std::string::npos);

  bench.daemon->signal(SIGKILL);
  CHECK(bench.daemon->wait(test::hang_max) == 128 + SIGKILL);
  REQUIRE(std::filesystem::exists(bench.socket));
  static_cast<void>(bench.listener.last());  // frames of the killed daemon are not evidence of the new one
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  CHECK(bench.ask({"status"}).status == 0);
}

TEST_CASE("a status socket in a folder that is not there is a start-up error of one line",
          "[integration][daemon][bus]") {
  Bench bench;
  bench.socket = bench.folder / "slip/bmud.sock";
  const Finished refused = run_program(bench.daemon_command());
  CHECK(refused.status == 71);
  CHECK(std::count(refused.err.begin(), refused.err.end(), '\n') == 1);
  CHECK(refused.err.find("directory " + (bench.folder / "slip") + " does not exist") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(bench.folder / "slip"));
}

namespace {

/// A pack with a pressed emergency stop, cleared while it is pressed and after it was released; and the daemon's
/// answers, without faults that the machine may have caused.
struct ClearedPack : Bench {
  nlohmann::json early;
  Finished refused;
  Finished refused_in_json;
  nlohmann::json late;

  [[nodiscard]] std::string stage() const {
    const nlohmann::json reply = ask_json("faults");
    for (const nlohmann::json& fault : reply.at("faults")) {
      if (fault.at("name") == "emergency_stop") return fault.at("stage").get<std::string>();
    }
    return {};
  }
  [[nodiscard]] nlohmann::json clear() const {
    nlohmann::json answer = ask_json("clear");
    const bool may_be_busy = test::may_have_been_kept_waiting(daemon->pid());
    for (const char* key : {"cleared", "still_present", "reasons"}) {
      answer[key] = of_the_pack(answer.at(key), may_be_busy);
    }
    return answer;
  }
  /// True if only the stop was there to be cleared: a held-up emulator causes lost modules, too.
  [[nodiscard]] bool clears_stop_alone() {
    const auto stop_alone = nlohmann::json{"emergency_stop"};
    start_emulator("0 estop 1 pressed\n");
    start_daemon();
    REQUIRE(listener.next(test::hang_max));
    const auto all_are_heard = [&] { return ask_json("status").at("modules_answering") == 4; };
    REQUIRE(becomes([&] { return stage() == "active" && all_are_heard(); }));
    static_cast<void>(clear());  // clears faults of an emulator that started slowly
    early = clear();
    refused = ask({"clear"});
    refused_in_json = ask({"--json", "clear"});
    send_event("estop 1 released");
    REQUIRE(becomes([&] { return stage() == "latched"; }));
    late = clear();
    return early.at("cleared").empty() && early.at("still_present") == stop_alone && late.at("cleared") == stop_alone &&
           late.at("still_present").empty();
  }
};

}  // namespace

TEST_CASE("the answer to clear tells what went and what stays, and why", "[integration][daemon][bus]") {
  const auto bench = test::driven<ClearedPack>([](ClearedPack& made) { return made.clears_stop_alone(); });
  const nlohmann::json& early = bench->early;
  CHECK(early.at("cleared").empty());
  CHECK(early.at("still_present") == nlohmann::json{"emergency_stop"});
  const nlohmann::json& reasons = early.at("reasons");
  REQUIRE(reasons.size() == 1);
  CHECK(reasons.at(0).at("name") == "emergency_stop");
  CHECK(reasons.at(0).at("reason") == "cause still present (emergency stop 1 (PDU))");
  CHECK(bench->refused.out.starts_with("Still confirmed: "));
  CHECK(bench->refused.out.find("emergency_stop") != std::string::npos);
  CHECK(bench->refused.status == 3);
  CHECK(bench->refused_in_json.status == 3);

  const nlohmann::json& late = bench->late;
  REQUIRE(late.at("cleared") == nlohmann::json{"emergency_stop"});
  CHECK(late.at("still_present").empty());
  CHECK(late.at("reasons").empty());
  // Faults caused by a busy machine may occur at any time, and stay until some ticks are in time again.
  Finished nothing;
  CHECK(bench->becomes([&] {
    nothing = bench->ask({"clear"});
    return nothing.out == "No faults to clear.\n";
  }));
  CHECK(nothing.out == "No faults to clear.\n");
  CHECK(nothing.status == 0);
}

TEST_CASE("a second master is named by the identifier it used, a node of nobody is counted, others are not seen",
          "[integration][daemon][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.hears_commands(5));  // another master's frame before that would end it
  auto port = open_bus(bench.bus, {.receive_ids = {internal_bus::contactor_command.base_id}});
  REQUIRE(port);
  CanFrame unconfigured{.id = internal_bus::ident.base_id + 63, .length = 8};
  seal(internal_bus::ident, 0, unconfigured);
  // A starved daemon discards pending frames: frames sent in that time may be without effect.
  nlohmann::json receive;
  const auto counts = [&](const char* reason) { return receive.at("rejected_by_reason").value(reason, 0); };
  REQUIRE(bench.becomes([&] {
    receive = bench.ask_json("status").at("receive");
    if (counts("foreign master") == 0) REQUIRE((*port)->send(contactor_command_frame({}, 77)));
    if (counts("not configured") == 0) REQUIRE((*port)->send(unconfigured));
    return counts("foreign master") > 0 && counts("not configured") > 0;
  }));
  REQUIRE((*port)->send({.id = 0x7F0, .length = 8}));
  CHECK(bench.listener.hears_commands(2));
  receive = bench.ask_json("status").at("receive");
  // A frame may have been sent again before the first was counted.
  CHECK(counts("foreign master") >= 1);
  CHECK(counts("not configured") >= 1);
  CHECK(receive.at("rejected") == counts("foreign master") + counts("not configured"));
  CHECK(receive.at("most_rejected").size() == 2);
  const Finished why = bench.ask({"why"});
  CHECK(why.out.find("frames of a second master on the internal bus (040 CONTACTOR_COMMAND)") != std::string::npos);
}

TEST_CASE("a sensor result that is none is counted and told apart from a frame that failed",
          "[integration][daemon][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  auto port = open_bus(bench.bus, {.receive_ids = {internal_bus::contactor_command.base_id}});
  REQUIRE(port);
  CanFrame absurd = make_frame(internal_bus::sensor_current);
  absurd.data[2] = 0x7F;  // about two million ampere
  seal(internal_bus::sensor_current, 3, absurd);
  nlohmann::json receive;
  // Until one is counted: a starved daemon discards pending frames.
  REQUIRE(bench.becomes([&] {
    REQUIRE((*port)->send(absurd));
    receive = bench.ask_json("status").at("receive");
    return receive.at("sensor_results_refused") >= 1;
  }));
  CHECK(receive.at("rejected") == 0);
  CHECK(receive.at("sensor_result_refused_last") == "out of range");
  const nlohmann::json sensor = bench.ask_json("status").at("sensor");
  CHECK(sensor.at("results_refused_by_reason").at("out of range") >= 1);
  CHECK(sensor.at("results_refused_by_reason").at("sensor fault") == 0);
  CHECK(sensor.at("frames_rejected_by_reason").at("wrong length") == 0);
  const std::string page = bench.ask({"status"}).out;
  CHECK(page.find("(out of range ") != std::string::npos);
  CHECK(page.find("), last out of range") != std::string::npos);
}

TEST_CASE("what waited while the daemon was stopped is not taken for news", "[integration][daemon][F53][F60][bus]") {
  Bench bench;
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  REQUIRE(bench.closes());
  bench.daemon->signal(SIGSTOP);
  int status = 0;
  REQUIRE(::waitpid(bench.daemon->pid(), &status, WUNTRACED) == bench.daemon->pid());
  static_cast<void>(bench.listener.last());
  CHECK_FALSE(bench.listener.next(milliseconds(300)));  // frames of other nodes in this time are pending in the daemon
  bench.emulator->signal(SIGKILL);
  CHECK(bench.emulator->wait(test::hang_max) == 128 + SIGKILL);
  CHECK_FALSE(bench.listener.next(milliseconds(1000)));  // now no node sends
  bench.daemon->signal(SIGCONT);
  // Its first decision opens: if it took the pending frames as fresh data, it would stay closed until they are stale. A
  // command that was decided before the stop may come first.
  int commands = 0;
  bool has_opened = false;
  while (!has_opened && commands < 2) {
    const auto command = bench.listener.next(test::hang_max);
    REQUIRE(command);
    has_opened = is_open(*command);
    ++commands;
  }
  CHECK(has_opened);
  const nlohmann::json answer = bench.ask_json("status");
  CHECK(answer.at("state").at("feedback").is_null());
  CHECK(answer.at("values").at("current_mA").is_null());
  CHECK(answer.at("values").at("pack_voltage_mV").is_null());
}

TEST_CASE("an interface that is not there keeps the daemon waiting, not failing", "[integration][daemon][bus]") {
  const Bench bench;
  std::vector<std::string> command = bench.daemon_command();
  std::replace(command.begin(), command.end(), bench.bus, std::string("nosuchcan0"));
  Process daemon(command, {.err_file = bench.log});
  const OwnedFd can(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  if (!can.is_open()) {
    // A kernel without CAN has no interface to wait for, and the daemon reports this.
    CHECK(daemon.wait(test::hang_max) == 71);
    CHECK(read_file(bench.log).find("nosuchcan0") != std::string::npos);
    return;
  }
  const auto is_open_and_waits = [&] {
    const nlohmann::json status = bench.ask_json("status");
    return status.is_object() && status.at("state").at("phase") == "open" && !status.at("permission").at("may_close");
  };
  const auto give_up_at = std::chrono::steady_clock::now() + test::hang_max;
  while (!is_open_and_waits()) REQUIRE(std::chrono::steady_clock::now() < give_up_at);
  CHECK(daemon.wait(milliseconds(0)) == -1);
}

TEST_CASE("every command of bmuctl answers a running daemon, as text and as JSON", "[integration][bmuctl][bus]") {
  Bench bench;
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  for (const std::string command :
       {"status", "cells", "faults", "why", "clear", "modules", "balance", "health", "wake", "drive"}) {
    CAPTURE(command);
    const Finished text = bench.ask({command});
    CHECK((text.status == 0 || (command == "clear" && text.status == 3)));  // the bus has just come up
    CHECK_FALSE(text.out.empty());
    CHECK(text.out.find('\033') == std::string::npos);
    const nlohmann::json json = bench.ask_json(command);
    CHECK(json.value("ok", false));
  }
  CHECK(bench.ask({"--color", "always", "status"}).out.find('\033') != std::string::npos);
}

TEST_CASE("a pack without a charger or an inverter says so, with a code of its own", "[integration][bmuctl][bus]") {
  Bench bench;
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  for (const std::string command : {"charger", "inverter"}) {
    CAPTURE(command);
    const Finished text = bench.ask({command});
    CHECK(text.status == 3);
    CHECK(text.out.find("section " + command + " of the pack file") != std::string::npos);
    const Finished json = bench.ask({"--json", command});
    CHECK(json.status == 3);
    CHECK(nlohmann::json::parse(json.out).at(command).is_null());
  }
}

TEST_CASE("the help of a command is about that command", "[integration][bmuctl]") {
  for (const std::string command : {"status", "cells", "faults", "why", "drive", "clear", "balance", "health",
                                    "charger", "inverter", "wake", "reload", "watch", "modules"}) {
    CAPTURE(command);
    const Finished help = run_program({program("bmuctl"), command, "--help"});
    CHECK(help.status == 0);
    CHECK(help.out.find("bmuctl " + (command == "status" ? "--json status" : std::string())) != std::string::npos);
    CHECK(help.out.find("Exit codes") != std::string::npos);
    CHECK(help.out.find("overview of the pack\n  bmuctl watch ") == std::string::npos);
    CHECK(help.out.find("Group bmud has read access") == std::string::npos);
  }
}

namespace {

/// With an insulation monitor on GPIO lines that do not exist.
struct NoLinesBench : Bench {
  NoLinesBench() {
    std::ifstream file(pack_file);
    nlohmann::json json = nlohmann::json::parse(file, nullptr, true, true);
    json["cell"] = test::in_source("config/cells/nmc-30ah-10p.json");
    json["insulation"] = {{"monitoring", "measured"}};
    json["gpio"] = {{"chip", "/dev/no-such-chip"},
                    {"insulation_pulses", {{"line", 1}}},
                    {"inputs", {{{"name", "monitor"}, {"kind", "insulation_ok"}, {"line", 2}}}}};
    pack = folder.file("pack.json", json.dump());
  }
};

}  // namespace

TEST_CASE("lines that cannot be read do not hide a unit that is heard", "[integration][daemon][gpio][bus]") {
  const auto has_failed = [](const nlohmann::json& status) {
    return status.is_object() && status.dump().find("\"lines_failed\"") != std::string::npos &&
           status["state"]["feedback"].is_object();
  };
  nlohmann::json status;
  const auto is_unit_lost = [&] {
    return status["faults_present"].dump().find("pdu_lost") != std::string::npos ||
           status["state"]["feedback_age_ms"] >= 1000;
  };
  const auto bench = test::driven<NoLinesBench>([&](NoLinesBench& made) {
    made.start_emulator("0 vehicle on\n");
    made.start_daemon();
    REQUIRE(made.listener.next(test::hang_max));
    const bool is_so = made.becomes([&] { return has_failed(status = made.ask_json("status")); });
    INFO(status.dump(1));
    REQUIRE(is_so);
    static_cast<void>(made.listener.last());
    REQUIRE(made.listener.hears_commands(30));  // 1.5 s: longer than the timeout of the PDU
    status = made.ask_json("status");
    return !is_unit_lost();
  });
  INFO(status.dump(1));
  REQUIRE_FALSE(is_unit_lost());
  CHECK(status["state"]["feedback"]["main_positive"] == false);
  CHECK(status["state"]["inputs"]["insulation_monitor_ok"].is_null());
  CHECK(status["state"]["inputs"]["insulation_resistance_Ohm"].is_null());
  CHECK(status["permission"]["may_close"] == false);
  CHECK(status["state"]["phase"] == "open");
  const std::string why = bench->ask({"why"}).out;
  INFO(why);
  CHECK(why.find("monitor, insulation_pulses: /dev/no-such-chip: cannot be opened") != std::string::npos);
  CHECK(why.find("GPIO lines not readable") != std::string::npos);
  CHECK(is_open(bench->listener.last()));
}

TEST_CASE("balancing is switched off and on by anybody, and says so", "[integration][bmuctl][balancing][bus]") {
  Bench bench;
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  const nlohmann::json before = bench.ask_json("balance");
  CHECK(before.at("is_switched_off") == false);
  CHECK(before.at("modules").size() == 4);
  CHECK(before.at("modules").at(0).at("to_go_uAs").size() == 12);
  CHECK(bench.ask({"balance", "--off"}).out.find("switched off") != std::string::npos);
  CHECK(bench.ask_json("balance").at("is_switched_off") == true);
  CHECK(bench.ask({"balance", "--on", "--off"}).status == 2);
  CHECK(bench.ask({"balance", "--on"}).status == 0);
  CHECK(bench.ask_json("balance").at("is_switched_off") == false);
}

TEST_CASE("without a daemon bmuctl says so in one line, and a wrong command line too", "[integration][bmuctl]") {
  const TemporaryFolder folder;
  for (const std::string command : {"status", "watch"}) {
    const Finished alone = run_program({program("bmuctl"), "--socket", folder / "none.sock", command});
    CHECK(alone.status == 1);
    CHECK(std::count(alone.err.begin(), alone.err.end(), '\n') == 1);
    CHECK(alone.err.find("no daemon at '") != std::string::npos);
  }
  CHECK(run_program({program("bmuctl")}).status == 2);
  CHECK(run_program({program("bmuctl"), "dance"}).status == 2);
}

}  // namespace bmu
