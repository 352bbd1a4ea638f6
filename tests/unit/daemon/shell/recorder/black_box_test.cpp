// Last minutes in memory, and the parts of them that are written to files.
#include "daemon/shell/recorder/black_box.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

namespace {

constexpr Duration part_length = 30s;

std::shared_ptr<const std::string> bytes(const std::string& text) {
  return std::make_shared<const std::string>(text);
}

/// Frame of one second, labelled by its number; every thirtieth begins a part.
RecordFrame second(int number) {
  const TimePoint from{std::chrono::seconds(number)};
  return {.bytes = bytes(std::to_string(number) + " "),
          .begins_part = std::chrono::seconds(number) % part_length == Duration{},
          .from = from,
          .until = from + 1s,
          .unix_time_us = std::int64_t{number} * 1'000'000};
}

BlackBoxCause cause_at(int number, bool is_routine = false) {
  return {.at = TimePoint{std::chrono::seconds(number)},
          .unix_time_us = std::int64_t{number} * 1'000'000,
          .word = "fault-x",
          .is_routine = is_routine,
          .head = bytes("why ")};
}

std::vector<std::string> files_of(const TemporaryFolder& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string seconds_text(int first, int last) {
  std::string text;
  for (int number = first; number <= last; ++number) text += std::to_string(number) + " ";
  return text;
}

struct Bench {
  TemporaryFolder folder;
  BlackBox box;
  int now = 0;

  explicit Bench(BlackBoxOptions options = {}) : box(with_folder(std::move(options), folder)) {}

  void run_to(int end) {
    for (; now < end; ++now) {
      box.add(second(now));
      box.write();
    }
  }
  static BlackBoxOptions with_folder(BlackBoxOptions options, const TemporaryFolder& folder) {
    if (options.folder.empty()) options.folder = folder.path().string();
    return options;
  }
};

}  // namespace

TEST_CASE("a black box has what was before, why, and the seconds after", "[unit][recording][black_box]") {
  Bench bench;
  bench.run_to(45);
  CHECK(files_of(bench.folder).empty());
  bench.box.trigger(cause_at(45));
  bench.box.write();
  REQUIRE(files_of(bench.folder) == std::vector<std::string>{"blackbox-19700101T000045.000Z-fault-x.log.zst"});
  // Written to disk at once: the cause of the opening may also interrupt the supply of the daemon.
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 44));
  CHECK(bench.box.files_written() == 0);

  bench.run_to(54);
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 53));
  CHECK(bench.box.files_written() == 0);
  bench.run_to(80);
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 54));
  CHECK(bench.box.files_written() == 1);
  CHECK_FALSE(bench.box.is_waiting());
}

TEST_CASE("the memory keeps whole parts that reach back far enough, and no more", "[unit][recording][black_box]") {
  Bench bench({.before = 60s});
  bench.run_to(89);
  CHECK(bench.box.memory_length() == 89s);
  bench.run_to(90);  // the part from 30 s covers a minute now
  CHECK(bench.box.memory_length() == 60s);
  bench.run_to(119);
  CHECK(bench.box.memory_length() == 89s);
  std::size_t size = seconds_text(30, 118).size();
  CHECK(bench.box.memory_bytes() == size);
  bench.box.trigger(cause_at(119));
  bench.box.write();
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(30, 118));
}

TEST_CASE("a flooded memory gives up old parts, but never the one that grows", "[unit][recording][black_box]") {
  Bench bench({.before = 600s, .memory_max_bytes = 200});
  bench.run_to(150);
  // A part has 30 frames of up to four letters: one whole part and the growing one are over the limit.
  CHECK(bench.box.memory_length() == 30s);
  CHECK(bench.box.memory_bytes() == seconds_text(120, 149).size());
}

TEST_CASE("what comes while a black box is open makes it longer", "[unit][recording][black_box]") {
  Bench bench;
  bench.run_to(10);
  bench.box.trigger(cause_at(10));
  bench.run_to(15);
  bench.box.trigger(cause_at(15));
  bench.run_to(60);
  REQUIRE(files_of(bench.folder).size() == 1);
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 14) + "why " + seconds_text(15, 24));
}

