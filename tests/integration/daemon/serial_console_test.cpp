// The serial console on pseudo-terminals: by itself with a misbehaving peer, and in the real daemon.
#include "daemon/shell/serial/serial_console.hpp"

#include <atomic>
#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/ioctl.h>

#include "config/cell_count.hpp"
#include "daemon/shell/serial/cell_count_setting.hpp"
#include "daemon/shell/serial/serial_port.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/pseudo_terminal.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu {
namespace {

using test::Bench;
using test::milliseconds;
using test::PseudoTerminal;

/// A log of `count` lines: "line 1", "line 2".
LogSource numbered_log(int count) {
  return [count] {
    return [count, number = 0]() mutable -> Result<std::optional<std::string>, std::string> {
      if (number == count) return std::nullopt;
      return "line " + std::to_string(++number);
    };
  };
}

/// A console without a daemon.
struct Desk {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> told;
  std::unique_ptr<SerialConsole> console;
  // State of the service mode: a line at each query.
  bool has_service = false;
  std::atomic<bool> is_service_on = false;
  int service_lines = 0;

  void start(const std::string& device, LogSource log = empty_log()) {
    auto started = SerialConsole::start(
        {.device = device, .look_again = 10ms, .service_look = 10ms},
        {.set_cell_count = [](std::size_t) -> Result<CellCountSet, std::string> { return failure(std::string("no")); },
         .log_source = std::move(log),
         .set_service =
             has_service ? std::function<void(bool)>([this](bool is_on) { is_service_on = is_on; }) : nullptr,
         .take_service_line = [this] { return std::optional("value " + std::to_string(++service_lines)); },
         .log =
             [this](Severity, std::string_view line) {
               const std::lock_guard lock(mutex);
               told.emplace_back(line);
               changed.notify_all();
             }});
    REQUIRE(started);
    console = std::move(*started);
  }
  [[nodiscard]] bool hears(const std::string& text) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, test::hang_max, [&] { return count_of(text) > 0; });
  }
  [[nodiscard]] int count_of(const std::string& text) const {
    int count = 0;
    for (const std::string& line : told) count += line.find(text) != std::string::npos ? 1 : 0;
    return count;
  }
};

std::string shipped_pack() {
  return test::in_source("config/packs/lipo-6s-24v.json");
}

/// The shipped pack of six cells, with or without permission to set its number of cells.
PackConfig six_cells(bool may_set) {
  auto pack = load_pack_config(shipped_pack());
  REQUIRE(pack);
  pack->serial.may_set_cell_count = may_set;
  return *pack;
}

/// Replaces the precharge resistor in the text of that pack by one that is rated for the voltage of 25 cells.
void give_room_for_cells(std::string& pack_text) {
  const std::string before =
      "\"precharge_overcurrent_mA\": 1000, \"precharge_resistance_Ohm\": 100, \"precharge_energy_J\": 30";
  const std::size_t at = pack_text.find(before);
  REQUIRE(at != std::string::npos);
  pack_text.replace(
      at, before.size(),
      "\"precharge_overcurrent_mA\": 3000, \"precharge_resistance_Ohm\": 100, \"precharge_energy_J\": 1000");
}

/// The same with the larger resistor, and with permission for further modules.
PackConfig extendable(std::uint8_t modules_max) {
  PackConfig pack = six_cells(true);
  pack.serial.modules_max = modules_max;
  give_room_for_cells(pack.sources.pack_text);
  return pack;
}

}  // namespace

// --- the port -------------------------------------------------------------------------------------------------------

