// The real daemon, the real emulator and a listener, as processes on an embedded bus of their own.
#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/records/event.hpp"
#include "daemon/shell/can/bus_port.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/busy_machine.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu::test {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

inline const std::string pack_file = test::in_source("config/packs/demo-48s.json");

/// Node on the bus that receives the contactor commands and nothing else.
class Listener {
 public:
  explicit Listener(const std::string& bus) {
    auto port = open_bus(bus, {.receive_ids = {internal_bus::contactor_command.base_id}});
    REQUIRE(port);
    port_ = std::move(*port);
  }

  /// Returns the next command; none if none came within `at_most`.
  [[nodiscard]] std::optional<ContactorOutputs> next(milliseconds at_most) {
    const auto deadline = steady_clock::now() + at_most;
    while (true) {
      ReceivedFrame received;
      if (port_->read(received) == ReadStatus::frame) return last_ = outputs_of(received.frame);
      const auto left = std::chrono::duration_cast<milliseconds>(deadline - steady_clock::now());
      pollfd wait{.fd = port_->fd(), .events = POLLIN, .revents = 0};
      if (left.count() <= 0 || ::poll(&wait, 1, static_cast<int>(left.count())) <= 0) return std::nullopt;
    }
  }
  /// Returns true as soon as a command that fulfils `is_wanted` is received.
  template <class IsWanted>
  [[nodiscard]] bool hears(IsWanted is_wanted, milliseconds at_most) {
    const auto deadline = steady_clock::now() + at_most;
    while (steady_clock::now() < deadline) {
      const auto command = next(milliseconds(500));
      if (command && is_wanted(*command)) return true;
    }
    return false;
  }
  /// Whether `count` commands come, one every 50 ms where the machine has the time.
  [[nodiscard]] bool hears_commands(int count) {
    for (int heard = 0; heard < count; ++heard) {
      if (!next(hang_max)) return false;
    }
    return true;
  }
  /// Number of commands received in a time: for one in which none may come, or any number.
  [[nodiscard]] int count_within(milliseconds time) {
    const auto deadline = steady_clock::now() + time;
    int count = 0;
    while (steady_clock::now() < deadline) {
      if (next(std::chrono::duration_cast<milliseconds>(deadline - steady_clock::now()))) ++count;
    }
    return count;
  }
  /// The last command of all, after every frame sent so far has been read.
  [[nodiscard]] ContactorOutputs last() {
    while (next(milliseconds(0))) {
    }
    return last_;
  }

 private:
  std::unique_ptr<BusPort> port_;
  ContactorOutputs last_;
};

inline bool is_closed(const ContactorOutputs& outputs) {
  return outputs.main_positive && outputs.main_negative && !outputs.precharge;
}
inline bool is_open(const ContactorOutputs& outputs) {
  return !outputs.any_contactor();
}

/// A bus of its own, a folder, and the programs on the bus.
struct Bench {
  TemporaryFolder folder;
  std::string bus = "unix:test-daemon-" + std::to_string(::getpid()) + "-" + std::to_string(next_number++);
  std::string socket = folder / "bmud.sock";
  std::string log = folder / "bmud.log";
  std::string pack = pack_file;
  std::vector<std::string> more_options{};           // of the daemon
  std::vector<std::string> more_emulator_options{};  // and of mmusim
  Listener listener{bus};
  OwnedFd events;  // open at both ends: an event waits in it for the emulator, in whatever order the two start
  std::unique_ptr<Process> emulator;
  std::unique_ptr<Process> daemon;

  Bench() = default;
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() {
    emulator.reset();
    daemon.reset();
    std::filesystem::remove("/dev/shm/bmud-bus." + bus.substr(5));
  }

