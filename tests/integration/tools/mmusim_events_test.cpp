// mmusim with live events from an operator while it runs.
#include <array>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

const std::string pack_file = test::in_source("config/packs/demo-48s.json");

/// An emulated pack on its own bus; its script ends it once the key was on, and then off.
struct Bench {
  TemporaryFolder folder;
  std::string pipe = folder / "events";
  std::string told;  // standard error so far
  OwnedFd reader;
  std::unique_ptr<Process> process;

  Bench() {
    std::ofstream(folder / "key.scn") << "wait frame PDU_STATUS vehicle_on = 1 within 60\n"
                                         "wait frame PDU_STATUS vehicle_on = 0 within 60\npass\n";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  }
  /// `before`: for a shell, commands before this program; '@' is the position of the program.
  void start(const std::string& events, const std::string& before = "@") {
    std::array<int, 2> ends{};
    REQUIRE(::pipe2(ends.data(), O_CLOEXEC) == 0);
    reader = OwnedFd(ends[0]);
    const OwnedFd writer(ends[1]);
    const std::string line = program("mmusim") + " --pack " + pack_file + " --bus unix:test-events-" +
                             std::to_string(::getpid()) + " --scenario " + folder / "key.scn" + " --events " + events;
    std::string whole = before;
    whole.replace(whole.find('@'), 1, line);
    process = std::make_unique<Process>(
        std::vector<std::string>{"/bin/sh", "-c", whole},
        ProcessOptions{.environment = {}, .out_file = folder / "out", .err_fd = writer.get()});
  }
  /// An operator who opens the pipe, writes, and closes it.
  void write(const std::string& text) const {
    const OwnedFd fd(::open(pipe.c_str(), O_WRONLY | O_CLOEXEC));  // waits for its reader
    REQUIRE(::write(fd.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  /// Reads until the text was reported; false if the output ends before.
  [[nodiscard]] bool tells(const std::string& text) {
    std::array<char, 4096> part{};
    while (told.find(text) == std::string::npos) {
      const auto length = ::read(reader.get(), part.data(), part.size());
      if (length <= 0) return false;
      told.append(part.data(), static_cast<std::size_t>(length));
    }
    return true;
  }
  [[nodiscard]] int end() { return process->wait(test::hang_max); }
};

constexpr const char* key_seen = "vehicle_on = 1 within 60: after";

}  // namespace

TEST_CASE("what is written into a pipe happens, whoever writes it, and what cannot be is told with its place",
          "[integration][mmusim][bus]") {
  Bench bench;
  bench.start(bench.pipe);
  bench.write(
      "\xEF\xBB\xBF# what follows is nonsense\n\nvehcle on\n  cell 9.1 voltage_mV 2700\nvehicle on   # the key\n");
  REQUIRE(bench.tells(key_seen));
  CHECK(bench.told.find("mmusim: " + bench.pipe + ":3:1: found 'vehcle', expected a target") != std::string::npos);
  CHECK(bench.told.find("mmusim: " + bench.pipe + ":4:1: found ") != std::string::npos);
  CHECK(bench.told.find(" s  vehicle on") != std::string::npos);
  bench.write("cell 2.7 voltage_mV ..2700 over 1\nvehi");
  REQUIRE(bench.tells(" s  cell 2.7 voltage_mV ..2700 over 1"));
  bench.write("cle off");
  bench.write("\n");
  CHECK(bench.end() == 0);
  CHECK(read_file(bench.folder / "out").find("events from outside: 3 taken, 2 refused") != std::string::npos);
}

TEST_CASE("a line that is too long is refused whatever it begins with, and the next one counts",
          "[integration][mmusim][bus]") {
  Bench bench;
  bench.start(bench.pipe);
  bench.write("vehicle off" + std::string(4096 - 11, ' ') + "\nload current_A 1" + std::string(5'000, ' ') + "5\n" +
              "# " + std::string(9'000, 'x') + "\nvehicle on\n");
  REQUIRE(bench.tells(key_seen));
  CHECK(bench.told.find(bench.pipe + ":2:1: found a line that is too long, expected 4096 bytes at most") !=
        std::string::npos);
  CHECK(bench.told.find(bench.pipe + ":1:") == std::string::npos);
  CHECK(bench.told.find("load current_A 1") == std::string::npos);
  bench.write("vehicle off\n");
  CHECK(bench.end() == 0);
}

TEST_CASE("standard input is taken for events, too, and its end ends nothing", "[integration][mmusim][bus]") {
  Bench bench;
  // Text without a newline counts as a line; the script switches the key off long after.
  std::ofstream(bench.folder / "key.scn") << "wait frame PDU_STATUS vehicle_on = 1 within 60\n+0.5 vehicle off\n"
                                             "wait frame PDU_STATUS vehicle_on = 0 within 60\npass\n";
  bench.start("-", "printf 'vehicle on' | @");
  CHECK(bench.end() == 0);
  CHECK(bench.tells(" s  vehicle on"));
}

TEST_CASE("events from what is no pipe, and in virtual time, are refused", "[integration][mmusim]") {
  const auto said = [](const std::string& events, const std::string& more) {
    return run_program(
        {"/bin/sh", "-c",
         program("mmusim") + " --pack " + pack_file + " --bus unix:test-no-events --events " + events + " " + more});
  };
  const Finished file = said(pack_file, "");
  CHECK(file.status == 1);
  CHECK(file.err ==
        "mmusim: " + pack_file + ": found neither a pipe nor a terminal; events in a file are a --scenario\n");
  CHECK(said("-", "</dev/null").err.starts_with("mmusim: standard input: found neither a pipe nor a terminal"));
  const Finished nothing = said("/nowhere/events", "");
  CHECK(nothing.status == 1);
  CHECK(nothing.err.find("/nowhere/events: cannot be opened, expected a pipe (mkfifo)") != std::string::npos);
  const Finished waits = run_program({program("mmusim"), "--pack", pack_file, "--with-master", "--events", "-"});
  CHECK(waits.status == 2);
  CHECK(waits.err.find("--events") != std::string::npos);
}

}  // namespace bmu
