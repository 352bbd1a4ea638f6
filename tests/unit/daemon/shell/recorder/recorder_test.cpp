// Recorder with its thread and real files.
#include "daemon/shell/recorder/recorder.hpp"

#include <chrono>
#include <ctime>
#include <filesystem>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>

#include "daemon/recording/replay.hpp"
#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/recorder/recorder_teller.hpp"
#include "mmu/scenario/scenario.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/common/line_reader.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;
using bmu::test::demo_pack;

namespace {

/// Pack that closes, has a low cell after five seconds, and opens.
struct Bench {
  PackConfig pack = demo_pack();
  std::unique_ptr<VirtualRun> run;
  std::unique_ptr<Recorder> recorder;

  explicit Bench(RecorderOptions options) {
    auto scenario =
        parse_scenario("0 pack soc_permille 800\n1 vehicle on\n+4 cell 2.7 voltage_mV 2700\n", core_vocabulary());
    REQUIRE(scenario);
    run = std::make_unique<VirtualRun>(pack.core, simulator_config(pack.core), *scenario);
    options.head = {.version = "0.1.0",
                    .buses = {.internal = "vcan0", .vehicle = "vcan0"},
                    .sources = pack.sources,
                    .hash = pack.core.hash};
    options.part_length = 2s;
    auto opened = Recorder::open(options, run->core());
    REQUIRE(opened);
    recorder = std::move(*opened);
    recorder->feed().begin(run->now());
    run->set_tap(&recorder->feed());
    recorder->start();
  }
  void run_to(Duration elapsed) {
    while (run->elapsed() < elapsed) run->step();
  }
  /// Runs as in real time: the thread finishes every second before the next. Entries offered while it holds the lock
  /// are not taken, so ticks continue until they are, one for each 10 ms that it was given.
  void run_with_thread_to(Duration elapsed) {
    for (Duration second = 1s; second <= elapsed; second += 1s) {
      run_to(second);
      REQUIRE(
          becomes([&](const RecorderStatus& status) { return status.memory_length >= second; }, [&] { run->step(); }));
    }
  }
  /// Waits for a status of the thread, which checks about once a second.
  template <class IsWanted, class Meanwhile>
  [[nodiscard]] bool becomes(IsWanted is_wanted, Meanwhile meanwhile) {
    const auto now = [] { return std::chrono::steady_clock::now(); };
    for (const auto deadline = now() + std::chrono::seconds(60); now() < deadline; meanwhile()) {
      for (const auto moment = now() + std::chrono::milliseconds(10); now() < moment; std::this_thread::yield()) {
        if (is_wanted(recorder->status())) return true;
      }
    }
    return false;
  }
  template <class IsWanted>
  [[nodiscard]] bool becomes(IsWanted is_wanted) {
    return becomes(is_wanted, [] {});
  }
};

std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path().string());
  return paths;
}

ReplayCounts replayed(const std::string& path) {
  const OwnedFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  REQUIRE(fd.is_open());
  LineReader reader(fd.get());
  LineReader::Line line;
  Replay replay({});
  while (true) {
    while (reader.take(line)) {
      if (!replay.take(line.text)) FAIL("line " << replay.problem()->line << ": " << replay.problem()->text);
    }
    const LineReader::Filled filled = reader.fill();
    REQUIRE(filled != LineReader::Filled::damaged);
    REQUIRE(filled != LineReader::Filled::error);
    if (filled == LineReader::Filled::end) break;
  }
  replay.end();
  return replay.counts();
}

/// Options for a full-length recording and black boxes.
RecorderOptions both_in(const TemporaryFolder& folder) {
  RecorderOptions options;
  options.files.folder = folder / "drive";
  options.black_box.folder = folder / "boxes";
  return options;
}

}  // namespace

TEST_CASE("a recorder writes what can be run again, at full length and around an opening", "[unit][recording][FS_6]") {
  const TemporaryFolder folder;
  Bench bench(both_in(folder));
  bench.run_to(9s);
  REQUIRE(bench.recorder->end(60s) == RecorderEnd::all_written);
  const RecorderStatus status = bench.recorder->status();
  CHECK(status.black_boxes == 1);
  CHECK(status.frames_lost == 0);
  CHECK(bench.recorder->pieces_lost() == 0);
  const auto drives = files_in(folder / "drive");
  const auto boxes = files_in(folder / "boxes");
  REQUIRE(drives.size() == 1);
  REQUIRE(boxes.size() == 1);
  CHECK(boxes[0] == status.black_box_path);
  for (const std::string& path : {drives[0], boxes[0]}) {
    const ReplayCounts counts = replayed(path);
    CAPTURE(path);
    CHECK(counts.ticks > 800);
    CHECK(counts.ticks_different == 0);
  }
}

TEST_CASE("a recording's times are those of the wall clock, however late it begins", "[unit][recording][F68]") {
  const TemporaryFolder folder;
  const PackConfig pack = demo_pack();
  const TimePoint began = monotonic_now() - 100s;  // start of the core
  Core core(pack.core, began, 0);
  RecorderOptions options;
  options.files.folder = folder / "drive";
  options.head = {.version = "0.1.0",
                  .buses = {.internal = "vcan0", .vehicle = "vcan0"},
                  .sources = pack.sources,
                  .hash = pack.core.hash};
  auto recorder = Recorder::open(options, core);
  REQUIRE(recorder);
  const std::int64_t unix_s = std::time(nullptr);
  (*recorder)->feed().begin(began);
  (*recorder)->start();
  (*recorder)->feed().decided(began, core.decide(began));
  REQUIRE((*recorder)->end(60s) == RecorderEnd::all_written);
  const auto drives = files_in(folder / "drive");
  REQUIRE(drives.size() == 1);
  const std::int64_t first_s = replayed(drives[0]).first_log_us / 1'000'000;
  CHECK(first_s > unix_s - 110);
  CHECK(first_s < unix_s - 90);
}