  void start_emulator(const std::string& scenario) {
    std::ofstream(folder / "test.scn") << "0 pack soc_permille 800\n0 link capacitance_uF 600\n" << scenario;
    const std::string pipe = folder / "events";
    if (!events.is_open()) {
      REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
      events = OwnedFd(::open(pipe.c_str(), O_RDWR | O_CLOEXEC));
      REQUIRE(events.is_open());
    }
    std::vector<std::string> words{program("mmusim"),   "--bus",    bus, "--pack", pack, "--scenario",
                                   folder / "test.scn", "--events", pipe};
    words.insert(words.end(), more_emulator_options.begin(), more_emulator_options.end());
    emulator = std::make_unique<Process>(
        words, ProcessOptions{.out_file = folder / "mmusim.out", .err_file = folder / "mmusim.log"});
    prefer(*emulator);
  }
  /// Sends an event of mmusim's scripts, without its time: it takes effect once the emulator reads it. For events that
  /// must follow an action of the daemon, since a time in the scenario may pass before the daemon has even started.
  void send_event(const std::string& event) const {
    const std::string line = event + "\n";
    REQUIRE(::write(events.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size()));
  }
  /// A request for a closed pack: two events, and the input that they change.
  struct Request {
    const char* off;
    const char* on;
    const char* input;
  };
  static constexpr Request vehicle_key{"vehicle off", "vehicle on", "vehicle_on"};
  static constexpr Request charger_plug{"charger disconnected", "charger connected", "charger_connected"};