TEST_CASE("a terminal is set to raw, 8 bits without parity, and the rate that was asked for",
          "[integration][serial][BMS_NF.5][pty]") {
  const PseudoTerminal terminal;
  const auto port = open_serial_port(terminal.name(), 38'400);
  REQUIRE(port);
  termios settings{};
  REQUIRE(::tcgetattr(port->get(), &settings) == 0);
  CHECK(::cfgetispeed(&settings) == B38400);
  CHECK(::cfgetospeed(&settings) == B38400);
  CHECK((settings.c_lflag & (ECHO | ICANON | ISIG)) == 0U);
  CHECK((settings.c_oflag & OPOST) == 0U);
  CHECK((settings.c_iflag & (IXON | ICRNL)) == 0U);
  CHECK((settings.c_cflag & CSIZE) == tcflag_t{CS8});
  CHECK((settings.c_cflag & (PARENB | CSTOPB | CRTSCTS)) == 0U);
  CHECK((::fcntl(port->get(), F_GETFL) & O_NONBLOCK) != 0);
}

TEST_CASE("a terminal is the console's alone while it has it, and anybody's afterwards",
          "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name());
  CHECK(terminal.ask("LogReq") == "Log is empty\r\n");
  const OwnedFd other(::open(terminal.name().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!other.is_open()) {
    CHECK(errno == EBUSY);  // except for root
    return;
  }
  const auto is_exclusive = [&] {
    int answer = 0;
    REQUIRE(::ioctl(other.get(), TIOCGEXCL, &answer) == 0);
    return answer != 0;
  };
  CHECK(is_exclusive());
  desk.console.reset();
  CHECK_FALSE(is_exclusive());
}

TEST_CASE("what is no terminal, or none that is there, is refused by name", "[integration][serial][BMS_NF.5][pty]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("file", "");
  CHECK(to_text(open_serial_port(file, 38'400).error()) ==
        "take as a terminal " + file + ": Inappropriate ioctl for device");
  CHECK(to_text(open_serial_port(folder / "none", 38'400).error()) ==
        "open " + (folder / "none") + ": No such file or directory");
  const PseudoTerminal terminal;
  CHECK(open_serial_port(terminal.name(), 38'401).error().code == EINVAL);
}

// --- the console ----------------------------------------------------------------------------------------------------

TEST_CASE("commands over a terminal are answered, each with CR LF, and nothing is echoed",
          "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name());
  CHECK(terminal.ask("LogReq") == "Log is empty\r\n");
  CHECK(terminal.ask("CellC:08") == "Refused: no\r\n");
  CHECK(terminal.ask("nonsense") == "Unknown command \"nonsense\" (Help lists the commands)\r\n");
  terminal.type("Help\r");
  CHECK(terminal.read_to("Help      list of commands\r\n").starts_with("CellC:xx"));
  for (const char byte : std::string("\n\nLogReq\n")) terminal.type(std::string(1, byte));
  CHECK(terminal.read_to("\r\n") == "Log is empty\r\n");
  CHECK(desk.hears("serial console " + terminal.name() + ": \"CellC:08\": Refused: no"));
  CHECK(desk.hears("\"LogReq\""));
}

TEST_CASE("the log is dumped line by line, and one with an error says so", "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  SECTION("ten hours of minutes") {
    desk.start(terminal.name(), numbered_log(600));
    terminal.type("LogReq\r\n");
    std::string wanted;
    for (int number = 1; number <= 600; ++number) wanted += "line " + std::to_string(number) + "\r\n";
    CHECK(terminal.read_to("lines\r\n") == wanted + "End of log: 600 lines\r\n");
    CHECK(terminal.ask("LogReq") == "line 1\r\n");  // from the start again
  }
  SECTION("a disk that fails") {
    desk.start(terminal.name(), [] {
      return [first = true]() mutable -> Result<std::optional<std::string>, std::string> {
        if (!std::exchange(first, false)) return failure(std::string("input/output error"));
        return std::optional<std::string>("line 1");
      };
    });
    CHECK(terminal.ask("LogReq") == "line 1\r\n");
    CHECK(terminal.read_to("\r\n") == "The log cannot be read: input/output error\r\n");
    CHECK(terminal.ask("x").starts_with("Unknown"));
  }
}

TEST_CASE("the service mode sends values until it is switched off, and ends with who switched it on",
          "[integration][serial][BMS_NF.5b][pty]") {
  const TemporaryFolder folder;
  const std::string device = folder / "ttyUSB0";
  Desk desk;
  desk.has_service = true;
  auto first = std::make_unique<PseudoTerminal>();
  std::filesystem::create_symlink(first->name(), device);
  desk.start(device);
  CHECK(first->ask("Service:on") == "Service on: measured values once per second\r\n");
  CHECK(first->read_to("\r\n") == "value 1\r\n");
  CHECK(first->read_to("\r\n") == "value 2\r\n");
  CHECK(desk.is_service_on);
  first->type("Service:off\r");
  CHECK(first->read_to("Service off\r\n").ends_with("Service off\r\n"));
  CHECK(desk.hears("\"Service:off\": Service off"));
  CHECK_FALSE(desk.is_service_on);
  CHECK(first->ask("LogReq") == "Log is empty\r\n");  // and no value comes before it

  first->type("Service:on\r");
  CHECK(first->read_to("value").ends_with("value"));
  first->hang_up();
  REQUIRE(desk.hears(device + " is gone"));
  CHECK_FALSE(desk.is_service_on);
  PseudoTerminal second;
  std::filesystem::remove(device);
  std::filesystem::create_symlink(second.name(), device);
  CHECK(second.ask("LogReq") == "Log is empty\r\n");
}

TEST_CASE("a console that has no values refuses the service mode", "[integration][serial][BMS_NF.5b][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name());
  CHECK(terminal.ask("Service:on") == "Refused: nothing is measured here\r\n");
  CHECK(terminal.ask("LogReq") == "Log is empty\r\n");
}

TEST_CASE("any line ends a dump that is under way", "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name(), numbered_log(1'000'000'000));
  terminal.type("LogReq\n");
  CHECK(terminal.read_to("line 5000\r\n").size() > 5'000);
  terminal.type("nonsense\n");
  CHECK(terminal.read_to("commands)\r\n").find("Unknown command \"nonsense\"") != std::string::npos);
  terminal.type("CellC:08\n");
  CHECK(terminal.read_to("\r\n") == "Refused: no\r\n");
}

TEST_CASE("garbage without end is answered once it ends, and costs nothing", "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name());
  terminal.type(std::string(1'000'000, 'x'));
  terminal.type("\n");
  CHECK(terminal.read_to("\r\n").starts_with("Too long: "));
  terminal.type(std::string(1'000, '\0') + "\n");
  CHECK(terminal.read_to("\r\n").starts_with("Unreadable characters: "));
  CHECK(terminal.ask("LogReq") == "Log is empty\r\n");
}

TEST_CASE("who does not read is not listened to, until he does, then nothing is missing",
          "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name());
  std::string lines;
  for (int number = 100'000; number < 200'000; ++number) lines += std::to_string(number) + "\n";
  const std::size_t typed = terminal.type_some(lines, milliseconds(500));
  CHECK(typed > 100);
  CHECK(typed < 50'000);  // of 700 000: the remaining bytes were not accepted
  for (std::size_t number = 0; number < typed / 7; ++number) {
    const std::string answer = terminal.read_to("\r\n");
    const std::string wanted = "Unknown command \"" + std::to_string(100'000 + number) + "\"";
    if (!answer.starts_with(wanted)) FAIL("found " << answer << ", wanted " << wanted);
  }
}

TEST_CASE("orders without end fill the terminal, not the log of the daemon", "[integration][serial][BMS_NF.5][pty]") {
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name());
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 1'000; ++i) REQUIRE(terminal.ask("CellC:08") == "Refused: no\r\n");
  const auto took = std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - start);
  const std::lock_guard lock(desk.mutex);
  CHECK(desk.count_of("CellC:08") <= 5 * (took.count() + 2));
}

TEST_CASE("a device that is not there is told once and found when it comes, one that goes is lost with what was begun",
          "[integration][serial][BMS_NF.5][pty]") {
  const TemporaryFolder folder;
  const std::string device = folder / "ttyUSB0";
  Desk desk;
  desk.start(device);
  CHECK(desk.hears("open " + device + ": No such file or directory; retrying"));
  auto first = std::make_unique<PseudoTerminal>();
  std::filesystem::create_symlink(first->name(), device);
  CHECK(first->ask("LogReq") == "Log is empty\r\n");
  first->type("CellC:1");
  first->hang_up();
  CHECK(desk.hears(device + " disconnected"));

  PseudoTerminal second;
  std::filesystem::remove(device);
  std::filesystem::create_symlink(second.name(), device);
  CHECK(second.ask("LogReq") == "Log is empty\r\n");
  const std::lock_guard lock(desk.mutex);
  CHECK(desk.count_of("No such file or directory") <= 2);  // once per loss, of a hundred checks
  CHECK(desk.count_of("is gone") == 1);
}

TEST_CASE("a console whose log hangs in a disk does not hold up the end", "[integration][serial][BMS_NF.5][pty]") {
  struct Disk {
    std::mutex mutex;
    std::condition_variable changed;
    bool is_asked = false;
    bool is_back = false;
  };
  const auto disk = std::make_shared<Disk>();
  PseudoTerminal terminal;
  Desk desk;
  desk.start(terminal.name(), [disk] {
    return [disk]() -> Result<std::optional<std::string>, std::string> {
      std::unique_lock lock(disk->mutex);
      disk->is_asked = true;
      disk->changed.notify_all();
      disk->changed.wait(lock, [&] { return disk->is_back; });
      return std::nullopt;
    };
  });
  terminal.type("LogReq\n");
  {
    std::unique_lock lock(disk->mutex);
    REQUIRE(disk->changed.wait_for(lock, test::hang_max, [&] { return disk->is_asked; }));
  }
  const auto start = std::chrono::steady_clock::now();
  desk.console.reset();
  CHECK(std::chrono::steady_clock::now() - start < test::hang_max);  // the disk would hang permanently
  const std::lock_guard lock(disk->mutex);
  disk->is_back = true;
  disk->changed.notify_all();
}

// --- the number of cells --------------------------------------------------------------------------------------------

TEST_CASE("a pack with another number of cells is checked like any other", "[integration][serial][config][BMS_NF.5]") {
  const PackConfig pack = six_cells(true);
  const auto eight = with_cell_count(pack, 8);
  REQUIRE(eight);
  CHECK(cell_count(eight->core) == 8);
  CHECK(eight->core.hash != pack.core.hash);
  CHECK(eight->name == pack.name);
  CHECK_FALSE(with_cell_count(pack, 0));
  const auto thirteen = with_cell_count(pack, 13);
  REQUIRE_FALSE(thirteen);
  CHECK(thirteen.error().front().path == "/modules/0/cells");
}

TEST_CASE("13 to 16 cells are spread over two modules where the pack may have them",
          "[integration][serial][config][BMS_F.2b]") {
  const PackConfig pack = extendable(2);
  for (std::size_t count = 13; count <= 16; ++count) {
    CAPTURE(count);
    const auto more = with_cell_count(pack, count);
    REQUIRE(more);
    const auto& modules = more->core.modules;
    REQUIRE(modules.size() == 2);
    CHECK(cell_count(more->core) == count);
    CHECK(modules[0].node == 1);
    CHECK(modules[1].node == 2);
    CHECK(modules[0].cell_count == (count + 1) / 2);
    CHECK(modules[1].cell_count == count / 2);
    CHECK(modules[1].temperature_sensor_count == modules[0].temperature_sensor_count);
  }
  const auto twelve = with_cell_count(pack, 12);
  REQUIRE(twelve);
  CHECK(twelve->core.modules.size() == 1);
  const auto too_many = with_cell_count(pack, 25);
  REQUIRE_FALSE(too_many);
  CHECK(too_many.error().front().path == "/modules/0/cells");
}

TEST_CASE("a pack of 16 cells in two modules closes, and undervoltage of its last cell opens it",
          "[integration][serial][config][BMS_F.2b]") {
  const auto more = with_cell_count(extendable(2), 16);
  REQUIRE(more);
  VirtualRun run(more->core, simulator_config(more->core), *parse_scenario("0 pack soc_permille 700\n1.5 vehicle on"));
  const auto run_to = [&run](Duration end) {
    while (run.elapsed() < end) run.step();
  };
  run_to(6s);
  const Core& core = run.core();
  REQUIRE(core.sequence().phase == Phase::closed);
  CHECK(run.simulator().pdu().outputs().contactors[0]);
  CHECK(core.pack().modules_answering == 2);
  CHECK(core.pack().cell_voltage_uV.count == 16);
  for (const std::uint8_t node : {std::uint8_t{1}, std::uint8_t{2}}) {
    CAPTURE(int{node});
    CHECK(core.modules().find(node)->answers_complete > 20);
  }
  REQUIRE(run.simulator().apply("cell 2.8 voltage_mV 3000"));
  run_to(7s);
  CHECK(core.sequence().phase == Phase::open);
  CHECK_FALSE(run.simulator().pdu().outputs().contactors[0]);
  CHECK(core.last_opening().fault == FaultId::cell_undervoltage);
  const Element cell = core.faults().state(FaultId::cell_undervoltage).confirmed.element;
  CHECK(cell.module_node == 2);
  CHECK(cell.number == 8);
  CHECK(cell.pack_number == 16);
}

TEST_CASE("the further module keeps neither the node nor the serial number of the first",
          "[integration][serial][config][BMS_F.2b]") {
  PackConfig pack = extendable(3);
  const std::string before = "\"node\": 1,";
  const std::size_t at = pack.sources.pack_text.find(before);
  REQUIRE(at != std::string::npos);
  pack.sources.pack_text.replace(at, before.size(), "\"nodes\": [1], \"serial_numbers\": [4711],");
  const auto more = with_cell_count(pack, 25);
  REQUIRE(more);
  const auto& modules = more->core.modules;
  REQUIRE(modules.size() == 3);
  CHECK(modules[0].cell_count == 9);
  CHECK(modules[1].cell_count == 8);
  CHECK(modules[2].cell_count == 8);
  CHECK(modules[0].serial_number == 4711U);
  CHECK_FALSE(modules[1].serial_number.has_value());
  CHECK(modules[2].node == 3);
}

TEST_CASE("CellC:16 is in force from the next start on, and CellC:06 takes it back",
          "[integration][serial][BMS_F.2b]") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  PackConfig file = extendable(2);
  {
    CellCountSetting setting(file, state);
    const auto set = setting.set(16, true);
    REQUIRE(set);
    CHECK_FALSE(set->is_in_force);
  }
  {
    CellCountSetting setting(file, state);
    CHECK(setting.told() == "cell count override: 16 cells (serial console), pack file 6");
    CHECK(setting.pack().core.modules.size() == 2);
    CHECK(setting.set(16, true)->is_in_force);
    REQUIRE(setting.set(6, true));
  }
  CHECK(cell_count(CellCountSetting(file, state).pack().core) == 6);
  file.serial.modules_max = 1;  // that pack cannot be extended any more
  CHECK(CellCountSetting(file, state).set(16, true).error().starts_with("invalid with 16 cells: "));
}

TEST_CASE("CellC is refused unless the pack file allows it and the contactors are open",
          "[integration][serial][BMS_NF.5]") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  CHECK(CellCountSetting(six_cells(false), state).set(8, true).error() ==
        "not allowed by the pack file (serial/may_set_cell_count)");
  CHECK(CellCountSetting(six_cells(false), state).set(6, true).error().starts_with("the pack file"));
  CHECK(CellCountSetting(six_cells(true), state).set(8, false).error() ==
        "contactors not open, or close request active");
  CHECK(CellCountSetting(six_cells(true), "").set(8, true).error().find("--state") != std::string::npos);
  CHECK(CellCountSetting(six_cells(true), state).set(13, true).error().starts_with("invalid with 13 cells: "));
  CHECK(
      CellCountSetting(six_cells(true), folder / "none/state").set(8, true).error().starts_with("not stored: create "));
  auto many = load_pack_config(test::pack_file);
  REQUIRE(many);
  many->serial.may_set_cell_count = true;
  CHECK(CellCountSetting(*many, state).set(47, true).error() == "not available for a pack with 4 modules");
  CHECK(CellCountSetting(*many, state).set(48, true)->is_in_force);
  CHECK(std::filesystem::is_empty(folder.path()));  // no call has saved anything
}

TEST_CASE("a number of cells that was set is in force from the next start on, and can be taken back",
          "[integration][serial][BMS_NF.5]") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  const PackConfig file = six_cells(true);
  {
    CellCountSetting setting(file, state);
    CHECK(setting.told().empty());
    CHECK(setting.set(6, true)->is_in_force);
    const auto set = setting.set(8, true);
    REQUIRE(set);
    CHECK_FALSE(set->is_in_force);
    CHECK_FALSE(setting.set(8, true)->is_in_force);
    CHECK(cell_count(setting.pack().core) == 6);
  }
  {
    // In operation may_set_cell_count comes from the file's text; the text that is read again here does not contain it.
    CellCountSetting setting(file, state);
    CHECK(setting.told() == "cell count override: 8 cells (serial console), pack file 6");
    CHECK(cell_count(setting.pack().core) == 8);
    CHECK(setting.set(8, true)->is_in_force);
    CHECK_FALSE(setting.set(6, true)->is_in_force);
  }
  const CellCountSetting setting(file, state);
  CHECK(setting.told().empty());
  CHECK(cell_count(setting.pack().core) == 6);
}

TEST_CASE("a number of cells that is damaged, of another pack file, or no longer allowed is not in force",
          "[integration][serial][BMS_NF.5]") {
  const TemporaryFolder folder;
  const std::string state = folder / "state.json";
  const std::string kept = state + ".cells";
  PackConfig file = six_cells(true);
  REQUIRE(CellCountSetting(file, state).set(7, true));
  REQUIRE(CellCountSetting(file, state).set(8, true));
  REQUIRE(cell_count(CellCountSetting(file, state).pack().core) == 8);
  const std::string good = read_file(kept);
  const auto in_force = [&] {
    const CellCountSetting setting(file, state);
    CHECK_FALSE(setting.told().empty());
    return cell_count(setting.pack().core);
  };
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string text = good;
    text[at] = static_cast<char>(text[at] ^ 1);
    std::ofstream(kept, std::ios::binary) << text;
    if (in_force() != 6) FAIL_CHECK("byte " << at);
    std::ofstream(kept, std::ios::binary) << good.substr(0, at);
    if (in_force() != 6) FAIL_CHECK("cut off at " << at);
  }
  std::ofstream(kept, std::ios::binary) << good;
  file.core.hash ^= 1U;
  CHECK(in_force() == 6);
  file.core.hash ^= 1U;
  CHECK(in_force() == 8);
  file.serial.may_set_cell_count = false;
  CHECK(cell_count(CellCountSetting(file, state).pack().core) == 6);
}

// --- in the daemon --------------------------------------------------------------------------------------------------

namespace {

/// The shipped pack of six cells with a section for the console, on its own terminal.
struct SerialBench : Bench {
  PseudoTerminal terminal;
  std::string state = folder / "state.json";

  void start(bool may_set, const std::string& scenario) {
    const std::string may = may_set ? "true" : "false";
    pack =
        folder.file("pack.json", pack_text(R"("device": ")" + terminal.name() + R"(", "may_set_cell_count": )" + may));
    start_emulator(scenario);
    begin();
  }
  /// The same pack with permission for a second module, beside two emulated modules of 8 cells.
  void start_beside_16_cells() {
    std::string text =
        pack_text(R"("modules_max": 2, "device": ")" + terminal.name() + R"(", "may_set_cell_count": true)");
    give_room_for_cells(text);
    const std::string one = R"({"node": 1, "cells": 6,)";
    std::string two = text;
    REQUIRE(two.find(one) != std::string::npos);
    two.replace(two.find(one), one.size(), R"({"nodes": [1, 2], "cells": 8,)");
    pack = folder.file("emulated.json", two);
    start_emulator("");
    pack = folder.file("pack.json", text);
    begin();
  }
  [[nodiscard]] static std::string pack_text(const std::string& serial) {
    std::string text = read_file(shipped_pack());
    const std::string cell = "../cells/lipo-3300.json";
    text.replace(text.find(cell), cell.size(), test::in_source("config/cells/lipo-3300.json"));
    const std::string name = R"("name": "LiPo 6s 24 V",)";
    text.insert(text.find(name), R"("serial": {)" + serial + "},\n  ");
    return text;
  }
  void begin(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = daemon_command();
    command.insert(command.end(), {"--state", state});
    command.insert(command.end(), more.begin(), more.end());
    daemon = std::make_unique<Process>(command, ProcessOptions{.err_file = log});
    prefer(*daemon);
    REQUIRE(listener.next(test::hang_max));
  }
  void end() {
    daemon->signal(SIGTERM);
    REQUIRE(daemon->wait(test::hang_max) == 0);
    static_cast<void>(listener.last());
  }
};

}  // namespace

TEST_CASE("the daemon answers on the terminal of its pack file, or of its command line, and the loop does not notice",
          "[integration][daemon][serial][BMS_NF.5][bus][pty]") {
  SerialBench bench;
  bench.start(false, "");
  CHECK(bench.terminal.ask("LogReq") == "Log is empty\r\n");
  CHECK(bench.terminal.ask("CellC:06") == "Refused: not allowed by the pack file (serial/may_set_cell_count)\r\n");
  CHECK(bench.terminal.ask("Service:on") == "Service on: measured values once per second\r\n");
  CHECK(bench.terminal.read_to("\r\n").find(" R:") != std::string::npos);
  bench.terminal.type("Service:off\r");
  CHECK(bench.terminal.read_to("Service off\r\n").ends_with("Service off\r\n"));
  REQUIRE(bench.ends_whole([&] { bench.begin(); }));
  PseudoTerminal other;
  bench.begin({"--serial", other.name()});
  // The previous session has stored its incomplete minute; one with an incomplete end may have stored it, too.
  int lines = 0;
  std::string line = other.ask("LogReq");
  for (; line.find(" C:") != std::string::npos; line = other.read_to("\r\n")) ++lines;
  CAPTURE(line);
  CHECK(lines > 0);
  CHECK(line.starts_with("End of log: " + std::to_string(lines) + " "));
  // The answers are not read.
  CHECK(other.type_some(std::string(200'000, '\n') + std::string(200'000, 'x'), milliseconds(200)) > 0);
  CHECK(bench.listener.hears_commands(20));
  CHECK(bench.becomes([&] {
    return read_file(bench.log).find("serial console " + bench.terminal.name() + ": \"CellC:06\": Refused: the pack") !=
           std::string::npos;
  }));
  bench.end();
}

TEST_CASE("while the daemon creates its history the log is empty, and that is no failure",
          "[integration][daemon][serial][history][bus][pty]") {
  SerialBench bench;
  bench.start(false, "");
  for (int start = 0; start < 3; ++start) {
    for (int i = 0; i < 20; ++i) REQUIRE(bench.terminal.ask("LogReq") == "Log is empty\r\n");
    bench.end();
    // Including the incomplete minute.
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(bench.folder / "history.sqlite" + end);
    bench.begin();
  }
}

TEST_CASE(
    "CellC is refused while the pack is closed, allowed and open it counts from the next start, and modules that "
    "have other cells keep the pack open",
    "[integration][daemon][serial][BMS_NF.5][BMS_F.2][bus][pty]") {
  const std::string refused = "Refused: contactors not open, or close request active\r\n";
  std::string answer;
  const auto driven = test::driven<SerialBench>([&](SerialBench& made) {
    made.start(true, "");
    REQUIRE(made.closes());
    answer = made.terminal.ask("CellC:08");
    return answer == refused;
  });
  CHECK(answer == refused);
  SerialBench& bench = *driven;
  CHECK_FALSE(std::filesystem::exists(bench.state + ".cells"));
  bench.send_event("vehicle off");
  REQUIRE(bench.listener.hears(test::is_open, test::hang_max));
  REQUIRE(bench.becomes([&] { return bench.terminal.ask("CellC:08") == "New Cell Count:08\r\n"; }));
  CHECK(bench.terminal.read_to("\r\n") == "Effective after a restart of bmud.\r\n");
  CHECK(bench.ask_json("status").at("faults_present").dump().find("wrong_cell_count") == std::string::npos);
  bench.end();

  bench.begin();
  CHECK(bench.becomes([&] {
    return read_file(bench.log).find("cell count override: 8 cells (serial console), pack file 6") != std::string::npos;
  }));
  REQUIRE(bench.becomes([&] {
    return bench.ask_json("status").at("faults_present").dump().find("wrong_cell_count") != std::string::npos;
  }));
  CHECK(bench.ask_json("status").at("permission").at("may_close") == false);
  CHECK(bench.terminal.ask("CellC:06") == "New Cell Count:06\r\n");
  bench.end();
}

TEST_CASE("CellC:16 on the terminal: the restarted daemon closes two modules of 8 cells, and opens for the last cell",
          "[integration][daemon][serial][BMS_F.2b][bus][pty]") {
  std::string asked;
  nlohmann::json before;
  nlohmann::json closed;
  nlohmann::json opening;
  const auto bench = test::driven<SerialBench>([&](SerialBench& made) {
    made.start_beside_16_cells();
    REQUIRE(made.becomes([&] { return (asked = made.terminal.ask("CellC:16")) == "New Cell Count:16\r\n"; }));
    CHECK(made.terminal.read_to("\r\n") == "Effective after a restart of bmud.\r\n");
    before = made.ask_json("status");
    made.end();
    made.begin();
    REQUIRE(made.closes());
    closed = made.ask_json("status");
    made.send_event("cell 2.8 voltage_mV 3000");
    REQUIRE(made.listener.hears(test::is_open, test::hang_max));
    opening = made.ask_json("why").at("last_opening");
    return closed.at("state").at("phase") == "closed" && opening.at("fault") == "cell_undervoltage";
  });
  INFO(closed.dump(1) << opening.dump(1));
  CHECK(before.at("values").at("cell_voltage").at("expected") == 6);
  CHECK(before.at("permission").at("may_close") == false);
  CHECK(closed.at("state").at("phase") == "closed");
  CHECK(closed.at("modules_answering") == 2);
  CHECK(closed.at("values").at("cell_voltage").at("count") == 16);
  CHECK(opening.at("fault") == "cell_undervoltage");
  const nlohmann::json& cell = opening.at("steps").at(0).at("element");
  CHECK(cell.at("module") == 2);
  CHECK(cell.at("number") == 8);
  CHECK(cell.at("pack_number") == 16);
  CHECK(read_file(bench->log).find("cell count override: 16 cells (serial console), pack file 6") != std::string::npos);
}

}  // namespace bmu
