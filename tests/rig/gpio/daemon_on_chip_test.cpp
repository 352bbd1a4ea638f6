// The real bmud with its contactors on lines of a chip of the kernel, and the modules, sensor and power distribution
// unit of mmusim on vcan0, in the emulated machine. The test provides the wiring: its auxiliary contacts follow the
// outputs, and it has the key and the emergency stop. Started by tests/rig/gpio_guest.sh.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "tests/rig/gpio/chip.hpp"
#include "tests/rig/gpio/insulation_monitor.hpp"
#include "tests/support/daemon_bench.hpp"

namespace bmu {

using namespace test;

namespace {

const std::string bus = "vcan0";
constexpr milliseconds patience{patience_ms};
constexpr std::int64_t tick_us = 10'000;

// --- the wiring -----------------------------------------------------------------------------------------------------

/// Auxiliary contacts that follow their contactor's output. In a thread of its own, which asserts nothing.
class Contacts {
 public:
  Contacts() : thread_([this] { follow(); }) {}
  Contacts(const Contacts&) = delete;
  Contacts& operator=(const Contacts&) = delete;
  ~Contacts() {
    is_over_ = true;
    thread_.join();
  }
  [[nodiscard]] bool works() const { return works_; }

 private:
  struct Wire {
    unsigned output = 0;
    unsigned contact = 0;
  };
  // Both ends of main_positive are active low.
  static constexpr Wire wires[] = {{positive_line, positive_contact_line},
                                   {negative_line, negative_contact_line},
                                   {precharge_line, precharge_contact_line}};

  static OwnedFd open_wire(unsigned line, int flags) {
    return OwnedFd(::open((chip_folder + "line" + std::to_string(line)).c_str(), flags | O_CLOEXEC));
  }
  /// 0 or 1; "?" if it cannot be read.
  static char level_of(unsigned line) {
    char level = '?';
    const OwnedFd fd = open_wire(line, O_RDONLY);
    return ::read(fd.get(), &level, 1) == 1 ? level : '?';
  }
  static bool set(unsigned line, char level) {
    const OwnedFd fd = open_wire(line, O_WRONLY);
    return ::write(fd.get(), &level, 1) == 1;
  }
  void follow() {
    while (!is_over_) {
      for (const Wire& wire : wires) {
        const char level = level_of(wire.output);
        works_ = works_ && level != '?' && (level == level_of(wire.contact) || set(wire.contact, level));
      }
      std::this_thread::sleep_for(milliseconds(5));
    }
  }

  std::atomic<bool> is_over_ = false;
  std::atomic<bool> works_ = true;
  std::thread thread_;
};

/// A car with its key off, and its daemon: all of it starts and ends with the test.
struct Car {
  PackFile pack;
  TemporaryFolder folder;
  std::string socket = folder / "bmud.sock";
  std::string driven = folder / "driven-lines.json";
  Listener listener{bus};
  std::unique_ptr<Contacts> contacts;
  std::unique_ptr<Process> world;
  std::unique_ptr<Process> daemon;

  explicit Car(bool has_pulses = false) {
    if (has_pulses) pack.capture_pulses();
    set_wire(estop_line, true);
    set_wire(key_line, false);
    contacts = std::make_unique<Contacts>();
    std::ofstream(folder / "calm.scn") << "0 pack soc_permille 600\n0 link capacitance_uF 600\n";
    world = std::make_unique<Process>(std::vector<std::string>{program("mmusim"), "--bus", bus, "--pack", pack.path(),
                                                               "--scenario", folder / "calm.scn"},
                                      ProcessOptions{.err_file = folder / "mmusim.log"});
    daemon = std::make_unique<Process>(
        std::vector<std::string>{program("bmud"), "--config", pack.path(), "--bus-internal", bus, "--bus-vehicle", bus,
                                 "--socket", socket, "--driven-lines", driven},
        ProcessOptions{.err_file = folder / "bmud.log"});
  }
  Car(const Car&) = delete;
  Car& operator=(const Car&) = delete;
  ~Car() {
    INFO(read_file(folder / "bmud.log"));
    CHECK(contacts->works());
    daemon.reset();
    // The wires keep their levels; the next test must start with open ones.
    static_cast<void>(open_gpio());
  }