  /// Off and on: the pack closes only on that edge, so the daemon must have received off before.
  void turn_on(const Request& request) {
    send_event(request.off);
    const auto is_off = [&] {
      const nlohmann::json status = ask_json("status");
      if (!status.is_object()) return false;
      const nlohmann::json& inputs = status.at("state").at("inputs");
      return inputs.is_object() && inputs.at(request.input) == false;
    };
    REQUIRE(becomes(is_off));
    send_event(request.on);
  }
  void turn_key_on() { turn_on(vehicle_key); }
  /// Turns the key until contactor commands for a closed pack are received. A starved daemon loses the edge and logs
  /// that; faults caused by a starved daemon or emulator, such as silent modules, stay until they are cleared. Then,
  /// and only then, the key is turned again, after a clear.
  [[nodiscard]] bool closes(const Request& request = vehicle_key) {
    const auto give_up_at = steady_clock::now() + hang_max;
    while (steady_clock::now() < give_up_at) {
      send_event(request.off);
      // A request is refused permanently while a fault is present, as after starving.
      const auto is_ready = [&] {
        if (is_blocked_by_starving()) static_cast<void>(ask({"clear"}));
        const nlohmann::json status = ask_json("status");
        return status.is_object() && status.at("permission").at("may_close") == true;
      };
      if (!becomes(is_ready)) FAIL("nothing lets it close any more: " << ask_json("why").dump());
      const int starved_before = starved_count();
      turn_on(request);
      for (int heard = 1; steady_clock::now() < give_up_at && starved_count() == starved_before; ++heard) {
        if (const auto command = listener.next(milliseconds(500)); command && is_closed(*command)) return true;
        constexpr int look_every = 20;  // a second of commands: the check starts a program
        if (heard % look_every == 0 && is_blocked_by_starving()) break;
      }
    }
    WARN("it does not close: " << ask_json("why").dump());
    return false;
  }
  /// How often the daemon has logged that it was stopped or starved for longer than the core bridges.
  [[nodiscard]] int starved_count() const {
    std::string line = to_text(Event{.id = EventId::loop_gap, .number = 0});
    line.erase(line.find(" 0 ms"));
    const std::string text = read_file(log);
    int count = 0;
    for (auto at = text.find(line); at != std::string::npos; at = text.find(line, at + 1)) ++count;
    return count;
  }
  /// Stops the daemon with SIGTERM. At its exit it waits a fraction of a second for pending writes, and logs if that
  /// was too short: then `begin` starts another session, which is stopped in its place.
  template <class Begin>
  [[nodiscard]] bool ends_whole(Begin begin) {
    constexpr int ends_max = 5;
    for (int ends = 1;; ++ends) {
      const std::size_t logged = read_file(log).size();
      daemon->signal(SIGTERM);
      if (daemon->wait(hang_max) != 0) return false;
      static_cast<void>(listener.last());
      if (read_file(log).find(end_not_whole, logged) == std::string::npos) return true;
      if (ends == ends_max) return false;
      begin();
    }
  }
  /// Whether faults prevent closing, and the machine may be their cause.
  [[nodiscard]] bool is_blocked_by_starving() const {
    const nlohmann::json status = ask_json("status");
    return status.is_object() && status.at("permission").at("may_close") == false &&
           !status.at("faults_present").empty() && may_have_been_held_up();
  }
  /// Whether the machine may have kept the daemon or the emulator waiting, by the kernel's counts while both run.
  [[nodiscard]] bool may_have_been_held_up() const {
    const auto may_have_been = [](const std::unique_ptr<Process>& process) {
      return process && process->pid() > 0 && may_have_been_kept_waiting(process->pid());
    };
    return may_have_been(daemon) || may_have_been(emulator);
  }
  /// Whether the daemon or the emulator reports that the machine kept it waiting for too long. Both are stopped here:
  /// the emulator reports it at its end, and the log is complete after the daemon's. `made_by_test`: how often the test
  /// itself has starved the daemon, which does not count against the machine.
  [[nodiscard]] bool was_held_up(int made_by_test = 0) const {
    for (Process* const process : {daemon.get(), emulator.get()}) {
      if (process == nullptr || process->pid() <= 0) continue;
      process->signal(SIGTERM);
      static_cast<void>(process->wait(hang_max));
    }
    const auto says = [](const std::string& path, const char* words) {
      return read_file(path).find(words) != std::string::npos;
    };
    return starved_count() > made_by_test || says(log, end_not_whole) || says(log, "thread stalled") ||
           says(folder / "mmusim.out", "process was stalled");
  }
  /// Checked after each contactor command, every 50 ms where the machine has the time.
  template <class IsSo>
  [[nodiscard]] bool becomes(IsSo is_so) {
    const auto give_up_at = steady_clock::now() + hang_max;
    do {
      if (is_so()) return true;
      REQUIRE(listener.next(hang_max));
    } while (steady_clock::now() < give_up_at);
    return false;
  }
  /// The same for an effect that needs a closed pack: returns false once the contactors are open.
  template <class IsSo>
  [[nodiscard]] bool becomes_unless_open(IsSo is_so) {
    bool is_it = false;
    static_cast<void>(becomes([&] { return (is_it = is_so()) || is_open(listener.last()); }));
    return is_it;
  }
  void start_daemon(ProcessOptions options = {}) {
    if (options.err_fd < 0) options.err_file = log;
    daemon = std::make_unique<Process>(daemon_command(), options);
    prefer(*daemon);
  }
  /// A starved pack opens, as required. Where this is permitted the scheduler prefers both programs to all other work
  /// of the machine, as it would on board.
  static void prefer(const Process& process) {
    constexpr int niceness = -15;
    static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(process.pid()), niceness));
  }
  [[nodiscard]] std::vector<std::string> daemon_command() const {
    std::vector<std::string> words{program("bmud"), "--config", pack,          "--bus-internal", bus,
                                   "--socket",      socket,     "--log-level", "debug"};
    words.insert(words.end(), more_options.begin(), more_options.end());
    return words;
  }
  [[nodiscard]] Finished ask(std::vector<std::string> words) const {
    words.insert(words.begin(), {program("bmuctl"), "--socket", socket});
    return run_program(words);
  }
  [[nodiscard]] nlohmann::json ask_json(const std::string& command) const {
    return nlohmann::json::parse(ask({"--json", command}).out, nullptr, false);
  }

  static constexpr const char* end_not_whole = "not finished within the timeout";
  static inline int next_number = 0;
};

/// Returns the bench for which `drive`, which closes the pack and returns whether it then behaved as required, has
/// returned true; or the last. A daemon without a processor for some 130 ms opens for that, and one with such an
/// emulator opens for silence: both correct, but not the subject of the test. Then, and for no other reason, another
/// bench is driven, a few times at most.
template <class Made = Bench, class Drive>
[[nodiscard]] std::unique_ptr<Made> driven(Drive drive) {
  constexpr int drives_max = 5;
  for (int drives = 1;; ++drives) {
    auto bench = std::make_unique<Made>();
    if (drive(*bench) || drives == drives_max || !bench->was_held_up()) return bench;
    WARN("the machine held up the daemon or the emulator: driven once more");
  }
}

}  // namespace bmu::test
