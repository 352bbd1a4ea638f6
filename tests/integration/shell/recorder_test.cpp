// Recordings of the real daemon are replayed by the real bmureplay, with the same decisions.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"

namespace bmu {

using test::Bench;
using test::is_open;

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path().string());
  return paths;
}

nlohmann::json replayed(const std::string& path) {
  const Finished finished = run_program({program("bmureplay"), "--json", path});
  INFO(finished.out << finished.err);
  return nlohmann::json::parse(finished.out);
}

/// Queries the daemon until its status satisfies `is_wanted`.
template <class IsWanted>
bool status_becomes(const Bench& bench, IsWanted is_wanted, milliseconds at_most) {
  const auto deadline = steady_clock::now() + at_most;
  while (steady_clock::now() < deadline) {
    const auto status = bench.ask_json("status");
    if (status.is_object() && is_wanted(status["recorder"])) return true;
  }
  return false;
}

int end(Process& process, int signal) {
  process.signal(signal);
  return process.wait(test::hang_max);
}

/// Number of contactor commands that are received while a drive is recorded, each the result of one tick.
constexpr int commands_min = 40;

bool is_recorded_whole(const Bench& bench) {
  const std::string text = read_file(bench.log);
  return text.find(Bench::end_not_whole) == std::string::npos && text.find("thread stalled") == std::string::npos;
}

constexpr const char* name_of_cell_box = "-fault-cell-undervoltage.log.zst";

bool has_black_box_of_cell(const nlohmann::json& recorder) {
  const nlohmann::json& path = recorder["black_box_path"];
  return path.is_string() && path.get<std::string>().ends_with(name_of_cell_box);
}

}  // namespace

TEST_CASE("a drive that the daemon recorded decides again as it did", "[integration][recording][FS_6][bus]") {
  // If the writer thread was held up, the recording has a gap or lacks its end, and the log reports it.
  int ended = -1;
  const auto driven = test::driven([&](Bench& made) {
    made.more_options = {"--record", made.folder / "drive", "--black-box", "none"};
    made.start_emulator("");
    made.start_daemon();
    REQUIRE(made.listener.next(test::hang_max));
    REQUIRE(made.closes());
    made.send_event("load current_A 15");
    static_cast<void>(made.ask({"clear"}));  // a command is recorded, too
    CHECK(made.listener.hears_commands(commands_min));
    ended = end(*made.daemon, SIGTERM);
    return ended == 0 && is_recorded_whole(made);
  });
  CHECK(ended == 0);
  const Bench& bench = *driven;

  const auto files = files_in(bench.folder / "drive");
  REQUIRE(files.size() == 1);
  const auto run = replayed(files[0]);
  INFO(run.dump(1));
  CHECK(run["identical"] == true);
  CHECK(run["ticks"] > commands_min);
  CHECK(run["damages"].empty());
  CHECK_FALSE(std::filesystem::exists(bench.folder / "none"));
  // A failed write is no success.
  for (const std::string form : {"", "--json ", "--show-config "}) {
    INFO(form);
    const Finished full =
        run_program({"/bin/sh", "-c", program("bmureplay") + " --quiet " + form + files[0] + " >/dev/full"});
    CHECK(full.status == 1);
    CHECK(full.err == "bmureplay: cannot write: No space left on device\n");
  }
}

TEST_CASE("an opening leaves a black box that can be run again", "[integration][recording][black_box][bus]") {
  const int signal = GENERATE(SIGTERM, SIGKILL);
  CAPTURE(signal);
  int ended = -1;
  // An opening by a stall has its own black box: the test needs a pack that was never starved.
  const auto driven = test::driven([&](Bench& made) {
    made.more_options = {"--black-box", made.folder / "boxes"};
    made.start_emulator("");
    made.start_daemon();
    REQUIRE(made.listener.next(test::hang_max));
    REQUIRE(made.closes());
    REQUIRE(made.listener.hears_commands(commands_min));
    // Faults of a start that the machine held up, which closes() clears, have one, too. It is complete before the
    // opening, which else would be in it.
    const std::string boxes = made.folder / "boxes";
    const auto is_whole = [&](const nlohmann::json& recorder) {
      return recorder["black_boxes"] == files_in(boxes).size();
    };
    REQUIRE(status_becomes(made, is_whole, test::hang_max));
    made.send_event("cell 2.7 voltage_mV 2700");
    REQUIRE(made.listener.hears(is_open, test::hang_max));
    if (!status_becomes(made, has_black_box_of_cell, test::hang_max)) return false;
    const bool is_of_the_cell = made.ask_json("status")["last_opening"]["fault"] == "cell_undervoltage";
    ended = end(*made.daemon, signal);
    return is_of_the_cell && made.starved_count() == 0 && is_recorded_whole(made);
  });
  auto files = files_in(driven->folder / "boxes");
  CAPTURE(files, read_file(driven->log));
  CHECK(ended == (signal == SIGKILL ? 128 + SIGKILL : 0));
  std::erase_if(files, [](const std::string& file) { return !file.ends_with(name_of_cell_box); });
  REQUIRE(files.size() == 1);
  const auto run = replayed(files[0]);
  INFO(run.dump(1));
  CHECK(run["identical"] == true);
  if (signal == SIGKILL) {  // up to the opening, at which the power was lost
    CHECK(run["ticks"] > commands_min);
  } else {  // complete, because the daemon has ended in order
    CHECK(run["black_boxes"].at(0)["cause"].get<std::string>().find("cell 2.7 (no. 19)") != std::string::npos);
    CHECK(run["damages"].empty());
  }
}

TEST_CASE("a folder for recordings that cannot be made is told at start", "[integration][recording][bus]") {
  Bench bench;
  const std::string file = bench.folder.file("file", "not a folder");
  bench.more_options = {"--record", file + "/drive"};
  bench.start_daemon();
  CHECK(bench.daemon->wait(test::hang_max) == 71);
  std::ifstream log(bench.log);
  const std::string text(std::istreambuf_iterator<char>(log), {});
  CHECK(text.find("make folder " + file + "/drive: Not a directory") != std::string::npos);
}

}  // namespace bmu
