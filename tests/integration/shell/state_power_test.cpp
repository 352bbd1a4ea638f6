// Loss of power at every call while the state is written; failure of every call; and files with arbitrary contents. The
// text read back is the old state or the new one, complete.
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/shell/state/state_file.hpp"
#include "daemon/shell/state/state_text.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/model_disk.hpp"
#include "tests/support/process.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {
namespace {

using test::DiskImage;
using test::ModelDisk;
using test::PowerIsGone;

const std::string path = "/state/state.json";

/// A state with the same number in all its sections, so that a mixture of two is detected: faults, contactors' wear,
/// counters, capacities, states of charge.
PersistentState state_of(std::uint32_t number) {
  PersistentState state;
  state.faults[static_cast<std::size_t>(FaultId::cell_deep_discharge)] = {.count = number, .is_locked = true};
  for (ContactorWear& wear : state.contactors) wear = {.closings = number, .openings = number};
  state.closing.lockout_ms = number;
  state.modules[1] = {.is_known = true, .serial_number = number};
  state.cell_charges = {.unix_time_ms = 1'700'000'000'000, .capacity_uAs = 1'000'000 + number};
  state.cell_charges.modules[1] = {.cell_count = 1, .serial_number = number, .cells = {{{number, number}}}};
  state.totals = {.charge_out_uAs = number, .charge_in_uAs = number, .energy_out_mWh = number, .energy_in_mWh = number};
  state.soc = {.is_kept = true, .capacity_uAs = 1'000'000 + number, .told_ppm = static_cast<std::int32_t>(number)};
  state.soc.modules[1].cell_count = 1;
  state.soc.modules[1].cells[0] = {.soc_ppm = static_cast<std::int32_t>(number),
                                   .health = {.capacity_ppm = static_cast<std::int32_t>(number)}};
  return state;
}

std::string text_of(std::uint32_t number) {
  return state_text(state_of(number));
}

constexpr std::uint32_t older = 1;
constexpr std::uint32_t old = 2;
constexpr std::uint32_t fresh = 3;
constexpr std::uint32_t next = 4;

/// The number of the state that is read; 0: none.
std::uint32_t read_number(StateFile& file) {
  std::uint32_t number = 0;
  std::string problems;
  const auto take = [&number](std::string_view text) -> Result<void, std::string> {
    const auto read = parse_state(text);
    if (!read) return failure(read.error());
    number = read->state.contactors[0].closings;
    if (read->state != state_of(number) || !read->soc_problem.empty() || !read->charges_problem.empty()) {
      FAIL_CHECK("a state of several numbers: " << text);
    }
    return {};
  };
  const FileFound found = file.read(take, problems);
  const bool is_there = found == FileFound::newest || found == FileFound::previous;
  return is_there ? number : 0;
}
/// Each distinct disk is read once: cuts at other calls mostly give the same disks.
std::uint32_t read_number(const DiskImage& image) {
  static std::map<DiskImage, std::uint32_t> numbers;
  const auto known = numbers.find(image);
  if (known != numbers.end()) return known->second;
  ModelDisk disk(image);
  StateFile file(path, disk);
  return numbers[image] = read_number(file);
}

/// One session: reads, and writes `number`. False: the power was lost.
bool live(ModelDisk& disk, std::uint32_t number) {
  StateFile file(path, disk);
  static_cast<void>(read_number(file));
  try {
    const auto written = file.write(text_of(number));
    REQUIRE(written);
    return true;
  } catch (const PowerIsGone&) {
    return false;
  }
}

/// Disks that differ only in the part of an unfinished file are of one kind.
DiskImage kind_of(DiskImage image) {
  static const std::set<std::string> whole{"", text_of(older), text_of(old), text_of(fresh), text_of(next)};
  const auto unfinished = image.find(path + ".new");
  if (unfinished != image.end() && whole.count(unfinished->second) == 0) unfinished->second = "part";
  return image;
}

struct Survey {
  int cuts = 0;  // until the sequence was completed
  std::set<DiskImage> kinds;
  std::uint64_t disks = 0;
};

/// A session that writes `number`, cut at each of its calls in turn; each possible disk must read as one of `before`
/// and `number`, and as `number` once the session has not been cut. `looks_at_all` false: one disk of each kind.
Survey cut_everywhere(const DiskImage& start, std::uint32_t before, std::uint32_t number, bool looks_at_all) {
  Survey survey;
  bool is_done = false;
  while (!is_done) {
    ModelDisk disk(start, survey.cuts);
    is_done = live(disk, number);
    std::set<DiskImage> kinds;
    disk.for_each_disk([&](const DiskImage& image) {
      ++survey.disks;
      if (!kinds.insert(kind_of(image)).second && !looks_at_all) return;
      const std::uint32_t read = read_number(image);
      if (read == number || (read == before && !is_done)) return;
      FAIL_CHECK("cut at call " << survey.cuts << ": read " << read << ", wanted " << before << " or " << number);
    });
    survey.kinds.merge(kinds);
    if (!is_done) ++survey.cuts;
  }
  return survey;
}

struct Start {
  const char* name;
  DiskImage image;
  std::uint32_t reads;
};

std::vector<Start> starts() {
  const std::string half = text_of(next).substr(0, 500);
  return {{"a first start", {}, 0},
          {"one generation", {{path, text_of(old)}}, old},
          {"two generations", {{path, text_of(old)}, {path + ".previous", text_of(older)}}, old},
          {"a cut life left a part of a file", {{path, text_of(old)}, {path + ".new", half}}, old},
          {"a cut life left a whole file",
           {{path, text_of(old)}, {path + ".previous", text_of(older)}, {path + ".new", text_of(next)}},
           old},
          {"a life was cut between its renames", {{path + ".previous", text_of(old)}, {path + ".new", half}}, old},
          {"the newest is damaged", {{path, half}, {path + ".previous", text_of(old)}}, old},
          {"the newest is damaged, again",
           {{path, half}, {path + ".previous", text_of(old)}, {path + ".damaged", "rubbish"}},
           old}};
}

// --- the system's calls, with a failure ---

/// Calls that are forwarded to the system, counted from start(); derived classes define the event at one of them.
class CountedCalls : public FileCalls {
 public:
  int open(const char* name, int flags, mode_t mode) override {
    return fails("open") ? -1 : FileCalls::open(name, flags, mode);
  }
  ssize_t write(int fd, const void* from, std::size_t size) override {
    // In small pieces, as on a disk that is almost full: more calls at which to cut.
    const std::size_t part = std::min<std::size_t>(size, 400);
    return fails("write") ? -1 : FileCalls::write(fd, from, part);
  }
  int sync(int fd) override { return fails("sync") ? -1 : FileCalls::sync(fd); }
  int rename(const char* from, const char* to) override { return fails("rename") ? -1 : FileCalls::rename(from, to); }
  int unlink(const char* name) override { return fails("unlink") ? -1 : FileCalls::unlink(name); }