TEST_CASE("folders that go while it records are told, and what waits is written when they are back",
          "[unit][recording][F75]") {
  const TemporaryFolder folder;
  RecorderOptions options;
  options.files.folder = folder / "drive";
  options.black_box.folder = folder / "boxes";
  options.retry = 10ms;
  Bench bench(options);
  std::filesystem::remove_all(folder / "boxes");
  bench.run_with_thread_to(8s);
  RecorderTeller teller;
  std::vector<std::string> told;
  const auto tell = [&] {
    teller.tell(bench.recorder->status(), bench.recorder->pieces_lost(),
                [&](Severity, std::string_view line) { told.emplace_back(line); });
  };
  REQUIRE(bench.becomes([](const RecorderStatus& status) { return !status.black_box_error.empty(); }));
  tell();
  tell();
  REQUIRE(told.size() == 1);
  CHECK(told[0].find("black box: write failed, will be retried: ") == 0);

  std::filesystem::create_directory(folder / "boxes");
  REQUIRE(bench.becomes(
      [](const RecorderStatus& status) { return !status.black_box_path.empty() && status.black_box_error.empty(); }));
  tell();
  REQUIRE(told.size() == 3);
  CHECK(told[1].find("black box: ") == 0);
  CHECK(told[2] == "black box: written after a retry");
  bench.run_to(9s);
  REQUIRE(bench.recorder->end(60s) == RecorderEnd::all_written);
  CHECK(replayed(files_in(folder / "boxes").at(0)).ticks_different == 0);
}

TEST_CASE("a folder that cannot be made is refused", "[unit][recording]") {
  const TemporaryFolder folder;
  RecorderOptions options;
  options.files.folder = folder.file("file", "") + "/drive";
  const PackConfig pack = demo_pack();
  const auto core = std::make_unique<Core>(pack.core, TimePoint{1s});
  const auto recorder = Recorder::open(options, *core);
  REQUIRE_FALSE(recorder);
  CHECK(to_text(recorder.error()).find("make folder ") == 0);
}

TEST_CASE("at the end a disk that comes back in time gets all of it", "[unit][recording][black_box][F75]") {
  const TemporaryFolder folder;
  RecorderOptions options;
  options.black_box.folder = folder / "boxes";
  options.retry = 1h;
  Bench bench(options);
  std::filesystem::remove_all(folder / "boxes");
  bench.run_with_thread_to(8s);
  REQUIRE(bench.becomes([](const RecorderStatus& status) { return status.black_box_tries_failed == 1; }));
  std::future<RecorderEnd> end = std::async(std::launch::async, [&] { return bench.recorder->end(60s); });
  // Without success at first.
  REQUIRE(bench.becomes([](const RecorderStatus& status) { return status.black_box_tries_failed > 1; }));
  std::filesystem::create_directory(folder / "boxes");
  CHECK(end.get() == RecorderEnd::all_written);
  const RecorderStatus status = bench.recorder->status();
  CHECK(status.black_boxes == 1);
  CHECK(status.black_boxes_lost == 0);
  CHECK(replayed(files_in(folder / "boxes").at(0)).ticks_different == 0);
}

TEST_CASE("what no disk takes until the end is told", "[unit][recording][black_box][F75]") {
  const TemporaryFolder folder;
  RecorderOptions options;
  options.black_box.folder = folder / "boxes";
  Bench bench(options);
  std::filesystem::remove_all(folder / "boxes");
  bench.run_to(8s);
  // A thread without processor time is left writing, and counts its losses later.
  CHECK(bench.recorder->end(1s) != RecorderEnd::all_written);
  REQUIRE(bench.becomes([](const RecorderStatus& status) { return status.black_boxes_lost == 1; }));
  const RecorderStatus status = bench.recorder->status();
  CHECK(status.black_boxes == 0);
  std::vector<std::string> told;
  RecorderTeller().tell(status, 0, [&](Severity, std::string_view line) { told.emplace_back(line); });
  REQUIRE(!told.empty());
  CHECK(told.back() == "black box: 1 trigger without a complete black box");
}

TEST_CASE("where memory is short a recording ends before the hole, and goes on behind it", "[unit][recording][F75]") {
  const TemporaryFolder folder;
  Bench bench(both_in(folder));
  bench.run_with_thread_to(3s);
  {
    // Only a head exceeds a megabyte of text.
    const test::AllocationLimit limit(1'000'000);
    bench.run_to(7s);  // opens within this time
    REQUIRE(bench.becomes([](const RecorderStatus& status) { return status.frames_lost > 0; }));
  }
  bench.run_to(12s);
  REQUIRE(bench.recorder->end(60s) == RecorderEnd::all_written);
  CHECK(bench.recorder->status().frames_lost > 1);
  CHECK(bench.recorder->pieces_lost() == 0);
  CHECK(bench.recorder->status().black_boxes == 1);
  CHECK(bench.recorder->status().black_boxes_lost == 0);
  for (const char* const name : {"drive", "boxes"}) {
    const auto files = files_in(folder / name);
    REQUIRE(files.size() == 1);
    const ReplayCounts counts = replayed(files[0]);
    CAPTURE(files[0], counts.ticks);
    CHECK(counts.begun > 2);
    CHECK(counts.ticks > 200);
    CHECK(counts.ticks + 200 < bench.run->core().ticks());
    CHECK(counts.ticks_different == 0);
  }
}