TEST_CASE("a fault behind a routine opening has a file of its own", "[unit][recording][black_box]") {
  Bench bench;
  bench.run_to(10);
  bench.box.trigger(cause_at(10, true));
  bench.run_to(13);
  bench.box.trigger(cause_at(13));
  bench.run_to(40);
  REQUIRE(files_of(bench.folder) == std::vector<std::string>{"blackbox-19700101T000010.000Z-routine-fault-x.log.zst",
                                                             "blackbox-19700101T000013.000Z-fault-x.log.zst"});
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 22));
}

TEST_CASE("causes that never end do not make one file without end", "[unit][recording][black_box]") {
  Bench bench({.longest = 30s});
  for (int number = 10; number < 100; number += 5) {
    bench.run_to(number);
    bench.box.trigger(cause_at(number));
  }
  bench.run_to(120);
  CHECK(files_of(bench.folder).size() == 3);
  CHECK(bench.box.files_written() == 3);
}

TEST_CASE("a disk that takes nothing gets it later", "[unit][recording][black_box][F75]") {
  const TemporaryFolder parent;
  Bench bench({.folder = parent / "later"});
  bench.run_to(5);
  bench.box.trigger(cause_at(5));
  bench.run_to(30);
  CHECK(bench.box.is_waiting());
  CHECK(bench.box.last_error() == "read folder " + (parent / "later") + ": No such file or directory");
  CHECK(bench.box.files_written() == 0);

  std::filesystem::create_directory(parent.path() / "later");
  bench.box.write();
  CHECK(bench.box.last_error().empty());
  CHECK(bench.box.files_written() == 1);
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 14));
}

TEST_CASE("of those that wait for a disk the oldest is given up, and counted", "[unit][recording][black_box][F75]") {
  const TemporaryFolder parent;
  Bench bench({.folder = parent / "later"});
  for (int box = 0; box < 6; ++box) {
    bench.run_to(20 * box + 5);
    bench.box.trigger(cause_at(20 * box + 5));
    bench.run_to(20 * box + 20);
  }
  CHECK(bench.box.files_lost() == 2);
  std::filesystem::create_directory(parent.path() / "later");
  bench.box.write();
  CHECK(bench.box.files_written() == 4);
}

TEST_CASE("a file that is there is not written over", "[unit][recording][black_box]") {
  Bench bench;
  bench.run_to(5);
  const std::string path = bench.folder.file("blackbox-19700101T000005.000Z-fault-x.log.zst", "precious");
  bench.box.trigger(cause_at(5));
  bench.box.write();
  CHECK(text_of(path) == "precious");
  CHECK(bench.box.last_error().empty());
  CHECK(bench.box.last_path() == bench.folder / "blackbox-19700101T000005.000Z-fault-x-2.log.zst");
}

TEST_CASE("routine openings go before faults when there are too many", "[unit][recording][black_box]") {
  Bench bench({.limits = {.count_max = 3}});
  const auto box_at = [&](int number, bool is_routine) {
    bench.run_to(number);
    bench.box.trigger(cause_at(number, is_routine));
    bench.run_to(number + 15);
  };
  box_at(5, false);
  box_at(25, true);
  box_at(45, true);
  box_at(65, false);
  CHECK(files_of(bench.folder) == std::vector<std::string>{"blackbox-19700101T000005.000Z-fault-x.log.zst",
                                                           "blackbox-19700101T000045.000Z-routine-fault-x.log.zst",
                                                           "blackbox-19700101T000105.000Z-fault-x.log.zst"});
}

TEST_CASE("at the end an open black box is whole as it is", "[unit][recording][black_box]") {
  Bench bench;
  bench.run_to(5);
  bench.box.trigger(cause_at(5));
  bench.run_to(7);
  bench.box.end();
  CHECK(bench.box.files_written() == 1);
  CHECK(text_of(bench.box.last_path()) == "why " + seconds_text(0, 6));
}