  void start() { count_ = 0; }
  /// -1: not started.
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] const std::string& last() const { return last_; }

 protected:
  /// Called with each call; true: it fails, with errno set.
  virtual bool happens(int number) = 0;

 private:
  bool fails(const char* what) {
    if (count_ < 0 || !happens(count_++)) return false;
    last_ = what;
    return true;
  }

  int count_ = -1;
  std::string last_;
};

class KillingCalls final : public CountedCalls {
 public:
  explicit KillingCalls(int at) : at_(at) {}

 private:
  bool happens(int number) override {
    if (number == at_) ::kill(::getpid(), SIGKILL);
    return false;
  }
  int at_;
};

class FailingCalls final : public CountedCalls {
 public:
  FailingCalls(int at, int code) : at_(at), code_(code) {}

 private:
  bool happens(int number) override {
    if (number != at_) return false;
    errno = code_;
    return true;
  }
  int at_;
  int code_;
};

/// Names and contents of the files in a folder.
DiskImage image_of(const std::filesystem::path& folder) {
  DiskImage image;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    image[entry.path().filename().string()] = read_file(entry.path().string());
  }
  return image;
}

/// A separate process that reads the state and writes the new one; true: it was killed before the end.
bool is_killed(const std::string& file_path, int at) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    KillingCalls calls(at);
    StateFile file(file_path, calls);
    std::string problems;
    const auto take = [](std::string_view) -> Result<void, std::string> { return {}; };
    static_cast<void>(file.read(take, problems));
    calls.start();
    ::_exit(file.write(text_of(fresh)) ? 0 : 1);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  if (WIFSIGNALED(status)) return true;
  REQUIRE(WIFEXITED(status));
  REQUIRE(WEXITSTATUS(status) == 0);
  return false;
}

}  // namespace