  [[nodiscard]] Finished open_gpio() const {
    return run_program({program("bmud"), "--open-gpio", "--config", pack.path(), "--driven-lines", driven});
  }
  [[nodiscard]] nlohmann::json ask(const std::string& what) const {
    const Finished asked = run_program({program("bmuctl"), "--socket", socket, "--json", what});
    return nlohmann::json::parse(asked.out, nullptr, false);
  }
  /// Queries repeatedly; each query is a process, so that there is time between two.
  template <class IsWanted>
  [[nodiscard]] bool comes_to(IsWanted is_wanted) const {
    const auto deadline = steady_clock::now() + patience;
    while (steady_clock::now() < deadline) {
      const nlohmann::json status = ask("status");
      if (status.is_object() && is_wanted(status)) return true;
    }
    UNSCOPED_INFO(ask("status").dump());
    return false;
  }
  void require_may_close() const {
    INFO(read_file(folder / "bmud.log"));
    REQUIRE(comes_to([](const nlohmann::json& status) { return status.at("permission").at("may_close") == true; }));
  }
  void close() {
    require_may_close();
    set_wire(key_line, true);
    INFO(read_file(folder / "bmud.log"));
    REQUIRE(comes_to([](const nlohmann::json& status) { return status.at("state").at("phase") == "closed"; }));
  }
};

// --- log of the chip -------------------------------------------------------------------------------------------------

/// The contactors' outputs only, in order.
std::vector<Driven> contactors_of(const std::vector<Driven>& rows) {
  std::vector<Driven> found;
  for (const Driven& row : rows) {
    if (row.line == positive_line || row.line == negative_line || row.line == precharge_line) found.push_back(row);
  }
  return found;
}

struct Beat {
  std::size_t changes = 0;
  std::int64_t longest_us = 0;  // between two of them
};

Beat watchdog_of(const std::vector<Driven>& rows) {
  Beat beat;
  std::int64_t before_us = 0;
  for (const Driven& row : rows) {
    if (row.line != watchdog_line) continue;
    if (beat.changes++ > 0) beat.longest_us = std::max(beat.longest_us, row.at_us - before_us);
    before_us = row.at_us;
  }
  return beat;
}

void tell(const std::string& what, std::int64_t us) {
  std::printf("measured: %s: %lld.%03lld ms\n", what.c_str(), static_cast<long long>(us / 1000),
              static_cast<long long>(us % 1000));
}

}  // namespace

// --- closing and opening --------------------------------------------------------------------------------------------

TEST_CASE("a daemon closes its lines one after the other: main negative, precharge, main positive") {
  Car car;
  car.require_may_close();
  const Log log;
  car.close();
  const std::vector<Driven> rows = contactors_of(log.news());
  REQUIRE(rows ==
          std::vector<Driven>{{negative_line, 1}, {precharge_line, 1}, {positive_line, 0}, {precharge_line, 0}});
  tell("main negative to precharge", rows[1].at_us - rows[0].at_us);
  tell("precharge to main positive", rows[2].at_us - rows[1].at_us);
  tell("main positive to precharge off", rows[3].at_us - rows[2].at_us);
  // The pack file's settle_ms and precharge_min_ms, a tick early at most, as decisions are made at ticks.
  CHECK(rows[1].at_us - rows[0].at_us >= 100'000 - tick_us);
  CHECK(rows[2].at_us - rows[1].at_us >= 100'000 - tick_us);
  CHECK(rows[3].at_us > rows[2].at_us);
  CHECK(car.listener.hears([](const ContactorOutputs& outputs) { return is_closed(outputs); }, patience));
}

TEST_CASE("a daemon whose emergency stop line lets go opens its lines within two ticks") {
  Car car;
  car.close();
  const Log log;
  set_wire(estop_line, false);
  REQUIRE(car.comes_to([](const nlohmann::json& status) { return status.at("state").at("phase") == "open"; }));
  const std::vector<Driven> rows = log.news();
  REQUIRE(rows.size() > 2);
  const auto stop = std::find(rows.begin(), rows.end(), Driven{estop_line, 0});
  REQUIRE(stop != rows.end());
  const std::vector<Driven> opened = contactors_of(rows);
  CHECK(opened.size() == 2);  // and nothing closes again
  for (const Driven& line : {Driven{positive_line, 1}, Driven{negative_line, 0}}) {
    const auto row = std::find(opened.begin(), opened.end(), line);
    REQUIRE(row != opened.end());
    tell("emergency stop to line " + std::to_string(line.line) + " open", row->at_us - stop->at_us);
    CHECK(row->at_us - stop->at_us <= 2 * tick_us);
  }
  CHECK_FALSE(is_closed());
  // Released again, the stop leaves the pack open: the end of a fault is no request.
  static_cast<void>(car.listener.last());
  set_wire(estop_line, true);
  CHECK_FALSE(
      car.listener.hears([](const ContactorOutputs& outputs) { return outputs.any_contactor(); }, milliseconds(1000)));
}

TEST_CASE("a daemon whose insulation monitor's pulses end on their line opens within two seconds") {
  auto monitor = std::make_unique<InsulationMonitor>(ir155::Reading{ir155::State::normal, known(900'000)});
  Car car(true);
  CHECK(monitor->works());
  car.close();
  const nlohmann::json insulation = car.ask("status").at("insulation");
  INFO(insulation.dump());
  CHECK(insulation.at("state") == "normal");
  CHECK(insulation.at("frequency_mHz").get<int>() > 9'000);
  CHECK(insulation.at("frequency_mHz").get<int>() < 11'000);
  CHECK(insulation.at("resistance_Ohm").get<int>() > 700'000);
  CHECK(insulation.at("resistance_Ohm").get<int>() < 1'100'000);

  const Log log;
  CHECK(monitor->works());
  monitor.reset();
  REQUIRE(car.comes_to([](const nlohmann::json& status) { return status.at("state").at("phase") == "open"; }));
  CHECK_FALSE(is_closed());
  CHECK(car.ask("status").at("last_opening").at("fault") == "insulation_monitor_lost");
  std::int64_t last_edge_us = 0;
  for (const Driven& row : log.news()) {
    if (row.line == pulse_line) last_edge_us = row.at_us;
  }
  const std::vector<Driven> opened = contactors_of(log.news());
  REQUIRE(last_edge_us > 0);
  REQUIRE(opened.size() == 2);
  tell("last edge of the monitor to both lines open", opened.back().at_us - last_edge_us);
  CHECK(opened.back().at_us - last_edge_us <= 2'000'000 + 2 * tick_us);
}

// --- a daemon that is gone ------------------------------------------------------------------------------------------

TEST_CASE(
    "a daemon's watchdog line changes with its ticks and stands still once it is killed, its contactors left closed") {
  Car car;
  car.close();
  static_cast<void>(car.listener.last());
  const Log log;
  CHECK(car.listener.count_within(milliseconds(1000)) >= 19);
  const Beat beat = watchdog_of(log.news());
  tell("longest time between two changes of the watchdog line", beat.longest_us);
  CHECK(beat.changes >= 95);
  CHECK(beat.longest_us <= 3 * tick_us);

  car.daemon->signal(SIGKILL);
  REQUIRE(car.daemon->wait(patience) == 128 + SIGKILL);
  const Log later;
  static_cast<void>(car.listener.last());
  CHECK(car.listener.count_within(milliseconds(500)) == 0);
  CHECK(watchdog_of(later.news()).changes == 0);
  // The reason for the watchdog line and the stop hook.
  CHECK(contactors_of(later.news()).empty());
  CHECK(is_closed());
  // The pack file is being edited at that time.
  std::ofstream(car.pack.path(), std::ios::trunc) << "{ half a pack";
  const Finished opened = car.open_gpio();
  INFO(opened.err);
  CHECK(opened.status == 0);
  CHECK_FALSE(is_closed());
  const std::vector<Driven> rows = contactors_of(later.news());
  CHECK(std::find(rows.begin(), rows.end(), Driven{positive_line, 1}) != rows.end());
  CHECK(std::find(rows.begin(), rows.end(), Driven{negative_line, 0}) != rows.end());
}

TEST_CASE(
    "a daemon that was stopped opens its lines with its first tick, and closes them for a new turn of the key only") {
  Car car;
  car.close();
  car.daemon->signal(SIGSTOP);
  int status = 0;
  REQUIRE(::waitpid(car.daemon->pid(), &status, WUNTRACED) == car.daemon->pid());
  const Log log;
  static_cast<void>(car.listener.last());
  CHECK(car.listener.count_within(milliseconds(500)) == 0);
  CHECK(watchdog_of(log.news()).changes == 0);
  CHECK(contactors_of(log.news()).empty());
  CHECK(is_closed());

  const std::int64_t continued_us =
      std::chrono::duration_cast<std::chrono::microseconds>(monotonic_now().time_since_epoch()).count();
  car.daemon->signal(SIGCONT);
  const auto first = car.listener.next(patience);
  REQUIRE(first);
  CHECK(is_open(*first));
  // No edge of the watchdog's line, which is the lowest, comes before the contactors are open.
  const std::vector<Driven> rows = log.news();
  const auto edge = std::find_if(rows.begin(), rows.end(), [](const Driven& row) { return row.line == watchdog_line; });
  REQUIRE(edge != rows.end());
  const std::vector<Driven> before_edge = contactors_of({rows.begin(), edge});
  CHECK(std::find(before_edge.begin(), before_edge.end(), Driven{positive_line, 1}) != before_edge.end());
  CHECK(std::find(before_edge.begin(), before_edge.end(), Driven{negative_line, 0}) != before_edge.end());
  tell("continued to the first edge of the watchdog line, open", edge->at_us - continued_us);

  const nlohmann::json faults = car.ask("faults").at("faults");
  const auto gap = std::find_if(faults.begin(), faults.end(),
                                [](const nlohmann::json& row) { return row.at("name") == "control_loop_gap"; });
  REQUIRE(gap != faults.end());
  CHECK(gap->at("count_since_start") == 1);
  // The key is still on when the pack may close again, and that is no request.
  static_cast<void>(run_program({program("bmuctl"), "--socket", car.socket, "clear"}));
  car.require_may_close();
  static_cast<void>(car.listener.last());
  CHECK_FALSE(
      car.listener.hears([](const ContactorOutputs& outputs) { return outputs.any_contactor(); }, milliseconds(1000)));
  CHECK(contactors_of(log.news()).size() == 2);
  set_wire(key_line, false);
  REQUIRE(
      car.comes_to([](const nlohmann::json& now) { return now.at("state").at("inputs").at("vehicle_on") == false; }));
  car.close();
}

}  // namespace bmu