// --- power ----------------------------------------------------------------------------------------------------------

TEST_CASE("a power loss at any call of writing leaves the old state or the new one, whatever the disk had not written",
          "[integration][state][power][F77]") {
  REQUIRE(text_of(old).size() > 1'024);  // several sectors
  for (const Start& start : starts()) {
    CAPTURE(start.name);
    REQUIRE(read_number(start.image) == start.reads);
    const Survey survey = cut_everywhere(start.image, start.reads, fresh, true);
    CHECK(survey.cuts >= 9);  // create, four writes, sync, two renames, sync
    CHECK(survey.disks > 1'000);
  }
}

TEST_CASE("a second power loss, on any disk the first one left, costs no more", "[integration][state][power][F77]") {
  for (const Start& start : starts()) {
    CAPTURE(start.name);
    for (const DiskImage& image : cut_everywhere(start.image, start.reads, fresh, false).kinds) {
      const std::uint32_t before = read_number(image);
      static_cast<void>(cut_everywhere(image, before, next, false));
    }
  }
}

TEST_CASE("a disk that says it has synced and did not is found out: the model is a sharp one",
          "[integration][state][power]") {
  const auto worst = [](bool about_files, bool about_folders) {
    std::set<std::uint32_t> numbers;
    for (int cut = 0; cut < 100; ++cut) {
      ModelDisk disk({{path, text_of(old)}}, cut);
      disk.lies_about_files = about_files;
      disk.lies_about_folders = about_folders;
      const bool is_done = live(disk, fresh);
      if (about_folders && !is_done) continue;  // durability is guaranteed only after write() has returned
      disk.for_each_disk([&](const DiskImage& image) { numbers.insert(read_number(image)); });
      if (is_done) break;
    }
    return numbers;
  };
  CHECK(worst(false, false) == std::set<std::uint32_t>{old, fresh});
  // A file with its name on disk before its bytes; the old one was renamed in the same call.
  CHECK(worst(true, false).count(0) == 1);
  CHECK(worst(false, true) == std::set<std::uint32_t>{old, fresh});
}

TEST_CASE("a process killed at any call of writing leaves the old state or the new one",
          "[integration][state][power][F77]") {
  for (int at = 0;; ++at) {
    CAPTURE(at);
    const TemporaryFolder folder;
    const std::string file_path = folder.file("state.json", text_of(old));
    static_cast<void>(folder.file("state.json.previous", text_of(older)));
    const bool was_killed = is_killed(file_path, at);
    StateFile file(file_path);
    const std::uint32_t read = read_number(file);
    CHECK((read == fresh || (was_killed && read == old)));
    // The next session continues from there.
    REQUIRE(file.write(text_of(next)));
    CHECK(read_number(file) == next);
    CHECK_FALSE(std::filesystem::exists(file_path + ".new"));
    if (was_killed) continue;
    CHECK(at >= 9);
    break;
  }
}

// --- calls that fail ------------------------------------------------------------------------------------------------

TEST_CASE("any call that fails leaves a state to read, and is told with file and step",
          "[integration][state][power][F75]") {
  for (const int code : {EIO, ENOSPC, EROFS, EACCES, EDQUOT}) {
    int failed = 0;
    for (int at = 0;; ++at) {
      CAPTURE(code, at);
      const TemporaryFolder folder;
      const std::string file_path = folder.file("state.json", text_of(old));
      FailingCalls calls(at, code);
      StateFile file(file_path, calls);
      REQUIRE(read_number(file) == old);
      const auto before = image_of(folder.path());
      calls.start();
      const auto written = file.write(text_of(fresh));
      if (at >= calls.count()) {
        REQUIRE(written);
        break;
      }
      CAPTURE(calls.last());
      if (calls.last() == "unlink") {  // a missing file need not be removed
        CHECK(written);
        continue;
      }
      ++failed;
      REQUIRE_FALSE(written);
      CAPTURE(to_text(written.error()));
      CHECK(written.error().code == code);
      CHECK(written.error().what.find(file_path) != std::string::npos);
      const bool is_of_folder = written.error().what.starts_with("sync the directory");
      CHECK(read_number(file) == (is_of_folder ? fresh : old));
      if (!is_of_folder) CHECK(image_of(folder.path()) == before);
      REQUIRE(file.write(text_of(next)));
      CHECK(read_number(file) == next);
    }
    CHECK(failed >= 9);
  }
}

TEST_CASE("a call that a signal interrupted is made again", "[integration][state][power][F72]") {
  for (int at = 0;; ++at) {
    CAPTURE(at);
    const TemporaryFolder folder;
    const std::string file_path = folder.file("state.json", text_of(old));
    FailingCalls calls(at, EINTR);
    StateFile file(file_path, calls);
    calls.start();
    CHECK(read_number(file) == old);
    REQUIRE(file.write(text_of(fresh)));
    CHECK(read_number(file) == fresh);
    if (at >= calls.count()) break;
  }
}

TEST_CASE("a disk that takes nothing and says nothing of it is an error, not a wait", "[integration][state][power]") {
  class Nothing final : public FileCalls {
    ssize_t write(int, const void*, std::size_t) override { return 0; }
  } calls;
  const TemporaryFolder folder;
  const std::string file_path = folder.file("state.json", text_of(old));
  StateFile file(file_path, calls);
  REQUIRE(read_number(file) == old);
  errno = 0;
  const auto written = file.write(text_of(fresh));
  REQUIRE_FALSE(written);
  CHECK(written.error().code == EIO);
  CHECK(written.error().what == "write " + file_path + ".new");
  CHECK(read_number(file) == old);
}

TEST_CASE("a text that could not be read again is not written", "[integration][state]") {
  const TemporaryFolder folder;
  const std::string file_path = folder.file("state.json", text_of(old));
  StateFile file(file_path);
  REQUIRE(read_number(file) == old);
  const auto before = image_of(folder.path());
  const auto written = file.write(std::string(StateFile::size_max + 1, ' '));
  REQUIRE_FALSE(written);
  CHECK(written.error().code == EFBIG);
  CHECK(image_of(folder.path()) == before);
  CHECK(file.write(std::string(StateFile::size_max, ' ')));
}

// --- files with invalid contents ------------------------------------------------------------------------------------

namespace {

/// With a sanitizer each nth, because all take a minute there; a build without tries all.
constexpr std::size_t one_of = test::is_sanitized ? 4 : 1;

}  // namespace

TEST_CASE("a newest file cut off or changed anywhere is answered with the previous one",
          "[integration][state][power]") {
  const std::string good = text_of(old);
  const auto read_with = [](const std::string& text) {
    return read_number(DiskImage{{path, text}, {path + ".previous", text_of(older)}});
  };
  // Without its line feed it is complete.
  for (std::size_t length = 0; length + 1 < good.size(); length += one_of) {
    if (read_with(good.substr(0, length)) != older) FAIL_CHECK("cut off at " << length);
  }
  for (std::size_t at = 0; at + 1 < good.size(); ++at) {
    constexpr std::array flips_of_byte{0x01U, 0x20U, 0x80U, 0xFFU};
    for (std::size_t index = test::is_sanitized ? at % 4 : 0; index < 4; index += one_of) {
      const unsigned flips = flips_of_byte.at(index);
      std::string text = good;
      text[at] = static_cast<char>(static_cast<unsigned char>(text[at]) ^ flips);
      if (read_with(text) != older) FAIL_CHECK("byte " << at << " flipped with " << flips);
    }
  }
  // Sectors of one file in the other.
  const std::string other = text_of(fresh);
  REQUIRE(other.size() == good.size());
  for (std::size_t from = 0; from < good.size(); from += 512) {
    std::string text = good;
    text.replace(from, 512, other.substr(from, 512));
    const std::uint32_t read = read_with(text);
    if (read != older && text != good && text != other) FAIL_CHECK("sector at " << from << ": " << read);
  }
}

TEST_CASE("generations that somebody swapped, or another program's file, are read for what they are",
          "[integration][state]") {
  CHECK(read_number(DiskImage{{path, text_of(older)}, {path + ".previous", text_of(old)}}) == older);
  CHECK(read_number(DiskImage{{path, R"({"format":1,"checksum":"0","content":{}})"}}) == 0);
  CHECK(read_number(DiskImage{{path, "\x7f\x45LF\x02\x01"}, {path + ".previous", text_of(old)}}) == old);
  CHECK(read_number(DiskImage{{path, ""}, {path + ".previous", text_of(old)}}) == old);
  CHECK(read_number(DiskImage{{path, std::string(4U << 20U, '[')}, {path + ".previous", text_of(old)}}) == old);
  // FILE.new is not valid until it is renamed.
  CHECK(read_number(DiskImage{{path + ".new", text_of(fresh)}, {path + ".previous", text_of(old)}}) == old);
  CHECK(read_number(DiskImage{{path + ".new", text_of(fresh)}}) == 0);
}

TEST_CASE("what lies where the new file is to be made is removed, not written through", "[integration][state]") {
  const TemporaryFolder folder;
  const std::string file_path = folder.file("state.json", text_of(old));
  const std::string unfinished = file_path + ".new";
  const std::string of_others = folder.file("of others", "of others");
  SECTION("a pipe") {
    REQUIRE(::mkfifo(unfinished.c_str(), 0600) == 0);
  }
  SECTION("a link to a file") {
    std::filesystem::create_symlink(of_others, unfinished);
  }
  SECTION("another name of a file") {
    std::filesystem::create_hard_link(of_others, unfinished);
  }
  SECTION("a file that everybody may write") {
    static_cast<void>(folder.file("state.json.new", "x"));
    REQUIRE(::chmod(unfinished.c_str(), 0666) == 0);
  }
  StateFile file(file_path);
  REQUIRE(read_number(file) == old);
  REQUIRE(file.write(text_of(fresh)));
  CHECK(read_number(file) == fresh);
  CHECK(read_file(of_others) == "of others");
  struct stat status {};
  REQUIRE(::lstat(file_path.c_str(), &status) == 0);
  CHECK(S_ISREG(status.st_mode));
  CHECK((status.st_mode & 0777U) == 0600U);
}

TEST_CASE("a folder in the place of one of the files is told, and costs no state", "[integration][state]") {
  const TemporaryFolder folder;
  const std::string file_path = folder.file("state.json", text_of(old));
  const std::string in_the_way = file_path + GENERATE(".new", ".previous");
  CAPTURE(in_the_way);
  std::filesystem::create_directories(in_the_way + "/with/something");
  StateFile file(file_path);
  REQUIRE(read_number(file) == old);
  const auto written = file.write(text_of(fresh));
  REQUIRE_FALSE(written);
  CHECK(to_text(written.error()).find(in_the_way) != std::string::npos);
  CHECK(read_number(file) == old);
  std::filesystem::remove_all(in_the_way);
  REQUIRE(file.write(text_of(fresh)));
  CHECK(read_number(file) == fresh);
}

}  // namespace bmu
